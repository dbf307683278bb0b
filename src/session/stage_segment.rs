//! Segment: which of the scan is the new garment.

use super::flow::Dressed;
use super::parameters::params_of;
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Walk};
use super::{SessionError, garment_kind, masks, worn};
use crate::fit::PoseInside;
use crate::scan::Scan;
use crate::segment::{Inner, Labels, RefineParams, refine};
use serde_json::json;

pub(super) fn segment(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    inner: &Dressed,
    inside: Kept<PoseInside>,
) -> Result<Kept<Labels>, SessionError> {
    let kind = garment_kind::of_step(step)?;
    let params: RefineParams = params_of(step, Stage::Segment)?;
    let mask_files: Vec<_> = step.masks.iter().map(|m| m.hash).collect();
    let inputs = json!({
        "scan": scan.hash,
        "figure": inner.figure.hash,
        "inside": inside.hash,
        "kind": kind.input(),
        "masks": mask_files,
        "params": params,
    });
    walk.stage(&step.name, Stage::Segment, inputs, |session, _tell| {
        let (scan, figure) = (session.store.load(scan)?, session.store.load(inner.figure)?);
        let inside = session.store.load(inside)?;
        let placement = kind.template.place(figure.body(), &figure.skeleton, &kind.extent);
        let marks = masks::marks_of(session, step, &scan)?;
        let surfaces = worn::surfaces_inside(&figure, &inside);
        let layers: Vec<Inner> = surfaces
            .iter()
            .zip(&figure.layers)
            .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
            .collect();
        let labels = refine(&scan, &layers, &placement, &marks, &params);
        let count = labels.garment_vertex_count();
        Ok(Outcome::of(labels).measured("garment_vertices", count as f64))
    })
}
