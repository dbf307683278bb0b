//! Scan: converts the file's bytes, or a recording's frames, to a cleaned scan.

use crate::formats::{RawMesh, read_recording};
use crate::scan::{
    CleaningStep, FramePose, FusionParams, FusionReport, FusionStep, Photograph, Scan, ScanParams, clean,
    color_from_texture, fuse, photographs,
};
use crate::session::error::SessionError;
use crate::session::open::{Input, ScanInput, Session};
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::FileInput;
use crate::session::recipe::{Reading, StepRecipe};
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Store, Warning};
use serde::Serialize;
use serde_json::json;
use std::path::Path;
use std::time::Instant;

pub(in crate::session::pipeline) const SCAN: Code = Code::new(Stage::Scan, 6);

#[derive(Clone, Serialize)]
pub(in crate::session) struct Inputs {
    file: FileInput,
    params: ScanParams,
    fusion: FusionParams,
}

impl Inputs {
    pub fn of(session: &Session, reading: Reading) -> Self {
        Self { file: FileInput::of(session, &reading.file), params: reading.scan, fusion: reading.fusion }
    }

    /// Whether the file holds no recording, as far as its name says.
    pub fn is_mesh(&self) -> bool {
        self.file.path().extension().is_some_and(|extension| extension != "zip")
    }
}

pub(in crate::session::pipeline) fn run(inputs: Inputs, store: &Store, on_progress: OnProgress) -> Run<Scan> {
    let input = inputs.file.open(store)?;
    let ReadScan { scan, fusion, findings, warnings } = read(&inputs, &input, on_progress)?;
    // Store a copy once the file is known to be valid. It also holds what textures are baked from later: the full
    // mesh with its coordinates, and the pictures as they are.
    inputs.file.keep(&input, store)?;
    if let Some(report) = &fusion {
        keep_poses(&inputs, &report.poses, store)?;
    }
    let (vertices, faces) = (scan.mesh.vertex_count(), scan.mesh.face_count());
    let findings: Vec<String> = scan.findings.iter().cloned().chain(findings).collect();
    let outcome = Outcome::of(scan).measured("vertices", vertices as f64).measured("faces", faces as f64);
    Ok(match fusion {
        Some(report) => measured(outcome, &report),
        None => outcome,
    }
    .found(findings)
    .warned(warnings))
}

/// Name of the camera poses of a recording, and what they depend on.
fn poses_key(inputs: &Inputs) -> Result<(String, ContentHash), SessionError> {
    let values = serde_json::to_value(inputs).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
    let hash = ContentHash::of_json(&json!({ "poses": 1, "inputs": values }));
    Ok((format!("{}.poses", hash.short()), hash))
}

fn keep_poses(inputs: &Inputs, poses: &[FramePose], store: &Store) -> Result<(), SessionError> {
    let (name, hash) = poses_key(inputs)?;
    store.derived().keep(&name, hash, &poses);
    Ok(())
}

/// The colour images of a scan's recording and where they were taken; `None` for a mesh. If their poses were not kept, the
/// frames are fused again.
pub(in crate::session) fn photographs_of(
    inputs: &Inputs,
    store: &Store,
) -> Result<Option<Vec<Photograph>>, SessionError> {
    let Inputs { file, fusion, .. } = inputs;
    let input = file.open(store)?;
    let ScanInput::Frames(zip) = input.scan(file.path())? else { return Ok(None) };
    let recording = read_recording(&zip).map_err(|e| file.fault(e))?;
    if recording.frames.iter().all(|frame| frame.color.is_none()) {
        return Ok(Some(Vec::new()));
    }
    let (name, hash) = poses_key(inputs)?;
    let poses: Vec<FramePose> = match store.derived().load(&name, hash) {
        Some(kept) => kept,
        None => {
            let fused = fuse(&recording, fusion, &mut |_| {}).map_err(|e| file.fault(e))?;
            store.derived().keep(&name, hash, &fused.report.poses);
            fused.report.poses
        }
    };
    photographs(&recording, &poses).map(Some).map_err(|e| file.fault(e))
}

/// A scan as read from its input.
struct ReadScan {
    scan: Scan,
    fusion: Option<FusionReport>,
    findings: Vec<String>,
    warnings: Vec<Warning>,
}

fn measured<T>(outcome: Outcome<T>, report: &FusionReport) -> Outcome<T> {
    let outcome = outcome
        .measured("frames", report.poses.len() as f64)
        .measured("turns", report.turns)
        .measured("residual_mm", report.residual_mm)
        .measured("sway_mm", report.sway_mm);
    if report.loops == 0 {
        return outcome;
    }
    outcome.measured("loop_mm", report.loop_mm).measured("loop_deg", report.loop_deg)
}

fn read(inputs: &Inputs, input: &Input, on_progress: OnProgress) -> Result<ReadScan, SessionError> {
    let Inputs { file, params, fusion } = inputs;
    let zip = match input.scan(file.path())? {
        ScanInput::Mesh(raw) => return read_mesh(inputs, *raw, on_progress),
        ScanInput::Frames(zip) => zip,
    };
    let began = Instant::now();
    let recording = read_recording(&zip).map_err(|e| file.fault(e))?;
    let fused = fuse(&recording, fusion, &mut |step| {
        on_progress(StageProgress::Text(&in_words(step, &began)));
        on_progress(StageProgress::Fusion(step));
    })
    .map_err(|e| file.fault(e))?;
    let mut scan = clean(&fused.mesh, params, &mut in_progress(on_progress)).map_err(|e| file.fault(e))?;
    scan.findings = fused.findings.into_iter().chain(scan.findings).collect();
    let has_pictures = recording.frames.iter().any(|frame| frame.color.is_some());
    let warnings = match has_pictures && scan.colors.is_none() {
        true => vec![Warning::new(
            "the frames have colour images, but the scan has no colours",
            "describe the colour camera under 'color' in camera.json, or register its images to the depth",
        )],
        false => Vec::new(),
    };
    Ok(ReadScan { scan, fusion: Some(fused.report), findings: Vec::new(), warnings })
}

fn read_mesh(inputs: &Inputs, mut raw: RawMesh, on_progress: OnProgress) -> Result<ReadScan, SessionError> {
    let texture = color_from_texture(&mut raw, &mut in_progress(on_progress)).unwrap_or_default();
    let doubts = raw.unread.iter().chain(&texture.doubts);
    let warnings = doubts.map(|part| Warning::new(&part.what, &part.remedy)).collect();
    let scan = clean(&raw, &inputs.params, &mut in_progress(on_progress));
    let scan = scan.map_err(|e| inputs.file.fault(e))?;
    let findings = texture.findings.into_iter().chain(raw.notes).collect();
    Ok(ReadScan { scan, fusion: None, findings, warnings })
}

fn in_progress(on_progress: OnProgress) -> impl FnMut(&CleaningStep) {
    |s| on_progress(StageProgress::Text(&format!("{} ({} faces)", s.name, s.faces)))
}

/// The cleaned scan of a step, computed here and not stored.
pub(in crate::session) fn cleaned_scan(step: &StepRecipe, path: &Path, input: &Input) -> Result<Scan, SessionError> {
    let file = FileInput::at(path.to_path_buf(), None);
    let Reading { scan, fusion, .. } = step.reading()?;
    let inputs = Inputs { file, params: scan, fusion };
    read(&inputs, input, &mut |_| {}).map(|read| read.scan)
}

/// A step of the fusion in words.
fn in_words(step: &FusionStep, began: &Instant) -> String {
    match step {
        FusionStep::Surveyed => "floor and walls found".into(),
        FusionStep::CutOut { frames } => format!("person cut out of {frames} frames"),
        FusionStep::Tracked { frame, of, residual, .. } => {
            let rate = (frame + 1) as f64 / began.elapsed().as_secs_f64().max(1e-3);
            let found = residual.map_or("lost".into(), |r| format!("{:.1} mm", 1e3 * r));
            format!("frame {} of {of} ({found}, {rate:.0} frames/s)", frame + 1)
        }
        FusionStep::Closed { loops } => format!("loop closed at {loops} places"),
        FusionStep::Settled { round, of, most } => {
            format!("round {} of {of}: frames moved by up to {:.1} mm", round + 1, 1e3 * most)
        }
        FusionStep::Placed { .. } => "all camera poses are final".into(),
        FusionStep::Integrated { .. } => "all frames fused".into(),
        FusionStep::Extracted { faces } => format!("surface of {faces} faces"),
    }
}
