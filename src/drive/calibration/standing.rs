//! Whether someone stands still in a T- or A-pose, and where.

use crate::body::Side;
use crate::body::Side::{Left, Right};
use crate::drive::error::DriveError;
use crate::drive::landmark::{LANDMARKS, Landmark, LandmarkFrame, Places};
use crate::geometry::{Point, Vec3};

/// Seconds of standing still that a calibration needs.
pub const CALIBRATION_SECS: f64 = 2.0;

/// The farthest that the mean of a landmark over a tenth of the calibration may move, in metres: people sway by 1 to 2 cm, and sensors
/// have 1 cm of noise.
const STILL: f64 = 0.035;

/// Fewest landmarks that determine a pose.
pub const FEWEST_LANDMARKS: usize = 8;

/// Angles of the arms from straight down in a T- or A-pose, in degrees.
const ARM_SPREAD_DEG: std::ops::Range<f64> = 12.0..110.0;

/// The mean place of each landmark in the first frames that stand still for long enough in a T- or A-pose, and when they begin.
/// Otherwise the number of frames that begin no such window, however the stream goes on.
pub fn still_window(frames: &[LandmarkFrame]) -> Result<(Places, f64), usize> {
    let Some(last) = frames.last() else { return Err(0) };
    for (k, first) in frames.iter().enumerate() {
        let end = first.secs + CALIBRATION_SECS;
        if end > last.secs + 1e-6 {
            return Err(k);
        }
        let window: Vec<&LandmarkFrame> = frames[k..].iter().take_while(|f| f.secs <= end + 1e-6).collect();
        if let Some(mean) = still_mean(&window).filter(|mean| posture(mean).is_ok()) {
            return Ok((mean, first.secs));
        }
    }
    Err(frames.len())
}

/// Why frames have no such window: the posture at their end, or that someone moves.
pub fn why_not_still(frames: &[LandmarkFrame]) -> DriveError {
    let Some(last) = frames.last() else { return DriveError::NoCalibrationPose { why: "no frame was read".into() } };
    let seen = frames.iter().map(LandmarkFrame::seen).max().unwrap_or_default();
    if seen < FEWEST_LANDMARKS {
        return DriveError::TooFewLandmarks { seen };
    }
    if last.secs - frames[0].secs + 1e-6 < CALIBRATION_SECS {
        return DriveError::NoCalibrationPose {
            why: format!("the stream is only {:.1} s long", last.secs - frames[0].secs),
        };
    }
    let middle = &frames[frames.len().min(30) / 2];
    let why = posture(&middle.places).err().unwrap_or_else(|| "the landmarks move all the time".into());
    DriveError::NoCalibrationPose { why }
}

/// Mean places of frames, `None` if some landmark moves. A landmark counts if half of the frames show it.
fn still_mean(window: &[&LandmarkFrame]) -> Option<Places> {
    let mean = |frames: &[&LandmarkFrame], k: usize| {
        let seen: Vec<Vec3> = frames.iter().filter_map(|f| Some(f.places[k]?.coords)).collect();
        (2 * seen.len() >= frames.len().max(1)).then(|| Point::from(seen.iter().sum::<Vec3>() / seen.len() as f64))
    };
    let whole: Places = std::array::from_fn(|k| mean(window, k));
    let parts = window.chunks(window.len().div_ceil(10).max(1));
    let moves = parts
        .into_iter()
        .any(|part| (0..LANDMARKS).any(|k| mean(part, k).zip(whole[k]).is_some_and(|(a, b)| (a - b).norm() > STILL)));
    (!moves && whole.iter().flatten().count() >= FEWEST_LANDMARKS).then_some(whole)
}

pub(super) fn at(places: &Places, landmark: Landmark) -> Option<Point> {
    places[landmark.index()]
}

pub(super) fn mean_of(points: impl IntoIterator<Item = Option<Point>>) -> Option<Point> {
    let points: Vec<Vec3> = points.into_iter().flatten().map(|p| p.coords).collect();
    (!points.is_empty()).then(|| Point::from(points.iter().sum::<Vec3>() / points.len() as f64))
}

/// The middle of the hips or the pelvis, and of the shoulders or the neck.
pub(super) fn trunk(places: &Places) -> Option<[Point; 2]> {
    let both = |of: fn(Side) -> Landmark| {
        let [a, b] = Side::BOTH.map(|side| at(places, of(side)));
        mean_of([Some(a?), Some(b?)])
    };
    let low = both(Landmark::Hip).or_else(|| at(places, Landmark::Pelvis))?;
    let high = both(Landmark::Shoulder).or_else(|| at(places, Landmark::Neck))?;
    Some([low, high])
}

/// The heading of the wearer: 0 looks along +Z.
pub(super) fn heading(places: &Places) -> Option<f64> {
    let across = |of: fn(Side) -> Landmark| Some(at(places, of(Left))? - at(places, of(Right))?);
    let left: Vec3 =
        [across(Landmark::Shoulder), across(Landmark::Hip)].into_iter().flatten().fold(Vec3::zeros(), |a, b| a + b);
    let forward = left.cross(&Vec3::y());
    (forward.norm() > 1e-6).then(|| forward.x.atan2(forward.z))
}

/// Checks that someone stands upright with both arms away from the body; says why not.
pub(super) fn posture(places: &Places) -> Result<(), String> {
    let Some([hips, shoulders]) = trunk(places) else {
        return Err("hips and shoulders are not all seen".into());
    };
    let up = shoulders - hips;
    if up.y < 0.9 * up.norm() {
        return Err("the trunk is not upright".into());
    }
    if let Some(ankles) = mean_of(Side::BOTH.map(|side| at(places, Landmark::Ankle(side))))
        && hips.y - ankles.y < 0.8 * up.norm()
    {
        return Err("the legs are not straight below the hips".into());
    }
    for side in Side::BOTH {
        let (Some(shoulder), Some(wrist)) = (at(places, Landmark::Shoulder(side)), at(places, Landmark::Wrist(side)))
        else {
            continue;
        };
        let arm = wrist - shoulder;
        let spread = (-arm.y / arm.norm().max(1e-9)).clamp(-1.0, 1.0).acos().to_degrees();
        if !ARM_SPREAD_DEG.contains(&spread) {
            return Err(format!("the {} arm is {spread:.0}° from straight down", side.name()));
        }
    }
    Ok(())
}
