//! Springs that move like the cloth that was simulated.

use super::chains::with_spring_bones;
use super::simulation::{SpringParams, SpringSimulation};
use crate::body::{Figure, Pose, skin};
use crate::geometry::{PerVertex, Point, VertexId};
use rayon::prelude::*;

/// VRM's programs compute about so many steps per second.
const STEPS_PER_SEC: f64 = 60.0;
const STIFFNESS: [f64; 7] = [0.1, 0.25, 0.5, 1.0, 1.5, 2.5, 4.0];
const DRAG: [f64; 5] = [0.1, 0.25, 0.4, 0.6, 0.8];

/// Every so many vertices of the loose parts are compared.
const STRIDE: usize = 7;
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Springs, and how near they come to the cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedSprings {
    /// The best of those that were tried.
    pub params: SpringParams,
    /// Mean distance in metres of the loose parts from the cloth.
    pub mean_distance: f64,
    /// The same where skin weights alone move them.
    pub skinned_distance: f64,
}

/// Finds share, stiffness and drag by trying all triples of a grid on an animation whose cloth was simulated.
///
/// **Shapes** `loose` one entry per layer, with one per vertex; `poses`: one per frame; `cloth`: per layer and frame the vertices.
///
/// **Frame** that of the figure, whose bind pose is that of the animation.
pub fn fitted_springs(
    figure: &Figure,
    loose: &[PerVertex<bool>],
    poses: &[Pose],
    fps: f64,
    cloth: &[Vec<PerVertex<Point>>],
) -> Option<FittedSprings> {
    // A part of the motion is that part of the way from skinning alone to chains alone.
    let rigged = with_spring_bones(figure, loose, 1.0);
    let mut ranks: Vec<usize> = rigged.chains.iter().map(|chain| chain.rank).collect();
    ranks.dedup();
    let compared = |rank: usize| {
        let vertices = (0..loose[rank].len()).filter(|&v| loose[rank].0[v]);
        vertices.step_by(STRIDE).map(VertexId::from_index).collect()
    };
    let parts: Vec<(usize, PerVertex<VertexId>)> = ranks.into_iter().map(|rank| (rank, compared(rank))).collect();
    let count = parts.iter().map(|(_, part)| part.len()).sum::<usize>() * poses.len();
    if count == 0 {
        return None;
    }
    let places = |figure: &Figure, pose: &Pose| -> Vec<Point> {
        let of_part = |(rank, part): &(usize, PerVertex<VertexId>)| {
            let layer = &figure.layers[*rank];
            let points = part.iter().map(|&v| layer.mesh.points()[v]).collect();
            skin(&points, &layer.weights.of_vertices(part), &figure.skeleton, pose).0
        };
        parts.iter().flat_map(of_part).collect()
    };
    let targets: Vec<Vec<Point>> = (0..poses.len())
        .map(|frame| parts.iter().flat_map(|(rank, part)| part.iter().map(move |&v| cloth[*rank][frame][v])).collect())
        .collect();
    let skinned: Vec<Vec<Point>> = poses.iter().map(|pose| places(figure, pose)).collect();
    let joints = rigged.figure.skeleton.len();
    let poses: Vec<Pose> = poses.iter().map(|pose| extended(pose, joints)).collect();
    let steps = (STEPS_PER_SEC / fps).round().max(1.0) as usize;
    let distances = |&(stiffness, drag): &(f64, f64)| -> [f64; SHARES.len()] {
        let params = SpringParams { stiffness, drag, ..SpringParams::default() };
        let mut simulation = SpringSimulation::at_rest(&rigged, params, &poses[0]);
        let mut sums = [0.0; SHARES.len()];
        for frame in 0..poses.len() {
            let before = &poses[frame.saturating_sub(1)];
            let mut moved = poses[frame].clone();
            for step in 1..=steps {
                let between = before.toward(&poses[frame], step as f64 / steps as f64);
                moved = simulation.step(&between, 1.0 / (fps * steps as f64));
            }
            let simulated = places(&rigged.figure, &moved);
            for ((p, q), target) in skinned[frame].iter().zip(&simulated).zip(&targets[frame]) {
                for (sum, share) in sums.iter_mut().zip(SHARES) {
                    *sum += (p + (q - p) * share - target).norm();
                }
            }
        }
        sums.map(|sum| sum / count as f64)
    };
    let pairs: Vec<(f64, f64)> = STIFFNESS.iter().flat_map(|&s| DRAG.map(|d| (s, d))).collect();
    let tried: Vec<[f64; SHARES.len()]> = pairs.par_iter().map(distances).collect();
    let triples = (0..pairs.len()).flat_map(|k| (0..SHARES.len()).map(move |s| (k, s)));
    let (k, s) = triples.min_by(|a, b| tried[a.0][a.1].total_cmp(&tried[b.0][b.1]))?;
    let all = skinned.iter().flatten().zip(targets.iter().flatten());
    let skinned_distance = all.map(|(p, q)| (p - q).norm()).sum::<f64>() / count as f64;
    let params = SpringParams { share: SHARES[s], stiffness: pairs[k].0, drag: pairs[k].1, ..SpringParams::default() };
    Some(FittedSprings { params, mean_distance: tried[k][s], skinned_distance })
}

/// A pose for further joints, which do not turn.
fn extended(pose: &Pose, joints: usize) -> Pose {
    let mut pose = pose.clone();
    pose.rotations.resize(joints, nalgebra::UnitQuaternion::identity());
    pose
}
