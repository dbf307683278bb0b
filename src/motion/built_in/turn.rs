//! `turn`: the arms are raised; one turn to the left and one to the right, in small steps.

use super::curve::through;
use super::puppet::{ANKLE, FPS, FRAMES, HALF_HIPS, Puppet};
use crate::body::HumanJoint::Shoulder;
use crate::body::{Pose, Side};
use crate::geometry::{Point, Vec3};
use crate::motion::aligned::about_vertical;
use crate::numerics::smoothstep;
use nalgebra::UnitQuaternion;

/// Heading of the hips in degrees over time: 3.2 s per turn, up to 170° per second, so that a skirt flies.
const HEADING: [(f64, f64); 4] = [(1.1, 0.0), (4.3, 360.0), (5.3, 360.0), (8.5, 0.0)];
/// Abduction of the arms in degrees: a little above level.
const ARMS: [(f64, f64); 4] = [(0.2, 12.0), (1.2, 98.0), (8.7, 98.0), (9.8, 12.0)];
/// Share of the time between two steps of a foot in which it is in the air.
const SWING_SHARE: f64 = 0.45;
/// Height of a step in metres.
const STEP_HEIGHT: f64 = 0.06;
/// Degrees by which each foot points outward.
const OUTWARD: f64 = 8.0;

/// How the feet follow the hips.
pub(super) struct Steps {
    /// Seconds per step.
    secs: f64,
    /// Half of the distance between the feet, in metres.
    half_base: f64,
}

/// Steps that keep the knees of broad figures apart.
pub(super) const SHORT: Steps = Steps { secs: 0.24, half_base: HALF_HIPS + 0.05 };
/// Feet that are up to 50° behind the hips. The knees of a foreign man crossed, and a leg gave way to his trousers by 28 mm.
pub(super) const LONG: Steps = Steps { secs: 0.32, half_base: HALF_HIPS + 0.015 };

pub(super) fn poses(steps: &Steps) -> Vec<Pose> {
    (0..FRAMES).map(|frame| pose(steps, frame as f64 / FPS)).collect()
}

fn pose(steps: &Steps, secs: f64) -> Pose {
    let mut puppet = Puppet::new();
    let (feet, heading) = (Side::BOTH.map(|side| foot(steps, side, secs)), through(&HEADING, secs));
    // The hips are lower while they turn, and over the foot that stands.
    let speed = (through(&HEADING, secs + 0.05) - through(&HEADING, secs - 0.05)) / 0.1;
    let bend = smoothstep(speed.abs() / 120.0);
    let sway = (feet[1].lifted - feet[0].lifted) * 0.25;
    let turn = about_vertical(heading.to_radians());
    let middle = Point::new(0.0, ANKLE + 0.8325 - 0.02 * bend, 0.0) + turn * Vec3::new(sway, 0.0, 0.0);
    // The trunk leads the turn a little, the head more.
    let lead = 6.0 * (speed / 120.0).clamp(-1.0, 1.0);
    puppet.hips(turn, middle);
    puppet.trunk([0.0, lead, 0.0]);
    puppet.gaze([0.0, 2.0 * lead, 0.0]);
    let arms = through(&ARMS, secs);
    let raised = smoothstep((arms - 30.0) / 70.0);
    for side in Side::BOTH {
        // Arms that are raised take the shoulders along: a third of the rise above 30°.
        puppet.turn_side(Shoulder, side, [0.0, 0.0, 10.0 * raised]);
        puppet.arm(side, 6.0 + 6.0 * raised, arms - 10.0 * raised, 0.0, 12.0);
    }
    for (side, foot) in Side::BOTH.into_iter().zip(&feet) {
        puppet.foot(side, &foot.ankle, &foot.rotation, OUTWARD + foot.ahead(heading) * side.sign());
    }
    puppet.pose
}

struct Placed {
    ankle: Point,
    rotation: UnitQuaternion<f64>,
    heading: f64,
    lifted: f64,
}

impl Placed {
    /// Degrees by which the foot is turned further than the hips.
    fn ahead(&self, heading: f64) -> f64 {
        (self.heading - heading).clamp(-40.0, 40.0)
    }
}

/// A foot at a time. It stands where the hips are in the middle of its rest, and steps to the next such place.
fn foot(steps: &Steps, side: Side, secs: f64) -> Placed {
    let period = 2.0 * steps.secs;
    let offset = if side == Side::Left { 0.0 } else { steps.secs };
    let cycle = ((secs - offset) / period).floor();
    let start = cycle * period + offset;
    let heading_of = |start: f64| {
        // The middle of the rest that follows the step which begins at `start`.
        through(&HEADING, start + period * (0.5 + 0.5 * SWING_SHARE))
    };
    let (from, to) = (heading_of(start - period), heading_of(start));
    let share = ((secs - start) / (SWING_SHARE * period)).clamp(0.0, 1.0);
    let moves = smoothstep((to - from).abs() / 4.0);
    let heading = from + (to - from) * smoothstep(share);
    let lifted = moves * 4.0 * share * (1.0 - share) * STEP_HEIGHT;
    let turn = about_vertical(heading.to_radians());
    let place = turn * Vec3::new(steps.half_base * side.sign(), 0.0, 0.0);
    let rotation = turn * about_vertical((OUTWARD * side.sign()).to_radians());
    Placed { ankle: Point::new(place.x, ANKLE + lifted, place.z), rotation, heading, lifted }
}
