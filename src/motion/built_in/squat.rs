//! `squat`: a squat, then a kick with the right leg, then another squat.

use super::curve::through;
use super::puppet::{ANKLE, FPS, FRAMES, HALF_HIPS, Puppet};
use crate::body::HumanJoint::{Foot, LowerLeg, Shoulder, UpperLeg};
use crate::body::Side::Right;
use crate::body::{Pose, Side};
use crate::geometry::Point;
use crate::geometry::Vec3;
use crate::motion::aligned::about_vertical;
use nalgebra::UnitQuaternion;

/// How far the squat and the kick go. Lengths are metres, angles degrees.
pub(super) struct Reach {
    /// How far the hips sink in the deepest squat, and how far back they go.
    down: f64,
    back: f64,
    /// How far hips and trunk lean forward there.
    lean: f64,
    bend: f64,
    /// How much further arms are raised forward there, and apart.
    arms_forward: f64,
    arms_apart: f64,
    /// Hip flexion of the kick over time: up, back, forward, and down.
    kick: [(f64, f64); 7],
}

/// Knees bent by 80°, arms apart, a kick to 68°: thighs and arms stay clear of the trunk in linear blend skinning, so that no cloth
/// between them presses the skin in.
pub(super) const HALF: Reach = Reach {
    down: 0.20,
    back: 0.15,
    lean: 22.0,
    bend: 8.0,
    arms_forward: 62.0,
    arms_apart: 14.0,
    kick: [(3.8, 16.0), (4.1, 18.0), (4.5, -10.0), (5.05, 66.0), (5.25, 68.0), (5.8, 32.0), (6.1, 20.0)],
};
/// Thighs level, arms forward, and a kick up to level.
pub(super) const DEEP: Reach = Reach {
    down: 0.38,
    back: 0.26,
    lean: 34.0,
    bend: 12.0,
    arms_forward: 116.0,
    arms_apart: -14.0,
    kick: [(3.8, 16.0), (4.1, 18.0), (4.5, -10.0), (5.05, 88.0), (5.25, 90.0), (5.8, 35.0), (6.1, 20.0)],
};

/// Depth of the squat over time, 0 to 1.
const DEPTH: [(f64, f64); 9] =
    [(0.4, 0.0), (1.6, 1.0), (2.0, 1.0), (3.2, 0.0), (4.0, 0.03), (6.6, 0.03), (7.0, 0.0), (8.0, 0.85), (9.3, 0.0)];
/// How far the weight is on the left foot, 0 to 1.
const SHIFT: [(f64, f64); 4] = [(3.1, 0.0), (3.8, 1.0), (6.6, 1.0), (7.2, 0.0)];
/// Height of the right foot over its place on the floor, in metres: straight up before the kick, straight down after it.
const LIFT: [(f64, f64); 4] = [(3.75, 0.0), (4.1, 0.10), (6.3, 0.10), (6.7, 0.0)];
/// How far the right leg follows the angles of the kick, 0 to 1.
const FREE: [(f64, f64); 4] = [(3.95, 0.0), (4.4, 1.0), (5.9, 1.0), (6.4, 0.0)];
/// Knee flexion of the kick: bent on the way up, straight at the top.
const KICK_KNEE: [(f64, f64); 7] =
    [(3.8, 36.0), (4.1, 40.0), (4.5, 62.0), (4.8, 82.0), (5.1, 8.0), (5.4, 38.0), (6.1, 40.0)];
/// Its abduction: straight up at first, then under the hips, and back.
const KICK_OUT: [(f64, f64); 4] = [(4.1, 17.0), (4.6, 3.0), (5.6, 3.0), (6.1, 17.0)];
/// Degrees by which each foot, and the knee above it, points outward.
const OUTWARD: f64 = 15.0;
/// Half of the distance between the feet, in metres.
const HALF_BASE: f64 = HALF_HIPS + 0.06;

pub(super) fn poses(reach: &Reach) -> Vec<Pose> {
    (0..FRAMES).map(|frame| pose(reach, frame as f64 / FPS)).collect()
}

fn pose(reach: &Reach, secs: f64) -> Pose {
    let mut puppet = Puppet::new();
    let (depth, shift, free) = (through(&DEPTH, secs), through(&SHIFT, secs), through(&FREE, secs));
    let hip = through(&reach.kick, secs) * free;
    let high = (hip / 90.0).clamp(0.0, 1.0);
    let lean = reach.lean * depth;
    let rotation = UnitQuaternion::from_scaled_axis(
        Vec3::new(lean * 0.9 - 8.0 * high, -8.0 * high, -5.0 * shift * free).map(f64::to_radians),
    );
    let low = 0.004 + reach.down * depth + 0.016 * shift;
    // In a wide stance the legs are slanted.
    let height = ANKLE + (0.8347f64.powi(2) - (HALF_BASE - HALF_HIPS).powi(2)).sqrt();
    puppet.hips(rotation, Point::new(0.86 * HALF_BASE * shift, height - low, -reach.back * depth - 0.03 * high));
    puppet.trunk([reach.bend * depth - 4.0 * high, 10.0 * high, 3.0 * shift * free]);
    puppet.gaze([-30.0 * depth + 6.0 * high, 0.0, 0.0]);
    for side in Side::BOTH {
        // Forward in the squat, bent before the chest in the kick.
        let guard = shift * free;
        puppet.turn_side(Shoulder, side, [0.0, -8.0 * depth, 0.0]);
        let swing = if side == Right { -18.0 * high } else { 14.0 * high };
        puppet.arm(
            side,
            4.0 + reach.arms_forward * depth + 24.0 * guard + swing,
            14.0 + reach.arms_apart * depth + 6.0 * guard,
            25.0 * guard,
            12.0 + 6.0 * depth + 62.0 * guard,
        );
    }
    for side in Side::BOTH {
        let lift = if side == Right { through(&LIFT, secs) } else { 0.0 };
        let place = Point::new(HALF_BASE * side.sign(), ANKLE + lift, 0.0);
        let turn = about_vertical((OUTWARD * side.sign()).to_radians());
        puppet.foot(side, &place, &turn, OUTWARD);
    }
    if free > 0.0 {
        kick(&mut puppet, secs, hip, free);
    }
    puppet.pose
}

/// Blends the right leg from its stance into the kick.
fn kick(puppet: &mut Puppet, secs: f64, hip: f64, free: f64) {
    let stance = puppet.pose.clone();
    let pointed = 25.0 * (hip / 90.0).clamp(0.0, 1.0);
    puppet.turn_side(UpperLeg, Right, [-hip, 6.0, through(&KICK_OUT, secs)]);
    puppet.turn_side(LowerLeg, Right, [through(&KICK_KNEE, secs), 0.0, 0.0]);
    puppet.turn_side(Foot, Right, [pointed - 5.0, 0.0, 0.0]);
    for (own, stance) in puppet.pose.rotations.iter_mut().zip(&stance.rotations) {
        *own = stance.try_slerp(own, free, 1e-9).unwrap_or(*own);
    }
}
