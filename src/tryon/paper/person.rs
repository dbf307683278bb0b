//! What the method reads of the posed person: key joints, arm and leg bones, and how the trunk turns along its height.
//!
//! **Source** Shi 2020, §§3, 5.2 and 7.4. The person is any figure in any pose; bones are its skeleton's. For §7.4 the paper only
//! proposes to bend the torso by its skeleton. We turn cloth at each height as the bone at that height turns from the bind pose,
//! since neither the spine nor a torso's skeleton is straight: their directions differ also where nothing is bent.
//!
//! Eqs. 9 and 16 know no collar bones: raised arms would lift the whole garment to the mouth. The trunk's key joints are therefore
//! those that move with the trunk alone, and what the collar bones add moves the sleeve's first node.

use crate::body::{Figure, HumanJoint, Pose, Side};
use crate::geometry::{Point, Vec3};
use crate::tryon::recognize::Openings;
use nalgebra::{Isometry3, Rotation3, UnitQuaternion};

/// A skirt has the thighs' turn from this far below the hips, in metres: over a shorter way its front would fold in a squat.
const BELOW_HIPS: f64 = 0.2;
/// Around the knees it changes over this distance on both sides, in metres.
const AROUND_KNEES: f64 = 0.1;

/// The posed person as a garment sees it. In metres.
#[derive(Clone, Debug)]
pub struct Person {
    /// Key joints J_1, J_2 (shoulders) or J_4, J_5 (hips) where the trunk alone brings them, the left first.
    pub key_joints: [Point; 2],
    /// How far the collar bones move the shoulders from there.
    pub shrug: [Vec3; 2],
    /// From the right key joint to the left one.
    pub left: Vec3,
    /// The same in the bind pose.
    pub left_in_bind: Vec3,
    /// Height of the middle of the key joints in the bind pose.
    pub key_height_in_bind: f64,
    /// How the trunk's bone at the key joints turns from the bind pose.
    pub trunk: Rotation3<f64>,
    /// {a_1, a_2, a_3}: joints of the arms or legs in the pose, the left first; empty for skirts.
    pub limbs: Vec<[Point; 3]>,
    /// Heights in the bind pose, ascending, and how the body there turns from the bind pose.
    pub turns: Vec<(f64, UnitQuaternion<f64>)>,
}

impl Person {
    /// Reads a figure in a pose. `None` if its skeleton has no shoulders or hips.
    pub fn of(figure: &Figure, pose: &Pose, openings: &Openings) -> Option<Self> {
        let skeleton = &figure.skeleton;
        let world_from_bind = skeleton.world_from_bind(pose);
        let bind = |joint: HumanJoint| skeleton.find(joint).map(|j| skeleton.joints_in_bind[j.index()]);
        let turn = |joint: HumanJoint| skeleton.find(joint).map(|j| world_from_bind[j.index()]);
        let posed = |joint: HumanJoint| Some(turn(joint)? * bind(joint)?);
        let pair = |joint: fn(Side) -> HumanJoint, at: &dyn Fn(HumanJoint) -> Option<Point>| {
            Some([at(joint(Side::Left))?, at(joint(Side::Right))?])
        };
        let is_top = matches!(openings, Openings::Top { .. } | Openings::Open { .. });
        let key: fn(Side) -> HumanJoint = if is_top { HumanJoint::UpperArm } else { HumanJoint::UpperLeg };
        let in_bind = pair(key, &bind)?;
        let chain = |side: Side| match is_top {
            true => [HumanJoint::UpperArm(side), HumanJoint::LowerArm(side), HumanJoint::Hand(side)],
            false => [HumanJoint::UpperLeg(side), HumanJoint::LowerLeg(side), HumanJoint::Foot(side)],
        };
        let upper = [HumanJoint::UpperChest, HumanJoint::Chest, HumanJoint::Spine, HumanJoint::Hips];
        let lower = [HumanJoint::Hips];
        let trunk = if is_top { &upper[..] } else { &lower[..] }.iter().find_map(|&joint| turn(joint))?;
        let key_joints = in_bind.map(|p| trunk * p);
        let in_pose = pair(key, &posed)?;
        let limb = |side: Side| {
            let [a, b, c] = chain(side).map(posed);
            Some([a?, b?, c?])
        };
        let limbs: Option<Vec<[Point; 3]>> = Side::BOTH.into_iter().map(limb).collect();
        Some(Self {
            key_joints,
            shrug: std::array::from_fn(|k| in_pose[k] - key_joints[k]),
            left: key_joints[0] - key_joints[1],
            left_in_bind: in_bind[0] - in_bind[1],
            key_height_in_bind: nalgebra::center(&in_bind[0], &in_bind[1]).y,
            trunk: trunk.rotation.to_rotation_matrix(),
            limbs: if matches!(openings, Openings::Tube { .. }) { Vec::new() } else { limbs? },
            turns: turns(&bind, &turn),
        })
    }

    /// How the body turns from the bind pose at a height of the bind pose.
    pub fn turn_at(&self, height: f64) -> UnitQuaternion<f64> {
        let above = self.turns.partition_point(|(y, _)| *y < height);
        let Some(upper) = self.turns.get(above) else {
            return self.turns.last().map_or_else(UnitQuaternion::identity, |(_, turn)| *turn);
        };
        let Some(lower) = above.checked_sub(1).map(|k| &self.turns[k]) else { return upper.1 };
        let share = (height - lower.0) / (upper.0 - lower.0).max(f64::MIN_POSITIVE);
        lower.1.try_slerp(&upper.1, share, 1e-9).unwrap_or(upper.1)
    }
}

/// Turns in the middle of each bone of the trunk, and below it the mean of both legs.
fn turns(
    bind: &dyn Fn(HumanJoint) -> Option<Point>,
    turn: &dyn Fn(HumanJoint) -> Option<Isometry3<f64>>,
) -> Vec<(f64, UnitQuaternion<f64>)> {
    let of_trunk = [HumanJoint::Hips, HumanJoint::Spine, HumanJoint::Chest, HumanJoint::UpperChest, HumanJoint::Neck];
    let trunk: Vec<(f64, UnitQuaternion<f64>)> =
        of_trunk.iter().filter_map(|&joint| Some((bind(joint)?.y, turn(joint)?.rotation))).collect();
    let mut all: Vec<(f64, UnitQuaternion<f64>)> =
        trunk.windows(2).map(|pair| (0.5 * (pair[0].0 + pair[1].0), pair[0].1)).collect();
    let mean = |joint: fn(Side) -> HumanJoint| {
        let [left, right] = Side::BOTH.map(|side| Some((bind(joint(side))?.y, turn(joint(side))?.rotation)));
        let (left, right) = (left?, right?);
        Some((0.5 * (left.0 + right.0), left.1.try_slerp(&right.1, 0.5, 1e-9).unwrap_or(left.1)))
    };
    if let (Some(hip), Some(knee)) = (mean(HumanJoint::UpperLeg), mean(HumanJoint::LowerLeg)) {
        all.extend([(hip.0 - BELOW_HIPS, hip.1), (knee.0 + AROUND_KNEES, hip.1), (knee.0 - AROUND_KNEES, knee.1)]);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}
