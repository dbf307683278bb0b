//! Scan: the file's bytes to a cleaned scan.

use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Tell, Walk};
use super::{SessionError, StageError};
use crate::formats::{MeshKind, RawMesh, read_mesh};
use crate::scan::{Scan, ScanParams, clean};
use serde_json::json;
use std::path::Path;

pub(super) fn scan(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    let params = params_of(step);
    let kind = Path::new(&step.scan).extension().map(|e| e.to_string_lossy().to_lowercase());
    let inputs = json!({ "file": step.hash, "kind": kind, "params": params });
    walk.stage(&step.name, Stage::Scan, inputs, |session, tell| {
        let path = session.resolve(&step.scan);
        let bytes = session.source_bytes(&step.source())?;
        let scan = read(&path, &bytes, &params, tell).map_err(|e| SessionError::bad_source(&path, e))?;
        // A copy is kept once the file is known to be good.
        session.store.keep_bytes(&bytes)?;
        let (vertices, faces) = (scan.mesh.vertex_count(), scan.mesh.face_count());
        let findings = scan.findings.clone();
        Ok(Outcome::of(scan).measured("vertices", vertices as f64).measured("faces", faces as f64).found(findings))
    })
}

fn params_of(step: &StepRecipe) -> ScanParams {
    let defaults = ScanParams::default();
    ScanParams { unit: step.unit, up: step.up, faces: step.faces.unwrap_or(defaults.faces), ..defaults }
}

fn read(path: &Path, bytes: &[u8], params: &ScanParams, tell: Tell) -> Result<Scan, StageError> {
    let raw = raw_mesh(path, bytes)?;
    Ok(clean(&raw, params, &mut |s| tell(&format!("{} ({} faces)", s.name, s.faces)))?)
}

/// What the file holds.
pub(super) fn raw_mesh(path: &Path, bytes: &[u8]) -> Result<RawMesh, StageError> {
    let extension = path.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(read_mesh(MeshKind::from_extension(&extension)?, bytes)?)
}
