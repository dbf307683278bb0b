//! The targets of the metrics, and whether they are met.

use super::garment::LayerPair;
use super::report::StepMeasures;
use serde::{Deserialize, Serialize};

/// Where the subject comes from: a model fits its own family better than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SubjectKind {
    /// Generated from the embedded body model.
    Invented,
    /// From any other source.
    Foreign,
}

/// A metric compared with its targets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TargetCheck {
    /// `T2` … `T10`.
    pub row: String,
    /// The metric.
    pub metric: String,
    /// Its value: the worst over the steps unless the metric says otherwise.
    pub value: f64,
    /// The first target; `None` if there is only a goal.
    pub first: Option<f64>,
    /// The final target.
    pub goal: f64,
    /// Whether `first` is met.
    pub meets_first: bool,
    /// Whether `goal` is met.
    pub meets_goal: bool,
}

/// Which side of a target is better.
#[derive(Clone, Copy)]
enum Better {
    Less,
    More,
}

fn check(
    row: &str,
    metric: &str,
    value: Option<f64>,
    first: Option<f64>,
    goal: f64,
    better: Better,
) -> Option<TargetCheck> {
    let value = value?;
    let meets = |limit: f64| match better {
        Better::Less => value <= limit,
        Better::More => value >= limit,
    };
    Some(TargetCheck {
        row: row.to_owned(),
        metric: metric.to_owned(),
        value,
        first,
        goal,
        meets_first: first.is_none_or(meets),
        meets_goal: meets(goal),
    })
}

/// The largest value; `None` of no values.
fn worst(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.fold(None, |most: Option<f64>, v| Some(most.map_or(v, |m| m.max(v))))
}

/// The targets that apply, in the order of their rows.
pub(super) fn check_targets(steps: &[StepMeasures], pairs: &[LayerPair], kind: SubjectKind) -> Vec<TargetCheck> {
    use Better::{Less, More};
    let invented = kind == SubjectKind::Invented;
    let by_kind = |own: f64, other: f64| if invented { own } else { other };
    let naked = steps.first();
    let hidden = || steps.iter().filter_map(|s| s.hidden.as_ref());
    let garments = || steps.iter().filter_map(|s| s.garment.as_ref());
    let count = garments().count();
    let iou_mean = (count > 0).then(|| garments().map(|g| g.garment_iou).sum::<f64>() / count as f64);
    let iou_worst = worst(garments().map(|g| -g.garment_iou)).map(|v| -v);
    let pairs_total = (!pairs.is_empty()).then(|| pairs.iter().map(|p| p.intersecting_pairs as f64).sum());
    [
        check(
            if invented { "T2" } else { "T3" },
            "model_only.surface_mean_mm",
            naked.and_then(|s| s.model_only).map(|s| s.surface_mean_mm),
            Some(by_kind(8.0, 15.0)),
            by_kind(4.0, 8.0),
            Less,
        ),
        check(
            "T4",
            "surface_mean_mm",
            naked.and_then(|s| s.surface).map(|s| s.surface_mean_mm),
            Some(4.0),
            by_kind(1.2, 1.8),
            Less,
        ),
        check("T5", "joint_mean_mm", naked.and_then(|s| s.joint_mean_mm), Some(35.0), by_kind(10.0, 20.0), Less),
        check("T6", "outside_scan", worst(steps.iter().filter_map(|s| s.outside_scan)), Some(0.0), 0.0, Less),
        check("T6", "outside_truth_percent", worst(hidden().map(|h| h.outside_truth_percent)), Some(1.0), 0.1, Less),
        check("T6", "outside_truth_p999_mm", worst(hidden().map(|h| h.outside_truth_p999_mm)), Some(5.0), 1.0, Less),
        check(
            "T7",
            "proximity_tight_mean_mm",
            worst(hidden().filter_map(|h| h.proximity_tight_mean_mm)),
            Some(15.0),
            5.0,
            Less,
        ),
        check(
            "T7",
            "proximity_loose_mean_mm",
            worst(hidden().filter_map(|h| h.proximity_loose_mean_mm)),
            Some(15.0),
            8.0,
            Less,
        ),
        check("T8", "garment_iou, mean", iou_mean, Some(0.85), 0.95, More),
        check("T8", "garment_iou, worst", iou_worst, Some(0.75), 0.90, More),
        check(
            "T9",
            "garment_surface_mean_mm",
            worst(garments().map(|g| g.garment_surface_mean_mm)),
            Some(8.0),
            5.0,
            Less,
        ),
        check("T10", "inside_percent", worst(pairs.iter().map(|p| p.inside_percent)), Some(0.1), 0.0, Less),
        check("T10", "intersecting_pairs, all", pairs_total, None, 0.0, Less),
    ]
    .into_iter()
    .flatten()
    .collect()
}
