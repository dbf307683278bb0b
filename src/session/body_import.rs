//! Body models of other makers, brought into our layout. Needs no session.

use super::body_build::write_model;
use super::body_model::read_body_model;
use super::{SessionError, source};
use crate::body::BodyModel;
use crate::train::{MakeHumanFiles, MakeHumanParams, Step, import_makehuman};
use std::path::{Path, PathBuf};

/// A model that was imported.
pub struct ImportedBody {
    /// The model.
    pub model: BodyModel,
    /// Whose it was.
    pub maker: &'static str,
    /// What was assumed, a sentence each.
    pub findings: Vec<String>,
}

/// Reads a model: an `.npz` of the SMPL family, or a folder with MakeHuman's base mesh, rig, weights and targets.
pub fn import_body(
    path: &Path,
    params: &MakeHumanParams,
    on_step: &mut dyn FnMut(&Step),
) -> Result<ImportedBody, SessionError> {
    if !path.is_dir() {
        let model = read_body_model(Some(path))?;
        let corrective = if model.pose_dirs.is_some() { ", corrective offsets by pose" } else { "" };
        let findings =
            vec![format!("{} shape components{corrective}; four weights a vertex are kept", model.component_count())];
        return Ok(ImportedBody { model, maker: "SMPL family", findings });
    }
    let files = makehuman_files(path)?;
    let targets = files.targets.len();
    let trained = import_makehuman(&files, params, on_step).map_err(|e| SessionError::bad_source(path, e))?;
    let held = 100.0 * trained.explained.last().copied().unwrap_or(0.0);
    let findings = vec![
        format!(
            "{} bodies sampled from {targets} macro targets; the components hold {held:.1} % of their variance",
            trained.bodies
        ),
        "the targets say nothing of stature, so bodies are scaled by 3.9 % (one deviation of adults of one sex)".into(),
        "finger bones move with the hand, twist bones with the bone that they belong to".into(),
    ];
    Ok(ImportedBody { model: trained.model, maker: "MakeHuman", findings })
}

impl ImportedBody {
    /// Writes the model, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), SessionError> {
        write_model(&self.model, path)
    }
}

fn makehuman_files(folder: &Path) -> Result<MakeHumanFiles, SessionError> {
    let text = |path: PathBuf| -> Result<String, SessionError> {
        let bytes = source::read(&path)?;
        String::from_utf8(bytes).map_err(|_| SessionError::BadFile {
            path,
            line: None,
            reason: "it is not text".into(),
            hint: "give MakeHuman's own file, not a compiled one (.npz, .mhm)".into(),
        })
    };
    let below = folder.join("targets").join("macrodetails");
    let mut paths = Vec::new();
    let entries = std::fs::read_dir(&below).map_err(|e| SessionError::reading(&below, e))?;
    for path in entries.flatten().map(|e| e.path()) {
        if path.extension().is_some_and(|e| e == "target") {
            paths.push(path);
        }
    }
    paths.sort();
    let mut targets = Vec::new();
    for path in paths {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        targets.push((name, text(path)?));
    }
    Ok(MakeHumanFiles {
        base: text(folder.join("base.obj"))?,
        skeleton: text(folder.join("default.mhskel"))?,
        weights: text(folder.join("default_weights.mhw"))?,
        targets,
    })
}
