//! Retargeting of a skeleton that arrives frame by frame.

use super::clip::Clip;
use super::error::MotionError;
use super::follow::{recognised, recognition};
use super::limits::Anatomy;
use super::retarget::{Retargeter, Start};
use crate::body::{Pose, Skeleton};
use crate::formats::{RawMotion, RawTransform};

/// Moves a figure by the frames of another skeleton as they arrive.
///
/// As for clips, except that later frames are not known: feet are not planted, jumps of the whole body remain, and the floor
/// is at y = 0 of the frames. The hips are as high above it as the sender's, per length of the legs.
pub struct LiveRetargeter<'a> {
    /// The sender's skeleton.
    rig: Clip,
    retargeter: Retargeter<'a>,
    anatomy: Anatomy<'a>,
    start: Start,
    recognition: String,
}

impl<'a> LiveRetargeter<'a> {
    /// Recognises a skeleton, and where its person begins: one that is far away or turned away is moved to where the figure
    /// stands.
    ///
    /// `first` holds the skeleton in its rest pose and the first frame; further frames are not used.
    ///
    /// **Errors** for a skeleton that is not that of a person.
    pub fn try_new(skeleton: &'a Skeleton, mut first: RawMotion) -> Result<Self, MotionError> {
        first.frames.truncate(1);
        let rig = Clip::new("live", first);
        let (map, placement) = recognised(&rig)?;
        let recognition = recognition(&map, &placement);
        let retargeter = Retargeter::try_new(skeleton, &rig, map, placement)?;
        let start = retargeter.start_of(&rig.world(0));
        Ok(Self { rig, retargeter, anatomy: Anatomy::new(skeleton), start, recognition })
    }

    /// The pose of one frame, with joints within their limits.
    ///
    /// **Shapes** `frame`: one transform per joint of the sender's skeleton, relative to its parent; finite.
    pub fn pose(&self, frame: &[RawTransform]) -> Pose {
        self.anatomy.limited(&self.pose_beyond_limits(frame)).0
    }

    /// What the skeleton was recognised as, in words.
    pub fn recognition(&self) -> &str {
        &self.recognition
    }

    fn pose_beyond_limits(&self, frame: &[RawTransform]) -> Pose {
        self.retargeter.pose_from(&self.rig.world_of(frame), &self.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::motion::tests::figure;
    use crate::motion::tests::rigs::{Turn, performance, placed, t_pose, with_rest};
    use crate::motion::{MotionParams, follow};

    /// The greatest differences of rotations, in radians, and of ways of the hips, in metres: level, and in height up to a
    /// constant.
    fn differences(found: &[Pose], expected: &[Pose]) -> [f64; 3] {
        let angle = |(a, b): (&Pose, &Pose)| {
            a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max)
        };
        let away: Vec<Vec3> = found.iter().zip(expected).map(|(a, b)| a.translation - b.translation).collect();
        let greatest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        [
            greatest(&mut found.iter().zip(expected).map(angle)),
            greatest(&mut away.iter().map(|v| v.xz().norm())),
            greatest(&mut away.iter().map(|v| (v.y - away[0].y).abs())),
        ]
    }

    fn compared(motion: &RawMotion, limits: bool) -> [f64; 3] {
        let live = LiveRetargeter::try_new(&figure().skeleton, motion.clone()).unwrap();
        let pose = |frame: &Vec<RawTransform>| if limits { live.pose(frame) } else { live.pose_beyond_limits(frame) };
        let found: Vec<Pose> = motion.frames.iter().map(pose).collect();
        let params = MotionParams { ease_secs: 0.0, plant: false, limits, clear: false };
        let track = follow(&Clip::new("x", motion.clone()), figure(), None, None, &params).unwrap().0;
        differences(&found, &track.poses)
    }

    #[test]
    fn live_frames_give_the_poses_of_the_clip() {
        for name in ["walk", "turn", "squat"] {
            let motion = with_rest(&performance(name, 5), t_pose);
            for limits in [false, true] {
                let [angle, level, height] = compared(&motion, limits);
                assert!(angle < 1e-6 && level < 1e-9, "{name}: {angle} rad, {level} m");
                // A clip is raised where the body would be below the floor.
                assert!(height < 0.03, "{name}: {height} m");
            }
        }
    }

    #[test]
    fn the_hips_are_as_high_per_leg_as_the_senders() {
        let motion = with_rest(&performance("idle", 30), t_pose);
        let heights = [1.0, 1.3].map(|size| {
            let motion = placed(&motion, &Turn::identity(), size);
            let live = LiveRetargeter::try_new(&figure().skeleton, motion.clone()).unwrap();
            live.pose(&motion.frames[0]).translation.y
        });
        assert!((heights[0] - heights[1]).abs() < 1e-9, "{heights:?}");
        // The legs of the clip and of the figure end differently far above their soles.
        assert!(heights[0].abs() < 0.05, "{heights:?}");
    }

    #[test]
    fn a_sender_far_away_who_looks_back_begins_where_the_figure_stands() {
        let motion = with_rest(&performance("idle", 30), t_pose);
        let expected = LiveRetargeter::try_new(&figure().skeleton, motion.clone()).unwrap().pose(&motion.frames[3]);
        let mut away = motion.clone();
        let back = Turn::from_axis_angle(&Vec3::y_axis(), 3.0);
        for frame in &mut away.frames {
            let at = back * Vec3::from(frame[0].translation) + Vec3::new(4.0, 0.0, -7.0);
            let [x, y, z, w] = frame[0].rotation;
            let rotation = back * Turn::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
            frame[0] = RawTransform { translation: at.into(), rotation: rotation.into_inner().coords.into() };
        }
        let found = LiveRetargeter::try_new(&figure().skeleton, away.clone()).unwrap().pose(&away.frames[3]);
        // The person looks straight ahead only to within the sway of idling.
        assert!(found.rotations[0].angle_to(&expected.rotations[0]) < 0.1);
        assert!((found.translation - expected.translation).norm() < 0.05);
        let [angle, ..] = differences(&[found], &[expected]);
        assert!(angle < 0.1, "{angle}");
    }

    #[test]
    fn a_skeleton_that_is_no_person_is_refused() {
        let mut motion = performance("idle", 100);
        for joint in &mut motion.joints {
            joint.name = "bone".into();
            joint.rest.translation = [0.0; 3];
        }
        assert!(matches!(LiveRetargeter::try_new(&figure().skeleton, motion), Err(MotionError::NotAPerson { .. })));
    }
}
