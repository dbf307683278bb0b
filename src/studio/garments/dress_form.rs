//! The dress form: the subject with arms and legs a little away from the body, and lookups on its surface.

use crate::body::{BonePosition, HumanJoint, Pose, Side, bone_positions, skin};
use crate::geometry::{NearestVertex, PerVertex, Point, TriMesh, Vec3, VertexId};
use crate::studio::subject::Subject;
use nalgebra::UnitQuaternion;

/// Arms 15° farther from the body than in the bind pose, legs 3°: garments are sewn in this pose, and their sleeves and
/// legs fold when they are worn.
pub(super) fn sewing_pose(subject: &Subject) -> Pose {
    let mut pose = Pose::bind(subject.skeleton.len());
    for (joint, degrees) in [
        (HumanJoint::UpperArm(Side::Left), 15.0f64),
        (HumanJoint::UpperArm(Side::Right), -15.0),
        (HumanJoint::UpperLeg(Side::Left), 3.0),
        (HumanJoint::UpperLeg(Side::Right), -3.0),
    ] {
        let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), degrees.to_radians());
        pose.rotations[subject.joint(joint).index()] = turn;
    }
    pose
}

/// The body around which a garment is sewn.
pub(super) struct DressForm<'a> {
    pub(super) subject: &'a Subject,
    pub(super) body: TriMesh,
    joints: Vec<Point>,
    positions: PerVertex<BonePosition>,
    nearest: NearestVertex,
}

impl<'a> DressForm<'a> {
    pub(super) fn of(subject: &'a Subject) -> Self {
        let pose = sewing_pose(subject);
        let posed = skin(subject.surface.points(), &subject.weights, &subject.skeleton, &pose);
        let body = subject.surface.with_points(posed);
        Self {
            joints: subject.skeleton.joints_in_world(&pose),
            positions: bone_positions(subject.surface.points(), &subject.weights, &subject.skeleton),
            nearest: NearestVertex::prepare(body.points().as_slice()),
            subject,
            body,
        }
    }

    /// The position of a joint, metres.
    pub(super) fn joint(&self, joint: HumanJoint) -> Point {
        self.joints[self.subject.joint(joint).index()]
    }

    /// A point between two joints.
    pub(super) fn between(&self, from: HumanJoint, to: HumanJoint, along: f64) -> Point {
        let (a, b) = (self.joint(from), self.joint(to));
        a + (b - a) * along
    }

    /// The nearest vertex of the skin.
    pub(super) fn nearest_vertex(&self, p: &Point) -> VertexId {
        let (vertex, _) = self.nearest.nearest(p).expect("a body has vertices");
        vertex
    }

    /// The joint whose bone a vertex belongs to.
    pub(super) fn part(&self, v: VertexId) -> HumanJoint {
        self.subject.part_of(self.positions[v].joint)
    }

    /// The position of a vertex along that bone, 0 to 1.
    pub(super) fn along(&self, v: VertexId) -> f64 {
        self.positions[v].along
    }
}
