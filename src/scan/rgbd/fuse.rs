//! Fuses RGB-D frames into a coloured mesh.

use super::axis::Axis;
use super::error::FusionError;
use super::frame::Frames;
use super::loop_closure::{Closure, close_loops, loop_residual};
use super::marching_cubes::FusedSurface;
use super::person::cut_out;
use super::report::{FramePose, Fusion, FusionReport, FusionStep, SurfaceSoFar};
use super::settle::{integrated, settle};
use super::survey::SceneSurvey;
use super::track::{Placed, SegmentedFrame, Track, track};
use super::volume::Volume;
use super::{FusionParams, mend};
use crate::formats::EncodedRecording;
use crate::geometry::Point;
use crate::scan::counted::counted;
use nalgebra::Isometry3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Least number of frames that cover a person with overlap: 24 frames of 15° are a full turn, half of them half a scan.
const LEAST_FRAMES: usize = 8;
/// Greatest share of lost frames.
const MOST_LOST: f64 = 0.34;
/// Least turn over all frames, in radians: 20°.
const LEAST_TURN: f64 = 0.35;
/// Move below which a pose is kept, as a share of a voxel.
const SETTLED_PER_VOXEL: f64 = 0.05;

/// Fuses frames of a person who turns in front of a static camera, and finds their poses.
///
/// **Frame and units** of the mesh: metres, Y up along the axis of the turn, the lowest point (or the floor) at 0, +Z toward
/// the camera of the first frame.
///
/// **Errors** for frames that cannot be read or show no turning person; see [`FusionError`].
///
/// **Guarantees** the same bytes with any number of threads.
///
/// **Source** Newcombe et al. 2011 (KinectFusion), with the background removed, loops closed by a pose graph, and all frames
/// realigned to their common surface.
pub fn fuse(
    recording: &EncodedRecording,
    params: &FusionParams,
    on_step: &mut dyn FnMut(&FusionStep),
) -> Result<Fusion, FusionError> {
    let frames = Frames::of(recording);
    if frames.count() < LEAST_FRAMES {
        return Err(FusionError::TooFewFrames { count: frames.count(), least: LEAST_FRAMES });
    }
    let survey = SceneSurvey::of(&frames)?;
    on_step(&FusionStep::Surveyed);
    let mut findings = survey.findings.clone();
    let cuts = cut_all(&frames, &survey, &mut findings)?;
    on_step(&FusionStep::CutOut { frames: cuts.len() });

    let [coarse, truncation] = params.tracking();
    let mut volume = Volume::new(coarse, truncation);
    let Track { mut placed, lost } =
        track(&cuts, &survey.axis, &survey.model_from_camera, &mut volume, &mut |frame, pose, residual, model| {
            let so_far = SurfaceSoFar::of(model);
            on_step(&FusionStep::Tracked { frame, of: cuts.len(), pose: *pose, residual, so_far });
        });
    refuse_if_lost(&frames, &cuts, &placed, &lost)?;
    let axis = refitted(&survey.axis, &placed)?;
    refuse_if_still(&axis, &placed)?;

    let drift = close_loops(&cuts, &mut placed, &axis, coarse, truncation);
    on_step(&FusionStep::Closed { loops: drift.loops });
    for round in 0..params.settling_rounds {
        volume = integrated(&cuts, &placed, Volume::new(coarse, truncation));
        let most = settle(&cuts, &mut placed, &volume);
        on_step(&FusionStep::Settled { round, of: params.settling_rounds, most });
        if most < SETTLED_PER_VOXEL * params.voxel {
            break;
        }
    }
    let axis = refitted(&axis, &placed)?;
    upright(&mut placed, &axis, &survey)?;
    let axis = refitted(&survey.axis, &placed)?;
    let loops = loop_residual(&cuts, &placed, &axis, coarse, truncation);
    on_step(&FusionStep::Placed { poses: poses(&placed) });
    drop(volume);
    let has_color = cuts.iter().any(|c| !c.view.colors.is_empty());
    let volume = if has_color { Volume::colored } else { Volume::new }(params.voxel, params.truncation);
    let volume = integrated(&cuts, &placed, volume);
    on_step(&FusionStep::Integrated { so_far: SurfaceSoFar::of(&volume) });
    let surface = volume.surface(params.least_evidence);
    if surface.faces.is_empty() {
        return Err(FusionError::NoSurface { count: placed.len() });
    }
    on_step(&FusionStep::Extracted { faces: surface.faces.len() });
    let report = Registration { cuts: &cuts, placed: &placed, lost: &lost, axis, drift, loops }.report(&frames);
    say(&report, &mut findings);
    let surface: FusedSurface = mend::repaired(surface, params, &mut findings);
    Ok(Fusion::of(surface, has_color, report, findings))
}

/// Segments all frames that show the person, without duplicate frames.
fn cut_all(
    frames: &Frames,
    survey: &SceneSurvey,
    findings: &mut Vec<String>,
) -> Result<Vec<SegmentedFrame>, FusionError> {
    let trouble = frames.color_trouble()?;
    let cuts: Vec<Result<Option<SegmentedFrame>, FusionError>> = (0..frames.count())
        .into_par_iter()
        .map(|frame| {
            if frames.is_duplicate(frame) {
                return Ok(None);
            }
            let depth = frames.depth(frame)?;
            let color = frames.color(frame)?;
            let view = cut_out(survey, &depth.depth, color.as_ref());
            Ok(view.map(|view| SegmentedFrame { frame, secs: frames.secs(frame), view }))
        })
        .collect();
    // Report the first bad frame, not the one that was read first.
    let cuts: Vec<Option<SegmentedFrame>> = cuts.into_iter().collect::<Result<_, FusionError>>()?;
    let twice = (0..frames.count()).filter(|&k| frames.is_duplicate(k)).count();
    let cuts: Vec<SegmentedFrame> = cuts.into_iter().flatten().collect();
    let empty = frames.count() - cuts.len() - twice;
    findings.extend(trouble);
    if twice > 0 {
        findings.push(format!("skipped {} identical to the previous frame", counted(twice, "frame")));
    }
    if empty > 0 {
        findings.push(format!("skipped {} without a person", counted(empty, "frame")));
    }
    if cuts.len() < LEAST_FRAMES {
        return Err(FusionError::NobodyInView { name: frames.name(0).into(), likely: frames.likely_scale() });
    }
    Ok(cuts)
}

fn poses(placed: &[Placed]) -> Vec<Isometry3<f64>> {
    placed.iter().map(|p| p.pose).collect()
}

fn refuse_if_lost(
    frames: &Frames,
    cuts: &[SegmentedFrame],
    placed: &[Placed],
    lost: &[usize],
) -> Result<(), FusionError> {
    let Some(&first) = lost.first() else { return Ok(()) };
    if lost.len() as f64 > MOST_LOST * cuts.len() as f64 || placed.len() < LEAST_FRAMES {
        let name = frames.name(cuts[first].frame).into();
        return Err(FusionError::NoOverlap { name, lost: lost.len(), count: cuts.len() });
    }
    Ok(())
}

fn refuse_if_still(axis: &Axis, placed: &[Placed]) -> Result<(), FusionError> {
    match turned(axis, placed) < LEAST_TURN {
        true => Err(no_turn(axis, placed)),
        false => Ok(()),
    }
}

/// The axis of the poses near `axis`; an error if they do not determine one.
fn refitted(axis: &Axis, placed: &[Placed]) -> Result<Axis, FusionError> {
    axis.fitted(&poses(placed)).ok_or_else(|| no_turn(axis, placed))
}

fn no_turn(axis: &Axis, placed: &[Placed]) -> FusionError {
    FusionError::NoTurn { count: placed.len(), turned_deg: turned(axis, placed).to_degrees() }
}

/// The range of headings, in radians.
fn turned(axis: &Axis, placed: &[Placed]) -> f64 {
    let headings = axis.headings(&poses(placed));
    let (low, high) = headings.iter().fold((0.0f64, 0.0f64), |(l, h), &a| (l.min(a), h.max(a)));
    high - low
}

/// Moves the model so that its axis is +Y through the origin; an error if the axis does not point up at all.
fn upright(placed: &mut [Placed], axis: &Axis, survey: &SceneSurvey) -> Result<(), FusionError> {
    let rotation = nalgebra::UnitQuaternion::rotation_between(&axis.direction, &survey.axis.direction);
    let rotation = rotation.filter(|_| axis.direction.y > 0.0).ok_or_else(|| no_turn(axis, placed))?;
    // At the height of 1 m, where the axis is most accurate.
    let at = axis.point + axis.direction.into_inner() * ((1.0 - axis.point.y) / axis.direction.y);
    let shift = Point::new(0.0, at.y, 0.0) - rotation * at;
    let motion = Isometry3::from_parts(shift.into(), rotation);
    for p in placed {
        p.pose = motion * p.pose;
    }
    Ok(())
}

/// The registered frames, as far as the report describes them.
struct Registration<'a> {
    cuts: &'a [SegmentedFrame],
    placed: &'a [Placed],
    lost: &'a [usize],
    axis: Axis,
    /// Disagreement of frames a turn apart after tracking.
    drift: Closure,
    /// Their disagreement with the final poses.
    loops: Closure,
}

impl Registration<'_> {
    fn report(&self, frames: &Frames) -> FusionReport {
        let Self { cuts, placed, lost, axis, drift, loops } = self;
        let unsteadiness = axis.unsteadiness(&poses(placed), &Point::new(0.0, 1.0, 0.0));
        let headings = axis.headings(&poses(placed));
        let (low, high) = headings.iter().fold((0.0f64, 0.0f64), |(l, h), &a| (l.min(a), h.max(a)));
        let mut residuals: Vec<f64> = placed.iter().map(|p| p.residual).collect();
        residuals.sort_by(f64::total_cmp);
        // A turn of n evenly spread frames is one step longer than the angle between the first and the last.
        let step = (high - low) / (placed.len() - 1).max(1) as f64;
        FusionReport {
            frames: frames.count(),
            lost: lost.iter().map(|&k| frames.name(cuts[k].frame).to_string()).collect(),
            poses: placed
                .iter()
                .map(|p| FramePose { frame: cuts[p.cut].frame, secs: cuts[p.cut].secs, model_from_camera: p.pose })
                .collect(),
            turns: (high - low + step) / TAU,
            residual_mm: 1e3 * residuals[residuals.len() / 2],
            drift_mm: 1e3 * drift.shift,
            drift_deg: drift.turn.to_degrees(),
            loops: loops.loops,
            loop_mm: 1e3 * loops.shift,
            loop_deg: loops.turn.to_degrees(),
            sway_mm: 1e3 * unsteadiness.shift,
            sway_deg: unsteadiness.tilt.to_degrees(),
        }
    }
}

/// Adds the report to the findings, one sentence per observation.
fn say(report: &FusionReport, findings: &mut Vec<String>) {
    /// Sway above this comes from the person, not from the sensor, in millimetres.
    const SWAY: f64 = 3.0;
    findings.push(format!(
        "fused {} of {} frames over {:.2} turns, with a residual of {:.1} mm",
        report.poses.len(),
        report.frames,
        report.turns,
        report.residual_mm
    ));
    if !report.lost.is_empty() {
        findings.push(format!(
            "skipped {} that could not be tracked; the first is {}",
            counted(report.lost.len(), "frame"),
            report.lost[0]
        ));
    }
    if report.loops > 0 {
        findings.push(format!(
            "the loop closes within {:.1} mm and {:.2}° (drift of the tracking: {:.1} mm and {:.2}°)",
            report.loop_mm, report.loop_deg, report.drift_mm, report.drift_deg
        ));
    }
    if report.turns < 0.9 {
        findings.push(format!(
            "this is a partial scan: the person turned by only {:.0}°, so the far side was not seen",
            360.0 * report.turns
        ));
    }
    if report.sway_mm > SWAY {
        findings.push(format!(
            "the person swayed by {:.0} mm and {:.1}° (root mean square) about the axis; moving parts are averaged",
            report.sway_mm, report.sway_deg
        ));
    }
}
