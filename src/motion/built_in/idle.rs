//! `idle`: standing, breathing, shifting the weight, looking around.

use super::curve::through;
use super::puppet::{ANKLE, FPS, FRAMES, HALF_HIPS, Puppet};
use crate::body::HumanJoint::{Shoulder, UpperChest};
use crate::body::{Pose, Side};
use crate::geometry::{Point, Vec3};
use crate::motion::aligned::about_vertical;
use nalgebra::UnitQuaternion;

/// Seconds per breath: 15 per minute at rest.
const BREATH_SECS: f64 = 4.0;
/// How far the weight is on the left foot, −1 to 1.
const WEIGHT: [(f64, f64); 6] = [(0.5, 0.0), (2.2, 1.0), (4.6, 0.9), (6.0, -1.0), (8.2, -0.9), (9.7, 0.0)];
/// Heading of the gaze in degrees; left is positive.
const GAZE: [(f64, f64); 8] =
    [(0.8, 0.0), (1.7, 28.0), (2.8, 26.0), (3.6, -4.0), (5.4, -6.0), (6.4, -30.0), (7.4, -26.0), (8.6, 0.0)];
/// Half of the distance between the feet, in metres.
const HALF_BASE: f64 = HALF_HIPS + 0.02;
/// Degrees by which each foot points outward.
const OUTWARD: f64 = 9.0;

pub(super) fn poses() -> Vec<Pose> {
    (0..FRAMES).map(|frame| pose(frame as f64 / FPS)).collect()
}

fn pose(secs: f64) -> Pose {
    let mut puppet = Puppet::new();
    let wave = |period: f64, shift: f64| (std::f64::consts::TAU * (secs / period + shift)).sin();
    let (weight, gaze) = (through(&WEIGHT, secs), through(&GAZE, secs));
    let breath = 0.5 - 0.5 * (std::f64::consts::TAU * secs / BREATH_SECS).cos();
    // Standing bodies sway by about a centimetre.
    let sway = Vec3::new(0.004 * wave(3.1, 0.2), 0.0, 0.006 * wave(4.7, 0.5));
    let raised = 3.0 * weight;
    let turned = 0.12 * gaze;
    let rotation = UnitQuaternion::from_scaled_axis(Vec3::new(0.0, turned, raised).map(f64::to_radians));
    let middle = Point::new(0.035 * weight, ANKLE + 0.8335 - 0.004 * weight * weight, 0.0) + sway;
    puppet.hips(rotation, middle);
    puppet.trunk([1.0 - 2.0 * breath, 0.15 * gaze, -1.3 * raised]);
    puppet.turn(UpperChest, [-1.5 * breath, 0.05 * gaze, -0.2 * raised]);
    puppet.gaze([3.0 * wave(5.3, 0.1), 0.65 * gaze, 0.04 * gaze]);
    for side in Side::BOTH {
        let own = wave(5.9, 0.3 * side.sign());
        puppet.turn_side(Shoulder, side, [0.0, 0.0, 1.5 * breath]);
        puppet.arm(side, 2.0 + 1.5 * own, 11.0 + 1.0 * own, 12.0, 16.0 + 3.0 * own);
        let turn = about_vertical((OUTWARD * side.sign()).to_radians());
        puppet.foot(side, &Point::new(HALF_BASE * side.sign(), ANKLE, 0.0), &turn, OUTWARD);
    }
    puppet.pose
}
