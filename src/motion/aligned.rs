//! The bind pose with its limbs turned to given directions.

use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use crate::body::Skeleton;
use crate::geometry::{Point, Vec3};
use nalgebra::{Unit, UnitQuaternion};

/// The joint at the end of a limb's bone: hand for lower arm.
pub(super) fn bone_end(joint: HumanJoint) -> Option<HumanJoint> {
    match joint {
        UpperArm(side) => Some(LowerArm(side)),
        LowerArm(side) => Some(Hand(side)),
        UpperLeg(side) => Some(LowerLeg(side)),
        LowerLeg(side) => Some(Foot(side)),
        Foot(side) => Some(Toes(side)),
        Hips | Spine | Chest | UpperChest | Neck | Head | Shoulder(_) | Hand(_) | Toes(_) => None,
    }
}

/// From a joint to the end of its bone in the bind pose.
pub(super) fn bone_in_bind(skeleton: &Skeleton, joint: HumanJoint) -> Option<Vec3> {
    let at = |joint| Some(skeleton.joints_in_bind[skeleton.find(joint)?.index()]);
    Some(at(bone_end(joint)?)? - at(joint)?)
}

/// For each joint the rotation from the bind pose to a pose whose arms and legs have the given directions.
///
/// The trunk is not turned. Each bone is turned by the smallest rotation, on from the rotation of the bone above; hands turn
/// with the forearms. Feet stay level and only turn about the vertical. A bone without a direction turns with the one above.
///
/// **Shapes** one rotation per joint.
pub(super) fn aligned(skeleton: &Skeleton, direction: impl Fn(HumanJoint) -> Option<Vec3>) -> Vec<UnitQuaternion<f64>> {
    let mut turned: Vec<UnitQuaternion<f64>> = Vec::with_capacity(skeleton.len());
    for j in skeleton.ids() {
        let above = skeleton.parents[j.index()].map_or_else(UnitQuaternion::identity, |parent| turned[parent.index()]);
        let joint = skeleton.human_joint(j);
        let bone = joint.and_then(|joint| Some((bone_in_bind(skeleton, joint)?, direction(joint)?)));
        turned.push(match (joint, bone) {
            (Some(Foot(_)), Some((bone, wanted))) => {
                let level = |v: Vec3| Vec3::new(v.x, 0.0, v.z);
                smallest_rotation(&level(bone), &level(wanted))
            }
            (Some(Foot(_)), None) => UnitQuaternion::identity(),
            (Some(UpperArm(_) | LowerArm(_) | UpperLeg(_) | LowerLeg(_)), Some((bone, wanted))) => {
                smallest_rotation(&(above * bone), &wanted) * above
            }
            (Some(Hips | Spine | Chest | UpperChest | Neck | Head | Shoulder(_)), _) => UnitQuaternion::identity(),
            _ => above,
        });
    }
    turned
}

/// The smallest rotation that turns one direction to another; no rotation if one has no length, and for opposed ones the half
/// turn about an axis perpendicular to both.
pub(super) fn smallest_rotation(from: &Vec3, to: &Vec3) -> UnitQuaternion<f64> {
    let (Some(from), Some(to)) = (Unit::try_new(*from, 1e-9), Unit::try_new(*to, 1e-9)) else {
        return UnitQuaternion::identity();
    };
    UnitQuaternion::rotation_between_axis(&from, &to).unwrap_or_else(|| {
        let across = if from.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
        let axis = Unit::new_normalize(from.cross(&across));
        UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI)
    })
}

/// A rotation about the vertical.
pub(super) fn about_vertical(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vec3::y_axis(), angle)
}

/// The heading of a rotation: that of the turned forward axis.
pub(super) fn heading(rotation: &UnitQuaternion<f64>) -> f64 {
    let forward = rotation * Vec3::z();
    // Where it points up or down, the heading is that of the top of the head.
    let level = if forward.y.abs() < 0.9 { forward } else { (rotation * Vec3::y()) * -forward.y.signum() };
    level.x.atan2(level.z)
}

/// The point halfway between two.
pub(super) fn midpoint(a: &Point, b: &Point) -> Point {
    nalgebra::center(a, b)
}
