//! The scans of later steps, for a body whose shape is fitted to all scans of the session.

use super::kinds::{NewGarments, looser};
use super::step_scan::{begin_scan, scan_of};
use crate::body::{BodyModel, Figure};
use crate::fit::{Contact, Cover, InsideParams, ShapeFrom};
use crate::geometry::PerVertex;
use crate::scan::Scan;
use crate::segment::contacts;
use crate::session::error::SessionError;
use crate::session::pipeline::memo::at::RunError;
use crate::session::pipeline::memo::walk::Walk;
use crate::session::recipe::{BodyStep, Recipe, Step};
use crate::session::store::Kept;
use serde::Serialize;

/// The scan of a later step, as evidence of the body's shape.
#[derive(Clone, Serialize)]
pub(in crate::session::pipeline) struct LaterScan {
    pub scan: Kept<Scan>,
    #[serde(flatten)]
    pub garments: NewGarments,
    pub params: InsideParams,
}

/// The scans of all later steps if the body's step uses them; otherwise none. For an estimated body they are all that there is.
pub(in crate::session::pipeline) fn later_scans(
    walk: &mut Walk,
    recipe: &Recipe,
    body: &BodyStep,
) -> Result<Vec<LaterScan>, SessionError> {
    if body.fit.shape_from == ShapeFrom::Naked && body.estimate.is_none() {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    let mut later = recipe.garment_scans().into_iter().peekable();
    while let Some(at) = later.next() {
        begin_scan(walk, later.peek().map(|&next| &recipe.steps[next]));
        let (step, garments, params) = match recipe.variant(&recipe.steps[at])? {
            Step::Garment(scan, only) => (&recipe.steps[at], NewGarments::alone(&only), scan.pose),
            Step::Outfit(scan, all) => (&recipe.steps[at], NewGarments::of_outfit(&all), scan.pose),
            _ => continue,
        };
        found.push(LaterScan { scan: scan_of(walk, step)?, garments, params });
    }
    Ok(found)
}

/// What clothes leave between each vertex of the model and each of the scans. The garments of earlier steps are still worn in later
/// scans.
///
/// **Shapes** one entry per scan, with V values.
///
/// **Errors** if a garment's template was painted on another body.
pub(in crate::session::pipeline) fn contacts_in_each(
    scans: &[LaterScan],
    model: &BodyModel,
) -> Result<Vec<PerVertex<Option<Contact>>>, RunError> {
    let mut worn = Vec::new();
    scans
        .iter()
        .map(|later| {
            worn.extend(later.garments.kinds.iter().map(|spec| (spec.template.clone(), spec.extent.clone())));
            Ok(contacts(&worn, model)?)
        })
        .collect()
}

/// The cover of each body vertex in each of the scans. The garments of earlier steps are still worn in later scans.
///
/// **Shapes** one entry per scan, with V values.
///
/// **Errors** if a garment's template was painted on another body.
pub(in crate::session::pipeline) fn covers(
    scans: &[LaterScan],
    bare: &Figure,
) -> Result<Vec<PerVertex<Cover>>, RunError> {
    let mut covered = PerVertex::filled(Cover::Bare, bare.body().mesh.vertex_count());
    scans
        .iter()
        .map(|later| {
            let new = later.garments.cover(bare)?;
            covered = covered.iter().zip(new.iter()).map(|(a, b)| looser(*a, *b)).collect();
            Ok(covered.clone())
        })
        .collect()
}
