//! A body without a bare scan: an outfit as the first step.

use crate::common::{overcoat, overcoat_ok};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn demo_scan(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo").join(name).display().to_string()
}

/// A session whose first step is the demo's woman in T-shirt and skirt, coarse.
fn scanned(dir: &Path, more: &[&str]) -> PathBuf {
    overcoat_ok(dir, &["new", "ann"]);
    let session = dir.join("ann");
    let outfit = demo_scan("2-skirt.ply");
    let args = [&["scan", "outfit", &outfit, "--template", "tshirt,skirt", "--faces", "6000"], more].concat();
    overcoat_ok(&session, &args);
    session
}

fn measures(session: &Path) -> Value {
    let status = overcoat_ok(session, &["status", "--json"]).json();
    let stages = status["steps"][0]["up_to_date"].as_array().unwrap();
    stages.iter().find(|stage| stage["stage"] == "fit").unwrap()["measures"].clone()
}

#[test]
fn an_outfit_as_the_first_step_gives_the_body_and_a_bare_scan_takes_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let session = scanned(dir.path(), &[]);
    overcoat_ok(&session, &["build"]);
    let status = overcoat_ok(&session, &["status"]);
    assert!(status.stdout.contains("estimated under clothes: stature"), "{}", status.stdout);
    let drawn = overcoat_ok(&session, &["view", "--confidence", "sure.png", "--json"]).json();
    let half = |part: &str| drawn["confidence"][part].as_f64().unwrap();
    for part in ["chest", "hips", "thigh", "hand"] {
        assert!((0.002..0.04).contains(&half(part)), "{drawn}");
    }
    assert!(session.join("sure.png").is_file() || dir.path().join("sure.png").is_file());
    let estimated = measures(&session);
    let of = |name: &str| estimated[name].as_f64().unwrap();

    // The bare scan of the same woman says how far the estimate is off.
    overcoat_ok(&session, &["scan", "body", &demo_scan("0-body.ply"), "--faces", "6000"]);
    overcoat_ok(&session, &["build"]);
    let report = overcoat_ok(&session, &["body", "measure", "--json"]).json();
    let truth = |name: &str| report["measures_cm"][name].as_f64().unwrap();
    for (short, name) in [("chest", "chest girth"), ("waist", "waist girth"), ("hip", "hip girth")] {
        let (value, half) = (of(&format!("estimated_{short}_cm")), of(&format!("estimated_{short}_half_interval_cm")));
        assert!((1.0..9.0).contains(&half), "{name} ± {half}");
        assert!((value - truth(name)).abs() < 2.0 * half, "{name} {value} ± {half}, truly {}", truth(name));
    }
    let status = overcoat_ok(&session, &["status"]);
    assert!(!status.stdout.contains("estimated"), "{}", status.stdout);
    let refused = overcoat(&session, &["view", "--confidence", "sure.png", "--force"]);
    assert!(refused.code == 2 && refused.stderr.contains("the body was scanned bare"), "{refused:?}");
    overcoat_ok(&session, &["undo"]);
    assert!(std::fs::read_to_string(session.join("recipe.toml")).unwrap().contains("estimated = true"));
}

#[test]
fn what_is_known_of_the_person_counts() {
    let dir = tempfile::tempdir().unwrap();
    let session = scanned(dir.path(), &["--measures", "waist=95,chest=110", "--weight", "80"]);
    overcoat_ok(&session, &["fit", "body"]);
    let told = measures(&session)["estimated_waist_cm"].as_f64().unwrap();
    overcoat_ok(&session, &["undo"]);
    let outfit = demo_scan("2-skirt.ply");
    overcoat_ok(&session, &["scan", "outfit", &outfit, "--template", "tshirt,skirt", "--faces", "6000"]);
    overcoat_ok(&session, &["fit", "body"]);
    let seen = measures(&session)["estimated_waist_cm"].as_f64().unwrap();
    assert!(told > seen + 4.0 && told < 95.5, "{told} from {seen}");
}

#[test]
fn what_cannot_be_estimated_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let fails = |args: &[&str], words: &str| {
        let session = dir.path().join("bob");
        let _ = std::fs::remove_dir_all(&session);
        overcoat_ok(dir.path(), &["new", "bob"]);
        let answer = overcoat(&session, args);
        let answer = if answer.code == 0 { overcoat(&session, &["build"]) } else { answer };
        assert_ne!(answer.code, 0, "{args:?}");
        assert!(answer.stderr.contains(words) || answer.stdout.contains(words), "{args:?}: {answer:?}");
    };
    let (skirt, bare) = (demo_scan("2-skirt.ply"), demo_scan("0-body.ply"));
    let outfit = ["scan", "outfit", &skirt, "--template", "tshirt,skirt"];
    fails(&[&outfit[..], &["--measures", "collar=40"]].concat(), "'collar' is no measure of a person");
    fails(&[&outfit[..], &["--measures", "chest"]].concat(), "'chest' is no measure");
    fails(&[&outfit[..], &["--weight=-3"]].concat(), "cannot be -3");
    fails(&["scan", "body", &bare, "--weight", "70"], "for a person without a bare scan");
    fails(&["scan", "body", &bare, "--known-body", &bare], "for a person without a bare scan");
    fails(&[&outfit[..], &["--known-body", "nobody.ply"]].concat(), "nobody.ply");
    fails(&["scan", "tshirt", &skirt, "--template", "tshirt"], "overcoat scan outfit FILE --template");
}
