//! Cut: cuts the garment out of the scan as its own mesh, with smooth hems.

use super::hair::KnownHair;
use super::posed::body_inside;
use crate::body::Figure;
use crate::cut::{BodyBelow, CutError, CutParams, EarlierCuts, Garment, cut_again};
use crate::fit::{FittedBody, PoseInside};
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::{SegmentError, Segmentation};
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::pipeline::memo::mention;
use crate::session::recipe::GarmentSpec;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store, Warning};
use serde::Serialize;

pub(in crate::session::pipeline) const CUT: Code = Code::new(Stage::Cut, 15);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub scan: Kept<Scan>,
    pub labels: Kept<Segmentation>,
    pub figure: Kept<Figure>,
    pub inside: Kept<PoseInside>,
    pub model: ModelInput,
    pub kind: GarmentSpec,
    /// The fit of the body with its hair, if the step cuts that out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hair: Option<Kept<FittedBody>>,
    /// What to do where nothing is labelled.
    pub if_nothing: IfNothing,
    pub params: CutParams,
}

/// What a scan that shows nothing of a garment means.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::session::pipeline) enum IfNothing {
    /// An error: the scan was given for this garment.
    Fails,
    /// No layer: the bare scan shows no hair.
    IsNoLayer,
    /// No layer and a doubt: the scan shows other garments, too, and they are what it was given for.
    IsDoubtful,
}

pub(in crate::session::pipeline) fn run(
    Inputs { scan: kept_scan, labels, figure, inside, model, kind, hair, if_nothing, params }: Inputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Garment> {
    let (scan, segmentation) = (store.load_shared(kept_scan)?, store.load_shared(labels)?);
    let adjacency = store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
    let (figure, inside) = (model.figure_shared(store, figure)?, store.load_shared(inside)?);
    let body = body_inside(&figure, &inside)?;
    let covered = match KnownHair::load(store, hair, &figure)? {
        Some(hair) => hair.0,
        None => kind.template.prior(figure.body(), &figure.skeleton, &kind.extent)?,
    };
    let goes_between_legs = kind.template.goes_between_legs();
    let below = BodyBelow { mesh: &body, covered: &covered, goes_between_legs };
    let earlier = store.prepared(kept_scan.hash, EarlierCuts::default);
    let expected = kind.template.expected_loops();
    let garment = match cut_again(&scan, &adjacency, &segmentation, &below, expected, &params, &earlier) {
        Err(CutError::NothingLabelled { .. }) if if_nothing == IfNothing::IsNoLayer => {
            return Ok(Outcome::of(Garment::absent()));
        }
        Err(CutError::NothingLabelled { .. }) if if_nothing == IfNothing::IsDoubtful => {
            let absent = SegmentError::NotInOutfit { garment: mention::THIS.into() };
            let warning = Warning::new(absent.to_string(), absent.hint().unwrap_or_default());
            return Ok(Outcome::of(Garment::absent()).warned([warning]));
        }
        found => found?,
    };
    let (vertices, hems) = (garment.mesh.vertex_count(), garment.hem_loops.len());
    let findings = garment.findings.clone();
    Ok(Outcome::of(garment).measured("vertices", vertices as f64).measured("hem_loops", hems as f64).found(findings))
}
