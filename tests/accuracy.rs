//! The goals of all measures on fixed subjects whose truth is known: a loss of accuracy fails here.
//!
//! A limit is the goal plus a small tolerance. Where a goal is not met today, the limit is today's value plus the
//! tolerance, and says so.

use crate::common::{Built, demo, outfit_a};
use goals::{GOALS, Limit, MM, bind_faults, exceeded, surface};
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

#[test]
fn a_synthetic_outfit_meets_every_goal() {
    let Built { report, .. } = outfit_a();
    let found = exceeded(report, GOALS.iter());
    assert!(found.is_empty(), "{found:#?}");
    assert_eq!(bind_faults(report), Some(0.0), "nothing crosses and nothing is inside");
}

#[test]
fn the_demo_meets_every_goal_but_that_of_the_swaying_body() {
    let report = &demo().report["truth"];
    let limits = GOALS.iter().filter(|limit| limit.row != DEMO_T4.row).chain([&DEMO_T4]);
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
        exceeded(report, GOALS.iter()).iter().map(|line| line.split(' ').next().unwrap().to_string()).collect()
    };
    let added = rows(&worse).into_iter().filter(|row| !rows(report).contains(row));
    assert_eq!(added.collect::<Vec<_>>(), ["T6", "T8", "T8", "T10"]);
    assert_eq!(rows(&Value::Null).len(), GOALS.len(), "a report without figures meets nothing");
}
