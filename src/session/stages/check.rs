//! Check: whether the results of a step are plausible.

use super::cut::CutStage;
use super::event::{OnProgress, Outcome};
use super::evidence::EvidenceStage;
use super::fit::FitStage;
use super::labelling::outfit_labels;
use super::pipeline_stage::{PipelineStage, StepContext};
use super::pose::PoseStage;
use super::posed::surfaces_inside;
use super::register::RegisterStage;
use super::scan::ScanStage;
use super::segment::SegmentStage;
use crate::body::{Figure, HumanJoint, Side};
use crate::check::{
    BodyPlausibility, BodyResult, Doubt, GarmentPlausibility, GarmentResult, Posture, Unlisted, check_body,
    check_garment, find_unlisted, is_lookalike, lookalike_doubt,
};
use crate::cut::Garment;
use crate::fit::{FittedBody, PoseInside, RegisteredBody};
use crate::geometry::{Adjacency, PerVertex, SurfaceIndex, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::{Fabric, Inner, OutfitLabels, Segmentation};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{GarmentSpec, StepRecipe, garment_spec};
use crate::session::stage::Stage;
use crate::session::stage_error::StageError;
use crate::session::store::{ContentHash, Kept, Warning};
use serde::Serialize;
use serde_json::{Value, json};

pub(in crate::session) struct CheckStage;

pub(in crate::session) enum Inputs {
    Body { scan: Kept<Scan>, fitted: Kept<FittedBody>, registered: Kept<RegisteredBody> },
    Garment(Box<GarmentInputs>),
}

pub(in crate::session) struct GarmentInputs {
    scan: Kept<Scan>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
    segmentation: Kept<Segmentation>,
    garment: Kept<Garment>,
    fabric: String,
    /// An earlier step with the same file.
    same_as: Option<String>,
    /// The evidence of what else the scan shows, if the garment belongs to an outfit or hair is known.
    beside: Option<ContentHash>,
}

/// What was checked.
#[derive(Serialize)]
pub(in crate::session) enum Plausibility {
    Body(BodyPlausibility),
    Garment(GarmentPlausibility),
}

impl PipelineStage for CheckStage {
    const STAGE: Stage = Stage::Check;
    const VERSION: u32 = 5;
    type Inputs = Inputs;
    type Output = Plausibility;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let scan = context.results.result::<ScanStage>()?;
        let model = context.walk.session().body_model_input();
        if context.step.is_body() {
            let (fitted, registered) =
                (context.results.result::<FitStage>()?, context.results.result::<RegisterStage>()?);
            let values =
                json!({ "scan": scan.hash, "fitted": fitted.hash, "registered": registered.hash, "model": model });
            return Ok((Inputs::Body { scan, fitted, registered }, values));
        }
        let (inside, segmentation) =
            (context.results.result::<PoseStage>()?, context.results.result::<SegmentStage>()?);
        let garment = context.results.result::<CutStage>()?;
        let fabric = garment_spec::of_step(context.step)?.template.fabric;
        let step = context.step;
        // The bare scan, from which hair is cut, shows no garments.
        let figure = if step.is_hair() { context.before_scan()? } else { context.inner()? }.figure()?;
        let earlier = context.walk.session().recipe.steps.iter().take_while(|other| other.name != step.name);
        let same_as = earlier
            .into_iter()
            .filter(|other| !other.is_hair())
            .filter(|other| step.outfit.is_none() || other.outfit != step.outfit)
            .find(|other| other.hash.is_some() && other.hash == step.hash)
            .map(|other| other.name.clone());
        let mut values = json!({
            "scan": scan.hash,
            "figure": figure.hash,
            "inside": inside.hash,
            "labels": segmentation.hash,
            "garment": garment.hash,
            "fabric": fabric,
            "model": model,
        });
        if let Some(other) = &same_as {
            values["same_as"] = json!(other);
        }
        let mut beside = None;
        let evidence = context.results.result::<EvidenceStage>()?.hash;
        if context.fit_with_hair()?.is_some() {
            values["hair"] = json!(evidence);
            beside = Some(evidence);
        }
        if step.outfit.is_some() {
            let steps = context.walk.session().recipe.outfit_of(step);
            let masks: Vec<Vec<_>> = steps.iter().map(|of| of.masks.iter().map(|m| m.hash).collect()).collect();
            let garments = context.walk.session().recipe.garments_of_outfit(step)?;
            let kinds: Vec<Value> = garments.iter().map(GarmentSpec::input).collect();
            values["outfit"] = json!({ "evidence": evidence, "masks": masks, "kinds": kinds });
            beside = Some(evidence);
        }
        let inputs = GarmentInputs { scan, figure, inside, segmentation, garment, fabric, same_as, beside };
        Ok((Inputs::Garment(Box::new(inputs)), values))
    }

    fn run(
        inputs: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Plausibility>, SessionError> {
        match inputs {
            Inputs::Body { scan, fitted, registered } => body(session, step, scan, fitted, registered),
            Inputs::Garment(inputs) => garment(session, step, *inputs),
        }
    }
}

fn body(
    session: &Session,
    step: &StepRecipe,
    scan: Kept<Scan>,
    fitted: Kept<FittedBody>,
    registered: Kept<RegisteredBody>,
) -> Result<Outcome<Plausibility>, SessionError> {
    let (scan, fitted, registered) =
        (session.store.load(scan)?, session.store.load(fitted)?, session.store.load(registered)?);
    let model = session.body_model()?;
    let surface_of_fit =
        fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
    let found = check_body(&BodyResult {
        scan: &fitted.bare_part(&scan),
        hidden: fitted.hair.as_ref().map(|hair| &hair.covers),
        fitted: &surface_of_fit,
        skeleton: &registered.skeleton,
        pose: &registered.pose,
        shape: &fitted.shape,
        weights: &model.weights,
    })
    .map_err(|e| SessionError::stage(&step.name, Stage::Check, e))?;
    let mm = |metres: Option<f64>| metres.map_or(f64::NAN, |m| 1e3 * m);
    let deg = |radians: Option<f64>| radians.map_or(f64::NAN, f64::to_degrees);
    Ok(Outcome::of(Plausibility::Body(found.clone()))
        .measured("tilt_deg", deg(found.tilt))
        .measured("hip_bend_deg", deg(found.posture.hip_bend))
        .measured("knee_bend_deg", deg(found.posture.knee_bend))
        .measured("unlike_hands_percent", found.unlike_hands_share.map_or(f64::NAN, |s| 1e2 * s))
        .measured("largest_unseen_cm2", found.largest_unseen.as_ref().map_or(0.0, |(area, _)| 1e4 * area))
        .measured("bent_median_deg", deg(found.bent_median))
        .measured("bent_p90_deg", deg(found.bent_p90))
        .measured("fitted_p95_mm", mm(found.fitted_p95))
        .measured("deviation", found.deviation)
        .warned(found.doubts().into_iter().map(warning)))
}

fn garment(session: &Session, step: &StepRecipe, inputs: GarmentInputs) -> Result<Outcome<Plausibility>, SessionError> {
    let GarmentInputs { scan: kept_scan, figure, inside, segmentation, garment, fabric, same_as, beside } = inputs;
    let failed = |e: StageError| SessionError::stage(&step.name, Stage::Check, e);
    let fabric = Fabric::named(&fabric).map_err(|e| failed(e.into()))?;
    let (scan, figure) = (session.store.load_shared(kept_scan)?, session.figure(figure)?);
    let (inside, segmentation) = (session.store.load(inside)?, session.store.load_shared(segmentation)?);
    let garment = session.store.load(garment)?;
    let surfaces = surfaces_inside(&figure, &inside)?;
    let inner: Vec<Inner> = (surfaces.iter().zip(&figure.layers))
        .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
        .collect();
    let skin = figure.posed(&inside.pose).swap_remove(0);
    // Fingers are curled in one scan and stretched in the next, and no fit moves them.
    let is_hand = |v: VertexId| {
        let joint = figure.body().weights.rows()[v][0].0;
        Side::BOTH.iter().any(|&side| figure.skeleton.is_part_of(joint, HumanJoint::Hand(side)))
    };
    let hands: PerVertex<bool> = skin.vertex_ids().map(is_hand).collect();
    let beside = match beside {
        None => None,
        Some(evidence) => {
            let adjacency = session.store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
            outfit_labels(session, step, evidence, &scan, &adjacency)?
        }
    };
    // With a garment alone, what it does not explain and is no hair may be one that is not listed: it counts as the rest.
    let others = beside.as_ref().map(|(labels, place)| match step.outfit {
        Some(_) => labels.of_others(*place),
        None => labels.hair(),
    });
    let found = check_garment(&GarmentResult {
        scan: &scan,
        garment: &garment,
        labels: &segmentation.labels.0,
        others: others.as_ref(),
        inner: &inner,
        skin: &skin,
        changing: &hands,
        thickness: fabric.thickness,
    })
    .map_err(|e| failed(e.into()))?;
    let mm = |metres: Option<f64>| metres.map_or(f64::NAN, |m| 1e3 * m);
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let posture = Posture::of(&figure.skeleton, &inside.pose);
    let mut outcome = Outcome::of(Plausibility::Garment(found.clone()))
        .measured("hip_bend_deg", posture.hip_bend.map_or(f64::NAN, f64::to_degrees))
        .measured("knee_bend_deg", posture.knee_bend.map_or(f64::NAN, f64::to_degrees))
        .measured("stand_off_median_mm", mm(found.stand_off_median))
        .measured("stand_off_p90_mm", mm(found.stand_off_p90))
        .measured("gap_median_mm", mm(found.gap_median))
        .measured("gap_p75_mm", mm(found.gap_p75))
        .measured("color_change", or_nan(found.color_change))
        .measured("recolored_percent", 1e2 * or_nan(found.recolored_share))
        .measured("unchanged_percent", 1e2 * or_nan(found.unchanged_share))
        .measured("rest_recolored_percent", 1e2 * or_nan(found.rest_recolored_share))
        .measured("unexplained_percent", 1e2 * found.unexplained.0)
        .measured("skin_median_mm", mm(found.skin_median))
        .measured("largest_hole_cm2", 1e4 * found.largest_hole)
        .measured("cut_off_hems", found.cut_off_hems.len() as f64)
        .measured("ragged_hem_ratio", found.most_ragged_hem.map_or(f64::NAN, |hem| hem.length_per_smooth_length));
    for (k, worn) in found.worn_before.iter().enumerate() {
        outcome = outcome
            .measured(&format!("worn{}_area", k + 1), worn.visible_area)
            .measured(&format!("worn{}_outside_percent", k + 1), 1e2 * worn.outside_share)
            .measured(&format!("worn{}_recolored_percent", k + 1), 1e2 * or_nan(worn.recolored_share));
    }
    let worn: Vec<&str> = figure.garments().iter().map(|layer| layer.name.as_str()).collect();
    let of_outfit = beside.as_ref().filter(|_| step.outfit.is_some()).map(|(labels, place)| OutfitResult {
        session,
        step,
        scan: &scan,
        labels,
        place: *place,
        figure: &figure,
        body: &surfaces[0],
    });
    let unlisted = of_outfit.as_ref().map(OutfitResult::unlisted).transpose()?.flatten();
    let lookalike = of_outfit.as_ref().map(OutfitResult::lookalike).transpose()?.flatten();
    if step.is_hair() {
        // The bare scan was checked with the body; strands are ragged, and may be of any length.
        return Ok(outcome);
    }
    let same = same_as.map(|other| {
        let what = format!("the file is the same as that of the step '{other}', so it shows no further garment");
        Warning::new(what, "give the scan in which the garment was put on")
    });
    Ok(outcome
        .warned(same)
        .warned(lookalike.map(warning))
        .warned(unlisted.map(|unlisted| warning(unlisted.doubt())))
        .warned(posture.doubt().map(warning))
        .warned(found.doubts(&step.name, &worn).into_iter().map(warning)))
}

/// A garment of an outfit: what its scan shows, and the body in it.
struct OutfitResult<'a> {
    session: &'a Session,
    step: &'a StepRecipe,
    scan: &'a Scan,
    labels: &'a OutfitLabels,
    /// The garment's place in the outfit, from the inside out.
    place: usize,
    figure: &'a Figure,
    /// The figure's body, posed in the scan.
    body: &'a TriMesh,
}

impl OutfitResult<'_> {
    /// What the scan shows that is not listed. It is reported once, by the outermost garment.
    fn unlisted(&self) -> Result<Option<Unlisted>, SessionError> {
        let outfit = self.session.recipe.outfit_of(self.step);
        if self.place + 1 < outfit.len() {
            return Ok(None);
        }
        let listed: Vec<&str> = outfit.iter().filter_map(|of| of.template.as_deref()).collect();
        find_unlisted(&self.scan.mesh, &self.labels.unexplained(), self.figure, self.body, &listed)
            .map_err(|e| SessionError::stage(&self.step.name, Stage::Check, e))
    }

    /// Whether the garment may be a part of another one of its outfit that is worn below it.
    fn lookalike(&self) -> Result<Option<Doubt>, SessionError> {
        let Self { scan, labels, figure, body, .. } = *self;
        let failed = |e: StageError| SessionError::stage(&self.step.name, Stage::Check, e);
        let index = SurfaceIndex::prepare(body);
        let below: Vec<VertexId> = scan.mesh.points().iter().map(|p| index.closest(p).nearest_corner(body)).collect();
        let own = labels.of_garment(self.place).labels.0;
        for (k, other) in self.session.recipe.outfit_of(self.step)[..self.place].iter().enumerate() {
            let spec = garment_spec::of_step(other)?;
            let covered =
                (spec.template.prior(figure.body(), &figure.skeleton, &spec.extent)).map_err(|e| failed(e.into()))?;
            let expected = below.iter().map(|&v| covered[v]).collect();
            let of_other = labels.of_garment(k).labels.0;
            if is_lookalike(scan, &own, &of_other, &expected).map_err(|e| failed(e.into()))? {
                return Ok(Some(lookalike_doubt(&self.step.name, &other.name)));
            }
        }
        Ok(None)
    }
}

fn warning(doubt: Doubt) -> Warning {
    Warning::new(doubt.what, doubt.remedy)
}
