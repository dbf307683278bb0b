//! Whether the person stands, by the angles at hips and knees.

use crate::body::{HumanJoint, Pose, Side, Skeleton};
use crate::geometry::Vec3;
use serde::{Deserialize, Serialize};

/// How far the legs are bent, in radians; `None` for a skeleton without these joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Posture {
    /// The greater of the angles between a thigh and the trunk, which goes from the neck to the hips; 0 is straight.
    pub hip_bend: Option<f64>,
    /// The greater of the angles between a lower leg and its thigh; 0 is straight.
    pub knee_bend: Option<f64>,
}

impl Posture {
    /// The posture of a pose.
    ///
    /// **Requires** a pose of that skeleton.
    pub fn of(skeleton: &Skeleton, pose: &Pose) -> Self {
        let joints = skeleton.joints_in_world(pose);
        let place = |joint| skeleton.find(joint).map(|j| joints[j.index()]);
        let between = |from, to| -> Option<Vec3> { Some(place(to)? - place(from)?) };
        let trunk = between(HumanJoint::Neck, HumanJoint::Hips);
        let thigh = |side| between(HumanJoint::UpperLeg(side), HumanJoint::LowerLeg(side));
        let shin = |side| between(HumanJoint::LowerLeg(side), HumanJoint::Foot(side));
        let greatest = |bend: &dyn Fn(Side) -> Option<f64>| Side::BOTH.into_iter().filter_map(bend).reduce(f64::max);
        Self {
            hip_bend: greatest(&|side| Some(thigh(side)?.angle(&trunk?))),
            knee_bend: greatest(&|side| Some(shin(side)?.angle(&thigh(side)?))),
        }
    }
}
