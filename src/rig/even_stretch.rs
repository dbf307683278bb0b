//! Skin weights that stretch cloth less: where skinning would make it far too long, the weights change more gradually.
//!
//! The weights of the naked body change from arm to trunk within a few centimetres of the armpit. Skin slides there. Cloth
//! cannot, and with these weights its edges become five or six times as long under raised arms. A real shirt is pulled
//! along over a wider area instead, and so is this one.

use super::error::RigError;
use super::inpaint::Inpainting;
use crate::body::{JointId, Pose, Skeleton, SkinWeights, Stance, unskin};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};
use nalgebra::Isometry3;
use rayon::prelude::*;

/// Edges that become longer than this in some stance become stiffer. Five garments of three synthetic people were looked at
/// with 1.5, 2, 2.2, 2.5 and 3: below 2.5 sleeves collapse where they blend arm and trunk, and no longer follow the arm.
const GREATEST_STRETCH: f64 = 2.5;
/// After this many rounds the same garments change little.
const ROUNDS: usize = 4;
/// Shorter edges, in metres, are slivers along a cut, whose ratio says nothing.
const LEAST_LENGTH: f64 = 2e-3;
/// The surroundings of an edge that is too long become stiffer with it, up to this far, in metres: otherwise the stretch
/// moves to the next edge and stays as great.
const REACH: f64 = 0.04;
/// What is left of the stretch of an edge at its next neighbour.
const DECAY: f64 = 0.7;
/// Stiffness in m² that an edge begins with, and the greatest. The first is twenty times that of the smoothing everywhere;
/// with more than the second the smallest confidences are lost in rounding.
const STIFFNESS: [f64; 2] = [2e-4, 1.0];
/// Least and greatest factor of an edge's stiffness from one round to the next.
const FACTORS: [f64; 2] = [0.8, 8.0];

/// Solves for the weights again and again, with stiffer edges where cloth would become too long.
///
/// **Shapes** the result has one row per vertex of the garment, not pruned. `edges` are those that `inpainting` was prepared
/// with.
pub(super) fn even_out(
    garment: &TriMesh,
    inpainting: &mut Inpainting,
    edges: &[[VertexId; 2]],
    (skeleton, pose): (&Skeleton, &Pose),
) -> Result<PerVertex<Vec<(JointId, f64)>>, RigError> {
    let stretching = Stretching::prepare(garment, edges, skeleton, pose);
    let mut stiffness = vec![0.0; edges.len()];
    let mut rows = inpainting.rows();
    for _ in 0..ROUNDS {
        let excess = stretching.of_edges(&rows).into_iter().map(|ratio| (ratio - 1.0) / (GREATEST_STRETCH - 1.0));
        let excess: Vec<f64> = excess.collect();
        if excess.iter().all(|e| *e <= 1.0) {
            break;
        }
        for (own, factor) in stiffness.iter_mut().zip(stretching.with_surroundings(&excess)) {
            *own = stiffer(*own, factor);
        }
        inpainting.stiffen(&stiffness)?;
        let next = inpainting.rows();
        if !next.iter().all(is_complete) {
            break;
        }
        rows = next;
    }
    Ok(rows)
}

/// The weights of a vertex sum to 1, but for the clamping at 0. Not so in a loose piece without any confident match whose
/// edges are so stiff that its small confidences are lost in rounding.
fn is_complete(row: &Vec<(JointId, f64)>) -> bool {
    row.iter().map(|r| r.1).sum::<f64>() > 0.5
}

fn stiffer(stiffness: f64, excess: f64) -> f64 {
    let [first, greatest] = STIFFNESS;
    if stiffness == 0.0 && excess <= 1.0 {
        return 0.0;
    }
    let next = stiffness.max(first) * excess.clamp(FACTORS[0], FACTORS[1]);
    if next < 0.1 * first { 0.0 } else { next.min(greatest) }
}

/// What the stretch of a garment's edges depends on, besides the weights.
struct Stretching<'a> {
    garment: &'a TriMesh,
    edges: &'a [[VertexId; 2]],
    skeleton: &'a Skeleton,
    pose: &'a Pose,
    /// Both sides of all straining stances: the transforms of the joints.
    stances: Vec<Vec<Isometry3<f64>>>,
    /// How many edges lie within the reach.
    rings: usize,
}

impl<'a> Stretching<'a> {
    fn prepare(garment: &'a TriMesh, edges: &'a [[VertexId; 2]], skeleton: &'a Skeleton, pose: &'a Pose) -> Self {
        let stances = Stance::STRAINING.iter().flat_map(|s| [s.pose(skeleton), s.mirrored_pose(skeleton)]);
        let length = |[a, b]: &[VertexId; 2]| (garment.points()[*a] - garment.points()[*b]).norm();
        let mean = edges.iter().map(length).sum::<f64>() / edges.len().max(1) as f64;
        Self {
            garment,
            edges,
            skeleton,
            pose,
            stances: stances.map(|stance| skeleton.world_from_bind(&stance)).collect(),
            rings: (REACH / mean.max(LEAST_LENGTH)).round() as usize,
        }
    }

    /// The greatest ratio, over all stances, by which each edge becomes longer than in the bind pose; at least 1.
    fn of_edges(&self, rows: &PerVertex<Vec<(JointId, f64)>>) -> Vec<f64> {
        let weights = SkinWeights::from_rows(rows.iter().cloned());
        let in_bind = unskin(self.garment.points(), &weights, self.skeleton, self.pose);
        // All weights, not the four largest: where the set of the largest changes there is a jump that no stiffness removes.
        let blended = |stance: &Vec<Isometry3<f64>>| -> Vec<_> {
            let of_vertex = |(p, row): (&Point, &Vec<(JointId, f64)>)| {
                let sum: f64 = row.iter().map(|r| r.1).sum();
                let moved = row.iter().map(|&(joint, w)| (stance[joint.index()] * p).coords * w);
                moved.sum::<Vec3>() / sum.max(1e-12)
            };
            in_bind.iter().zip(rows.iter()).map(of_vertex).collect()
        };
        let in_stances: Vec<Vec<_>> = self.stances.par_iter().map(blended).collect();
        let ratio = |&[a, b]: &[VertexId; 2]| {
            let rest = (in_bind[a] - in_bind[b]).norm();
            if rest < LEAST_LENGTH {
                return 1.0;
            }
            let posed = in_stances.iter().map(|points| (points[a.index()] - points[b.index()]).norm());
            posed.fold(rest, f64::max) / rest
        };
        self.edges.par_iter().map(ratio).collect()
    }

    /// The value of each edge, or what is left of a greater one nearby.
    fn with_surroundings(&self, of_edges: &[f64]) -> Vec<f64> {
        let mut of_vertices = vec![0.0_f64; self.garment.vertex_count()];
        for ([a, b], &value) in self.edges.iter().zip(of_edges) {
            for v in [a.index(), b.index()] {
                of_vertices[v] = of_vertices[v].max(value);
            }
        }
        for _ in 0..self.rings {
            let before = of_vertices.clone();
            for [a, b] in self.edges {
                let (a, b) = (a.index(), b.index());
                of_vertices[a] = of_vertices[a].max(DECAY * before[b]);
                of_vertices[b] = of_vertices[b].max(DECAY * before[a]);
            }
        }
        self.edges.iter().map(|[a, b]| 0.5 * (of_vertices[a.index()] + of_vertices[b.index()])).collect()
    }
}
