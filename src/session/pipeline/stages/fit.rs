//! Fit: the body model to the naked scan.

use super::later_scans::{self, LaterScan};
use crate::check::HAIR_AREA;
use crate::fit::{
    self, DressedScan, EstimatedBody, FittedBody, HALF_INTERVAL_90, KnownMeasure, NakedParams, OtherScan,
    fit_estimated, fit_naked, fit_together,
};
use crate::scan::Scan;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::pipeline::memo::mention;
use crate::session::recipe::{KnownMeasures, WEIGHT};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store, Warning};
use serde::Serialize;

/// Advice for a naked scan without a limb.
const USE_ALL_SCANS: &str =
    "scan again with the limb, or let a later scan that shows it add it: `overcoat fit body --shape-from all`";

pub(in crate::session::pipeline) const FIT: Code = Code::new(Stage::Fit, 11);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub scan: Kept<Scan>,
    pub model: ModelInput,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<LaterScan>,
    /// What is known of the person, if the body is estimated from the other scans, of which the first is `scan`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<KnownMeasures>,
    pub params: NakedParams,
}

pub(in crate::session::pipeline) fn run(inputs: Inputs, store: &Store, on_progress: OnProgress) -> Run<FittedBody> {
    match inputs.estimate.clone() {
        Some(known) => estimated(inputs, &known, store, on_progress),
        None => naked(inputs, store, on_progress),
    }
}

fn naked(
    Inputs { scan, model, others, params, .. }: Inputs,
    store: &Store,
    on_progress: OnProgress,
) -> Run<FittedBody> {
    let (scan, model) = (store.load(scan)?, model.load(store)?);
    let mut on_step = |s: &fit::FitIteration| on_progress(StageProgress::Iteration(&scan, s));
    let mut fitted = fit_naked(&scan, &model, &params, &mut on_step)?;
    if !others.is_empty() {
        let scans = others.iter().map(|other| store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
        let names: Vec<String> = (0..others.len()).map(mention::garment_scan).collect();
        let covers = later_scans::covers(&others, &fitted.figure(&model))?;
        let other_scans: Vec<OtherScan> = (others.iter().zip(&scans).zip(&names).zip(covers))
            .map(|(((of, scan), name), cover)| OtherScan { name, scan, cover, params: of.params.clone() })
            .collect();
        fitted = fit_together(&scan, &fitted, &other_scans, &model, &params, &mut on_step)?;
    }
    let (report, unseen) = (fitted.report.clone(), fitted.unseen.clone());
    let hair = fitted.hair.as_ref().map_or(0.0, |hair| 1e4 * hair.area);
    let scans = 1 + fitted.poses_in_others.iter().flatten().count();
    let distances = (report.residual_mean, report.residual_p95);
    let outcome = with_measures(Outcome::of(fitted), distances, report.iterations, report.converged, &report.log)
        .measured("confidence", report.confidence);
    let outcome = if hair > 0.0 { outcome.measured(HAIR_AREA, hair) } else { outcome };
    let outcome = outcome.warned(doubts(report.converged, report.iterations, report.confidence, report.is_confident()));
    let lacking = unseen.iter().filter(|_| others.is_empty()).map(|&limb| {
        let name = model.skeleton.part_name(limb);
        Warning::new(format!("the scan does not show the {name}, which comes from the model"), USE_ALL_SCANS)
    });
    let head = (!report.head_is_seen).then(|| {
        Warning::new("the scan does not show the head, which comes from the model", "scan again with the head")
    });
    let outcome = outcome.warned(lacking).warned(head);
    Ok(if others.is_empty() { outcome } else { outcome.measured("scans_in_shape", scans as f64) })
}

/// The measures that say how certain an estimated body is, with their names among the stage's measures.
const SHOWN: [(&str, &str); 4] =
    [("stature", "stature"), ("chest girth", "chest"), ("waist girth", "waist"), ("hip girth", "hip")];

/// Shape and pose from the scans of the dressed person.
fn estimated(
    Inputs { model, others, params, .. }: Inputs,
    known: &KnownMeasures,
    store: &Store,
    on_progress: OnProgress,
) -> Run<FittedBody> {
    /// Half of the chest's interval above which the clothes say too little. Metres.
    const VAGUE: f64 = 0.08;
    let model = model.load(store)?;
    let scans = others.iter().map(|other| store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
    let contacts = later_scans::contacts_in_each(&others, &model)?;
    let dressed: Vec<DressedScan> =
        scans.iter().zip(contacts).map(|(scan, contact)| DressedScan { scan, contact }).collect();
    let known: Vec<KnownMeasure> = known.iter().map(|(name, value)| known_measure(name, *value)).collect();
    let mut on_step = |s: &fit::FitIteration| on_progress(StageProgress::Iteration(&scans[0], s));
    let EstimatedBody { fitted, measures, .. } = fit_estimated(&dressed, &model, &known, &params, &mut on_step)?;
    let report = fitted.report.clone();
    let distances = (report.residual_mean, report.residual_p95);
    let mut outcome = with_measures(Outcome::of(fitted), distances, report.iterations, report.converged, &report.log)
        .measured("confidence", report.confidence)
        .measured("scans_in_shape", others.len() as f64);
    let mut vague = None;
    for (name, short) in SHOWN {
        let Some(m) = measures.iter().find(|m| m.name == name) else { continue };
        let half = HALF_INTERVAL_90 * m.deviation;
        outcome = outcome
            .measured(&format!("estimated_{short}_cm"), 1e2 * m.metres)
            .measured(&format!("estimated_{short}_half_interval_cm"), 1e2 * half);
        if name == "chest girth" && half > VAGUE {
            vague = Some(half);
        }
    }
    let doubt = vague.map(|half| {
        Warning::new(
            format!("the clothes say little about the body: the chest is certain only to ± {:.0} cm", 1e2 * half),
            "scan in closer clothes too, give --measures or --weight, or scan the bare body",
        )
    });
    let unfinished = doubts(report.converged, report.iterations, 1.0, true);
    Ok(outcome.warned(unfinished).warned(doubt))
}

/// A known measure with the error of a tape, or of scales and of the body's density.
fn known_measure(name: &str, value: f64) -> KnownMeasure {
    let deviation = match name {
        WEIGHT => 0.03 * value,
        "stature" => 0.01,
        _ => 0.015,
    };
    KnownMeasure { name: name.into(), value, deviation }
}

/// What is in doubt about a fit.
pub(in crate::session::pipeline) fn doubts(
    converged: bool,
    iterations: usize,
    confidence: f64,
    is_confident: bool,
) -> Vec<Warning> {
    let remedy = "compare body and scan in `view --sheet`, above all hands and feet; scan again if they differ";
    let unfinished = || Warning::new(format!("the fit did not converge in {iterations} iterations"), remedy);
    let low = || Warning::new(format!("scan and figure agree badly, confidence {confidence:.2} of 1"), remedy);
    match (converged, is_confident) {
        (false, _) => vec![unfinished()],
        (true, false) => vec![low()],
        (true, true) => Vec::new(),
    }
}

/// Adds the measures common to all fits; distances are the mean and the 95th percentile, in metres.
pub(in crate::session::pipeline) fn with_measures<T>(
    outcome: Outcome<T>,
    (mean, p95): (f64, f64),
    iterations: usize,
    converged: bool,
    log: &[String],
) -> Outcome<T> {
    outcome
        .measured("residual_mean_mm", mean * 1e3)
        .measured("residual_p95_mm", p95 * 1e3)
        .measured("iterations", iterations as f64)
        .measured("converged", if converged { 1.0 } else { 0.0 })
        .found(log.iter().cloned())
}
