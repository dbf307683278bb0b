//! Where skinning tears cloth in the poses it must stand.

use crate::body::{Pose, Skeleton, SkinWeights, Stance, skin, unskin};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, geodesic_distances};
use rayon::prelude::*;

/// The poses in which cloth must not tear; the last two are mirrored as well.
const STANCES: [Stance; 4] = [Stance::ArmsUp, Stance::Squat, Stance::ThighRaised, Stance::Stride];
/// How many of them are the same for left and right.
const SYMMETRIC: usize = 2;
/// Greatest ratio by which an edge may become longer; the body's own skin reaches 2.0. At the goal, 1.6, sleeves slide so far
/// that a jacket over a T-shirt and jeans (synthetic person 21) is posed with 0.14 % of the skin outside; here with 0.09 %.
const MOST_STRETCH: f64 = 1.8;
/// Distance along the cloth, in metres, by which torn parts are widened: twice the length over which weights are smoothed.
const REACH: f64 = 0.02;
/// Shorter edges, in metres, are slivers along a cut, of which rounding changes the length.
const LEAST_LENGTH: f64 = 2e-3;

/// Finds the vertices of a garment at which skinning stretches cloth too far.
pub(super) struct Tearing<'a> {
    garment: &'a TriMesh,
    adjacency: Adjacency,
    skeleton: &'a Skeleton,
    pose: &'a Pose,
    poses: Vec<Pose>,
}

impl<'a> Tearing<'a> {
    /// **Frame** the garment in the scan's pose, which is `pose`.
    pub fn prepare(garment: &'a TriMesh, skeleton: &'a Skeleton, pose: &'a Pose) -> Self {
        let mirrored = STANCES[SYMMETRIC..].iter().map(|stance| stance.mirrored_pose(skeleton));
        let poses = STANCES.iter().map(|stance| stance.pose(skeleton)).chain(mirrored).collect();
        Self { garment, adjacency: Adjacency::prepare(garment), skeleton, pose, poses }
    }

    /// Whether an edge at the vertex becomes longer than `MOST_STRETCH` times its length, as scanned or in the bind pose.
    ///
    /// **Shapes** one row of weights per vertex of the garment, and one flag.
    pub fn find(&self, weights: &SkinWeights) -> PerVertex<bool> {
        let scanned = self.garment.points();
        let in_bind = unskin(scanned, weights, self.skeleton, self.pose);
        let posed: Vec<PerVertex<Point>> =
            self.poses.par_iter().map(|pose| skin(&in_bind, weights, self.skeleton, pose)).collect();
        let mut torn = PerVertex::filled(false, scanned.len());
        for &([a, b], _) in self.adjacency.edges() {
            let length = |points: &PerVertex<Point>| (points[a] - points[b]).norm();
            let rest = length(scanned).min(length(&in_bind));
            if rest > LEAST_LENGTH && posed.iter().any(|points| length(points) > MOST_STRETCH * rest) {
                (torn[a], torn[b]) = (true, true);
            }
        }
        torn
    }

    /// Sets the confidence to 0 near the vertices, so that the weights change over a wider part of the cloth.
    pub fn distrust(&self, torn: &PerVertex<bool>, confidence: &mut PerVertex<f64>) {
        let sources: Vec<_> = self.garment.vertex_ids().filter(|&v| torn[v]).map(|v| (v, 0.0)).collect();
        let distances = geodesic_distances(self.garment, &self.adjacency, &sources, REACH);
        for (confidence, distance) in confidence.0.iter_mut().zip(distances.iter()) {
            if *distance <= REACH {
                *confidence = 0.0;
            }
        }
    }
}
