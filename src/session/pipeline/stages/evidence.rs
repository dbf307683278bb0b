//! Evidence: what the scan shows of the new garment. It does not depend on masks, so that one costs only what is near it.

use super::hair::KnownHair;
use super::kinds::NewGarments;
use super::labelling::Evidence;
use super::posed::surfaces_inside;
use crate::body::Figure;
use crate::fit::{FittedBody, PoseInside};
use crate::scan::Scan;
use crate::segment::{Inner, Proposal, RefineParams, propose, propose_outfit};
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::recipe::GarmentSpec;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use serde::Serialize;

pub(in crate::session::pipeline) const EVIDENCE: Code = Code::new(Stage::Evidence, 6);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub scan: Kept<Scan>,
    pub figure: Kept<Figure>,
    pub inside: Kept<PoseInside>,
    pub model: ModelInput,
    #[serde(flatten)]
    pub garments: NewGarments,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hair: Option<Kept<FittedBody>>,
    pub params: RefineParams,
}

pub(in crate::session::pipeline) fn run(
    Inputs { scan, figure, inside, model, garments, hair, params }: Inputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Evidence> {
    let (scan, figure) = (store.load(scan)?, model.figure(store, figure)?);
    let inside = store.load(inside)?;
    let hair = KnownHair::load(store, hair, &figure)?.map(|hair| hair.placement(&figure));
    if garments.are_hair() && hair.is_none() {
        return Ok(Outcome::of(Evidence::Garment(Proposal::of_nothing(&scan.mesh))));
    }
    let place = |spec: &GarmentSpec| spec.template.place(figure.body(), &figure.skeleton, &spec.extent);
    let placements = garments.kinds.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    let surfaces = surfaces_inside(&figure, &inside)?;
    let layers: Vec<Inner> = surfaces
        .iter()
        .zip(&figure.layers)
        .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
        .collect();
    Ok(Outcome::of(match (placements.as_slice(), &hair, garments.is_outfit) {
        (_, Some(hair), _) if garments.are_hair() => Evidence::Garment(propose(&scan, &layers, hair, &params)?),
        ([only], None, false) => Evidence::Garment(propose(&scan, &layers, only, &params)?),
        (all, hair, _) => Evidence::Outfit(propose_outfit(&scan, &layers, all, hair.as_ref(), &params)?),
    }))
}
