//! The whole way from a clip to the poses of a figure.

use super::aligned::{about_vertical, heading};
use super::clip::Clip;
use super::ease::lead_in;
use super::error::MotionError;
use super::ground::Ground;
use super::limits::Anatomy;
use super::names::map_by_names;
use super::params::MotionParams;
use super::placement::Placement;
use super::planting::plant;
use super::retarget::Retargeter;
use super::rig_map::RigMap;
use super::smooth::envelope;
use super::structure::map_by_structure;
use super::track::{FrameRange, PoseTrack};
use crate::body::{Figure, Pose, Skeleton};
use crate::geometry::Vec3;

/// Frames per second above which a clip is thinned by default: films and game engines need no more.
const MOST_FPS: f64 = 60.0;
/// Most frames of a track: an hour at 30 per second.
const MOST_FRAMES: usize = 108_000;
/// A clip whose feet are within this of the floor, in metres, has the right height.
const FLOOR_TOLERANCE: f64 = 0.01;
/// Share of the frames that may be lower than the floor: captured feet dip into it, and the start of a clip may be bad.
const BELOW_FLOOR_SHARE: f64 = 0.05;
/// Jumps of the whole body that are reported one by one.
const JUMPS_REPORTED: usize = 3;
/// Time over which a body is raised that would touch the floor, in seconds.
const RAISE_SECS: f64 = 0.2;

/// What moving a figure by a clip found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionReport {
    /// Assumptions and corrections, one sentence each.
    pub findings: Vec<String>,
    /// Times that a foot rested on the floor.
    pub stances: usize,
    /// Joints beyond their limits, over all frames.
    pub limited_joints: usize,
    /// The furthest that the body was raised above the floor, in metres.
    pub raised: f64,
    /// The furthest that the hips sank for legs that are too short, in metres.
    pub sunk: f64,
}

/// Moves a figure by a clip: retargets its bones, keeps joints within their limits, plants the feet, lets nothing pass through
/// the floor, and leads in from the bind pose.
///
/// `fps` are the frames per second of the track, by default the clip's own or, above 60, an even part of them; `range` the
/// frames of it, by default all.
///
/// **Errors** for a clip without a person, and for frames that it does not have.
///
/// **Guarantees** equal arguments give equal bytes.
pub fn follow(
    clip: &Clip,
    figure: &Figure,
    fps: Option<f64>,
    range: Option<FrameRange>,
    params: &MotionParams,
) -> Result<(PoseTrack, MotionReport), MotionError> {
    let mut report = MotionReport { findings: clip.notes.clone(), ..MotionReport::default() };
    let (map, placement) = recognised(clip)?;
    report.findings.push(recognition(&map, &placement));
    if let Some(frame) = placement.reference_frame {
        report.findings.push(format!("its rest pose does not stand, so frame {frame} serves as one"));
    }
    let (fps, times) = times_of(clip, fps)?;
    let range = match range {
        None => 0..times.len(),
        Some(FrameRange { from, to }) if from < to && to <= times.len() => from..to,
        Some(FrameRange { from, to }) => {
            return Err(MotionError::NoSuchFrames { frames: times.len(), fps, from, to });
        }
    };
    let skeleton = &figure.skeleton;
    let retargeted = Retargeter::try_new(skeleton, clip, map, placement)?.poses(clip, &times);
    for (frame, distance) in retargeted.jumps.iter().take(JUMPS_REPORTED) {
        report.findings.push(format!("the whole body jumps by {distance:.1} m at frame {frame}: the jump is removed"));
    }
    if let Some(more @ 1..) = retargeted.jumps.len().checked_sub(JUMPS_REPORTED) {
        report.findings.push(format!("so it does at {more} more frames; the jumps are removed"));
    }
    let mut poses = retargeted.poses;
    let anatomy = params.limits.then(|| Anatomy::new(skeleton));
    if let Some(anatomy) = &anatomy {
        report.limited_joints = limit(anatomy, &mut poses);
    }
    let ground = Ground::of(figure);
    let moved = settle(skeleton, &ground, &mut poses);
    if moved != 0.0 {
        report.findings.push(format!(
            "the clip was moved {} by {:.0} mm onto the floor",
            if moved > 0.0 { "up" } else { "down" },
            moved.abs() * 1e3
        ));
    }
    report.raised = raise(skeleton, &ground, &mut poses, fps, false);
    if params.plant {
        let planted = plant(skeleton, &ground, anatomy.as_ref(), &mut poses, fps);
        (report.stances, report.sunk) = (planted.stances, planted.sunk);
    }
    report.raised = report.raised.max(raise(skeleton, &ground, &mut poses, fps, true));
    let begins_later = range.start > 0;
    let mut poses = poses[range].to_vec();
    if begins_later {
        bring_back(skeleton, &mut poses);
    }
    let lead = (params.ease_secs * fps).round() as usize;
    let mut all = lead_in(skeleton, &ground, &poses[0], lead);
    raise_each(skeleton, &ground, &mut all);
    all.append(&mut poses);
    Ok((PoseTrack { fps, lead, poses: all }, report))
}

/// The human joints of a clip's skeleton, and its frame.
///
/// **Errors** for a skeleton that is not that of a person.
pub(super) fn recognised(clip: &Clip) -> Result<(RigMap, Placement), MotionError> {
    let map = match map_by_names(clip) {
        Some(map) => map,
        None => {
            map_by_structure(clip).map_err(|missing| MotionError::NotAPerson { joints: clip.joint_count(), missing })?
        }
    };
    let placement = Placement::of(clip, &map)?;
    Ok((map, placement))
}

/// What was recognised, in words.
pub(super) fn recognition(map: &RigMap, placement: &Placement) -> String {
    let rig = map.rig.map_or_else(|| "by its structure".into(), |rig| format!("as {rig}"));
    format!("skeleton recognised {rig}: {} of 22 joints; {}", map.len(), placement.assumed)
}

/// Moves a part of a clip to where the figure stands, level and turned about the vertical: the first pose is above the place of
/// the bind pose, and faces as it does. Otherwise the lead-in would be a leap across the way that was cut off.
fn bring_back(skeleton: &Skeleton, poses: &mut [Pose]) {
    let Some(first) = poses.first() else { return };
    let (root, start) = (skeleton.joints_in_bind[0], first.translation);
    let turn = about_vertical(-heading(&first.rotations[0]));
    let begin = Vec3::new(root.x + start.x, 0.0, root.z + start.z);
    for pose in poses {
        let from_begin = root.coords + pose.translation - begin;
        pose.translation = turn * from_begin + Vec3::new(root.x, 0.0, root.z) - root.coords;
        pose.rotations[0] = turn * pose.rotations[0];
    }
}

/// Frames per second, and the time of each frame in the clip.
fn times_of(clip: &Clip, fps: Option<f64>) -> Result<(f64, Vec<f64>), MotionError> {
    let own = clip.fps();
    let fps = fps.unwrap_or_else(|| own / (own / MOST_FPS - 1e-9).ceil().max(1.0));
    let secs = (clip.frame_count() - 1) as f64 / own;
    let frames = secs * fps;
    // Compared as a number: a clip may claim any time.
    if frames >= MOST_FRAMES as f64 || frames.is_nan() {
        return Err(MotionError::TooManyFrames { frames: frames as usize, most: MOST_FRAMES });
    }
    let count = (frames + 1e-6).floor() as usize + 1;
    Ok((fps, (0..count).map(|k| (k as f64 / fps).min(secs)).collect()))
}

fn limit(anatomy: &Anatomy, poses: &mut [Pose]) -> usize {
    let mut beyond = 0;
    for pose in poses {
        let (limited, count) = anatomy.limited(pose);
        *pose = limited;
        beyond += count;
    }
    beyond
}

/// Height of the lowest vertex above the floor in each pose.
fn heights(skeleton: &Skeleton, ground: &Ground, poses: &[Pose], with_feet: bool) -> Vec<f64> {
    let height = |pose: &Pose| {
        let world = skeleton.world_from_bind(pose);
        let feet = (0..2).map(|side| ground.lowest_of_foot(side, &world)).fold(f64::INFINITY, f64::min);
        ground.lowest_of_body(&world).min(if with_feet { feet } else { f64::INFINITY })
    };
    poses.iter().map(height).collect()
}

/// Height of the body above the floor in each pose, and of its heels and balls. Toes that a clip does not bend dip into the
/// floor at every step.
fn heights_of_soles(skeleton: &Skeleton, ground: &Ground, poses: &[Pose]) -> Vec<f64> {
    let height = |pose: &Pose| {
        let world = skeleton.world_from_bind(pose);
        ground.lowest_of_soles(skeleton, &world).min(ground.lowest_of_body(&world))
    };
    poses.iter().map(height).collect()
}

/// Moves a whole track up or down onto the floor; returns by how much.
fn settle(skeleton: &Skeleton, ground: &Ground, poses: &mut [Pose]) -> f64 {
    let mut heights = heights_of_soles(skeleton, ground, poses);
    heights.sort_by(f64::total_cmp);
    let low = heights[(BELOW_FLOOR_SHARE * (heights.len() - 1) as f64).floor() as usize];
    if !low.is_finite() || low.abs() <= FLOOR_TOLERANCE {
        return 0.0;
    }
    poses.iter_mut().for_each(|pose| pose.translation.y -= low);
    -low
}

/// Raises the body where it would be below the floor, along a smooth curve; returns by how much at most.
fn raise(skeleton: &Skeleton, ground: &Ground, poses: &mut [Pose], fps: f64, with_feet: bool) -> f64 {
    let raised = envelope(&depths(skeleton, ground, poses, with_feet), (RAISE_SECS * fps).round() as usize);
    for (pose, by) in poses.iter_mut().zip(&raised) {
        pose.translation.y += by;
    }
    raised.into_iter().fold(0.0, f64::max)
}

/// Raises each pose by what it needs; for poses that pass over into others, which a smooth curve would leave at the end.
fn raise_each(skeleton: &Skeleton, ground: &Ground, poses: &mut [Pose]) {
    let depths = depths(skeleton, ground, poses, true);
    for (pose, by) in poses.iter_mut().zip(depths) {
        pose.translation.y += by;
    }
}

/// How far below the floor the lowest vertex of each pose is.
fn depths(skeleton: &Skeleton, ground: &Ground, poses: &[Pose], with_feet: bool) -> Vec<f64> {
    /// Metres of rounding.
    const ROUNDING: f64 = 1e-6;
    let heights = heights(skeleton, ground, poses, with_feet).into_iter();
    heights.map(|height| if height < -ROUNDING { -height } else { 0.0 }).collect()
}
