//! Builds a body model from the files of many bodies: meshes of one topology, or scans.

use super::error::BodiesError;
use crate::body::{BodyModel, ModelLicense};
use crate::formats::{FormatError, MeshKind, NpzCompression, read_npz, write_npz};
use crate::geometry::{Point, VertexId};
use crate::session::{Content, Outputs, read_body_model, read_input, read_mesh_file};
use crate::train::{BuildParams, TrainInputs, Trained, TrainingProgress, build_model};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The request to build a model.
#[derive(Clone, Debug, Default)]
pub struct BuildBody {
    /// Mesh files, folders of them, or `.npz` files with `vertices (N,V,3)` and `faces (F,3)`, and optionally
    /// `joints (N,J,3)` with `joint_names (J)`. Next to a scan `NAME.ply` there may be `NAME.landmarks.json`: vertices
    /// of the template, and their positions in the scan.
    pub inputs: Vec<PathBuf>,
    /// The model that provides joints and weights, or that is registered to scans; `None` for the embedded one.
    pub template: Option<PathBuf>,
    /// Units, axes and training.
    pub params: BuildParams,
}

/// A trained model.
pub struct BuiltBody {
    /// The model and its measures.
    pub trained: Trained,
    /// That of the template.
    license: ModelLicense,
    /// The assumptions, one sentence each.
    pub findings: Vec<String>,
}

/// Reads the bodies and trains a model on them.
///
/// **Errors** if a file cannot be read, there is no body, or no model can be trained on them.
pub fn build_body(request: &BuildBody, on_step: &mut dyn FnMut(&TrainingProgress)) -> Result<BuiltBody, BodiesError> {
    let template = read_body_model(request.template.as_deref())?;
    let license = request.template.as_deref().map(license_of).transpose()?.unwrap_or_default();
    let mut inputs = TrainInputs::default();
    for path in files(&request.inputs)? {
        read_bodies(&path, &mut inputs)?;
    }
    if inputs.is_empty() {
        return Err(no_inputs(&request.inputs));
    }
    let (trained, findings) = build_model(inputs, &template, &request.params, on_step)
        .map_err(|e| BodiesError::bad_source(&common_name(&request.inputs), e))?;
    Ok(BuiltBody { trained, license, findings })
}

impl BuiltBody {
    /// Writes the model atomically.
    pub fn write(&self, path: &Path, outputs: &mut Outputs) -> Result<(), BodiesError> {
        write_model(&self.trained.model, &self.license, path, outputs)
    }
}

/// The licence that a model's file states.
pub(super) fn license_of(path: &Path) -> Result<ModelLicense, BodiesError> {
    ModelLicense::read(Cursor::new(read_input(path)?)).map_err(|e| BodiesError::bad_source(path, e))
}

/// Writes a model as an `.npz` in the SMPL layout.
pub(super) fn write_model(
    model: &BodyModel,
    license: &ModelLicense,
    path: &Path,
    outputs: &mut Outputs,
) -> Result<(), BodiesError> {
    let mut npz = model.to_npz().map_err(|e| BodiesError::bad_source(path, e))?;
    license.insert(&mut npz);
    let mut bytes = Vec::new();
    write_npz(&npz, NpzCompression::Deflated, &mut Cursor::new(&mut bytes))
        .map_err(|e| BodiesError::bad_source(path, e))?;
    Ok(outputs.write_bytes(path, Content::BodyModel, bytes)?)
}

/// Adds the bodies of a file.
fn read_bodies(path: &Path, inputs: &mut TrainInputs) -> Result<(), BodiesError> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz")) {
        let failed = |e: FormatError| BodiesError::bad_source(path, e);
        let npz = read_npz(Cursor::new(read_input(path)?)).map_err(failed)?;
        return inputs.push_stack(&file_name(path), &npz).map_err(failed);
    }
    inputs.push_mesh(file_name(path), read_mesh_file(path)?, landmarks_beside(path)?);
    Ok(())
}

/// `NAME.landmarks.json` next to a mesh: `{"1234": [x, y, z], …}`, a vertex of the template and its position in the mesh.
fn landmarks_beside(mesh: &Path) -> Result<Vec<(VertexId, Point)>, BodiesError> {
    let path = mesh.with_extension("landmarks.json");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let bytes = read_input(&path)?;
    let bad = |reason: String, line| BodiesError::BadFile {
        path: path.clone(),
        line,
        reason,
        hint: "write an object of vertices of the template and their places in the scan: {\"1234\": [0.1, 1.5, 0.2]}"
            .into(),
    };
    let places: BTreeMap<String, [f64; 3]> =
        serde_json::from_slice(&bytes).map_err(|e| bad(e.to_string(), Some(e.line())))?;
    let landmark = |(vertex, place): (String, [f64; 3])| {
        let v: u32 = vertex.parse().map_err(|_| bad(format!("'{vertex}' is no vertex of the template"), None))?;
        Ok((VertexId(v), Point::from(place)))
    };
    places.into_iter().map(landmark).collect()
}

/// All named files; those of a folder in alphabetical order.
fn files(inputs: &[PathBuf]) -> Result<Vec<PathBuf>, BodiesError> {
    let mut all = Vec::new();
    for input in inputs {
        if !input.is_dir() {
            all.push(input.clone());
            continue;
        }
        let entries = std::fs::read_dir(input).map_err(|e| BodiesError::reading(input, e))?;
        let mut found: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| is_body_file(p)).collect();
        if found.is_empty() {
            return Err(no_inputs(std::slice::from_ref(input)));
        }
        found.sort();
        all.extend(found);
    }
    Ok(all)
}

fn is_body_file(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    path.is_file() && (extension == "npz" || MeshKind::from_extension(&extension).is_ok())
}

fn no_inputs(inputs: &[PathBuf]) -> BodiesError {
    BodiesError::BadRequest {
        what: format!("there is no body in '{}'", common_name(inputs).display()),
        hint: "give meshes (ply, obj, glb, stl, off), folders of them, or an .npz with the arrays vertices (N,V,3) and faces (F,3)".into(),
    }
}

fn common_name(inputs: &[PathBuf]) -> PathBuf {
    inputs.first().cloned().unwrap_or_default()
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
