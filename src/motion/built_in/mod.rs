//! Clips of our own: a walk, a turn, a squat with a kick, standing idle. Each has 300 frames at 30 per second.

mod curve;
mod gait;
mod idle;
mod puppet;
mod squat;
mod turn;
mod walk;

use super::clip::Clip;
use crate::formats::RawMotion;

/// The names of the clips.
pub const BUILT_IN_CLIPS: [&str; 4] = ["walk", "turn", "squat", "idle"];

/// The clip of that name; `None` if there is none.
pub fn built_in_clip(name: &str) -> Option<Clip> {
    Some(Clip::new(name, built_in_motion(name)?))
}

/// The built-in clips for a prior of poses: the squat is as deep as people squat, and the turn twists the legs. Cloth needs
/// neither, and a clip that changes for its sake leaves the bodies of photos as they are.
pub fn clips_of_prior() -> Vec<Clip> {
    let of_prior = |name: &str| match name {
        "squat" => Some(Clip::new(name, puppet::motion(name, &squat::poses(&squat::DEEP)))),
        "turn" => Some(Clip::new(name, puppet::motion(name, &turn::poses(&turn::LONG)))),
        _ => built_in_clip(name),
    };
    BUILT_IN_CLIPS.into_iter().filter_map(of_prior).collect()
}

/// The motion of the built-in clip of that name, as arrays; `None` if there is none.
pub(super) fn built_in_motion(name: &str) -> Option<RawMotion> {
    let poses = match name {
        "walk" => walk::poses(),
        "turn" => turn::poses(&turn::SHORT),
        "squat" => squat::poses(&squat::HALF),
        "idle" => idle::poses(),
        _ => return None,
    };
    Some(puppet::motion(name, &poses))
}
