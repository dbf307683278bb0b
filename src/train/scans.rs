//! Registers scans with one template: each becomes a body of the template's topology, in its bind pose.

use super::error::TrainError;
use super::progress::TrainingProgress;
use crate::body::BodyModel;
use crate::fit::{NakedParams, RegisterHints, RegisterParams, fit_naked, register_with_hints};
use crate::formats::RawMesh;
use crate::geometry::{Point, TriMesh, VertexId, self_intersecting_pairs};
use crate::scan::{ScanParams, clean};

/// A scan with landmarks.
#[derive(Clone, Debug)]
pub struct ScanToRegister {
    /// Its name in messages.
    pub name: String,
    /// The scan.
    pub mesh: RawMesh,
    /// Landmarks: vertices of the template and their positions in the frame and unit of the mesh; may be empty.
    pub landmarks: Vec<(VertexId, Point)>,
}

/// A scan's body.
#[derive(Clone, Debug)]
pub struct ScannedBody {
    /// The template's vertices on the scan, in the template's bind pose.
    pub surface: TriMesh,
    /// Mean distance of the registered surface to the scan, metres.
    pub residual: f64,
    /// Pairs of triangles of the surface that cross.
    pub crossing: usize,
}

/// Fits the template's model to each scan, moves it onto the scan, and unposes it into the bind pose.
///
/// **Errors** name the first mesh that is not a scan of a person, or to which no body fits.
pub fn registered_bodies(
    scans: &[ScanToRegister],
    model: &BodyModel,
    params: &ScanParams,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<Vec<(String, ScannedBody)>, TrainError> {
    let mut bodies = Vec::with_capacity(scans.len());
    let vertices = model.template.vertex_count();
    for ScanToRegister { name, landmarks, .. } in scans {
        if let Some((v, _)) = landmarks.iter().find(|(v, _)| v.index() >= vertices) {
            return Err(TrainError::NoSuchLandmark { name: name.clone(), vertex: v.0, vertices });
        }
    }
    for (done, ScanToRegister { name, mesh: raw, landmarks }) in scans.iter().enumerate() {
        on_step(&TrainingProgress { doing: "registering", done, total: scans.len() });
        let scan = clean(raw, params, &mut |_| {})
            .map_err(|e| TrainError::NotAScan { name: name.clone(), source: Box::new(e) })?;
        let failed = |source| TrainError::NotABody { name: name.clone(), source };
        let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {}).map_err(failed)?;
        let landmarks: Vec<(VertexId, Point)> =
            landmarks.iter().map(|(v, p)| (*v, scan.world_from_file.world_from_file(p))).collect();
        let params = RegisterParams::default();
        let hints = RegisterHints { landmarks: &landmarks, ..RegisterHints::default() };
        let registered = register_with_hints(&scan, model, &fitted, &hints, &params, &mut |_| {}).map_err(failed)?;
        let residual = registered.report.residual_mean;
        let crossing = self_intersecting_pairs(&registered.surface).len();
        bodies.push((name.clone(), ScannedBody { surface: registered.surface, residual, crossing }));
    }
    Ok(bodies)
}
