//! Adds a scan to a session. The scan is read and cleaned at once, so that a bad file is reported before anything
//! changes.

use crate::parameters::Settings;
use crate::scan::{Unit, Up};
use crate::session::error::SessionError;
use crate::session::open::{Input, Session, Writer, source};
use crate::session::recipe::{BodySurface, StepRecipe};
use crate::session::results::ScanRecording;
use crate::session::results::ShowIn;
use crate::session::stage::Stage;
use crate::session::stages::{Event, Forced, StageReport, Walk, scan_of};
use std::path::PathBuf;

/// A scan to be added.
#[derive(Clone, Debug, Default)]
pub struct NewScan {
    /// `body`, or the garment's name.
    pub name: String,
    /// The file, or the folder of RGB-D frames.
    pub file: PathBuf,
    /// The garment kind.
    pub template: Option<String>,
    /// Unit of the file; guessed if `None`.
    pub unit: Option<Unit>,
    /// Up axis of the file; guessed if `None`.
    pub up: Option<Up>,
    /// Approximate number of faces of the cleaned scan.
    pub faces: Option<usize>,
    /// The surface that becomes the figure's body; for the body's step only.
    pub surface: Option<BodySurface>,
    /// Voxel size of the fusion of RGB-D frames, in millimetres.
    pub voxel_mm: Option<f64>,
    /// Parameters of reading the scan that differ from the defaults.
    pub reading: Settings,
    /// Parameters of the naked fit that differ from the defaults; for the body's step only.
    pub fitting: Settings,
    /// Where the garment ends.
    pub until: Option<String>,
    /// Where its sleeves end.
    pub sleeve: Option<String>,
    /// Target of the recording of the fusion of RGB-D frames.
    pub view: Option<ShowIn>,
    /// Whether the recording may replace a file of the user.
    pub force: bool,
    /// Whether to replace the step of that name.
    pub replace: bool,
}

impl Writer {
    /// Adds a scan as the next step. On an error the session is unchanged.
    pub fn add_scan(&mut self, new: &NewScan, on_event: &mut dyn FnMut(&Event)) -> Result<StageReport, SessionError> {
        // Masks are anchored in space, so they also apply to another mesh of the same person.
        let masks = self.session.recipe.step(&new.name).map(|old| old.masks.clone()).unwrap_or_default();
        let mut step = StepRecipe {
            name: new.name.clone(),
            scan: String::new(),
            hash: None,
            template: new.template.clone(),
            unit: new.unit,
            up: new.up,
            faces: new.faces,
            surface: new.surface,
            voxel_mm: new.voxel_mm,
            reading: new.reading.clone(),
            fit: new.fitting.clone(),
            until: new.until.clone(),
            sleeve: new.sleeve.clone(),
            masks,
            ..StepRecipe::default()
        };
        let mut recipe = self.session.recipe.clone();
        recipe.put_step(step.clone(), new.replace)?;
        step = recipe.step(&new.name)?.clone();
        if step.template.is_some() {
            recipe.garment_of(&step)?;
        }
        let mut recording = recording_of(new, &self.session)?;
        let hash = Input::at(&new.file)?.hash()?;
        let named = source::named(self.session.dir(), &new.file, hash)?;
        (step.scan, step.hash) = (named.file, named.hash);
        self.session.recipe.put_step(step.clone(), new.replace)?;
        let (change, forced) = (change_of(new), forced_by(new));
        let mut watched = |event: &Event| {
            if let (Some(recording), Event::Fused { at, .. }) = (&mut recording, event) {
                recording.see(at);
            }
            on_event(event);
        };
        let resolved = self.session.resolve(&step.scan);
        let mut walk = Walk::make(self, &change, &forced, &mut watched);
        scan_of(&mut walk, &step).map_err(|e| match e {
            SessionError::BadSource { path, source } if path == resolved => {
                SessionError::BadSource { path: new.file.clone(), source }
            }
            other => other,
        })?;
        let report = walk.into_reports().pop();
        // If this very scan exists already, only the recipe changes.
        self.save(&change)?;
        if let Some(recording) = recording {
            recording.finish(report.as_ref().map_or(&[], |r| r.findings.as_slice()))?;
        }
        report.ok_or(SessionError::NotBuilt { step: new.name.clone(), stage: Stage::Scan })
    }
}

/// The requested recording; a mesh has nothing to show.
fn recording_of(new: &NewScan, session: &Session) -> Result<Option<ScanRecording>, SessionError> {
    let Some(to) = &new.view else { return Ok(None) };
    if !new.file.is_dir() {
        return Err(SessionError::BadRequest {
            what: format!("'{}' is not a folder of RGB-D frames, so there is nothing to show", new.file.display()),
            hint: "omit --view; `overcoat view --save OUT.rrd` records the result of a scan".into(),
        });
    }
    let mut outputs = session.outputs(new.force);
    outputs.protect(&new.file, "is in the folder of the frames");
    ScanRecording::try_new(&new.name, to, outputs).map(Some)
}

/// A stage that is to be recorded must run, even if it is up to date.
fn forced_by(new: &NewScan) -> Forced {
    match new.view {
        Some(_) => Forced::Named(vec![(new.name.clone(), Some(Stage::Scan))]),
        None => Forced::Nothing,
    }
}

/// The change in words.
fn change_of(new: &NewScan) -> String {
    let file = new.file.file_name().unwrap_or_default().to_string_lossy();
    let replaced = if new.replace { ", replaced" } else { "" };
    format!("scan {} {file}{replaced}", new.name)
}
