//! Cloth on a figure that a clip moves.

use super::cloth_params::ClothParams;
use super::cloth_report::{ClothReport, Reporter, crossing_pairs, rounded};
use super::cloth_track::ClothTrack;
use super::constraint_solver::SolverState;
use super::coupled::Simulation;
use super::error::ClothError;
use super::mode::{ClothMode, ClothSolver};
use crate::body::{Figure, Layer, Skinning};
use crate::geometry::{Adjacency, Point};
use crate::motion::PoseTrack;
use crate::parameters::Parameters;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Duration;

/// A frame of cloth, as soon as it is computed.
pub struct ClothFrame<'a> {
    /// Its number.
    pub number: usize,
    /// Where every vertex of the figure is, one layer after another, metres.
    pub at: &'a [Point],
    /// All frames up to it.
    pub track: &'a ClothTrack,
    simulation: &'a Simulation<'a>,
    reporter: &'a Reporter,
}

/// The state of a simulation after a frame. A simulation that resumes from it gives the same bytes as one never stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClothCheckpoint {
    solver: SolverState,
    reporter: Reporter,
}

impl ClothFrame<'_> {
    /// The state after the frame.
    pub fn checkpoint(&self) -> ClothCheckpoint {
        ClothCheckpoint { solver: self.simulation.solver.state(), reporter: self.reporter.clone() }
    }

    /// The time spent in each part of the solver since the simulation began or resumed.
    pub fn timings(&self) -> [(&'static str, Duration); 4] {
        let [forces, search, contact, correction] = self.simulation.solver.timings;
        [("forces", forces), ("search for pairs", search), ("contact", contact), ("correction", correction)]
    }
}

/// Moves the layers of a figure by `track`, from the bind pose on.
///
/// **Shapes** the frames of the result are the poses of `track`.
///
/// **Frame and units** metres, world, Y up.
///
/// `resumed`: the frames so far and the checkpoint after the last of them; for constraints only.
///
/// `on_frame` is called with each frame that is computed.
///
/// **Errors** layers that cross in the bind pose where the constraints start from them, an unknown fabric, a parameter
/// out of range; see [`ClothError`].
///
/// **Guarantees** with constraints, coupled or as physics alone: no two faces cross in any frame if none do in the bind
/// pose, on the `f32` positions of the result. Blended cloth equals skinning where its physics weight is 0. The result does
/// not depend on the number of threads.
///
/// **Source** Hu 2017, Eq. 8: as a blend of the vertices, or, coupled, with the skinned place as a compliant constraint of
/// each vertex. Stretch and bending by projective dynamics (Bouaziz 2014) with XPBD (Macklin 2016) behind it, or by springs
/// and Runge–Kutta steps (Shi 2020, Eqs. 22–24). The stress that carries a scanned garment's weight in the bind pose turns
/// with the skin, so that it does not sag.
pub fn simulate(
    figure: &Figure,
    skinning: Skinning,
    track: &PoseTrack,
    params: &ClothParams,
    (mode, solver): (ClothMode, ClothSolver),
    resumed: Option<(ClothTrack, ClothCheckpoint)>,
    on_frame: &mut dyn FnMut(&ClothFrame<'_>),
) -> Result<(ClothTrack, ClothReport), ClothError> {
    params.check_values()?;
    let mut simulation = Simulation::prepare(figure, skinning, params, (mode, solver))?;
    if mode.is_simulated() && solver == ClothSolver::Constraints {
        let pairs = crossing_pairs(&simulation.solver.surfaces, &simulation.solver.tree, &simulation.solver.at);
        if pairs > 0 {
            return Err(ClothError::Crossing { pairs });
        }
    }
    let vertices = simulation.solver.surfaces.vertices.iter().map(|range| range.len() as u32).collect();
    let mut result = ClothTrack { vertices, frames: vec![rounded(&simulation.solver.at)] };
    let mut reporter = Reporter::new(solver, hems(figure, &simulation.solver.surfaces.vertices));
    match resumed {
        Some((frames, checkpoint)) => {
            simulation.solver.set_state(checkpoint.solver);
            (result, reporter) = (frames, checkpoint.reporter);
        }
        None => {
            let at = &simulation.solver.at;
            on_frame(&ClothFrame { number: 0, at, track: &result, simulation: &simulation, reporter: &reporter });
        }
    }
    let first = result.frames.len() - 1;
    let weights = physics_weights(figure);
    for (k, poses) in track.poses.windows(2).enumerate().skip(first) {
        if mode.is_simulated() {
            simulation.frame(&poses[0], &poses[1], track.fps)?;
        }
        let places = simulation.places(&poses[1]).0;
        let blended: Vec<Point>;
        let at = match mode {
            ClothMode::Skinned => &places,
            ClothMode::Blended => {
                let each = places.iter().zip(&simulation.solver.at).zip(&weights);
                blended = each.map(|((place, at), &share)| place + (at - place) * share).collect();
                &blended
            }
            ClothMode::Physics | ClothMode::Coupled => &simulation.solver.at,
        };
        reporter.add(k + 1, &simulation.solver.surfaces, &simulation.solver.tree, at, &places);
        result.frames.push(rounded(at));
        on_frame(&ClothFrame { number: k + 1, at, track: &result, simulation: &simulation, reporter: &reporter });
    }
    Ok((result, reporter.finish(simulation.solver.stopped_steps(), simulation.least_stiffness())))
}

/// The boundary loops of cloth, of all layers together.
///
/// **Shapes** `vertices`: the vertices of each layer.
fn hems(figure: &Figure, vertices: &[Range<usize>]) -> Vec<Vec<usize>> {
    let of_layer = |(layer, range): (&Layer, &Range<usize>)| -> Vec<Vec<usize>> {
        let loops = Adjacency::prepare(&layer.mesh).boundary_loops();
        loops.into_iter().map(|hem| hem.into_iter().map(|v| range.start + v.index()).collect()).collect()
    };
    figure.layers.iter().zip(vertices).skip(1).flat_map(of_layer).collect()
}

/// The share of physics of every vertex; 0 for the body.
fn physics_weights(figure: &Figure) -> Vec<f64> {
    let of_layer = |layer: &Layer| match &layer.physics {
        Some(physics) => physics.0.clone(),
        None => vec![0.0; layer.mesh.vertex_count()],
    };
    figure.layers.iter().flat_map(of_layer).collect()
}
