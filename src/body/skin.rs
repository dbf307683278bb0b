//! Linear blend skinning.

use super::pose_dirs::PoseOffsets;
use super::{JointId, Pose, PoseDirs, Skeleton};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use nalgebra::{Isometry3, Matrix3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The most joints that may move a vertex: what film and game engines read at most.
pub const INFLUENCES: usize = 8;
/// The joints that move a vertex, with their weights.
pub type SkinRow = [(JointId, f64); INFLUENCES];
/// The joints that move a vertex of a body, and all that many programs read from a file.
const FEW_INFLUENCES: usize = 4;

/// The joint with the greatest weight, where fingers count as part of the hand.
///
/// **Requires** `body_joints` as [`Skeleton::body_joints`] gives it.
pub fn dominant_body_joint(row: &SkinRow, body_joints: &[JointId]) -> JointId {
    let sum = |joint: JointId| row.iter().filter(|(j, _)| body_joints[j.index()] == joint).map(|(_, w)| w).sum::<f64>();
    let rest = row[1..].iter().filter(|(_, w)| *w > 0.0).map(|(j, _)| body_joints[j.index()]);
    let first = body_joints[row[0].0.index()];
    rest.fold(first, |most, joint| if sum(joint) > sum(most) { joint } else { most })
}

/// How strongly each joint moves each vertex; and, for a model with corrective offsets, how the pose deforms the surface
/// before the joints move it.
///
/// **Shapes** one row of eight (joint, weight) pairs per vertex.
///
/// **Guarantees** weights are ≥ 0, sum to 1 (±1e-9) and descend in each row; unused slots are joint 0 with weight 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkinWeights {
    rows: PerVertex<SkinRow>,
    pose_offsets: Option<PoseOffsets>,
}

impl SkinWeights {
    /// Keeps the four largest weights of each row and scales them to a sum of 1. A row without weight follows the root.
    ///
    /// **Shapes** `rows`: V lists of any length; the result is `V × 4`.
    pub fn from_rows(rows: impl IntoIterator<Item = Vec<(JointId, f64)>>) -> Self {
        Self { rows: rows.into_iter().map(|row| prune(row, FEW_INFLUENCES)).collect(), pose_offsets: None }
    }

    /// Keeps the eight largest weights of each row, as cloth in an armpit needs, and scales them to a sum of 1.
    ///
    /// **Shapes** `rows`: V lists of any length; the result is `V × 8`.
    pub fn from_rows_of_cloth(rows: impl IntoIterator<Item = Vec<(JointId, f64)>>) -> Self {
        Self { rows: rows.into_iter().map(|row| prune(row, INFLUENCES)).collect(), pose_offsets: None }
    }

    /// The weights of at most four joints per vertex, for programs that read no more.
    ///
    /// The fifth weight is subtracted from the four larger ones. So the result is continuous where two joints change places,
    /// and cloth does not tear there; dropping the smaller weights alone tears it.
    pub fn with_four_influences(&self) -> Self {
        let few = |row: &SkinRow| {
            let fifth = row[FEW_INFLUENCES].1;
            prune(row.iter().map(|&(j, w)| (j, w - fifth)).collect(), FEW_INFLUENCES)
        };
        Self { rows: self.rows.iter().map(few).collect(), pose_offsets: self.pose_offsets.clone() }
    }

    /// Whether more than four joints move some vertex.
    pub fn needs_more_than_four(&self) -> bool {
        self.rows.iter().any(|row| row[FEW_INFLUENCES].1 > 0.0)
    }

    /// Adds the corrective offsets of the model, for its own surface.
    pub fn with_pose_dirs(self, dirs: Arc<PoseDirs>) -> Self {
        Self { pose_offsets: Some(PoseOffsets::of_model(dirs)), ..self }
    }

    /// Adds the corrective offsets of another surface, with the weights `body`, for a surface that follows it.
    ///
    /// **Shapes** `places`: per vertex the vertices of the other surface that it follows, with shares; the shares sum to 1,
    /// or to less where the surface hangs loosely on the body.
    ///
    /// **Requires** one entry of `places` per row.
    pub fn following(self, body: &Self, places: impl IntoIterator<Item = Vec<(VertexId, f64)>>) -> Self {
        let pose_offsets = body.pose_offsets.as_ref().map(|own| own.followed(places.into_iter()));
        Self { pose_offsets, ..self }
    }

    /// The weights of some of the vertices, in their order.
    ///
    /// **Shapes** `kept` has one entry per row of the result.
    pub fn of_vertices(&self, kept: &PerVertex<VertexId>) -> Self {
        let rows = kept.iter().map(|&v| self.rows[v]).collect();
        let pose_offsets = self.pose_offsets.as_ref().map(|own| own.followed(kept.iter().map(|&v| vec![(v, 1.0)])));
        Self { rows, pose_offsets }
    }

    /// The rows of several surfaces one after another.
    pub fn joined<'a>(parts: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let rows = parts.clone().flat_map(|part| part.rows.iter().copied()).collect();
        let pose_offsets = PoseOffsets::joined(parts.map(|part| (part.pose_offsets.as_ref(), part.len())));
        Self { rows, pose_offsets }
    }

    /// The corrective offsets of the model, where it has them.
    pub fn pose_dirs(&self) -> Option<&Arc<PoseDirs>> {
        self.pose_offsets.as_ref().and_then(PoseOffsets::dirs)
    }

    /// Restores the model's corrective offsets, which are not stored with the weights. A rigid surface stays rigid.
    pub fn restore_pose_dirs(&mut self, dirs: &Arc<PoseDirs>) {
        if let Some(own) = &mut self.pose_offsets {
            own.set_dirs(dirs);
        }
    }

    /// Drops the corrective offsets.
    pub fn rigid(self) -> Self {
        Self { pose_offsets: None, ..self }
    }

    /// Whether the pose deforms the surface by corrective offsets.
    pub fn has_pose_offsets(&self) -> bool {
        self.pose_offsets.is_some()
    }

    /// The corrective offset of each vertex in `pose`, in the axes of the bind pose; `None` for a rigid surface.
    ///
    /// **Shapes** `V × 3`, in metres.
    pub fn offsets_in(&self, pose: &Pose) -> Option<PerVertex<Vec3>> {
        let pose_offsets = self.pose_offsets.as_ref()?;
        debug_assert!(pose_offsets.dirs().is_some(), "the model's corrective offsets were not restored");
        pose_offsets.in_pose(pose)
    }

    /// Points of the bind pose plus their corrective offsets in `pose`.
    ///
    /// **Shapes** `V × 3`.
    pub fn with_pose_offsets(&self, points_in_bind: &PerVertex<Point>, pose: &Pose) -> PerVertex<Point> {
        match self.offsets_in(pose) {
            None => points_in_bind.clone(),
            Some(offsets) => points_in_bind.iter().zip(offsets.iter()).map(|(p, d)| p + d).collect(),
        }
    }

    /// One row per vertex.
    pub fn rows(&self) -> &PerVertex<SkinRow> {
        &self.rows
    }
    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.rows.len()
    }
    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
    /// The least number of joints that a skeleton for these weights has: one more than the greatest joint id.
    pub fn least_joint_count(&self) -> usize {
        self.rows.iter().flatten().map(|(joint, _)| joint.index() + 1).max().unwrap_or(0)
    }
    /// Blends rows: `Σ factor · row`, not pruned. Used for points on triangles.
    ///
    /// **Shapes** one entry per joint that moves the point.
    pub fn blend(&self, parts: &[(VertexId, f64)]) -> Vec<(JointId, f64)> {
        let mut sum: Vec<(JointId, f64)> = Vec::with_capacity(8);
        for &(v, factor) in parts {
            for &(j, w) in &self.rows[v] {
                if w <= 0.0 {
                    continue;
                }
                match sum.iter_mut().find(|(k, _)| *k == j) {
                    Some((_, total)) => *total += factor * w,
                    None => sum.push((j, factor * w)),
                }
            }
        }
        sum
    }
}

fn prune(mut row: Vec<(JointId, f64)>, most: usize) -> SkinRow {
    row.retain(|&(_, w)| w.is_finite() && w > 0.0);
    row.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    row.truncate(most);
    let sum: f64 = row.iter().map(|r| r.1).sum();
    let mut out = [(JointId(0), 0.0); INFLUENCES];
    if sum <= 0.0 {
        out[0].1 = 1.0;
        return out;
    }
    for (slot, (j, w)) in out.iter_mut().zip(row) {
        *slot = (j, w / sum);
    }
    out
}

/// Rotation and translation of each joint.
///
/// **Shapes** one pair per joint.
fn as_matrices(transforms: &[Isometry3<f64>]) -> Vec<(Matrix3<f64>, Vec3)> {
    transforms.iter().map(|t| (t.rotation.to_rotation_matrix().into_inner(), t.translation.vector)).collect()
}

fn blended(row: &SkinRow, world_from_bind: &[(Matrix3<f64>, Vec3)]) -> (Matrix3<f64>, Vec3) {
    let mut linear = Matrix3::zeros();
    let mut offset = Vec3::zeros();
    // Weights descend: what follows a zero is never read, which for most vertices is half of the row.
    for &(j, w) in row.iter().take_while(|(_, w)| *w > 0.0) {
        let (rotation, translation) = &world_from_bind[j.index()];
        linear += rotation * w;
        offset += translation * w;
    }
    (linear, offset)
}

/// A shorter array would cut the surface off silently. Files with arrays that disagree are refused when they are read, and
/// each stage checks its arguments, so only a fault of the program gets here.
pub(super) fn check_lengths(points: &PerVertex<Point>, weights: &SkinWeights, skeleton: &Skeleton, pose: &Pose) {
    assert_eq!(weights.len(), points.len(), "rows of skin weights for the points");
    assert_eq!(pose.rotations.len(), skeleton.len(), "rotations of the pose for the joints of the skeleton");
}

/// Moves points from the bind pose into `pose`: Hu 2017, Eq. 3, `Σ_j w_j R_j (v + c(pose))`, where `c` are the corrective
/// offsets of models that have them.
///
/// **Shapes** `V × 3` in and out, with `V` rows of weights and one rotation per joint.
///
/// # Panics
/// If the shapes are others.
pub fn skin(
    points_in_bind: &PerVertex<Point>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose: &Pose,
) -> PerVertex<Point> {
    match weights.has_pose_offsets() {
        true => skin_rigidly(&weights.with_pose_offsets(points_in_bind, pose), weights, skeleton, pose),
        false => skin_rigidly(points_in_bind, weights, skeleton, pose),
    }
}

/// The blend alone, for points that already include their corrective offsets.
pub(crate) fn skin_rigidly(
    points_in_bind: &PerVertex<Point>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose: &Pose,
) -> PerVertex<Point> {
    check_lengths(points_in_bind, weights, skeleton, pose);
    let transforms = as_matrices(&skeleton.world_from_bind(pose));
    let moved = points_in_bind
        .0
        .par_iter()
        .zip(weights.rows.0.par_iter())
        .map(|(p, row)| {
            let (linear, offset) = blended(row, &transforms);
            Point::from(linear * p.coords + offset)
        })
        .collect::<Vec<_>>();
    moved.into()
}

/// Moves points from `pose` back into the bind pose: inverts each blended matrix and subtracts the corrective offsets.
///
/// **Shapes** `V × 3` in and out, with `V` rows of weights and one rotation per joint.
///
/// # Panics
/// If the shapes are others.
///
/// A blend of rotations far apart is nearly singular; there the strongest joint's own transform is inverted.
pub fn unskin(
    points_in_world: &PerVertex<Point>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose: &Pose,
) -> PerVertex<Point> {
    /// Below this determinant a blended matrix has lost half of its volume: two rotations over about 100° apart.
    const LEAST_DETERMINANT: f64 = 0.4;
    check_lengths(points_in_world, weights, skeleton, pose);
    let transforms = skeleton.world_from_bind(pose);
    let matrices = as_matrices(&transforms);
    let moved = points_in_world
        .0
        .par_iter()
        .zip(weights.rows.0.par_iter())
        .map(|(p, row)| {
            let (linear, offset) = blended(row, &matrices);
            match linear.try_inverse() {
                Some(inverse) if linear.determinant() > LEAST_DETERMINANT => Point::from(inverse * (p.coords - offset)),
                _ => transforms[row[0].0.index()].inverse_transform_point(p),
            }
        })
        .collect::<Vec<_>>();
    match weights.offsets_in(pose) {
        None => moved.into(),
        Some(offsets) => moved.iter().zip(offsets.iter()).map(|(p, d)| p - d).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn arm() -> (Skeleton, SkinWeights, PerVertex<Point>) {
        let skeleton = Skeleton {
            names: vec!["a".into(), "b".into()],
            parents: vec![None, Some(JointId(0))],
            joints_in_bind: vec![Point::origin(), Point::new(1.0, 0.0, 0.0)],
        };
        let points: PerVertex<Point> = (0..20).map(|i| Point::new(f64::from(i) * 0.1, 0.1, -0.05)).collect();
        let weights = SkinWeights::from_rows(points.iter().map(|p| {
            let t = (p.x - 0.5).clamp(0.0, 1.0);
            vec![(JointId(0), 1.0 - t), (JointId(1), t)]
        }));
        (skeleton, weights, points)
    }

    #[test]
    #[should_panic(expected = "rows of skin weights for the points")]
    fn weights_for_other_points_are_a_fault_and_cut_nothing_off() {
        let (skeleton, weights, points) = arm();
        skin(&points.0[..5].to_vec().into(), &weights, &skeleton, &Pose::bind(2));
    }

    #[test]
    #[should_panic(expected = "rotations of the pose")]
    fn a_pose_of_another_skeleton_is_a_fault() {
        let (skeleton, weights, points) = arm();
        unskin(&points, &weights, &skeleton, &Pose::bind(3));
    }

    #[test]
    fn weights_sum_to_one_and_at_most_four_stay() {
        let weights = SkinWeights::from_rows([(0..9).map(|j| (JointId(j), f64::from(j) + 1.0)).collect(), vec![]]);
        for row in weights.rows().iter() {
            assert!((row.iter().map(|r| r.1).sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!(weights.rows().0[0][0].0, JointId(8));
    }

    #[test]
    fn where_the_fourth_and_fifth_joint_change_places_four_weights_change_little() {
        let row = |t: f64| {
            let small = [0.08 - t, 0.08 + t, 0.02];
            let rest = [0.4, 0.3, 0.12].into_iter().chain(small);
            (0..).map(JointId).zip(rest).collect::<Vec<_>>()
        };
        let of_joint = |weights: &SkinWeights, j: u16| -> f64 {
            weights.rows().0[0].iter().filter(|e| e.0 == JointId(j)).map(|e| e.1).sum()
        };
        let cloth = |t| SkinWeights::from_rows_of_cloth([row(t)]);
        let (before, after) = (cloth(-1e-6).with_four_influences(), cloth(1e-6).with_four_influences());
        let dropped = [-1e-6, 1e-6].map(|t| SkinWeights::from_rows([row(t)]));
        let jump = |a: &SkinWeights, b: &SkinWeights| {
            (0..6).map(|j| (of_joint(a, j) - of_joint(b, j)).abs()).fold(0.0, f64::max)
        };
        assert!(jump(&before, &after) < 1e-5, "{before:?} {after:?}");
        assert!(jump(&dropped[0], &dropped[1]) > 0.05, "plain pruning jumps");
        assert!(cloth(0.0).needs_more_than_four() && !before.needs_more_than_four());
        let few = SkinWeights::from_rows([row(0.0)]);
        assert_eq!(few.with_four_influences(), few, "four weights stay as they are");
    }

    #[test]
    fn unskin_undoes_skin() {
        let (skeleton, weights, points) = arm();
        let mut pose = Pose::bind(2);
        pose.translation = Vec3::new(0.3, -0.2, 0.9);
        pose.rotations[0] = UnitQuaternion::from_euler_angles(0.2, 0.5, -0.1);
        pose.rotations[1] = UnitQuaternion::from_euler_angles(0.0, 0.1, 0.8);
        let there = skin(&points, &weights, &skeleton, &pose);
        let back = unskin(&there, &weights, &skeleton, &pose);
        for (p, q) in points.iter().zip(back.iter()) {
            assert!((p - q).norm() < 1e-9);
        }
    }

    #[test]
    fn the_bind_pose_moves_nothing_and_a_rigid_pose_keeps_distances() {
        let (skeleton, weights, points) = arm();
        let same = skin(&points, &weights, &skeleton, &Pose::bind(2));
        assert!(points.iter().zip(same.iter()).all(|(p, q)| (p - q).norm() < 1e-12));
        let mut pose = Pose::bind(2);
        pose.rotations[0] = UnitQuaternion::from_euler_angles(0.7, -0.4, 1.3);
        let moved = skin(&points, &weights, &skeleton, &pose);
        let (a, b) = ((points.0[0] - points.0[19]).norm(), (moved.0[0] - moved.0[19]).norm());
        assert!((a - b).abs() < 1e-12);
    }
}
