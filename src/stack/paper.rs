//! Equation 7 of Hu 2017, with nothing added.

use super::obstacle::Obstacle;
use super::params::StackParams;
use crate::geometry::{Point, TriMesh};
use rayon::prelude::*;

/// `v' = v + (k + d) · norm(v)` for every vertex inside a layer: once for each layer, innermost first.
///
/// **Source** Hu 2017, Eq. 7: `v` is a vertex of the garment inside the layer, `norm(v)` its own normal, `d` its distance
/// to the closest point of the layer, `k` the clearance. There is no test of limbs, no smoothing and no second round, so a
/// vertex whose normal does not point to the closest surface may stay inside. Where the paper is silent we chose:
/// - *Layers.* Eq. 7 names the naked body; §6.3 also speaks of penetration between clothes. Each garment below is treated
///   as the body is, after it, with normals of the garment as moved so far.
/// - *Inside* means behind the closest point's pseudonormal. An open layer has an inside no deeper than
///   `greatest_depth`, and none beyond its border.
/// - *Normals* are the means of the adjacent faces' normals, weighted by angle.
/// - *k* is `clearance`, in metres; the paper gives no value.
pub(super) fn push_along_normals(mesh: &TriMesh, obstacles: &[Obstacle], params: &StackParams) -> TriMesh {
    let mut mesh = mesh.clone();
    for obstacle in obstacles {
        let normals = mesh.vertex_normals();
        let moved: Vec<Point> = (mesh.points().0.par_iter().zip(&normals.0))
            .map(|(v, normal)| match obstacle.depth_inside(v) {
                Some(d) => v + normal * (params.clearance + d),
                None => *v,
            })
            .collect();
        mesh = mesh.with_points(moved);
    }
    mesh
}
