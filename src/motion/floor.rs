//! Where the floor of a clip is: where soles rest.

use super::ground::Ground;
use crate::body::{Pose, Skeleton};

/// A clip whose feet are within this of the floor, in metres, has the right height.
const FLOOR_TOLERANCE: f64 = 0.01;
/// Share of the frames that may be lower than the floor: captured feet dip into it, and the start of a clip may be bad.
const BELOW_FLOOR_SHARE: f64 = 0.05;
/// Soles that are higher than the rest of the body by more than this, in metres, carry nobody: hands or seat do.
const CARRYING: f64 = 0.05;
/// Share of the frames that must be carried by soles, for them to say where the floor is.
const LEAST_CARRIED: f64 = 0.1;

/// The lowest points of a pose above the floor.
#[derive(Clone, Copy)]
struct Lowest {
    soles: f64,
    /// Without the feet.
    body: f64,
}

impl Lowest {
    /// Of heels and balls: toes that a clip does not bend dip into the floor at every step.
    fn of(skeleton: &Skeleton, ground: &Ground, poses: &[Pose]) -> Vec<Self> {
        let of_pose = |pose: &Pose| {
            let world = skeleton.world_from_bind(pose);
            Self { soles: ground.lowest_of_soles(skeleton, &world), body: ground.lowest_of_body(&world) }
        };
        poses.iter().map(of_pose).collect()
    }

    fn is_carried_by_soles(&self) -> bool {
        self.soles.is_finite() && self.soles <= self.body + CARRYING
    }
}

/// Moves a whole track up or down onto the floor; returns by how much.
///
/// Hands or seat that touch the floor at some time are lower or higher there than on the person of the clip, so they decide
/// only where soles hardly ever carry.
pub(super) fn settle(skeleton: &Skeleton, ground: &Ground, poses: &mut [Pose]) -> f64 {
    let lowest = Lowest::of(skeleton, ground, poses);
    let mut heights: Vec<f64> =
        lowest.iter().filter(|l| l.is_carried_by_soles()).map(|l| l.soles.min(l.body)).collect();
    if (heights.len() as f64) < LEAST_CARRIED * lowest.len() as f64 {
        heights = lowest.iter().map(|l| l.soles.min(l.body)).collect();
    }
    heights.sort_by(f64::total_cmp);
    let low = heights[(BELOW_FLOOR_SHARE * (heights.len() - 1) as f64).floor() as usize];
    if !low.is_finite() || low.abs() <= FLOOR_TOLERANCE {
        return 0.0;
    }
    poses.iter_mut().for_each(|pose| pose.translation.y -= low);
    -low
}

/// Removes a vertical drift of the root that is even in time; returns how far it went, or `None` if there is none.
///
/// On stairs, a foot that rests does not move; with a drift, it rises evenly all the time.
pub(super) fn without_drift(skeleton: &Skeleton, ground: &Ground, poses: &mut [Pose], fps: f64) -> Option<f64> {
    /// Drift over the whole clip that is removed, in metres: less is noise, and the feet are planted.
    const LEAST: f64 = 0.05;
    /// Sideways speed below which a foot rests, in metres per second.
    const RESTS: f64 = 0.25;
    /// Share of the steps between frames in which a foot must rest.
    const LEAST_RESTING: f64 = 0.2;
    /// Share of the spread of the soles' heights that may remain: a clip that climbs keeps all of it.
    const REMAINS: f64 = 0.5;
    let worlds: Vec<_> = poses.iter().map(|pose| skeleton.world_from_bind(pose)).collect();
    let mut rates = Vec::new();
    for pair in worlds.windows(2) {
        let moves = (0..2).flat_map(|side| {
            let sole = &ground.soles[side];
            let feet = [ground.foot_in(side, &pair[0]), ground.foot_in(side, &pair[1])];
            [sole.heel, sole.ball].map(|p| [feet[0] * p, feet[1] * p])
        });
        let lowest = moves.min_by(|a, b| a[0].y.total_cmp(&b[0].y));
        let moved = lowest.map(|[before, after]| (after - before) * fps);
        rates.extend(moved.filter(|v| v.x.hypot(v.z) < RESTS).map(|v| v.y));
    }
    if (rates.len() as f64) < LEAST_RESTING * worlds.len() as f64 {
        return None;
    }
    rates.sort_by(f64::total_cmp);
    let drift = rates.get(rates.len() / 2)? / fps * (poses.len() - 1) as f64;
    if !drift.is_finite() || drift.abs() < LEAST {
        return None;
    }
    let at = |frame: usize| drift * frame as f64 / (poses.len() - 1).max(1) as f64;
    let lowest = Lowest::of(skeleton, ground, poses);
    let spread = |removed: &dyn Fn(usize) -> f64| {
        let carried = lowest.iter().enumerate().filter(|(_, l)| l.is_carried_by_soles());
        let mut heights: Vec<f64> = carried.map(|(frame, l)| l.soles - removed(frame)).collect();
        heights.sort_by(f64::total_cmp);
        let quantile = |share: f64| heights.get((share * heights.len() as f64) as usize).copied().unwrap_or(0.0);
        quantile(0.9) - quantile(0.1)
    };
    if spread(&at) > REMAINS * spread(&|_| 0.0) {
        return None;
    }
    let moved: Vec<f64> = (0..poses.len()).map(at).collect();
    poses.iter_mut().zip(moved).for_each(|(pose, by)| pose.translation.y -= by);
    Some(drift)
}

/// A time in which nothing touches the floor.
pub(super) struct Hover {
    /// The greatest height above the floor, in metres.
    pub height: f64,
    pub secs: f64,
    /// The first frame, counted from 0.
    pub frame: usize,
}

/// The longest time in which a figure is in the air, if no jump takes so long.
pub(super) fn longest_hover(skeleton: &Skeleton, ground: &Ground, poses: &[Pose], fps: f64) -> Option<Hover> {
    /// Height above the floor, in metres, that is more than the noise of a capture.
    const ABOVE: f64 = 0.08;
    /// The longest jumps of people take 0.9 s, in seconds.
    const LONGEST_JUMP: f64 = 1.2;
    let heights: Vec<f64> = Lowest::of(skeleton, ground, poses).iter().map(|l| l.soles.min(l.body)).collect();
    let mut longest: Option<(usize, usize)> = None;
    let mut from = 0;
    for frame in 0..=heights.len() {
        if heights.get(frame).is_some_and(|&height| height > ABOVE) {
            continue;
        }
        if longest.is_none_or(|(a, b)| frame - from > b - a) {
            longest = Some((from, frame));
        }
        from = frame + 1;
    }
    let (from, to) = longest?;
    let secs = (to - from) as f64 / fps;
    let height = heights[from..to].iter().copied().fold(0.0, f64::max);
    (secs > LONGEST_JUMP && height.is_finite()).then_some(Hover { height, secs, frame: from })
}
