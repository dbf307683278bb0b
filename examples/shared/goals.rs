//! The goals of the measures: rows T2 to T10 of the table of targets in `docs/evaluation.md`, for synthetic subjects. The
//! tests assert them, `sensitivity` lists the parameters that break one.

use serde_json::Value;

/// A limit for one measure. Of measures that several steps have, the worst counts.
pub struct Limit {
    /// The row of the table.
    pub row: &'static str,
    /// The measure.
    pub metric: &'static str,
    /// Reads the measure from a report of `overcoat measure --json`.
    pub value: fn(&Value) -> Option<f64>,
    /// Larger values miss the goal.
    pub at_most: f64,
}

/// The tolerance of lengths, millimetres: a twentieth of the smallest goal that has one. Results may change by that much
/// when a stage is improved, and no more.
pub const MM: f64 = 0.06;

/// The goals for a synthetic subject of our own family.
pub const GOALS: [Limit; 12] = [
    Limit { row: "T2", metric: "model_only", value: model_only, at_most: 4.0 + MM },
    Limit { row: "T4", metric: "surface_mean_mm", value: surface, at_most: 1.2 + MM },
    Limit { row: "T5", metric: "joint_mean_mm", value: joints, at_most: 10.0 + MM },
    Limit { row: "T6", metric: "outside_scan", value: |r| worst(r, "outside_scan"), at_most: 0.0 },
    Limit { row: "T6", metric: "outside_truth_percent", value: |r| worst(r, "outside_truth_percent"), at_most: 0.105 },
    Limit {
        row: "T6",
        metric: "outside_truth_p999_mm",
        value: |r| worst(r, "outside_truth_p999_mm"),
        at_most: 1.0 + MM,
    },
    Limit { row: "T7", metric: "tight", value: |r| worst(r, "proximity_tight_mean_mm"), at_most: 5.0 + MM },
    Limit { row: "T7", metric: "loose", value: |r| worst(r, "proximity_loose_mean_mm"), at_most: 8.0 + MM },
    Limit { row: "T8", metric: "1 - garment_iou, mean", value: iou_loss_mean, at_most: 0.05 + 0.002 },
    Limit { row: "T8", metric: "1 - garment_iou, worst", value: iou_loss_worst, at_most: 0.10 + 0.002 },
    Limit { row: "T9", metric: "garment_surface", value: |r| worst(r, "garment_surface_mean_mm"), at_most: 5.0 + MM },
    Limit { row: "T10", metric: "inside and crossing", value: bind_faults, at_most: 0.0 },
];

fn steps(report: &Value) -> impl Iterator<Item = &Value> {
    report["steps"].as_array().into_iter().flatten()
}

fn of_steps<'a>(report: &'a Value, measure: &'a str) -> impl Iterator<Item = f64> + 'a {
    steps(report).filter_map(move |step| step[measure].as_f64())
}

fn largest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.reduce(f64::max)
}

/// The largest value of a measure over the steps.
pub fn worst(report: &Value, measure: &str) -> Option<f64> {
    largest(of_steps(report, measure))
}

fn model_only(report: &Value) -> Option<f64> {
    steps(report).next()?["model_only"]["surface_mean_mm"].as_f64()
}

/// T4.
pub fn surface(report: &Value) -> Option<f64> {
    steps(report).next()?["surface_mean_mm"].as_f64()
}

fn joints(report: &Value) -> Option<f64> {
    steps(report).next()?["joint_mean_mm"].as_f64()
}

fn iou_loss_mean(report: &Value) -> Option<f64> {
    let losses: Vec<f64> = of_steps(report, "garment_iou").map(|iou| 1.0 - iou).collect();
    (!losses.is_empty()).then(|| losses.iter().sum::<f64>() / losses.len() as f64)
}

fn iou_loss_worst(report: &Value) -> Option<f64> {
    largest(of_steps(report, "garment_iou").map(|iou| 1.0 - iou))
}

/// Percent of garment vertices inside an inner layer, plus the number of intersecting pairs of triangles.
pub fn bind_faults(report: &Value) -> Option<f64> {
    let pairs = report["pairs"].as_array()?;
    let faults = |pair: &Value| Some(pair["inside_percent"].as_f64()? + pair["intersecting_pairs"].as_f64()?);
    largest(pairs.iter().map(|pair| faults(pair).unwrap_or(f64::INFINITY)))
}

/// The limits that a report of `measure` exceeds, or about which it is silent.
pub fn exceeded<'a>(report: &Value, limits: impl Iterator<Item = &'a Limit>) -> Vec<String> {
    let check = |Limit { row, metric, value, at_most }: &Limit| match value(report) {
        Some(value) if value <= *at_most => None,
        Some(value) => Some(format!("{row} {metric}: {value:.4}, at most {at_most:.4}")),
        None => Some(format!("{row} {metric}: not measured")),
    };
    limits.filter_map(check).collect()
}
