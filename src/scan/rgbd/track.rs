//! Tracks the camera's pose relative to the person, frame by frame.

use super::align::{Alignment, SETTLING, TRACKING, align, misfit};
use super::axis::Axis;
use super::raycast::{Prediction, Reach};
use super::view::PersonFrame;
use super::volume::Volume;
use nalgebra::Isometry3;

/// A segmented frame.
pub(super) struct SegmentedFrame {
    /// Index of the frame in the recording.
    pub(super) frame: usize,
    pub(super) secs: f64,
    pub(super) view: PersonFrame,
}

/// A frame with a pose.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    /// Index of the segmented frame.
    pub(super) cut: usize,
    pub(super) pose: Isometry3<f64>,
    /// Robust standard deviation of its points from the surface, metres.
    pub(super) residual: f64,
}

/// The frames with a pose, in order of time, and the lost ones.
pub(super) struct Track {
    pub(super) placed: Vec<Placed>,
    pub(super) lost: Vec<usize>,
}

/// Called for each frame: index, estimated pose, residual if it was not lost, and the model so far.
pub(super) type OnFrame<'a> = &'a mut dyn FnMut(usize, &Isometry3<f64>, Option<f64>, &Volume);

/// At least this share of a frame's points must agree with the model: neighbours 15° apart share four fifths of what
/// they see, and a wrong place shares less than half.
const LEAST_OVERLAP: f64 = 0.55;
/// Greatest mean misfit (see [`misfit`]) of a correct pose: correct ones have 0.02 to 0.2.
const MOST_MISFIT: f64 = 0.45;
/// Gate of the search, metres.
const SEARCH_GATE: f32 = 0.06;
/// Steps of the search about the axis, radians (2.5°): two fit into ICP's reach.
const SEARCH_STEP: f64 = 0.0436;
/// Search range around the prediction, in steps: 30°.
const SEARCH_REACH: i32 = 12;
/// Number of consecutive lost frames after which the whole turn is searched.
const WIDE_AFTER: usize = 2;
/// Rotation (2°, in radians) and translation (metres) from the prediction above which the frame is predicted and
/// aligned again.
const FAR: [f64; 2] = [0.035, 0.02];

/// Tracks the frames against the model fused from the frames so far.
///
/// **Source** Newcombe et al. 2011, with a constant rate about the axis as prediction, and a search about the axis
/// where the prediction fails.
pub(super) fn track(
    cuts: &[SegmentedFrame],
    axis: &Axis,
    start: &Isometry3<f64>,
    volume: &mut Volume,
    on_frame: OnFrame,
) -> Track {
    let mut track = Track { placed: Vec::new(), lost: Vec::new() };
    let Some(first) = cuts.first() else { return track };
    volume.integrate(&first.view, start);
    track.placed.push(Placed { cut: 0, pose: *start, residual: 0.0 });
    on_frame(0, start, Some(0.0), volume);
    let mut rate = 0.0;
    for (k, cut) in cuts.iter().enumerate().skip(1) {
        let last = &track.placed[track.placed.len() - 1];
        let elapsed = (cut.secs - cuts[last.cut].secs).max(0.0);
        let guess = axis.turn(rate * elapsed) * last.pose;
        let lost_in_a_row = k - last.cut - 1;
        let begin = track.placed.len() == 1;
        let mut found = if begin { None } else { place(&cut.view, volume, &guess, Reach::Near) };
        if found.is_none() {
            let whole = lost_in_a_row >= WIDE_AFTER;
            found = search(&cut.view, volume, axis, &guess, &last.pose, whole);
        }
        match found {
            Some(alignment) => {
                let turned = axis.angle_of(&(alignment.model_from_camera * last.pose.inverse()).rotation);
                if elapsed > 0.0 {
                    rate = turned / elapsed;
                }
                volume.integrate(&cut.view, &alignment.model_from_camera);
                on_frame(k, &alignment.model_from_camera, Some(alignment.residual), volume);
                let (pose, residual) = (alignment.model_from_camera, alignment.residual);
                track.placed.push(Placed { cut: k, pose, residual });
            }
            None => {
                on_frame(k, &guess, None, volume);
                track.lost.push(k);
            }
        }
    }
    track
}

/// Renders the model for the camera of a view from a pose.
pub(super) fn predicted(view: &PersonFrame, volume: &Volume, pose: &Isometry3<f64>, reach: Reach) -> Prediction {
    volume.predict(&view.levels[0], pose, reach)
}

fn place(view: &PersonFrame, volume: &Volume, guess: &Isometry3<f64>, reach: Reach) -> Option<Alignment> {
    let mut prediction = predicted(view, volume, guess, reach);
    let mut found = align(view, &prediction, guess, &TRACKING);
    let moved = found.model_from_camera * guess.inverse();
    let far = moved.rotation.angle() > FAR[0]
        || (found.model_from_camera.translation.vector - guess.translation.vector).norm() > FAR[1];
    if far && found.overlap > 0.0 {
        let guess = found.model_from_camera;
        prediction = predicted(view, volume, &guess, reach);
        found = align(view, &prediction, &guess, &SETTLING);
    }
    let good = found.overlap >= LEAST_OVERLAP
        && misfit(view, &prediction, &found.model_from_camera, SEARCH_GATE) < MOST_MISFIT;
    good.then_some(found)
}

/// Tries poses about the axis, near the prediction and near the last pose (a frame may be a duplicate), or all around.
fn search(
    view: &PersonFrame,
    volume: &Volume,
    axis: &Axis,
    guess: &Isometry3<f64>,
    last: &Isometry3<f64>,
    whole: bool,
) -> Option<Alignment> {
    let reach = if whole { (std::f64::consts::PI / SEARCH_STEP).ceil() as i32 } else { SEARCH_REACH };
    let mut places: Vec<(f64, Isometry3<f64>)> = (-reach..=reach)
        .map(|k| axis.turn(f64::from(k) * SEARCH_STEP) * guess)
        .chain([*last])
        .map(|pose| (misfit(view, &coarse(view, volume, &pose), &pose, SEARCH_GATE), pose))
        .collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The best three that are not next to each other.
    let mut tried: Vec<Isometry3<f64>> = Vec::new();
    let mut best: Option<(f64, Alignment)> = None;
    for (_, pose) in &places {
        if tried.iter().any(|t| (t.inverse() * pose).rotation.angle() < 1.5 * SEARCH_STEP) {
            continue;
        }
        tried.push(*pose);
        if let Some(found) = place(view, volume, pose, Reach::Far) {
            let pose = &found.model_from_camera;
            let cost = misfit(view, &predicted(view, volume, pose, Reach::Far), pose, 0.03);
            if best.as_ref().is_none_or(|b| cost < b.0) {
                best = Some((cost, found));
            }
        }
        if tried.len() == 3 {
            break;
        }
    }
    best.map(|b| b.1)
}

/// The prediction at a quarter of the size, for the search.
fn coarse(view: &PersonFrame, volume: &Volume, pose: &Isometry3<f64>) -> Prediction {
    volume.predict(&view.levels[1], pose, Reach::Far)
}
