//! The goals of all measures on fixed subjects whose truth is known: a loss of accuracy fails here.
//!
//! A limit is the goal plus a small tolerance. Where a goal is not met today, the limit is today's value plus the
//! tolerance, and says so.

use crate::common::{Built, demo, outfit_a};
use goals::{GOALS, Limit, MM, bind_faults, exceeded, surface, worst};
use serde_json::Value;

#[path = "../examples/shared/goals.rs"]
mod goals;

/// Where the demo misses a goal, the limit that replaces it.
const DEMO_T4: Limit = Limit {
    row: "T4",
    metric: "surface_mean_mm",
    value: surface,
    // The goal is 1.2 mm. The demo's bare body comes from 36 frames of a person who sways: 1.90 mm today.
    at_most: 1.90 + MM,
};

/// The goal is 0.1 %. The pullover's step has 0.124 % today; it had 0.091 before hems were moved to the edge of the cloth, which
/// changes the shirt and the skirt that its pose is fitted with.
const DEMO_T6: Limit = Limit {
    row: "T6",
    metric: "outside_truth_percent",
    value: |report| worst(report, "outside_truth_percent"),
    at_most: 0.129,
};

/// The goal is 0.1 %. The jacket's step has 0.116 % today; it had 0.085 while `studio` sewed with values of its own. Of other people
/// in the same garments seed 22 went from 0.031 to 0, seed 23 from 0.050 to 0.038.
const OUTFIT_A_T6: Limit = Limit { at_most: 0.121, ..DEMO_T6 };

#[test]
fn a_synthetic_outfit_meets_every_goal_but_one() {
    let Built { report, .. } = outfit_a();
    let limits = GOALS.iter().filter(|limit| limit.metric != OUTFIT_A_T6.metric).chain([&OUTFIT_A_T6]);
    let found = exceeded(report, limits);
    assert!(found.is_empty(), "{found:#?}");
    assert_eq!(bind_faults(report), Some(0.0), "nothing crosses and nothing is inside");
}

#[test]
fn the_demo_meets_every_goal_but_two() {
    let report = &demo().report["truth"];
    let replaced = |limit: &&Limit| limit.row != DEMO_T4.row && limit.metric != DEMO_T6.metric;
    let limits = GOALS.iter().filter(replaced).chain([&DEMO_T4, &DEMO_T6]);
    let found = exceeded(report, limits);
    assert!(found.is_empty(), "{found:#?}");
    assert!(surface(report) > Some(1.2 + MM), "the demo meets T4 now: drop its exception");
}

#[test]
fn a_loss_of_accuracy_is_found() {
    let report = &demo().report["truth"];
    let mut worse = report.clone();
    worse["steps"][2]["garment_iou"] = 0.7.into();
    worse["steps"][1]["outside_scan"] = 1e-6.into();
    worse["pairs"][0]["intersecting_pairs"] = 1.into();
    let rows = |report: &Value| -> Vec<String> {
        exceeded(report, GOALS.iter()).iter().map(|line| line.split(':').next().unwrap().to_string()).collect()
    };
    let added = rows(&worse).into_iter().filter(|row| !rows(report).contains(row));
    assert_eq!(
        added.collect::<Vec<_>>(),
        ["T6 outside_scan", "T8 1 - garment_iou, mean", "T8 1 - garment_iou, worst", "T10 inside and crossing"]
    );
    assert_eq!(rows(&Value::Null).len(), GOALS.len(), "a report without figures meets nothing");
}
