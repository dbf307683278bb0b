//! The pose of the figure on a poster.

use crate::body::HumanJoint::{self, Chest, Foot, Head, LowerArm, LowerLeg, Neck, Spine, UpperArm, UpperLeg};
use crate::body::Side::{Left, Right};
use crate::body::{Pose, Skeleton};
use crate::geometry::Vec3;
use nalgebra::UnitQuaternion;

/// A step forward with a raised hand: degrees about x (leg forward is negative), y and z, as seen in the bind pose.
const POSE: [(HumanJoint, [f64; 3]); 14] = [
    (Spine, [1.0, 4.0, 0.0]),
    (Chest, [0.0, 5.0, 1.0]),
    (Neck, [0.0, 6.0, 0.0]),
    (Head, [-2.0, 10.0, -3.0]),
    (UpperArm(Left), [0.0, 0.0, 18.0]),
    (LowerArm(Left), [-12.0, 0.0, 34.0]),
    (UpperArm(Right), [6.0, 0.0, 22.0]),
    (LowerArm(Right), [-14.0, -12.0, 0.0]),
    (UpperLeg(Left), [-5.0, 0.0, -2.0]),
    (LowerLeg(Left), [5.0, 0.0, 0.0]),
    (Foot(Left), [0.0, 0.0, 0.0]),
    (UpperLeg(Right), [4.0, 0.0, 2.0]),
    (LowerLeg(Right), [2.0, 0.0, 0.0]),
    (Foot(Right), [-6.0, 0.0, 0.0]),
];

/// A skeleton that steps forward with a raised hand.
pub fn striding(skeleton: &Skeleton) -> Pose {
    let mut pose = Pose::bind(skeleton.len());
    for (joint, degrees) in POSE {
        if let Some(joint) = skeleton.find(joint) {
            let [x, y, z] = degrees.map(f64::to_radians);
            let about = |axis: nalgebra::Unit<Vec3>, angle| UnitQuaternion::from_axis_angle(&axis, angle);
            pose.rotations[joint.index()] =
                about(Vec3::y_axis(), y) * about(Vec3::x_axis(), x) * about(Vec3::z_axis(), z);
        }
    }
    pose
}
