//! Plants the feet: what rests on the floor does not slide, and no sole is below it.
//!
//! A stance is a time in which heel or ball of a foot rests. In it, both have fixed places on the floor, as far apart as on the
//! foot: the heel's holds after heel strike, both while the foot is flat, the ball's while the heel rises. The ankle follows
//! from them and from the clip's own pitch of the foot, the leg from the ankle. Before and after a stance the correction fades
//! out; where a leg is too short, the hips sink, both along smooth curves.

use super::aligned::{about_vertical, heading};
use super::contacts::{contacts, runs};
use super::ground::Ground;
use super::leg::Leg;
use super::limits::Anatomy;
use super::smooth::{blurred, envelope};
use crate::body::{Pose, Side, Skeleton};
use crate::geometry::{Point, Vec3};
use crate::numerics::{smoothstep, wrapped_angle};
use nalgebra::{Isometry3, UnitQuaternion};

type Turn = UnitQuaternion<f64>;

/// Time over which a correction fades before and after a stance, in seconds: half of a swing.
const FADE_SECS: f64 = 0.25;
/// Time over which heel and ball take over from each other, in seconds.
const ROLL_SECS: f64 = 0.08;
/// Time over which the hips sink and rise for legs that are too short, in seconds.
const SINK_SECS: f64 = 0.2;
/// How far the sole of a swinging foot is above the floor at least, in metres: people walk with 1 to 2 cm.
const CLEARANCE: f64 = 0.012;
/// Time in which a foot gets there, in seconds.
const CLEAR_SECS: f64 = 0.1;
/// A foot that turns by more than this during a stance pivots, in radians: 20°. Its heading follows the clip.
const PIVOT: f64 = 0.35;
/// A sole at rest is lowered or raised onto the floor where it is off by more than this, in metres.
const TOLERANCE: f64 = 1e-4;

/// The corrections of one foot, frame by frame.
struct Footwork {
    ankles: Vec<Point>,
    feet: Vec<Turn>,
    toes: Vec<Option<Turn>>,
    /// Frame by frame how far the foot is above the floor at least, in metres; 0 in a stance, where it touches it.
    clearances: Vec<f64>,
}

/// What planting did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Planted {
    /// Number of stances, both feet.
    pub stances: usize,
    /// The furthest that the hips sank, in metres.
    pub sunk: f64,
}

/// Plants the feet of a track.
///
/// **Shapes** `poses` one per frame.
///
/// Joints of the legs end within their limits; where an ankle would be beyond them, the heel rises.
pub(super) fn plant(
    skeleton: &Skeleton,
    ground: &Ground,
    anatomy: Option<&Anatomy>,
    poses: &mut [Pose],
    fps: f64,
) -> Planted {
    let legs = Side::BOTH.map(|side| Leg::of(skeleton, side));
    let [Some(left), Some(right)] = legs else { return Planted::default() };
    let legs = [left, right];
    if poses.is_empty() {
        return Planted::default();
    }
    let mut planted = Planted::default();
    let transforms: Vec<Vec<Isometry3<f64>>> = poses.iter().map(|pose| skeleton.world_from_bind(pose)).collect();
    let mut footwork = [0, 1].map(|side| {
        let (work, stances) = footwork(skeleton, ground, &legs[side], side, &transforms, fps);
        planted.stances += stances;
        work
    });
    planted.sunk = sink(skeleton, &legs, &footwork, poses, fps);
    reach(skeleton, &legs, &footwork, poses);
    for side in [0, 1] {
        // Skin near the ball is between foot and toes, so its lowest point is known only after both have turned.
        for (frame, pose) in poses.iter().enumerate() {
            let low = ground.lowest_of_foot(side, &skeleton.world_from_bind(pose));
            let clearance = footwork[side].clearances[frame];
            let moved = if clearance == 0.0 { -low } else { (clearance - low).max(0.0) };
            if low.is_finite() && moved.abs() > TOLERANCE {
                footwork[side].ankles[frame].y += moved;
            }
        }
    }
    planted.sunk += sink(skeleton, &legs, &footwork, poses, fps);
    reach(skeleton, &legs, &footwork, poses);
    if let Some(anatomy) = anatomy {
        for (frame, pose) in poses.iter_mut().enumerate() {
            for (side, leg) in legs.iter().enumerate() {
                roll_to_limits(skeleton, ground, anatomy, leg, side, &footwork[side].ankles[frame], pose);
            }
            *pose = anatomy.limited(pose).0;
        }
    }
    planted
}

/// Turns a foot about its ball until the ankle is within its limits.
fn roll_to_limits(
    skeleton: &Skeleton,
    ground: &Ground,
    anatomy: &Anatomy,
    leg: &Leg,
    side: usize,
    ankle: &Point,
    pose: &mut Pose,
) {
    /// The leg follows the ankle, which turns the foot again, by less each time.
    const ROUNDS: usize = 5;
    let sole = &ground.soles[side];
    let from_ball = skeleton.joints_in_bind[leg.foot.index()] - sole.ball;
    let mut ball = None;
    for _ in 0..ROUNDS {
        let Some(within) = anatomy.limited_joint(pose, leg.foot) else { return };
        let world = skeleton.world_from_bind(pose);
        let ball = *ball.get_or_insert(world[leg.foot.index()] * sole.ball);
        let rotation = world[leg.lower.index()].rotation * within;
        let target = if ball.y - ground.floor < ON_FLOOR { ball + rotation * from_ball } else { *ankle };
        let toes = leg.toes.map(|toes| world[toes.index()].rotation);
        leg.reach(skeleton, pose, &target, &rotation, toes.as_ref());
    }
}

/// A ball lower than this, in metres, stays on the floor while its heel rises.
const ON_FLOOR: f64 = 0.03;

fn reach(skeleton: &Skeleton, legs: &[Leg; 2], footwork: &[Footwork; 2], poses: &mut [Pose]) {
    for (frame, pose) in poses.iter_mut().enumerate() {
        for (leg, work) in legs.iter().zip(footwork) {
            leg.reach(skeleton, pose, &work.ankles[frame], &work.feet[frame], work.toes[frame].as_ref());
        }
    }
}

/// Lowers the hips where a resting foot is out of reach; returns by how much at most.
fn sink(skeleton: &Skeleton, legs: &[Leg; 2], footwork: &[Footwork; 2], poses: &mut [Pose], fps: f64) -> f64 {
    let needed: Vec<f64> = poses
        .iter()
        .enumerate()
        .map(|(frame, pose)| {
            let joints = skeleton.joints_in_world(pose);
            let of_leg = |(leg, work): (&Leg, &Footwork)| {
                let drop = leg.drop_to_reach(&joints[leg.upper.index()], &work.ankles[frame]);
                // A straight leg is at its reach; a hair more is none.
                if work.clearances[frame] == 0.0 && drop > 1e-4 { drop } else { 0.0 }
            };
            legs.iter().zip(footwork).map(of_leg).fold(0.0, f64::max)
        })
        .collect();
    let sunk = envelope(&needed, (SINK_SECS * fps).round() as usize);
    for (pose, drop) in poses.iter_mut().zip(&sunk) {
        pose.translation.y -= drop;
    }
    sunk.into_iter().fold(0.0, f64::max)
}

fn footwork(
    skeleton: &Skeleton,
    ground: &Ground,
    leg: &Leg,
    side: usize,
    transforms: &[Vec<Isometry3<f64>>],
    fps: f64,
) -> (Footwork, usize) {
    let sole = &ground.soles[side];
    let ankle_in_bind = skeleton.joints_in_bind[leg.foot.index()];
    let foot = |frame: usize| transforms[frame][leg.foot.index()];
    let count = transforms.len();
    let above_floor = |p: Point| Point::new(p.x, p.y - ground.floor, p.z);
    let heels: Vec<Point> = (0..count).map(|f| above_floor(foot(f) * sole.heel)).collect();
    let balls: Vec<Point> = (0..count).map(|f| above_floor(foot(f) * sole.ball)).collect();
    let (heel_rests, ball_rests) = (contacts(&heels, fps), contacts(&balls, fps));
    let rests: Vec<bool> = heel_rests.iter().zip(&ball_rests).map(|(h, b)| *h || *b).collect();

    let mut work = Footwork {
        ankles: (0..count).map(|f| foot(f) * ankle_in_bind).collect(),
        feet: (0..count).map(|f| foot(f).rotation).collect(),
        toes: (0..count).map(|f| leg.toes.map(|toes| transforms[f][toes.index()].rotation)).collect(),
        clearances: vec![0.0; count],
    };
    let roll = (ROLL_SECS * fps).round() as usize;
    let as_weights = |flags: &[bool]| blurred(&flags.iter().map(|&f| f64::from(u8::from(f))).collect::<Vec<_>>(), roll);
    let (heel_weights, ball_weights) = (as_weights(&heel_rests), as_weights(&ball_rests));
    let stances = runs(&rests, true);
    // Corrections of the stances' frames: of the ankle's place, and of the foot's rotation.
    let mut corrections: Vec<Option<(Vec3, Turn)>> = vec![None; count];
    for &(from, to) in &stances {
        let frames = from..to;
        let spot = Spot::of(sole, frames.clone(), &heels, &balls, &heel_rests, &ball_rests, &work.feet);
        for frame in frames {
            let turned = about_vertical(wrapped_angle(spot.heading(&work.feet[frame]) - heading(&work.feet[frame])))
                * work.feet[frame];
            let level = about_vertical(spot.heading(&work.feet[frame]));
            let (h, b) = (heel_weights[frame], ball_weights[frame]);
            let flat = if heel_rests[frame] && ball_rests[frame] { 1.0 } else { smoothstep(2.0 * h.min(b)) };
            let rotation = turned.try_slerp(&level, flat, 1e-9).unwrap_or(level);
            let (heel_place, ball_place) = spot.places(sole, ground.floor, spot.heading(&work.feet[frame]));
            let by_heel = heel_place - rotation * (sole.heel - ankle_in_bind);
            let by_ball = ball_place - rotation * (sole.ball - ankle_in_bind);
            // A point that does not rest has no say, however near its rest is.
            let (h, b) = match (heel_rests[frame], ball_rests[frame]) {
                (true, false) => (1.0, 0.0),
                (false, true) => (0.0, 1.0),
                _ => (h, b),
            };
            let ankle = by_heel + (by_ball - by_heel) * (b / (h + b).max(1e-9));
            corrections[frame] = Some((ankle - work.ankles[frame], rotation * work.feet[frame].inverse()));
        }
    }
    for (frame, clearance) in work.clearances.iter_mut().enumerate() {
        let next = stances.partition_point(|&(from, _)| from <= frame);
        let since = next.checked_sub(1).map_or(usize::MAX, |k| (frame + 1).saturating_sub(stances[k].1));
        let until = stances.get(next).map_or(usize::MAX, |&(from, _)| from - frame);
        let share = since.min(until) as f64 / (CLEAR_SECS * fps).max(1.0);
        *clearance = CLEARANCE * share.min(1.0);
    }
    let fade = (FADE_SECS * fps).max(1.0);
    let corrected: Vec<(Vec3, Turn)> = (0..count)
        .map(|frame| match corrections[frame] {
            Some(own) => own,
            None => {
                let near = |k: usize| corrections.get(k).copied().flatten().map(|c| (frame.abs_diff(k), c));
                // The end of the stance before and the start of the one after.
                let next = stances.partition_point(|&(from, _)| from <= frame);
                let before = next.checked_sub(1).and_then(|k| near(stances[k].1 - 1));
                let after = stances.get(next).and_then(|&(from, _)| near(from));
                let share = |near: &Option<(usize, (Vec3, Turn))>| {
                    near.map_or(0.0, |(distance, _)| smoothstep(1.0 - distance as f64 / fade))
                };
                // Between two stances near each other the corrections pass over into each other.
                let (a, b) = (share(&before), share(&after));
                let (a, b) = (a / (a + b).max(1.0), b / (a + b).max(1.0));
                let part = |near: Option<(usize, (Vec3, Turn))>, share: f64| match near {
                    Some((_, (moved, turned))) => (moved * share, Turn::from_scaled_axis(turned.scaled_axis() * share)),
                    None => (Vec3::zeros(), Turn::identity()),
                };
                let (a, b) = (part(before, a), part(after, b));
                (a.0 + b.0, a.1 * b.1)
            }
        })
        .collect();
    for (frame, (moved, turned)) in corrected.into_iter().enumerate() {
        work.ankles[frame] += moved;
        work.feet[frame] = turned * work.feet[frame];
        // Toes stay on the floor while the foot rolls over them.
        if let Some(toes) = &mut work.toes[frame] {
            let own = turned * *toes;
            let level = about_vertical(heading(&work.feet[frame]));
            *toes = own.try_slerp(&level, ball_weights[frame], 1e-9).unwrap_or(own);
        }
    }
    (work, stances.len())
}

/// The place of a foot on the floor during a stance.
struct Spot {
    /// Where the ball is, at height 0.
    ball: Point,
    /// The heading of the foot, unless it pivots.
    fixed_heading: Option<f64>,
}

impl Spot {
    /// The place and heading that fit a stance best: the mean over the frames in which a point rests.
    fn of(
        sole: &super::ground::Sole,
        frames: std::ops::Range<usize>,
        heels: &[Point],
        balls: &[Point],
        heel_rests: &[bool],
        ball_rests: &[bool],
        feet: &[Turn],
    ) -> Self {
        let is_flat = |f: &usize| heel_rests[*f] && ball_rests[*f];
        let flat: Vec<usize> = frames.clone().filter(is_flat).collect();
        let measured: Vec<usize> = if flat.is_empty() { frames.clone().collect() } else { flat };
        // Relative to the first, so that the mean does not depend on where an angle wraps.
        let first = heading(&feet[measured[0]]);
        let turns: Vec<f64> = measured.iter().map(|&f| wrapped_angle(heading(&feet[f]) - first)).collect();
        let mean = first + turns.iter().sum::<f64>() / turns.len() as f64;
        let range = turns.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - turns.iter().copied().fold(f64::INFINITY, f64::min);
        let fixed_heading = (range <= PIVOT).then_some(mean);
        let from_heel = sole.ball - sole.heel;
        let (mut sum, mut count) = (Vec3::zeros(), 0.0);
        for f in frames {
            let turn = about_vertical(fixed_heading.unwrap_or_else(|| heading(&feet[f])));
            if ball_rests[f] {
                sum += balls[f].coords;
                count += 1.0;
            }
            if heel_rests[f] {
                sum += (heels[f] + turn * from_heel).coords;
                count += 1.0;
            }
        }
        let ball = sum / f64::max(count, 1.0);
        Self { ball: Point::new(ball.x, 0.0, ball.z), fixed_heading }
    }

    fn heading(&self, foot: &Turn) -> f64 {
        self.fixed_heading.unwrap_or_else(|| heading(foot))
    }

    /// Where heel and ball are on the floor, at the heights that they have in the bind pose above it.
    fn places(&self, sole: &super::ground::Sole, floor: f64, heading: f64) -> (Point, Point) {
        let from_ball = about_vertical(heading) * (sole.heel - sole.ball);
        let at = |p: Point, in_bind: &Point| Point::new(p.x, in_bind.y.max(floor), p.z);
        (at(self.ball + from_ball, &sole.heel), at(self.ball, &sole.ball))
    }
}
