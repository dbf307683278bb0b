//! The way from the bind pose to the first frame of a clip.

use super::aligned::heading;
use super::ground::Ground;
use super::leg::Leg;
use crate::body::{Pose, Side, Skeleton};
use crate::geometry::Vec3;
use crate::numerics::{smoothstep, wrapped_angle};
use nalgebra::{Isometry3, UnitQuaternion};

/// How high a foot is lifted that moves far, in metres.
const STEP_HEIGHT: f64 = 0.05;
/// A foot that moves less far than this, in metres, is lifted less.
const SHORT_STEP: f64 = 0.15;

/// Poses from the bind pose, included, to the first pose of a clip, not included. The feet step there one after the other.
///
/// **Shapes** `frames` poses.
pub(super) fn lead_in(skeleton: &Skeleton, ground: &Ground, first: &Pose, frames: usize) -> Vec<Pose> {
    let bind = Pose::bind(skeleton.len());
    let (at_bind, at_first) = (skeleton.world_from_bind(&bind), skeleton.world_from_bind(first));
    let legs: Vec<Leg> = Side::BOTH.iter().filter_map(|&side| Leg::of(skeleton, side)).collect();
    // The foot that the first pose holds higher moves last, so that the other one stands by then.
    let height = |side: usize| ground.lowest_of_foot(side, &at_first);
    let second = usize::from(height(1) >= height(0));
    let steps: Vec<Step> = legs.iter().map(|leg| Step::between(skeleton, leg, &at_bind, &at_first)).collect();
    let mut poses = vec![bind.clone(); frames.min(1)];
    for frame in 1..frames {
        let share = frame as f64 / frames as f64;
        let mut pose = bind.toward(first, smoothstep(share));
        let targets: Vec<_> = steps
            .iter()
            .enumerate()
            // Half of the time each, with a little overlap.
            .map(|(side, step)| step.at((share * 1.9 - if side == second { 0.9 } else { 0.0 }).clamp(0.0, 1.0)))
            .collect();
        let joints = skeleton.joints_in_world(&pose);
        let drops =
            legs.iter().zip(&targets).map(|(leg, (ankle, ..))| leg.drop_to_reach(&joints[leg.upper.index()], ankle));
        let drop = drops.fold(0.0, f64::max);
        if drop > 1e-4 {
            pose.translation.y -= drop;
        }
        for (leg, (ankle, foot, toes)) in legs.iter().zip(&targets) {
            leg.reach(skeleton, &mut pose, ankle, foot, toes.as_ref());
        }
        poses.push(pose);
    }
    poses
}

/// The way of a foot.
struct Step {
    from: (Isometry3<f64>, Option<UnitQuaternion<f64>>),
    to: (Isometry3<f64>, Option<UnitQuaternion<f64>>),
    lift: f64,
}

impl Step {
    fn between(skeleton: &Skeleton, leg: &Leg, a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> Self {
        let ankle = skeleton.joints_in_bind[leg.foot.index()];
        let place = |world: &[Isometry3<f64>]| {
            let foot = world[leg.foot.index()];
            let at = Isometry3::from_parts((foot * ankle).coords.into(), foot.rotation);
            (at, leg.toes.map(|toes| world[toes.index()].rotation))
        };
        let (from, to) = (place(a), place(b));
        let moved: Vec3 = to.0.translation.vector - from.0.translation.vector;
        let turned = wrapped_angle(heading(&to.0.rotation) - heading(&from.0.rotation)).abs() * 0.1;
        Self { from, to, lift: STEP_HEIGHT * smoothstep((moved.xz().norm() + turned) / SHORT_STEP) }
    }

    fn at(&self, share: f64) -> (crate::geometry::Point, UnitQuaternion<f64>, Option<UnitQuaternion<f64>>) {
        let s = smoothstep(share);
        let slerp = |a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>| a.try_slerp(b, s, 1e-9).unwrap_or(*b);
        let ankle = self.from.0.translation.vector.lerp(&self.to.0.translation.vector, s)
            + Vec3::y() * (4.0 * s * (1.0 - s) * self.lift);
        let toes = self.from.1.zip(self.to.1).map(|(a, b)| slerp(&a, &b));
        (ankle.into(), slerp(&self.from.0.rotation, &self.to.0.rotation), toes)
    }
}
