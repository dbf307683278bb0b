//! Cloth on a figure that a clip moves.

use super::cloth_params::ClothParams;
use super::cloth_report::{ClothReport, Reporter, crossing_pairs, rounded};
use super::cloth_track::ClothTrack;
use super::coupled::Simulation;
use super::error::ClothError;
use crate::body::{Figure, Skinning};
use crate::motion::PoseTrack;
use crate::parameters::Parameters;

/// Simulates the layers of a figure that is moved by `track`, from the bind pose on.
///
/// **Shapes** the frames of the result are the poses of `track`.
///
/// **Frame and units** metres, world, Y up.
///
/// **Errors** layers that cross in the bind pose, an unknown fabric, a parameter out of range; see [`ClothError`].
///
/// **Guarantees** no two faces cross in any frame if none do in the bind pose, on the `f32` positions of the result. The result
/// does not depend on the number of threads.
///
/// **Source** Hu 2017, Eq. 8, with the skinned place as a compliant constraint of each vertex; stretch and bending by XPBD
/// (Macklin 2016). The stress that carries a scanned garment's weight in the bind pose turns with the skin, so
/// that it does not sag.
pub fn simulate(
    figure: &Figure,
    skinning: Skinning,
    track: &PoseTrack,
    params: &ClothParams,
    on_frame: &mut dyn FnMut(usize, usize),
) -> Result<(ClothTrack, ClothReport), ClothError> {
    params.check_values()?;
    let mut simulation = Simulation::prepare(figure, skinning, params)?;
    let pairs = crossing_pairs(&simulation.surfaces, &simulation.tree, &simulation.at);
    if pairs > 0 {
        return Err(ClothError::Crossing { pairs });
    }
    let vertices = simulation.surfaces.vertices.iter().map(|range| range.len() as u32).collect();
    let mut result = ClothTrack { vertices, frames: vec![rounded(&simulation.at)] };
    let mut reporter = Reporter::new();
    for (k, poses) in track.poses.windows(2).enumerate() {
        simulation.frame(&poses[0], &poses[1], track.fps);
        let places = simulation.places(&poses[1]).0;
        reporter.add(k + 1, &simulation.surfaces, &simulation.tree, &simulation.at, &places);
        result.frames.push(rounded(&simulation.at));
        on_frame(k + 1, track.poses.len() - 1);
    }
    Ok((result, reporter.finish(simulation.stopped_steps)))
}
