//! Loop closure: measures the drift after a full turn and distributes it over the frames between.

use super::align::{Alignment, TRACKING, align, moved};
use super::axis::Axis;
use super::raycast::Reach;
use super::track::{Placed, SegmentedFrame, predicted};
use super::volume::Volume;
use crate::numerics::{SparseCholesky, wrapped_angle};
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A measured pose of one frame in the frame of another.
struct Edge {
    from: usize,
    to: usize,
    from_camera_to: Isometry3<f64>,
    weight: f64,
}

/// Result of the loop closure.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Closure {
    /// The number of loops.
    pub(super) loops: usize,
    /// Mean disagreement there, metres and radians.
    pub(super) shift: f64,
    pub(super) turn: f64,
}

/// Least difference of headings of the two frames of a loop, in radians: 270°.
const AROUND: f64 = 0.75 * TAU;
/// Greatest difference of their headings modulo a turn, in radians: 20°.
const SAME_VIEW: f64 = 0.35;
/// Frames on either side that form the local model for a later frame.
const WINDOW: usize = 2;
/// Greatest number of compared pairs per turn.
const MOST_PAIRS: usize = 6;
/// Weight of a loop relative to a step between frames: it is measured against several frames.
const LOOP_WEIGHT: f64 = 4.0;
/// Least overlap of a loop.
const LEAST_OVERLAP: f64 = 0.6;

/// Compares frames that see the same side a turn apart, and corrects the poses so that they agree. Returns the
/// disagreement before the correction.
///
/// **Source** pose graph on SE(3), Gauss–Newton; Grisetti et al. 2010.
pub(super) fn close_loops(
    cuts: &[SegmentedFrame],
    placed: &mut [Placed],
    axis: &Axis,
    voxel: f64,
    truncation: f64,
) -> Closure {
    let edges = loop_edges(cuts, placed, axis, voxel, truncation);
    let before = disagreement(&edges, placed);
    if edges.is_empty() {
        return before;
    }
    relax(placed, &edges);
    before
}

/// The disagreement of frames that see the same side a turn apart.
pub(super) fn loop_residual(
    cuts: &[SegmentedFrame],
    placed: &[Placed],
    axis: &Axis,
    voxel: f64,
    truncation: f64,
) -> Closure {
    disagreement(&loop_edges(cuts, placed, axis, voxel, truncation), placed)
}

fn pose_at(placed: &[Placed]) -> Vec<Isometry3<f64>> {
    placed.iter().map(|p| p.pose).collect()
}

/// Pairs (earlier, later) of frames that see the same side, evenly sampled from all such pairs.
fn loop_pairs(headings: &[f64]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for later in 0..headings.len() {
        for earlier in 0..later {
            let turned = (headings[later] - headings[earlier]).abs();
            let apart = wrapped_angle(turned).abs();
            if turned > AROUND && apart < SAME_VIEW {
                pairs.push((earlier, later));
            }
        }
    }
    let span = headings.iter().fold(0.0f64, |most, h| most.max((h - headings[0]).abs()));
    let most = MOST_PAIRS * (span / TAU).round().max(1.0) as usize;
    let step = pairs.len().div_ceil(most).max(1);
    pairs.into_iter().step_by(step).collect()
}

fn loop_edges(cuts: &[SegmentedFrame], placed: &[Placed], axis: &Axis, voxel: f64, truncation: f64) -> Vec<Edge> {
    let headings = axis.headings(&pose_at(placed));
    let pairs = loop_pairs(&headings);
    pairs
        .par_iter()
        .filter_map(|&(earlier, later)| {
            let near = earlier.saturating_sub(WINDOW)..(earlier + WINDOW + 1).min(placed.len());
            let mut local = Volume::new(voxel, truncation);
            // Only the frames around the earlier one, not those since.
            for p in placed[near].iter().filter(|p| p.cut < placed[later].cut) {
                local.integrate(&cuts[p.cut].view, &p.pose);
            }
            let view = &cuts[placed[later].cut].view;
            let guess = placed[later].pose;
            let found: Alignment = align(view, &predicted(view, &local, &guess, Reach::Far), &guess, &TRACKING);
            let measured = placed[earlier].pose.inverse() * found.model_from_camera;
            (found.overlap > LEAST_OVERLAP).then_some(Edge {
                from: earlier,
                to: later,
                from_camera_to: measured,
                weight: LOOP_WEIGHT,
            })
        })
        .collect()
}

fn disagreement(edges: &[Edge], placed: &[Placed]) -> Closure {
    let mut closure = Closure { loops: edges.len(), ..Closure::default() };
    for edge in edges {
        let stated = placed[edge.from].pose.inverse() * placed[edge.to].pose;
        // Measured at the person, not at the camera, whose lever arm would amplify the rotation.
        let off = edge.from_camera_to * stated.inverse();
        let person = placed[edge.from].pose.inverse() * Point3::new(0.0, 1.0, 0.0);
        closure.shift += (off * person - person).norm() / edges.len() as f64;
        closure.turn += off.rotation.angle() / edges.len() as f64;
    }
    closure
}

/// Least squares over all edges, the first frame held.
fn relax(placed: &mut [Placed], loops: &[Edge]) {
    let steps: Vec<Edge> = (1..placed.len())
        .map(|k| Edge {
            from: k - 1,
            to: k,
            from_camera_to: placed[k - 1].pose.inverse() * placed[k].pose,
            weight: 1.0,
        })
        .collect();
    let unknowns = 6 * (placed.len() - 1);
    for _ in 0..10 {
        let mut triplets: Vec<(usize, usize, f64)> = (0..unknowns).map(|i| (i, i, 1e-9)).collect();
        let mut right = vec![0.0; unknowns];
        for edge in steps.iter().chain(loops) {
            add_edge(edge, placed, &mut triplets, &mut right);
        }
        let Ok(factor) = SparseCholesky::prepare(unknowns, &triplets) else { return };
        let step = factor.solve(&right);
        for (p, step) in placed[1..].iter_mut().zip(step.chunks_exact(6)) {
            p.pose = moved(&p.pose, &Vector6::from_column_slice(step), &Point3::origin());
        }
        if step.iter().all(|s| s.abs() < 1e-7) {
            return;
        }
    }
}

/// Both poses move by small motions in the model's frame. The error of an edge is the remaining motion between them,
/// and its derivatives are ±1.
fn add_edge(edge: &Edge, placed: &[Placed], triplets: &mut Vec<(usize, usize, f64)>, right: &mut [f64]) {
    let (from, to) = (&placed[edge.from].pose, &placed[edge.to].pose);
    let left = from * edge.from_camera_to * to.inverse();
    let mut error = Vector6::zeros();
    error.fixed_rows_mut::<3>(0).copy_from(&left.rotation.scaled_axis());
    error.fixed_rows_mut::<3>(3).copy_from(&left.translation.vector);
    // A rotation by 1 rad moves a point half a metre from the axis by half a metre.
    let lever = Matrix6::from_diagonal(&Vector6::new(0.25, 0.25, 0.25, 1.0, 1.0, 1.0)) * edge.weight;
    let pull = lever * error;
    let mut add = |row: usize, column: usize, sign: f64| {
        for k in 0..6 {
            triplets.push((6 * row + k, 6 * column + k, sign * lever[(k, k)]));
        }
    };
    // The first frame is fixed.
    let slot = |frame: usize| frame.checked_sub(1);
    let (a, b) = (slot(edge.from), slot(edge.to));
    if let Some(a) = a {
        add(a, a, 1.0);
        (0..6).for_each(|k| right[6 * a + k] -= pull[k]);
    }
    if let Some(b) = b {
        add(b, b, 1.0);
        (0..6).for_each(|k| right[6 * b + k] += pull[k]);
    }
    if let (Some(a), Some(b)) = (a, b) {
        add(a, b, -1.0);
        add(b, a, -1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Vec3};
    use std::f64::consts::PI;

    #[test]
    fn drift_over_a_turn_is_spread_evenly() {
        let axis = Axis { point: Point::origin(), direction: Vec3::y_axis() };
        let start = Isometry3::new(Vec3::new(0.0, 0.0, 2.0), Vec3::new(0.0, PI, 0.0));
        let truth = |k: usize| axis.turn(k as f64 * TAU / 36.0) * start;
        // Each step turns a tenth of a degree too far and rises by half a millimetre.
        let drifted =
            |k: usize| Isometry3::translation(0.0, 5e-4 * k as f64, 0.0) * axis.turn(k as f64 * 1.75e-3) * truth(k);
        let mut placed: Vec<Placed> = (0..37).map(|k| Placed { cut: k, pose: drifted(k), residual: 0.0 }).collect();
        let edge = Edge { from: 0, to: 36, from_camera_to: truth(0).inverse() * truth(36), weight: 1e4 };
        let before = disagreement(std::slice::from_ref(&edge), &placed);
        assert!((before.shift - 0.018).abs() < 1e-3 && (before.turn - 0.063).abs() < 1e-3);
        relax(&mut placed, &[edge]);
        for (k, p) in placed.iter().enumerate() {
            let off = p.pose * truth(k).inverse();
            assert!(off.rotation.angle() < 2e-4 && off.translation.vector.norm() < 2e-4, "{k}: {off}");
        }
    }
}
