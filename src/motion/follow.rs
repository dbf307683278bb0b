//! The whole way from a clip to the poses of a figure.

use super::aligned::{about_vertical, heading};
use super::clearance::clear_arms;
use super::clip::Clip;
use super::ease::lead_in;
use super::error::MotionError;
use super::fingers::fingers_below;
use super::floor::{Hover, longest_hover, settle, without_drift};
use super::ground::Ground;
use super::limits::Anatomy;
use super::mirrored::is_mirrored;
use super::names::map_by_names;
use super::params::MotionParams;
use super::placement::Placement;
use super::planting::plant;
use super::retarget::Retargeter;
use super::rig_map::RigMap;
use super::smooth::envelope;
use super::structure::map_by_structure;
use super::track::{FrameRange, PoseTrack};
use crate::body::{Figure, HumanJoint, Pose, Side, Skeleton};
use crate::geometry::Vec3;
use std::borrow::Cow;

/// Frames per second above which a clip is thinned by default: films and game engines need no more.
const MOST_FPS: f64 = 60.0;
/// Most frames of a track: an hour at 30 per second.
const MOST_FRAMES: usize = 108_000;
/// Share of joints beyond their limits that is reported: captures of other people have up to 5 %.
const MOST_LIMITED: f64 = 0.15;
/// Jumps of the whole body that are reported one by one.
const JUMPS_REPORTED: usize = 3;
/// Turn of an arm that is reported, degrees.
const LEAST_CLEARED_DEG: f64 = 3.0;
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
    /// The furthest that an arm was turned outward to be clear of the clothes, in degrees.
    pub cleared_deg: f64,
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
    let (mut map, mut placement) = recognised(clip)?;
    let mut clip = Cow::Borrowed(clip);
    if is_mirrored(&clip, &map, &placement) {
        clip = Cow::Owned(clip.mirrored());
        placement = Placement::of(&clip, &map)?;
        report
            .findings
            .push("knees and toes point backwards, as in data of a left-handed frame: the clip was mirrored".into());
    }
    let clip = clip.as_ref();
    if !map.fingers.values().any(|&joint| clip.turns(joint, &placement.reference)) {
        map.fingers.clear();
    }
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
    if params.clear {
        report.cleared_deg = clear_arms(figure, &mut poses, fps);
    }
    if report.cleared_deg >= LEAST_CLEARED_DEG {
        report.findings.push(format!(
            "arms are held up to {:.0}° farther out, so that they are not inside the clothes",
            report.cleared_deg
        ));
    }
    let ground = Ground::of(figure);
    if let Some(drift) = without_drift(skeleton, &ground, &mut poses, fps) {
        report.findings.push(format!(
            "the root drifts {} by {:.0} mm while the feet rest: the drift is removed",
            if drift > 0.0 { "up" } else { "down" },
            drift.abs() * 1e3
        ));
    }
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
    if let Some(Hover { height, secs, frame }) = longest_hover(skeleton, &ground, &poses, fps) {
        report.findings.push(format!(
            "nothing touches the floor for {secs:.1} s from frame {frame}, up to {height:.2} m above it: does the clip climb or \
             swim, or does its root drift?"
        ));
    }
    let of_all = report.limited_joints as f64 / (poses.len() * skeleton.len()).max(1) as f64;
    if of_all > MOST_LIMITED {
        report.findings.push(format!(
            "{:.0} % of all joints are bent further than people can, and were limited: is the clip of another rig, or are left \
             and right exchanged?",
            100.0 * of_all
        ));
    }
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
    let mut map = match map_by_names(clip) {
        Some(map) => map,
        None => {
            map_by_structure(clip).map_err(|missing| MotionError::NotAPerson { joints: clip.joint_count(), missing })?
        }
    };
    for side in Side::BOTH {
        if let Some(hand) = map.start(HumanJoint::Hand(side)) {
            map.fingers.extend(fingers_below(clip, hand, side));
        }
    }
    let placement = Placement::of(clip, &map)?;
    Ok((map, placement))
}

/// What was recognised, in words.
pub(super) fn recognition(map: &RigMap, placement: &Placement) -> String {
    let rig = map.rig.map_or_else(|| "by its structure".into(), |rig| format!("as {rig}"));
    let fingers = match map.fingers.len() {
        0 => String::new(),
        count => format!(", {count} of fingers"),
    };
    format!("skeleton recognised {rig}: {} of 22 joints{fingers}; {}", map.len(), placement.assumed)
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
