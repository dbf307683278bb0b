//! Pushes a garment clear of the body and of every layer below it, in the bind pose. The result is the figure's next
//! surface.

mod arguments;
mod clear;
mod crossing;

mod error;
mod movable_region;
mod obstacle;
mod paper;
mod params;
mod press;
mod push;

mod report;
mod required_moves;
mod smooth;
#[cfg(test)]
mod tests;

pub use error::StackError;
pub use params::{StackMethod, StackParams};
pub use press::{PressParams, PressReport, press};
pub use report::{LayerReport, StackReport};

use crate::body::{Figure, Limb};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::parameters::Parameters;
use crate::rig::RiggedGarment;
use arguments::check_weights;
use clear::cleared;
use obstacle::{Obstacle, limbs_of};

/// Pushes a garment clear of all layers of a figure.
///
/// **Frame** the bind pose, in metres.
///
/// **Guarantees** faces and vertex order stay; the inner layers do not move. The report counts the vertices still inside
/// and the pairs of triangles still crossing.
///
/// **Source** with [`StackMethod::Paper`] Hu 2017, Eq. 7: `v' = v + (k + d) · norm(v)`. The smooth solve is Shi 2020,
/// Eqs. 19–21, with two differences: the bending energy of the displacement replaces the umbrella operator, and the
/// targets are bounds, so that nothing is pulled inwards.
pub fn stack(
    garment: &RiggedGarment,
    figure: &Figure,
    params: &StackParams,
) -> Result<(TriMesh, StackReport), StackError> {
    let mesh = &garment.mesh;
    if mesh.face_count() == 0 {
        return Err(StackError::EmptyGarment);
    }
    check_weights("the garment", mesh, &garment.weights, &figure.skeleton)?;
    for layer in &figure.layers {
        check_weights(&layer.name, &layer.mesh, &layer.weights, &figure.skeleton)?;
    }
    params.check_values()?;
    let limb_of_joint = Limb::of_joints(&figure.skeleton);
    let limbs = limbs_of(&garment.weights, &limb_of_joint);
    let obstacles: Vec<Obstacle> =
        (figure.layers.iter()).map(|l| Obstacle::prepare(&l.mesh, &l.weights, &limb_of_joint, params)).collect();

    let before = measure(mesh, &obstacles);
    let clear = clear_vertices(mesh, &limbs, &obstacles, params.clearance);
    let (stacked, rounds) = cleared(mesh, &limbs, &obstacles, params)?;
    let after = measure(&stacked, &obstacles);

    let moves: Vec<f64> = stacked.points().iter().zip(mesh.points().iter()).map(|(p, q)| (p - q).norm()).collect();
    let of_clear: Vec<f64> = moves.iter().zip(clear.iter()).filter(|(_, c)| **c).map(|(m, _)| *m).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let layers = figure
        .layers
        .iter()
        .zip(before.iter().zip(&after))
        .map(|(layer, (before, after))| LayerReport {
            layer: layer.name.clone(),
            inside_before: before.0,
            inside_after: after.0,
            intersecting_pairs_before: before.1,
            intersecting_pairs_after: after.1,
        })
        .collect();
    let report = StackReport {
        layers,
        mean_move: mean(&moves),
        max_move: moves.iter().copied().fold(0.0, f64::max),
        mean_move_of_clear: mean(&of_clear),
        rounds,
    };
    Ok((stacked, report))
}

/// Vertices inside each obstacle, and crossing pairs.
fn measure(mesh: &TriMesh, obstacles: &[Obstacle]) -> Vec<(usize, usize)> {
    let faces: Vec<_> = mesh.face_ids().collect();
    obstacles.iter().map(|o| (o.count_inside(mesh), o.pairs_with(mesh, &faces).len())).collect()
}

fn clear_vertices(
    mesh: &TriMesh,
    limbs: &PerVertex<[f64; 5]>,
    obstacles: &[Obstacle],
    clearance: f64,
) -> PerVertex<bool> {
    let normals = mesh.vertex_normals();
    mesh.points()
        .enumerate()
        .map(|(v, p): (_, &Point)| {
            obstacles
                .iter()
                .all(|o| o.clearance_of(p, &normals[v], &limbs[v], clearance).is_none_or(|c| c.height >= clearance))
        })
        .collect()
}
