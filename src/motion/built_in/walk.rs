//! `walk`: ten seconds straight ahead, from standing to standing.

use super::gait::{self, FLAT, STANCE};
use super::puppet::{ANKLE, FPS, FRAMES, Puppet};
use crate::body::HumanJoint::{Foot, Hips, LowerLeg, Neck, Shoulder, Spine, UpperChest, UpperLeg};
use crate::body::{Pose, Side};
use crate::geometry::{Point, Vec3};
use crate::motion::smooth::blurred;
use crate::numerics::smoothstep;

/// Seconds per stride: 110 steps per minute (Winter's natural cadence is 105).
const STRIDE_SECS: f64 = 1.09;
/// Whole strides of the walk; it begins and ends with a swing of the left foot.
const STRIDES: f64 = 8.0;
/// Seconds of standing before and after.
const REST_SECS: f64 = 0.4;
/// Degrees by which the arms are held off the body.
const ARMS_OUT: f64 = 9.0;

/// How far a foot is raised that leaves its rest or comes back to it, 0 to 1.
fn first_lift(secs: f64) -> f64 {
    let walked = (secs - REST_SECS) / STRIDE_SECS;
    let bump = |share: f64| 4.0 * (share * (1.0 - share)).max(0.0);
    bump(walked / SWING).max(bump((STRIDES + SWING - walked) / SWING))
}

/// How far the stride is at a time, and how large it is, 0 to 1.
fn stride(secs: f64) -> (f64, f64) {
    let walked = ((secs - REST_SECS) / STRIDE_SECS).clamp(0.0, STRIDES + SWING);
    // The left foot leaves its place beside the right one, and comes back beside it, in the air.
    let size = smoothstep(walked / SWING).min(smoothstep((STRIDES + SWING - walked) / SWING));
    (STANCE + walked, size)
}

/// Share of the stride in which a foot is in the air.
const SWING: f64 = 1.0 - STANCE;

pub(super) fn poses() -> Vec<Pose> {
    let mut puppet = Puppet::new();
    let mut poses: Vec<Pose> = Vec::with_capacity(FRAMES);
    // Heels and balls relative to the hips in the frame before.
    let mut before: Option<[[Point; 2]; 2]> = None;
    let (mut ahead, mut lows) = (Vec3::zeros(), Vec::with_capacity(FRAMES));
    for frame in 0..FRAMES {
        let (phase, size) = stride(frame as f64 / FPS);
        let phases = [phase, phase + 0.5].map(|p| p.rem_euclid(1.0));
        set_pose(&mut puppet, phases, size, first_lift(frame as f64 / FPS));
        let world = puppet.world();
        let soles = Side::BOTH.map(|side| puppet.sole(&world, side));
        if let Some(before) = before {
            let weights = phases.map(load);
            // The hips move so that the part of the sole which carries the body stays in place.
            let moved = |k: usize| {
                let [heel, ball] = [0, 1].map(|point| soles[k][point] - before[k][point]);
                heel.lerp(&ball, forward(phases[k])) * (weights[k] / (weights[0] + weights[1]))
            };
            let step = moved(0) + moved(1);
            ahead -= Vec3::new(step.x, 0.0, step.z);
        }
        before = Some(soles);
        lows.push(soles.iter().flatten().map(|p| p.y).fold(f64::INFINITY, f64::min));
        puppet.pose.translation += ahead;
        poses.push(puppet.pose.clone());
    }
    // The supporting foot changes at once, the height of the hips does not.
    for (pose, low) in poses.iter_mut().zip(blurred(&lows, 2)) {
        pose.translation.y -= low;
    }
    poses
}

fn set_pose(puppet: &mut Puppet, phases: [f64; 2], size: f64, first_lift: f64) {
    puppet.pose = Pose::bind(puppet.pose.rotations.len());
    let (raised, leading) = gait::pelvis(phases[0]);
    let (raised, leading) = (raised * size, leading * size);
    puppet.turn(Hips, [2.0 * size, -leading, raised]);
    // The trunk stays upright and turns against the pelvis.
    puppet.turn(Spine, [0.0, 0.5 * leading, -raised]);
    puppet.turn(UpperChest, [0.0, 1.3 * leading, 0.0]);
    puppet.turn(Neck, [-2.0 * size, -0.8 * leading, 0.0]);
    for (side, phase) in Side::BOTH.into_iter().zip(phases) {
        let leg = gait::leg(phase);
        // A wide base in standing, a narrow one in walking.
        let inward = 1.5 * size;
        let lift = if side == Side::Left { 15.0 * first_lift } else { 0.0 };
        puppet.turn_side(UpperLeg, side, [-leg.hip * size - lift, 4.0, -inward]);
        puppet.turn_side(LowerLeg, side, [leg.knee * size + 2.0 * (1.0 - size) + 2.0 * lift, 0.0, 0.0]);
        puppet.turn_side(Foot, side, [-leg.ankle * size, 2.0, inward]);
        let (shoulder, elbow) = gait::arm(phase);
        puppet.turn_side(Shoulder, side, [0.0, -2.0 * size * (std::f64::consts::TAU * phase).cos(), 0.0]);
        puppet.arm(side, shoulder * size, ARMS_OUT, 8.0, elbow * size + 12.0 * (1.0 - size));
    }
    let hips = Point::new(0.0, ANKLE + 0.8, 0.0);
    puppet.hips(puppet.pose.rotations[0], hips);
}

/// Where a foot carries the body, from the heel, 0, to the ball, 1.
fn forward(phase: f64) -> f64 {
    smoothstep((phase - FLAT.0) / (FLAT.1 - FLAT.0))
}

/// How much of the body a foot carries: it takes over in the first tenth of its stance and gives off in the last.
fn load(phase: f64) -> f64 {
    let double = STANCE - 0.5;
    (phase / double).clamp(0.0, 1.0).min(((STANCE - phase) / double).clamp(0.0, 1.0))
}
