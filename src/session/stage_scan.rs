//! Scan: the file's bytes to a cleaned scan.

use super::{SessionError, StageError};
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Walk};
use crate::formats::{MeshKind, RawMesh, read_mesh};
use crate::scan::Scan;
use serde_json::json;
use std::path::Path;

pub(super) fn scan(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    let kind = Path::new(&step.scan.file).extension().map(|e| e.to_string_lossy().to_lowercase());
    let inputs = json!({ "file": step.scan.hash, "kind": kind, "unit": step.unit, "up": step.up, "faces": step.faces });
    walk.stage(&step.name, Stage::Scan, inputs, |session, _tell| {
        let path = session.resolve(&step.scan.file);
        let bytes = session.source_bytes(&step.scan)?;
        let scan = read(&path, &bytes, step).map_err(|e| SessionError::BadSource { path, source: Box::new(e) })?;
        // A copy is kept once the file is known to be good.
        session.store.keep_bytes(&bytes)?;
        let (vertices, faces) = (scan.mesh.vertex_count(), scan.mesh.face_count());
        let findings = scan.findings.clone();
        Ok(Outcome::of(scan).measured("vertices", vertices as f64).measured("faces", faces as f64).found(findings))
    })
}

fn read(path: &Path, bytes: &[u8], _step: &StepRecipe) -> Result<Scan, StageError> {
    let _raw = raw_mesh(path, bytes)?;
    Err(StageError::NotAvailable)
}

/// What the file holds.
pub(super) fn raw_mesh(path: &Path, bytes: &[u8]) -> Result<RawMesh, StageError> {
    let extension = path.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(read_mesh(MeshKind::from_extension(&extension)?, bytes)?)
}
