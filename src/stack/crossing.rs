//! Separates triangles that still cross although all their corners are outside.

use super::obstacle::{Obstacle, concerns};
use super::params::StackParams;
use super::required_moves::RequiredMoves;
use super::smooth::{Smoother, moved_by};
use crate::geometry::{FaceId, PerVertex, Point, TriMesh, Vec3, VertexId};
use crate::numerics::NumericsError;

/// A garment triangle is lifted by the depth of a crossing plus this margin, in metres; the margin grows each round.
const MARGIN: f64 = 1e-4;
/// Length in metres over which lifts are spread where no smoothing length is given: about an edge.
const LIFT_LENGTH: f64 = 3e-3;
/// Greatest lift of a corner in one round, in metres: the depth of a crossing is an estimate, and rounds are cheap.
const GREATEST_LIFT: f64 = 3e-3;

/// Lifts the garment's triangles off the inner triangles that they cross, until none crosses or the rounds are used up.
/// Returns the mesh with the fewest crossings and the number of rounds it took.
pub(super) fn separate(
    mesh: TriMesh,
    limbs: &PerVertex<[f64; 5]>,
    obstacles: &[Obstacle],
    smoother: &Smoother,
    params: &StackParams,
) -> Result<(TriMesh, usize), NumericsError> {
    let mut mesh = mesh;
    let mut best: Option<(usize, TriMesh, usize)> = None;
    let mut moved: Vec<FaceId> = mesh.face_ids().collect();
    let mut pairs: Vec<(usize, FaceId, FaceId)> = Vec::new();
    for round in 0..=params.iterations {
        // Pairs of faces that did not move are still valid.
        pairs.retain(|(_, g, _)| moved.binary_search(g).is_err());
        for (o, obstacle) in obstacles.iter().enumerate() {
            let crossing = obstacle.pairs_with(&mesh, &moved).into_iter();
            let pressing = crossing.filter(|&(g, f)| obstacle.faces_along(f, &mesh.face_normal(g)));
            pairs.extend(pressing.map(|(g, f)| (o, g, f)));
        }
        pairs.sort_unstable();
        let mut required = smoother.required_of_inside_vertices(&mesh);
        let left = pairs.len() + required.count();
        if best.as_ref().is_none_or(|b| left < b.0) {
            best = Some((left, mesh.clone(), round));
        }
        if left == 0 || round == params.iterations {
            break;
        }
        for &(o, g, f) in &pairs {
            lift(&mesh, g, &obstacles[o], f, limbs, MARGIN * (1 + round) as f64, &mut required);
        }
        // First smoothly, so that whole areas rise; in the second half only the corners, which always reach their target.
        let next = if round < params.iterations / 2 {
            let length = params.smoothing_lengths.last().copied().unwrap_or(LIFT_LENGTH);
            let region = smoother.region(&required, length)?;
            let risen = moved_by(&mesh, &region.smoothed(&required));
            moved_by(&risen, smoother.required_moves(&risen, Some(&region)).moves())
        } else {
            moved_by(&mesh, required.moves())
        };
        moved = (mesh.faces().enumerate())
            .filter(|(_, corners)| corners.iter().any(|&v| mesh.points()[v] != next.points()[v]))
            .map(|(g, _)| g)
            .collect();
        mesh = next;
    }
    Ok(best.map_or((mesh, 0), |(_, mesh, rounds)| (mesh, rounds)))
}

/// Requires the corners of garment face `g` to rise above inner face `f`, by the smaller of the two penetration depths.
fn lift(
    mesh: &TriMesh,
    g: FaceId,
    obstacle: &Obstacle,
    f: FaceId,
    limbs: &PerVertex<[f64; 5]>,
    margin: f64,
    required: &mut RequiredMoves,
) {
    let inner = obstacle.index.mesh();
    let (outer_corners, inner_corners) = (mesh.faces()[g], inner.faces()[f]);
    let (t, u) = (mesh.triangle(g), inner.triangle(f));
    let (out, garment_out) = (smooth_normal(&obstacle.vertex_normals, &inner_corners), mesh.face_normal(g));
    let depth =
        |points: &[Point; 3], plane: &Point, n: &Vec3| points.iter().map(|p| n.dot(&(p - plane))).fold(0.0, f64::max);
    let below_inner = depth(&t, &u[0], &-inner.face_normal(f));
    let above_garment = depth(&u, &t[0], &garment_out);
    let height = (below_inner.min(above_garment) + margin).min(GREATEST_LIFT);
    for v in outer_corners {
        if inner_corners.iter().any(|&w| concerns(&limbs[v], &obstacle.limbs[w])) {
            required.require(v, out * height);
        }
    }
}

fn smooth_normal(normals: &PerVertex<Vec3>, corners: &[VertexId; 3]) -> Vec3 {
    corners.iter().map(|&v| normals[v]).sum::<Vec3>().try_normalize(1e-9).unwrap_or_else(|| normals[corners[0]])
}
