//! A stream played on a figure, frame by frame as it arrives.

use super::calibration::{CALIBRATION_SECS, Calibration, StreamKind, calibrate, still_window};
use super::error::DriveError;
use super::grounding::Grounding;
use super::ik::{Driven, IkDriver};
use super::landmark::{LandmarkFrame, Places};
use super::laplacian::Solved;
use super::recognition::PoseLibrary;
use super::stream::{Smoothed, Smoothing, noise_of};
use super::transfer::{Between, KeyPose, LaplacianDriver, TransferFrame, TransferParams};
use crate::body::{Figure, Pose};

/// Frames that wait for a calibration pose, at most: 60 s at 60 frames per second.
const MOST_WAITING: usize = 3600;
/// A figure that stays this far from its landmarks on average, in metres, does not follow them.
const FAR: f64 = 0.05;

/// A frame of a stream on the figure.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayedFrame {
    /// Seconds since the stream began.
    pub secs: f64,
    /// The landmarks in the figure's world, filtered.
    pub places: Places,
    /// The figure's pose.
    pub pose: Pose,
    /// The body's surface, where the paper's method found it; otherwise the pose skins all layers.
    pub solved: Option<Box<Solved>>,
    /// Steps of the solver.
    pub steps: usize,
    /// Mean distance of the landmarks from the figure's, in metres.
    pub distance: f64,
}

/// Counts of what was played.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlayedCounts {
    /// Frames played.
    pub frames: usize,
    /// Frames in which some landmark was lost for longer than could be bridged.
    pub incomplete: usize,
    /// Frames whose landmarks the figure could not reach, by 50 mm on average.
    pub unreached: usize,
    /// Sum of the solver's steps.
    pub steps: usize,
    /// Sum of the mean distances to the landmarks, in metres.
    pub distance: f64,
}

/// Key poses of the paper's method, and what is between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyPoses {
    /// Seconds from one key pose to the next; 0 solves every frame. The paper's k (§3.5, Fig. 14).
    pub interval_secs: f64,
    /// The frames between them.
    pub between: Between,
}

/// A key pose, and the frames since then, which wait for the next.
struct Keyed {
    secs: f64,
    pose: KeyPose,
    waiting: Vec<(f64, Places)>,
}

/// Plays a stream on a figure.
pub struct Player<'a> {
    figure: &'a Figure,
    kind: StreamKind,
    smoothing: Option<Smoothing>,
    smoothed: Smoothed,
    noise: f64,
    waiting: Vec<LandmarkFrame>,
    /// So many of them begin no calibration.
    moving: usize,
    library: Option<(PoseLibrary, KeyPoses)>,
    keyed: Option<Keyed>,
    playing: Option<(Calibration, IkDriver<'a>, Option<Grounding>)>,
    laplacian: Option<LaplacianDriver<'a>>,
    counts: PlayedCounts,
}

impl<'a> Player<'a> {
    /// A player that waits for the calibration pose. Without `smoothing`, the noise of the calibration decides on it.
    pub fn new(figure: &'a Figure, kind: StreamKind, smoothing: Option<Smoothing>) -> Self {
        Self {
            figure,
            kind,
            smoothing,
            smoothed: Smoothed::new(smoothing.unwrap_or_default()),
            noise: 0.0,
            waiting: Vec::new(),
            moving: 0,
            library: None,
            keyed: None,
            playing: None,
            laplacian: None,
            counts: PlayedCounts::default(),
        }
    }

    /// A player by the paper's method, with the templates of a library. With key poses, frames come when the next key pose does.
    pub fn by_laplacian(self, library: PoseLibrary, keys: KeyPoses) -> Self {
        Self { library: Some((library, keys)), ..self }
    }

    /// What is known of the stream by now; it counts until the calibration.
    pub fn set_kind(&mut self, kind: StreamKind) {
        self.kind = kind;
    }

    /// The calibration, once it was found.
    pub fn calibration(&self) -> Option<&Calibration> {
        self.playing.as_ref().map(|(calibration, ..)| calibration)
    }

    /// The tracker's noise while the wearer stood still: a standard deviation per axis, in metres.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// What was played.
    pub fn counts(&self) -> PlayedCounts {
        self.counts
    }

    /// Takes in a frame. Frames before the calibration wait; then all of them are played at once, so that a recording is whole.
    ///
    /// **Errors** if nobody stands in a calibration pose for a minute.
    pub fn push(&mut self, frame: LandmarkFrame) -> Result<Vec<PlayedFrame>, DriveError> {
        if self.playing.is_some() {
            return Ok(self.play(&frame));
        }
        self.waiting.push(frame);
        let (wearer, at_secs) = match still_window(&self.waiting[self.moving..]) {
            Ok(found) => found,
            Err(_) if self.waiting.len() >= MOST_WAITING => return Err(self.not_calibrated()),
            Err(moving) => {
                self.moving += moving;
                return Ok(Vec::new());
            }
        };
        let still: Vec<LandmarkFrame> = self
            .waiting
            .iter()
            .filter(|f| f.secs >= at_secs && f.secs <= at_secs + CALIBRATION_SECS)
            .cloned()
            .collect();
        self.noise = noise_of(&still);
        self.smoothed = Smoothed::new(self.smoothing.unwrap_or_else(|| Smoothing::for_noise(self.noise)));
        let calibration = calibrate(self.figure, &wearer, at_secs, self.kind)?;
        self.laplacian = match &self.library {
            Some((library, _)) => {
                Some(LaplacianDriver::try_new(self.figure, &calibration, library, TransferParams::default())?)
            }
            None => None,
        };
        let driver = IkDriver::new(self.figure, &calibration);
        let grounding = self.kind.is_hip_centred.then(|| Grounding::new(self.figure));
        self.playing = Some((calibration, driver, grounding));
        let waiting = std::mem::take(&mut self.waiting);
        Ok(waiting.iter().flat_map(|frame| self.play(frame)).collect())
    }

    /// Ends the stream: the frames that still wait for a key pose.
    ///
    /// **Errors** if it ended before a calibration.
    pub fn end(&mut self) -> Result<Vec<PlayedFrame>, DriveError> {
        if self.playing.is_none() {
            return Err(self.not_calibrated());
        }
        let Some(Keyed { secs, pose, mut waiting }) = self.keyed.take() else { return Ok(Vec::new()) };
        let Some((last_secs, last)) = waiting.pop() else { return Ok(Vec::new()) };
        Ok(self.play_from_key(Keyed { secs, pose, waiting }, last_secs, last))
    }

    fn not_calibrated(&self) -> DriveError {
        super::calibration::why_not_still(&self.waiting)
    }

    fn play(&mut self, frame: &LandmarkFrame) -> Vec<PlayedFrame> {
        let Some((calibration, driver, _)) = self.playing.as_mut() else { return Vec::new() };
        let frame = self.smoothed.next(frame);
        let places = calibration.in_world(&frame.places);
        if self.laplacian.is_none() {
            let driven = driver.follow(calibration, &places);
            return self.played(frame.secs, places, driven, None).into_iter().collect();
        }
        let interval = self.library.as_ref().map_or(0.0, |(_, keys)| keys.interval_secs);
        match self.keyed.take() {
            // Half a frame of tolerance at 120 frames per second: times of streams jitter.
            Some(mut keyed) if frame.secs < keyed.secs + interval - 0.004 => {
                keyed.waiting.push((frame.secs, places));
                self.keyed = Some(keyed);
                Vec::new()
            }
            Some(keyed) => self.play_from_key(keyed, frame.secs, places),
            None => self.key(frame.secs, places, interval).into_iter().collect(),
        }
    }

    /// Solves a key pose; it is kept where others follow at an interval.
    fn key(&mut self, secs: f64, places: Places, interval: f64) -> Option<PlayedFrame> {
        let (calibration, ..) = self.playing.as_ref()?;
        let frame = self.laplacian.as_mut()?.follow(calibration, &places);
        if interval > 0.0 {
            let pose = self.laplacian.as_ref()?.key_pose(frame.clone());
            self.keyed = Some(Keyed { secs, pose, waiting: Vec::new() });
        }
        self.transferred(secs, places, frame)
    }

    /// The frames between a key pose and the next, and that one.
    fn play_from_key(&mut self, before: Keyed, secs: f64, places: Places) -> Vec<PlayedFrame> {
        let Some(keys) = self.library.as_ref().map(|(_, keys)| *keys) else { return Vec::new() };
        let Some((calibration, ..)) = self.playing.as_ref() else { return Vec::new() };
        let Some(laplacian) = self.laplacian.as_mut() else { return Vec::new() };
        let next = laplacian.follow(calibration, &places);
        let pose = laplacian.key_pose(next.clone());
        let span = (secs - before.secs).max(f64::MIN_POSITIVE);
        let mut played = Vec::new();
        for (at, seen) in before.waiting {
            let Some(laplacian) = &self.laplacian else { break };
            let frame = laplacian.between(&before.pose, &pose, (at - before.secs) / span, keys.between);
            played.extend(self.transferred(at, seen, frame));
        }
        self.keyed = Some(Keyed { secs, pose, waiting: Vec::new() });
        played.extend(self.transferred(secs, places, next));
        played
    }

    fn transferred(&mut self, secs: f64, places: Places, frame: TransferFrame) -> Option<PlayedFrame> {
        let (calibration, ..) = self.playing.as_ref()?;
        let laplacian = self.laplacian.as_ref()?;
        let distance = laplacian.distance(&frame, calibration, &places);
        let driven = Driven { pose: laplacian.pose_of(&frame), steps: frame.solved.iterations, distance };
        self.played(secs, places, driven, Some(Box::new(frame.solved)))
    }

    /// Grounds and counts a frame.
    fn played(
        &mut self,
        secs: f64,
        mut places: Places,
        mut driven: Driven,
        mut solved: Option<Box<Solved>>,
    ) -> Option<PlayedFrame> {
        let (calibration, _, grounding) = self.playing.as_mut()?;
        if let Some(grounding) = grounding {
            let shift = grounding.shift(&self.figure.skeleton, &driven.pose);
            driven.pose.translation += shift;
            if let Some(solved) = &mut solved {
                solved.points = solved.points.iter().map(|p| p + shift).collect();
            }
            places = places.map(|place| place.map(|p| p + shift));
        }
        let lost = places.iter().zip(calibration.known).any(|(place, known)| known && place.is_none());
        self.counts.frames += 1;
        self.counts.incomplete += usize::from(lost);
        self.counts.unreached += usize::from(driven.distance > FAR);
        self.counts.steps += driven.steps;
        self.counts.distance += driven.distance;
        let Driven { pose, steps, distance } = driven;
        Some(PlayedFrame { secs, places, pose, solved, steps, distance })
    }
}
