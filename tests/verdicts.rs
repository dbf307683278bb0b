//! One verdict per step: what is implausible, what failed, and what `--strict` does about it.

use crate::common::{copy_folder, demo, mean_body, on_demo_scans, overcoat, overcoat_ok, write_mesh};
use overcoat::geometry::Point;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn demo_scan(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo").join(name)
}

/// The built body of the demo, on which garments can be tried.
fn body_of_demo(dir: &Path) -> PathBuf {
    let session = dir.join("alice");
    copy_folder(&demo().session, &session);
    let recipe = "version = 1\n\n[[step]]\nname = \"body\"\nscan = \"SCANS/0-body.ply\"\n";
    std::fs::write(session.join("recipe.toml"), on_demo_scans(recipe)).unwrap();
    session
}

/// The step of that name in the status.
fn status_of(session: &Path, step: &str) -> Value {
    let status = overcoat_ok(session, &["status", "--json"]).json();
    status["steps"].as_array().unwrap().iter().find(|s| s["name"] == step).unwrap().clone()
}

#[test]
fn the_demo_has_a_verdict_per_step_in_status_build_and_its_json() {
    let status = overcoat_ok(&demo().session, &["status"]).stdout;
    let built = overcoat_ok(&demo().session, &["build", "--json"]).json();
    for step in built["steps"].as_array().unwrap() {
        let (name, verdict) = (step["step"].as_str().unwrap(), step["verdict"].as_str().unwrap());
        assert!(verdict == "good" || verdict.starts_with("check it: "), "{step}");
        assert_eq!(verdict == "good", step["warnings"].as_array().unwrap().is_empty(), "{step}");
        assert!(status.contains(&format!("\n{name}: {verdict}\n")), "{status}");
        assert_eq!(status_of(&demo().session, name)["verdict"], step["verdict"]);
    }
    assert_eq!(status_of(&demo().session, "body")["verdict"], "good");
    assert_eq!(status_of(&demo().session, "tshirt")["verdict"], "good");
}

#[test]
fn a_garment_that_is_not_in_the_scan_is_reported_and_strict_fails() {
    let dir = tempfile::tempdir().unwrap();
    let session = body_of_demo(dir.path());
    let bare = demo_scan("0-body.ply");
    overcoat_ok(&session, &["scan", "tshirt", bare.to_str().unwrap(), "--template", "tshirt"]);
    let built = overcoat_ok(&session, &["build", "--json"]).json();
    let step = &built["steps"][1];
    assert!(
        step["verdict"].as_str().unwrap().starts_with("check it: the file is the same as that of the step 'body'"),
        "{step}"
    );
    let warnings: Vec<&str> = step["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
    assert!(warnings.iter().any(|w| w.starts_with("the scan seems to show no tshirt")), "{warnings:?}");

    let strict = overcoat(&session, &["build", "--strict"]);
    assert!(strict.code == 1 && strict.stderr.contains("1 of 2 steps are not good: tshirt"), "{strict:?}");
    assert_eq!(overcoat(&session, &["build"]).code, 0);
    let replayed = overcoat(dir.path(), &["replay", "alice", "--into", "bob", "--strict", "--json"]);
    assert_eq!(replayed.code, 1, "{replayed:?}");
    assert_eq!(replayed.json()["steps"][1]["verdict"], step["verdict"]);

    // The contact sheet and the status show it too.
    overcoat_ok(&session, &["view", "--sheet", "../sheet.png"]);
    assert!(overcoat_ok(&session, &["status"]).stdout.contains("\ntshirt: check it: the file is the same"));
}

#[test]
fn a_table_of_subjects_lists_the_verdicts() {
    let dir = tempfile::tempdir().unwrap();
    let session = body_of_demo(dir.path());
    let bare = demo_scan("0-body.ply");
    overcoat_ok(&session, &["scan", "tshirt", bare.to_str().unwrap(), "--template", "tshirt"]);
    std::fs::write(dir.path().join("people.csv"), "subject\nanna\n").unwrap();
    let people = ["replay", "alice", "--subjects", "people.csv", "--into", "people"];
    let said = overcoat_ok(dir.path(), &people).stdout;
    assert!(said.contains("tshirt: check it: the file is the same"), "{said}");
    let table = std::fs::read_to_string(dir.path().join("people/summary.csv")).unwrap();
    assert!(table.starts_with("subject,result,body.verdict,tshirt.verdict,"), "{table}");
    assert!(table.contains("anna,check,good,"), "{table}");
    assert_eq!(overcoat(dir.path(), &[&people[..], &["--strict"]].concat()).code, 1);
}

#[test]
fn a_failed_step_stays_failed_in_the_status_until_it_runs_again() {
    let dir = tempfile::tempdir().unwrap();
    let session = body_of_demo(dir.path());
    // A hat in a scan without one: nothing is labelled.
    let bare = demo_scan("0-body.ply");
    overcoat_ok(&session, &["scan", "hat", bare.to_str().unwrap(), "--template", "hat"]);
    let failed = overcoat(&session, &["build"]);
    assert_eq!(failed.code, 1, "{failed:?}");
    let step = status_of(&session, "hat");
    assert!(step["verdict"].as_str().unwrap().starts_with("failed: "), "{step}");
    assert_eq!(status_of(&session, "body")["verdict"], "good");

    // What exists is drawn: the body, and the scan that failed.
    overcoat_ok(&session, &["view", "--sheet", "../sheet.png", "--poster", "../poster.png"]);
    for picture in ["sheet.png", "poster.png"] {
        assert!(std::fs::metadata(dir.path().join(picture)).unwrap().len() > 10_000, "{picture}");
    }

    let good = demo_scan("1-tshirt.ply");
    overcoat_ok(&session, &["step", "remove", "hat"]);
    overcoat_ok(&session, &["scan", "tshirt", good.to_str().unwrap(), "--template", "tshirt"]);
    overcoat_ok(&session, &["build"]);
    assert_eq!(status_of(&session, "tshirt")["verdict"], "good");
}

#[test]
fn a_scan_on_its_side_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    // Feet along x: the file's up axis is x, but the user says y.
    let lying = mean_body(|p| Point::new(p.y, p.x + 0.9, p.z));
    let file = write_mesh(dir.path().join("lying.ply"), &lying);
    overcoat_ok(dir.path(), &["new", "alice"]);
    let session = dir.path().join("alice");
    let scanned = overcoat(&session, &["scan", "body", file.to_str().unwrap(), "--up", "+y"]);
    if scanned.code == 0 {
        let built = overcoat(&session, &["build"]);
        let said = status_of(&session, "body")["verdict"].as_str().unwrap_or("none").to_string();
        assert!(built.code == 1 || said.contains("the up axis of the file is probably another"), "{said}");
    }
}
