//! The tailor's dummy: the subject with arms and legs a little away, and what can be looked up on it.

use super::subject::Subject;
use crate::body::{BonePosition, Pose, bone_positions, skin};
use crate::geometry::{NearestVertex, PerVertex, Point, TriMesh, Vec3, VertexId};
use nalgebra::UnitQuaternion;

/// Arms 15° further from the body than in the bind pose, legs 3°: sleeves and legs are sewn on so, and fold when worn.
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

/// The body that a pattern is laid around.
pub(super) struct Dummy<'a> {
    pub(super) subject: &'a Subject,
    pub(super) body: TriMesh,
    joints: Vec<Point>,
    positions: PerVertex<BonePosition>,
    nearest: NearestVertex,
}

impl<'a> Dummy<'a> {
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

    /// A joint by its name.
    pub(super) fn joint(&self, name: &str) -> Point {
        self.subject.skeleton.find_name(name).map_or(Point::origin(), |j| self.joints[j.index()])
    }

    /// A point between two joints.
    pub(super) fn between(&self, from: &str, to: &str, along: f64) -> Point {
        let (a, b) = (self.joint(from), self.joint(to));
        a + (b - a) * along
    }

    /// The skin's nearest vertex.
    pub(super) fn at(&self, p: &Point) -> VertexId {
        self.nearest.nearest(p).map_or(VertexId(0), |(v, _)| v)
    }

    /// The bone to which a vertex belongs.
    pub(super) fn part(&self, v: VertexId) -> &str {
        &self.subject.skeleton.names[self.positions[v].joint.index()]
    }

    /// How far along that bone.
    pub(super) fn along(&self, v: VertexId) -> f64 {
        self.positions[v].along
    }
}
