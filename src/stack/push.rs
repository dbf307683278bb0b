//! Equation 7 of Hu 2017 with additions of ours: for comparison with the smooth solve.

use super::obstacle::Obstacle;
use super::params::StackParams;
use crate::geometry::{PerVertex, Point, TriMesh};
use rayon::prelude::*;

/// `v' = v + (k + d) · n` for every vertex inside some layer, repeated until none is or the rounds are used up.
///
/// **Source** after Hu 2017, Eq. 7. Here `n` points from the vertex to the closest surface point, not along the vertex's
/// normal. A layer moves only vertices of its own limbs. Of several layers the deepest decides the move of each round.
pub(super) fn push(
    mesh: &TriMesh,
    limbs: &PerVertex<[f64; 5]>,
    obstacles: &[Obstacle],
    params: &StackParams,
) -> TriMesh {
    let mut mesh = mesh.clone();
    for _ in 0..params.iterations {
        let normals = mesh.vertex_normals();
        let moved: Vec<Point> = (mesh.points().0.par_iter().enumerate())
            .map(|(v, p)| {
                let deepest = obstacles
                    .iter()
                    .filter_map(|o| o.clearance_of(p, &normals.0[v], &limbs.0[v], 0.0))
                    .filter(|c| c.height < 0.0)
                    .min_by(|a, b| a.height.total_cmp(&b.height));
                deepest.map_or(*p, |c| p + c.normal * (params.clearance - c.height))
            })
            .collect();
        let is_done = moved == mesh.points().0;
        mesh = mesh.with_points(moved);
        if is_done {
            break;
        }
    }
    mesh
}
