//! The dress form: the subject with arms and legs a little away from the body, and lookups on its surface.

use crate::body::{BonePosition, Pose, bone_positions, skin};
use crate::geometry::{NearestVertex, PerVertex, Point, TriMesh, Vec3, VertexId};
use crate::studio::subject::Subject;
use nalgebra::UnitQuaternion;

/// Arms 15° farther from the body than in the bind pose, legs 3°: garments are sewn in this pose, and their sleeves and
/// legs fold when they are worn.
pub(super) fn sewing_pose(subject: &Subject) -> Pose {
    let mut pose = Pose::bind(subject.skeleton.len());
    for (name, degrees) in
        [("leftUpperArm", 15.0f64), ("rightUpperArm", -15.0), ("leftUpperLeg", 3.0), ("rightUpperLeg", -3.0)]
    {
        if let Some(j) = subject.skeleton.find_name(name) {
            pose.rotations[j.index()] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), degrees.to_radians());
        }
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
    pub(super) fn joint(&self, name: &str) -> Point {
        self.subject.skeleton.find_name(name).map_or(Point::origin(), |j| self.joints[j.index()])
    }

    /// A point between two joints.
    pub(super) fn between(&self, from: &str, to: &str, along: f64) -> Point {
        let (a, b) = (self.joint(from), self.joint(to));
        a + (b - a) * along
    }

    /// The nearest vertex of the skin.
    pub(super) fn nearest_vertex(&self, p: &Point) -> VertexId {
        self.nearest.nearest(p).map_or(VertexId(0), |(v, _)| v)
    }

    /// The name of the joint whose bone a vertex belongs to.
    pub(super) fn part(&self, v: VertexId) -> &str {
        &self.subject.skeleton.names[self.positions[v].joint.index()]
    }

    /// The position of a vertex along that bone, 0 to 1.
    pub(super) fn along(&self, v: VertexId) -> f64 {
        self.positions[v].along
    }
}
