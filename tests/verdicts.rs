//! One verdict per step: what is implausible, what failed, and what `--strict` does about it.

use crate::common::{
    body_of_demo, built_quick_session, coarse_session, demo, demo_mesh, demo_scan, mean_body, overcoat, overcoat_ok,
    write_mesh,
};
use overcoat::formats::read_ply;
use overcoat::geometry::Point;
use serde_json::Value;
use std::path::Path;

/// The verdicts of a build, which must do its work.
fn verdicts(session: &Path) -> Vec<String> {
    let built = overcoat_ok(session, &["build", "--json"]).json();
    built["steps"].as_array().unwrap().iter().map(|s| s["verdict"].as_str().unwrap().to_string()).collect()
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
fn a_wrong_order_of_scans_and_a_scan_given_twice_are_reported() {
    let dir = tempfile::tempdir().unwrap();
    let tshirt = demo_scan("1-tshirt.ply");
    let steps = [
        ("body", demo_scan("0-body.ply")),
        ("skirt", demo_scan("2-skirt.ply")),
        ("tshirt", tshirt.clone()),
        ("vest", tshirt),
    ];
    let found = verdicts(&coarse_session(dir.path(), "alice", &steps));
    assert_eq!(found[0], "good");
    assert!(found[1].starts_with("check it: "), "the T-shirt below it is not listed: {found:?}");
    assert!(found[2].starts_with("check it: the scan does not show the skirt on "), "{found:?}");
    let twice = "check it: the file is the same as that of the step 'tshirt', so it shows no further garment";
    assert!(found[3].starts_with(twice), "{found:?}");
}

#[test]
fn another_person_in_a_garment_s_scan_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    // As tall, and a tenth broader.
    let mut broad = demo_mesh("1-tshirt.ply");
    broad.points.iter_mut().for_each(|p| (p[0], p[2]) = (1.1 * p[0], 1.1 * p[2]));
    let broad = write_mesh(dir.path().join("broad.ply"), &broad);
    let found = verdicts(&coarse_session(dir.path(), "alice", &[("body", demo_scan("0-body.ply")), ("tshirt", broad)]));
    assert!(found[1].starts_with("check it: visible skin is "), "{found:?}");
    assert!(found[1].contains("mm from the scan: it may show another person"), "{found:?}");
}

#[test]
fn a_clothed_person_as_bare_body_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let found = verdicts(&coarse_session(dir.path(), "alice", &[("body", demo_scan("1-tshirt.ply"))]));
    assert!(found[0].starts_with("check it: ") && found[0].contains("the person may be clothed"), "{found:?}");
    // Their girths are those of the clothes, so `body measure` says it, too: of the session and of the file.
    let session = overcoat_ok(dir.path(), &["-C", "alice", "body", "measure"]).stdout;
    let scan = demo_scan("1-tshirt.ply").display().to_string();
    let file = overcoat_ok(dir.path(), &["body", "measure", &scan]).stdout;
    for said in [session, file] {
        assert!(said.lines().any(|line| line.starts_with("check it: ") && line.contains("clothed")), "{said}");
    }
    let bare = demo_scan("0-body.ply").display().to_string();
    let measured = overcoat_ok(dir.path(), &["body", "measure", &bare, "--json"]).json();
    assert_eq!(measured["warnings"].as_array().unwrap().len(), 0, "{measured}");
}

#[test]
fn a_person_who_sits_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let mut show = vec!["body", "show", "--mesh", "sitting.ply"];
    for turn in ["leftUpperLeg=-80,0,0", "rightUpperLeg=-80,0,0", "leftLowerLeg=80,0,0", "rightLowerLeg=80,0,0"] {
        show.extend(["--pose", turn]);
    }
    overcoat_ok(dir.path(), &show);
    let found = verdicts(&coarse_session(dir.path(), "alice", &[("body", dir.path().join("sitting.ply"))]));
    assert!(found[0].starts_with("check it: a hip is bent by "), "{found:?}");
    assert!(found[0].contains("the person seems to sit or squat"), "{found:?}");
}

#[test]
fn a_ragged_garment_is_reported_by_the_number_and_the_shape_of_its_hems() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let warnings = |session: &Path| status_of(session, "tshirt")["warnings"].to_string();
    assert!(!warnings(&session).contains("ragged"), "{}", warnings(&session));
    // Notches are painted out of the lower hem, 8 cm deep, twelve around the waist, and the lower legs as cloth, which has more
    // edges.
    overcoat_ok(&session, &["mask", "tshirt", "--template", "../labels.ply"]);
    let file = dir.path().join("labels.ply");
    let mut labels = read_ply(std::fs::File::open(&file).unwrap()).unwrap();
    let colors = labels.colors.as_mut().unwrap();
    let is_cloth = |c: &[u8; 3]| c[0] > 150 && c[1] < 100;
    let worn: Vec<[f64; 3]> =
        labels.points.iter().zip(&*colors).filter(|(_, c)| is_cloth(c)).map(|(p, _)| *p).collect();
    let low = worn.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let floor = labels.points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let middle = [0, 2].map(|axis| worn.iter().map(|p| p[axis]).sum::<f64>() / worn.len() as f64);
    for (p, color) in labels.points.iter().zip(colors.iter_mut()) {
        let turn = (p[2] - middle[1]).atan2(p[0] - middle[0]) / std::f64::consts::TAU;
        if is_cloth(color) && p[1] < low + 0.08 && ((24.0 * turn).floor() as i64).rem_euclid(2) == 0 {
            *color = [150; 3];
        }
        if p[1] < floor + 0.35 {
            *color = [230, 80, 60];
        }
    }
    write_mesh(file, &labels);
    overcoat_ok(&session, &["mask", "tshirt", "../labels.ply"]);
    overcoat_ok(&session, &["build"]);
    for doubt in
        ["a hem of the tshirt is ragged, most of all ", " hem loops, 4 expected; look at the edges of the tshirt"]
    {
        assert!(warnings(&session).contains(doubt), "{}", warnings(&session));
    }
    // The number stays what it is wherever it is shown.
    let built = overcoat_ok(&session, &["build", "--json"]).json();
    assert_eq!(built["steps"][1]["warnings"], status_of(&session, "tshirt")["warnings"]);
}

#[test]
fn a_bare_scan_as_hat_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    // Another file of the same bare person.
    let mut again = demo_mesh("0-body.ply");
    again.points.iter_mut().for_each(|p| p[0] += 0.1);
    let again = write_mesh(dir.path().join("again.ply"), &again);
    let session = coarse_session(dir.path(), "alice", &[("body", demo_scan("0-body.ply")), ("hat", again)]);
    let answer = overcoat(&session, &["build"]);
    assert!(answer.code == 1 && answer.stderr.contains("no part of the scan belongs to the garment"), "{answer:?}");
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

    // The garments after it are put on the figure before it, and say so.
    let good = demo_scan("1-tshirt.ply");
    overcoat_ok(&session, &["scan", "tshirt", good.to_str().unwrap(), "--template", "tshirt"]);
    let built = overcoat(&session, &["build"]);
    assert_eq!(built.code, 1, "{built:?}");
    assert!(built.stderr.contains("hat") && built.stderr.contains("tshirt: check it"), "{}", built.stderr);
    let without = "it lies on the figure without 'hat'";
    let step = status_of(&session, "tshirt");
    assert!(step["warnings"].to_string().contains(without), "{step}");
    assert!(status_of(&session, "hat")["verdict"].as_str().unwrap().starts_with("failed: "));
    overcoat_ok(&session, &["view", "--sheet", "../sheet.png", "--poster", "../poster.png", "--force"]);
    let moved = overcoat_ok(&session, &["animate", "walk", "--frames", "20..22", "--mode", "lbs", "--json"]).json();
    assert_eq!(moved["measures"]["frames"], 2.0, "{moved}");
    let exported = overcoat_ok(&session, &["export", "layers/", "--json"]).json();
    assert!(exported.to_string().contains("'hat' failed and is not in the figure"), "{exported}");
    let layers = [("body", true), ("tshirt", true), ("hat", false)];
    assert!(layers.iter().all(|(name, is)| session.join(format!("layers/{name}.ply")).exists() == *is));
    assert_eq!(overcoat(&session, &["export", "hat/", "--at", "hat"]).code, 1);

    overcoat_ok(&session, &["step", "remove", "hat"]);
    overcoat_ok(&session, &["build"]);
    let step = status_of(&session, "tshirt");
    assert!(!step["verdict"].as_str().unwrap().starts_with("failed: "), "{step}");
    assert!(!step["warnings"].to_string().contains(without), "{step}");
}

#[test]
fn a_scan_on_its_side_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    // The head along x: the file's up axis is x, but the user says y.
    let lying = mean_body(|p| Point::new(p.y, 0.9 - p.x, p.z));
    let file = write_mesh(dir.path().join("lying.ply"), &lying);
    overcoat_ok(dir.path(), &["new", "alice"]);
    let session = dir.path().join("alice");
    overcoat_ok(&session, &["scan", "body", file.to_str().unwrap(), "--up", "+y"]);
    let built = overcoat(&session, &["build"]);
    let said = status_of(&session, "body")["verdict"].as_str().unwrap_or("none").to_string();
    let is_refused = built.code == 1 && said.starts_with("failed: ") && said.contains("is the up axis wrong (--up)");
    let is_doubted = built.code == 0 && said.contains("the up axis of the file is probably another");
    assert!(is_refused || is_doubted, "{said}: {built:?}");

    // Halfway to its side the fit still finds the person, and without the flag all is well.
    let (sin, cos) = 0.8_f64.sin_cos();
    let leaning = mean_body(|p| Point::new(p.x, cos * p.y - sin * p.z, sin * p.y + cos * p.z));
    let file = write_mesh(dir.path().join("leaning.ply"), &leaning);
    overcoat_ok(&session, &["scan", "body", file.to_str().unwrap(), "--up", "+y", "--replace"]);
    let found = verdicts(&session);
    assert!(found[0].starts_with("check it: the person leans 4"), "{found:?}");
    assert!(found[0].contains("the up axis of the file is probably another; scan it again with `--up`"), "{found:?}");
    overcoat_ok(&session, &["step", "set", "body", "up="]);
    assert_eq!(verdicts(&session), ["good"]);
}
