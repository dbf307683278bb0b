//! Builds a body model from meshes of one topology or from scans.

use super::error::TrainError;
use super::inputs::TrainInputs;
use super::learn::{Trained, train};
use super::leave_out::split;
use super::params::TrainParams;
use super::progress::TrainingProgress;
use super::rig::Rig;
use super::scans::{ScanToRegister, registered_bodies};
use super::subjects::Subjects;
use crate::body::BodyModel;
use crate::formats::RawMesh;
use crate::geometry::{Point, TriMesh};
use crate::scan::{ScanParams, Unit, Up, clean};

/// How a model is built.
#[derive(Clone, Debug, Default)]
pub struct BuildParams {
    /// Register the template to every mesh, as to a scan.
    pub register: bool,
    /// The unit of the meshes; `None` to guess it.
    pub unit: Option<Unit>,
    /// The upward axis of the meshes; `None` to guess it.
    pub up: Option<Up>,
    /// The training.
    pub train: TrainParams,
}

/// Brings the bodies into one topology and trains a model on them. Returns the model and the assumptions, one sentence
/// each.
///
/// **Errors** where there are too few bodies, or one of them cannot be used.
pub fn build_model(
    inputs: TrainInputs,
    template: &BodyModel,
    params: &BuildParams,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<(Trained, Vec<String>), TrainError> {
    params.train.check(inputs.len())?;
    let (subjects, rig, train_params, findings) = if params.register {
        from_scans(inputs, template, params, on_step)
    } else {
        from_meshes(inputs, template, params)
    }?;
    let trained = train(&subjects, &rig, &train_params, on_step)?;
    Ok((trained, findings))
}

type Learnable = (Subjects, Rig, TrainParams, Vec<String>);

/// Meshes of one topology, used as they are.
fn from_meshes(inputs: TrainInputs, template: &BodyModel, params: &BuildParams) -> Result<Learnable, TrainError> {
    let mut findings = inputs.findings;
    let meshes = meshes_of(&inputs.meshes)?;
    let subjects = Subjects::try_new(&meshes, inputs.joints)?;
    let (name, first) = &inputs.meshes[0];
    let scan_params = ScanParams {
        unit: params.unit,
        up: params.up,
        faces: usize::MAX,
        smoothing_passes: 0,
        ..ScanParams::default()
    };
    let frame = clean(first, &scan_params, &mut |_| {})
        .map_err(|e| TrainError::NotAScan { name: name.clone(), source: Box::new(e) })?;
    findings.extend(frame.findings.iter().cloned());
    let subjects = subjects.map_points(|p| frame.world_from_file.world_from_file(p)).stood_alike();
    let is_ours = meshes[0].1.faces() == template.template.faces();
    let (kept, _) = split(subjects.bodies.len(), params.train.leave_out);
    let (subjects, rig) = if is_ours {
        findings.push("the meshes have the template's own topology: its joints and weights are kept".into());
        (subjects, Rig::of_model(template))
    } else {
        findings.push("joints and weights are those of the template, moved onto the mean of the bodies".into());
        if template.weights.has_pose_offsets() {
            findings.push("the template's corrective offsets by pose hold for its own vertices and bind pose only, and are left out".into());
        }
        Rig::for_subjects(subjects, &kept, template)?
    };
    Ok((subjects, rig, params.train.clone(), findings))
}

/// Scans: the template is registered to each.
fn from_scans(
    inputs: TrainInputs,
    template: &BodyModel,
    params: &BuildParams,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<Learnable, TrainError> {
    let scan_params = ScanParams { unit: params.unit, up: params.up, ..ScanParams::default() };
    let scans: Vec<ScanToRegister> = inputs
        .meshes
        .into_iter()
        .zip(inputs.landmarks)
        .map(|((name, mesh), landmarks)| ScanToRegister { name, mesh, landmarks })
        .collect();
    let scanned = registered_bodies(&scans, template, &scan_params, on_step)?;
    let findings = scanned
        .iter()
        .zip(&scans)
        .map(|((name, body), scan)| {
            let by = match scan.landmarks.len() {
                0 => String::new(),
                1 => ", by 1 landmark".into(),
                n => format!(", by {n} landmarks"),
            };
            let crossing = match body.crossing {
                0 => String::new(),
                n => format!("; {n} pairs of its triangles cross"),
            };
            format!("{name}: the template lies {:.1} mm off the scan{by}{crossing}", body.residual * 1e3)
        })
        .collect();
    let meshes: Vec<(String, TriMesh)> = scanned.into_iter().map(|(name, body)| (name, body.surface)).collect();
    let subjects = Subjects::try_new(&meshes, None)?;
    // Registered surfaces are in the bind pose already.
    Ok((subjects, Rig::of_model(template), TrainParams { unpose: false, ..params.train.clone() }, findings))
}

fn meshes_of(raw: &[(String, RawMesh)]) -> Result<Vec<(String, TriMesh)>, TrainError> {
    raw.iter()
        .map(|(name, raw)| {
            let points = raw.points.iter().copied().map(Point::from).collect();
            let mesh = TriMesh::try_from_indices(points, &raw.faces);
            mesh.map(|m| (name.clone(), m))
                .map_err(|e| TrainError::NotAMesh { name: name.clone(), reason: e.to_string() })
        })
        .collect()
}
