//! Scans registered by one template: each becomes a body of the template's topology, in its bind pose.

use super::{Step, TrainError};
use crate::body::BodyModel;
use crate::fit::{NakedParams, RegisterParams, fit_naked, register};
use crate::formats::RawMesh;
use crate::geometry::TriMesh;
use crate::scan::{ScanParams, clean};

/// A scan's body.
#[derive(Clone, Debug)]
pub struct ScannedBody {
    /// The template's vertices on the scan, in the template's bind pose.
    pub surface: TriMesh,
    /// Mean distance of the registered surface to the scan, metres.
    pub residual: f64,
}

/// Fits the template's model to each scan, moves it onto the scan, and carries it into the bind pose.
///
/// **Errors** the first scan that is none, or to which no body fits, by its name.
pub fn registered_bodies(
    scans: &[(String, RawMesh)],
    model: &BodyModel,
    params: &ScanParams,
    on_step: &mut dyn FnMut(&Step),
) -> Result<Vec<(String, ScannedBody)>, TrainError> {
    let mut bodies = Vec::with_capacity(scans.len());
    for (done, (name, raw)) in scans.iter().enumerate() {
        on_step(&Step { doing: "registering", done, total: scans.len() });
        let scan = clean(raw, params, &mut |_| {})
            .map_err(|e| TrainError::NotAScan { name: name.clone(), source: Box::new(e) })?;
        let failed = |source| TrainError::NotABody { name: name.clone(), source };
        let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {}).map_err(failed)?;
        let registered = register(&scan, model, &fitted, &RegisterParams::default(), &mut |_| {}).map_err(failed)?;
        let residual = registered.report.residual_mean;
        bodies.push((name.clone(), ScannedBody { surface: registered.surface, residual }));
    }
    Ok(bodies)
}
