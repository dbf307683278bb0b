//! A figure that moves into another pose and takes its cloth along: where skinned layers cross, simulated ones do not.

use super::cloth_params::ClothParams;
use super::error::ClothError;
use super::mode::{ClothMode, ClothSolver};
use super::simulate::simulate;
use crate::body::{Figure, Pose, Skinning};
use crate::geometry::TriMesh;
use crate::motion::PoseTrack;

/// Frames per second, and frames of the way there and of the rest: a half and a third of a second.
const FPS: f64 = 30.0;
const MOVING: usize = 15;
const RESTING: usize = 10;

/// The surfaces of a figure in `pose`, after it moved there from the bind pose. Skin gives way where cloth is squeezed.
///
/// **Shapes** one mesh per layer, the body first.
///
/// **Errors** layers that cross in the bind pose, an unknown fabric; see [`ClothError`].
///
/// **Guarantees** no two faces cross in the coordinates that are exported (`f32`).
pub fn carried(figure: &Figure, pose: &Pose) -> Result<Vec<TriMesh>, ClothError> {
    let bind = Pose::bind(figure.skeleton.len());
    let way = (0..=MOVING).map(|k| bind.toward(pose, k as f64 / MOVING as f64));
    let poses: Vec<Pose> = way.chain(std::iter::repeat_n(pose.clone(), RESTING)).collect();
    let track = PoseTrack { fps: FPS, lead: 0, poses };
    let how = (ClothMode::Coupled, ClothSolver::Constraints);
    let (cloth, _) = simulate(figure, Skinning::Linear, &track, &ClothParams::default(), how, None, &mut |_| {})?;
    let layers = cloth.layers_in(track.poses.len() - 1);
    Ok(figure.layers.iter().zip(layers).map(|(layer, points)| layer.mesh.with_points(points.0)).collect())
}
