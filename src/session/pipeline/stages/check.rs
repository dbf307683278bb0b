//! Check: whether the results of a step are plausible.

use super::kinds::NewGarments;
use super::labelling::{Evidence, outfit_labels};
use super::marks::MasksOfScan;
use super::posed::surfaces_inside;
use crate::body::{Figure, HumanJoint, Side};
use crate::check::{
    BodyPlausibility, BodyResult, Doubt, GarmentPlausibility, GarmentResult, ON_HEAD_AREA, Posture, TriedOn, Unlisted,
    check_body, check_garment, find_unlisted, is_lookalike, lookalike_doubt,
};
use crate::cut::Garment;
use crate::fit::{FittedBody, PoseInside, RegisteredBody};
use crate::geometry::{Adjacency, PerVertex, SurfaceIndex, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::{Fabric, Inner, OutfitLabels, Segmentation};
use crate::session::pipeline::memo::at::{Code, Run, RunError};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::pipeline::memo::mention;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store, Warning};
use serde::Serialize;

pub(in crate::session::pipeline) const CHECK: Code = Code::new(Stage::Check, 10);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct BodyInputs {
    pub scan: Kept<Scan>,
    pub fitted: Kept<FittedBody>,
    pub registered: Kept<RegisteredBody>,
    pub model: ModelInput,
    /// Whether the scan shows clothes, below which the body was estimated.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_estimated: bool,
}

#[derive(Clone, Serialize)]
pub(in crate::session::pipeline) struct GarmentInputs {
    pub scan: Kept<Scan>,
    /// The figure without the garment.
    pub figure: Kept<Figure>,
    pub inside: Kept<PoseInside>,
    pub labels: Kept<Segmentation>,
    pub garment: Kept<Garment>,
    pub model: ModelInput,
    pub fabric: String,
    pub is_hair: bool,
    /// Whether the body was estimated from the scans of clothes.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_estimated: bool,
    /// An earlier step with the same file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub same_as: Option<usize>,
    /// What else the scan shows, if the garment belongs to an outfit or hair is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beside: Option<Beside>,
}

/// What a scan shows beside a garment.
#[derive(Clone, Serialize)]
pub(in crate::session::pipeline) struct Beside {
    pub evidence: Kept<Evidence>,
    pub masks: MasksOfScan,
    #[serde(flatten)]
    pub garments: NewGarments,
}

/// What was checked.
#[derive(Serialize)]
pub(in crate::session::pipeline) enum Plausibility {
    Body(BodyPlausibility),
    Garment(GarmentPlausibility),
    TriedOn(TriedOn),
}

pub(in crate::session::pipeline) fn body(
    inputs: BodyInputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Plausibility> {
    let BodyInputs { scan, fitted, registered, model, is_estimated } = inputs;
    let (scan, fitted, registered) = (store.load(scan)?, store.load(fitted)?, store.load(registered)?);
    let model = model.load(store)?;
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
    })?;
    let doubts = if is_estimated { found.doubts_of_pose() } else { found.doubts() };
    let mm = |metres: Option<f64>| metres.map_or(f64::NAN, |m| 1e3 * m);
    let deg = |radians: Option<f64>| radians.map_or(f64::NAN, f64::to_degrees);
    Ok(Outcome::of(Plausibility::Body(found.clone()))
        .measured("tilt_deg", deg(found.tilt))
        .measured("hip_bend_deg", deg(found.posture.hip_bend))
        .measured("knee_bend_deg", deg(found.posture.knee_bend))
        .measured("unlike_hands_percent", found.unlike_hands_share.map_or(f64::NAN, |s| 1e2 * s))
        .measured("largest_unseen_cm2", found.largest_unseen.as_ref().map_or(0.0, |(area, _)| 1e4 * area))
        .measured(ON_HEAD_AREA, 1e4 * found.on_head)
        .measured("bent_median_deg", deg(found.bent_median))
        .measured("bent_p90_deg", deg(found.bent_p90))
        .measured("fitted_p95_mm", mm(found.fitted_p95))
        .measured("deviation", found.deviation)
        .warned(doubts.into_iter().map(warning)))
}

pub(in crate::session::pipeline) fn garment(
    inputs: GarmentInputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Plausibility> {
    let is_estimated = inputs.is_estimated;
    let GarmentInputs {
        scan: kept_scan, figure, inside, labels, garment, model, fabric, is_hair, same_as, beside, ..
    } = inputs;
    let fabric = Fabric::named(&fabric)?;
    let (scan, figure) = (store.load_shared(kept_scan)?, model.figure(store, figure)?);
    let (inside, segmentation) = (store.load(inside)?, store.load_shared(labels)?);
    let garment = store.load(garment)?;
    let surfaces = surfaces_inside(&figure, &inside)?;
    let inner: Vec<Inner> = (surfaces.iter().zip(&figure.layers))
        .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
        .collect();
    let skin = figure.posed(&inside.pose).swap_remove(0);
    // Fingers are curled in one scan and stretched in the next, and the synergies of a grasp express that only roughly.
    let is_hand = |v: VertexId| {
        let joint = figure.body().weights.rows()[v][0].0;
        Side::BOTH.iter().any(|&side| figure.skeleton.is_part_of(joint, HumanJoint::Hand(side)))
    };
    let hands: PerVertex<bool> = skin.vertex_ids().map(is_hand).collect();
    let mut labels_beside = None;
    if let Some(Beside { evidence, masks, .. }) = &beside {
        let adjacency = store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
        labels_beside = outfit_labels(store, *evidence, masks, kept_scan, &scan, &adjacency)?;
    }
    let beside = beside.as_ref().zip(labels_beside.as_ref());
    // With a garment alone, what it does not explain and is no hair may be one that is not listed: it counts as the rest.
    let others = beside.map(|(of, labels)| match of.garments.is_outfit {
        true => labels.of_others(of.masks.place),
        false => labels.hair(),
    });
    let mut found = check_garment(&GarmentResult {
        scan: &scan,
        garment: &garment,
        labels: &segmentation.labels.0,
        by_hand: &segmentation.by_hand,
        others: others.as_ref(),
        inner: &inner,
        skin: &skin,
        changing: &hands,
        thickness: fabric.thickness,
    })?;
    if is_estimated {
        // The body has this skin from this scan: its distance tells nothing of the person.
        found.skin_median = None;
    }
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
        .measured("unseen_edge_percent", 1e2 * or_nan(found.unseen_edge_share))
        .measured("largest_hole_cm2", 1e4 * found.largest_hole)
        .measured("cut_off_hems", found.cut_off_hems.len() as f64)
        .measured("ragged_hem_ratio", found.most_ragged_hem.map_or(f64::NAN, |hem| hem.length_per_smooth_length));
    for (k, worn) in found.worn_before.iter().enumerate() {
        outcome = outcome
            .measured(&format!("worn{}_area", k + 1), worn.visible_area)
            .measured(&format!("worn{}_outside_percent", k + 1), 1e2 * worn.outside_share)
            .measured(&format!("worn{}_recolored_percent", k + 1), 1e2 * or_nan(worn.recolored_share));
    }
    if is_hair {
        // The bare scan was checked with the body; strands are ragged, and may be of any length.
        return Ok(outcome);
    }
    let worn: Vec<&str> = figure.garments().iter().map(|layer| layer.name.as_str()).collect();
    let of_outfit = beside.filter(|(of, _)| of.garments.is_outfit).map(|(of, labels)| OutfitResult {
        scan: &scan,
        labels,
        garments: &of.garments,
        place: of.masks.place,
        figure: &figure,
        body: &surfaces[0],
    });
    let unlisted = of_outfit.as_ref().map(OutfitResult::unlisted).transpose()?.flatten();
    let lookalike = of_outfit.as_ref().map(OutfitResult::lookalike).transpose()?.flatten();
    let same = same_as.map(|other| {
        let other = mention::step(other);
        let what = format!("the file is the same as that of the step '{other}', so it shows no further garment");
        Warning::new(what, "give the scan in which the garment was put on")
    });
    Ok(outcome
        .warned(same)
        .warned(lookalike.map(warning))
        .warned(unlisted.map(|unlisted| warning(unlisted.doubt())))
        .warned(posture.doubt().map(warning))
        .warned(found.doubts(mention::THIS, &worn).into_iter().map(warning)))
}

/// A garment of an outfit: what its scan shows, and the body in it.
struct OutfitResult<'a> {
    scan: &'a Scan,
    labels: &'a OutfitLabels,
    garments: &'a NewGarments,
    /// The garment's place in the outfit, from the inside out.
    place: usize,
    figure: &'a Figure,
    /// The figure's body, posed in the scan.
    body: &'a TriMesh,
}

impl OutfitResult<'_> {
    /// What the scan shows that is not listed. It is reported once, by the outermost garment.
    fn unlisted(&self) -> Result<Option<Unlisted>, RunError> {
        let kinds = &self.garments.kinds;
        if self.place + 1 < kinds.len() {
            return Ok(None);
        }
        let listed: Vec<&str> = kinds.iter().map(|of| of.template.name.as_str()).collect();
        Ok(find_unlisted(&self.scan.mesh, &self.labels.unexplained(), self.figure, self.body, &listed)?)
    }

    /// Whether the garment may be a part of another one of its outfit that is worn below it.
    fn lookalike(&self) -> Result<Option<Doubt>, RunError> {
        let Self { scan, labels, figure, body, .. } = *self;
        let index = SurfaceIndex::prepare(body);
        let below: Vec<VertexId> = scan.mesh.points().iter().map(|p| index.closest(p).nearest_corner(body)).collect();
        let own = labels.of_garment(self.place).labels.0;
        for (k, spec) in self.garments.kinds[..self.place].iter().enumerate() {
            let covered = spec.template.prior(figure.body(), &figure.skeleton, &spec.extent)?;
            let expected = below.iter().map(|&v| covered[v]).collect();
            let of_other = labels.of_garment(k).labels.0;
            if is_lookalike(scan, &own, &of_other, &expected)? {
                return Ok(Some(lookalike_doubt(mention::THIS, &mention::garment_of_scan(k))));
            }
        }
        Ok(None)
    }
}

pub(in crate::session::pipeline) fn warning(doubt: Doubt) -> Warning {
    Warning::new(doubt.what, doubt.remedy)
}
