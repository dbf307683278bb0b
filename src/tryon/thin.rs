//! A figure with its limbs and trunk made thin around their bones, so that it stands free in a garment.

use crate::body::{Figure, HumanJoint, JointId, Pose, Skeleton};
use crate::geometry::{Point, TriMesh, Vec3};
use rayon::prelude::*;

/// The layers of a figure near a garment, with the bone that each joint thins to.
pub(super) struct ThinFigure<'a> {
    figure: &'a Figure,
    /// A point and the direction of each joint's bone in the bind pose; no direction where it shrinks on all sides.
    bones: Vec<(Point, Option<Vec3>)>,
    /// Per layer the part near the garment, and the vertices of the layer that it has.
    parts: Vec<(TriMesh, Vec<usize>)>,
}

impl<'a> ThinFigure<'a> {
    /// The parts of all layers that are within `reach` metres of the bounds of a garment in the bind pose.
    pub(super) fn near(figure: &'a Figure, garment: &TriMesh, reach: f64) -> Self {
        let skeleton = &figure.skeleton;
        let bones = skeleton.ids().map(|joint| bone_of(skeleton, joint)).collect();
        let bounds = garment.bounds();
        let is_near = |p: &Point| {
            bounds.as_ref().is_some_and(|b| (0..3).all(|k| p[k] > b.min[k] - reach && p[k] < b.max[k] + reach))
        };
        let parts = figure.layers.iter().map(|layer| {
            let mesh = &layer.mesh;
            let keep = mesh.faces().iter().map(|face| face.iter().any(|&v| is_near(&mesh.points()[v]))).collect();
            let (part, from) = mesh.part(&keep);
            (part, from.iter().map(|v| v.index()).collect())
        });
        Self { figure, bones, parts: parts.collect() }
    }

    /// The parts in a pose, with distances from the bones multiplied by `thickness`: affine maps of the bones, blended as
    /// skinning blends their rotations.
    ///
    /// **Guarantees** layers keep their order; with a thickness of 1 this is skinning.
    pub(super) fn posed(&self, pose: &Pose, thickness: f64) -> Vec<TriMesh> {
        let world_from_bind = self.figure.skeleton.world_from_bind(pose);
        let thinned = |p: &Point, joint: JointId| {
            let (origin, axis) = &self.bones[joint.index()];
            let along = axis.map_or(Vec3::zeros(), |axis| axis * (p - origin).dot(&axis));
            world_from_bind[joint.index()] * (origin + along + (p - origin - along) * thickness)
        };
        let of_layer = |(layer, (part, from)): (&crate::body::Layer, &(TriMesh, Vec<usize>))| {
            let points = layer.weights.with_pose_offsets(layer.mesh.points(), pose);
            let rows = layer.weights.rows();
            let at: Vec<Point> = from
                .par_iter()
                .map(|&v| {
                    let used = rows.0[v].iter().filter(|(_, w)| *w > 0.0);
                    Point::from(used.map(|&(j, w)| thinned(&points.0[v], j).coords * w).sum::<Vec3>())
                })
                .collect();
            part.with_points(at)
        };
        self.figure.layers.iter().zip(&self.parts).map(of_layer).collect()
    }
}

/// A point on the bone of a joint, and its direction, in the bind pose. Head, hands and feet shrink on all sides: a foot must not
/// stand out of the leg of trousers.
fn bone_of(skeleton: &Skeleton, joint: JointId) -> (Point, Option<Vec3>) {
    let at = |j: JointId| skeleton.joints_in_bind[j.index()];
    let mut above = Some(joint);
    while let Some(j) = above {
        if let Some(HumanJoint::Head | HumanJoint::Hand(_) | HumanJoint::Foot(_)) = skeleton.human_joint(j) {
            return (at(j), None);
        }
        above = skeleton.parents[j.index()];
    }
    let ahead = skeleton.human_joint(joint).and_then(next_along).and_then(|next| skeleton.find(next));
    let next = ahead.or_else(|| skeleton.ids().find(|&child| skeleton.parents[child.index()] == Some(joint)));
    let direction = next.and_then(|next| (at(next) - at(joint)).try_normalize(1e-6));
    (at(joint), Some(direction.unwrap_or_else(Vec3::y)))
}

/// The joint at the other end of a bone, where several begin.
fn next_along(joint: HumanJoint) -> Option<HumanJoint> {
    match joint {
        HumanJoint::Hips => Some(HumanJoint::Spine),
        HumanJoint::UpperChest => Some(HumanJoint::Neck),
        HumanJoint::Shoulder(side) => Some(HumanJoint::UpperArm(side)),
        _ => None,
    }
}
