//! Single stages: the recipe remembers a parameter, dependent stages run again, and each reports the reason.

use crate::common::{built_quick_session, fingerprint, overcoat, overcoat_ok, quick_session, ran};
use std::path::Path;

fn recipe(session: &Path) -> String {
    std::fs::read_to_string(session.join("recipe.toml")).unwrap()
}

/// What ran in a build, without reasons.
fn names(of: &[(String, String)]) -> Vec<&str> {
    of.iter().map(|(stage, _)| stage.as_str()).collect()
}

#[test]
fn a_parameter_is_remembered_and_only_dependent_stages_run_again() {
    let dir = tempfile::tempdir().unwrap();
    let session = quick_session(dir.path(), "alice");

    // A single stage builds what it depends on, and no more.
    let fitted = overcoat_ok(&session, &["fit", "body", "--json"]).json();
    assert_eq!(names(&ran(&fitted)), ["body/scan", "body/fit", "body/register"]);
    let built = overcoat_ok(&session, &["build", "--json"]).json();
    let rest = [
        "body/figure",
        "tshirt/scan",
        "tshirt/pose",
        "tshirt/segment",
        "tshirt/cut",
        "tshirt/rig",
        "tshirt/stack",
        "tshirt/figure",
    ];
    let all = ran(&built);
    assert!(rest.iter().all(|stage| names(&all).contains(stage)), "{all:?}");
    assert!(all.iter().all(|(_, why)| why == "never_ran"), "{all:?}");

    let set = overcoat_ok(&session, &["stack", "tshirt", "--clearance", "0.004", "--json"]).json();
    assert_eq!(set["set"][0], "tshirt.stack.clearance 0.002 → 0.004");
    assert_eq!(ran(&set), [("tshirt/stack".into(), "parameter clearance 0.002 0.004".to_string())]);
    assert!(recipe(&session).contains("[step.stack]\nclearance = 0.004\n"), "{}", recipe(&session));
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["steps"][1]["out_of_date"][0], "figure");
    assert_eq!(status["steps"][1]["why"]["figure"][0]["name"], "stack");
    let built = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    assert_eq!(built[0], ("tshirt/figure".into(), "upstream stack".to_string()));
    assert!(names(&built).iter().all(|stage| !stage.starts_with("body/") && *stage != "tshirt/stack"), "{built:?}");

    // Undone and built again, nothing remains to be done: the earlier results are current.
    overcoat_ok(&session, &["undo"]);
    assert!(!recipe(&session).contains("clearance"));
    assert_eq!(overcoat_ok(&session, &["build", "--json"]).json()["ran"], 0);
    overcoat_ok(&session, &["redo"]);
    assert_eq!(overcoat_ok(&session, &["build", "--json"]).json()["ran"], 0);
    let reset = overcoat_ok(&session, &["stack", "--reset", "--json"]).json();
    assert_eq!(reset["set"][0], "tshirt.stack.clearance 0.004 → 0.002");
    let weighed = overcoat_ok(&session, &["weigh", "--greatest-share", "0.25", "--json"]).json();
    assert_eq!(weighed["set"].as_array().unwrap().len(), 1, "the body is not weighed: {weighed}");
}

#[test]
fn parameters_of_pressing_and_of_reading_a_scan_can_be_set_too() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let set = overcoat_ok(&session, &["weigh", "tshirt", "--press-clearance", "0.002", "--json"]).json();
    assert_eq!(set["set"][0], "tshirt.press.clearance 0.0012 → 0.002");
    assert_eq!(ran(&set), [("tshirt/press".into(), "parameter clearance 0.0012 0.002".to_string())]);
    assert!(recipe(&session).contains("[step.press]\nclearance = 0.002\n"), "{}", recipe(&session));

    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/1-tshirt.ply");
    let scan = |flags: &[&str]| {
        let again = ["scan", "tshirt", file.to_str().unwrap(), "--template", "tshirt", "--replace", "--faces", "4000"];
        overcoat(&session, &[&again[..], flags].concat())
    };
    for (flags, says) in [
        (["--smoothing-passes", "-1"], "smoothing_passes of the stage scan cannot be '-1'"),
        (["--truncation", "9"], "truncation of the stage scan cannot be '9'"),
    ] {
        let answer = scan(&flags);
        assert!(answer.code == 2 && answer.stderr.contains(says), "{answer:?}");
    }
    assert!(recipe(&session).contains("[step.press]"), "what was refused changed nothing: {}", recipe(&session));
    assert_eq!(scan(&["--smoothing-passes", "9"]).code, 0);
    assert!(recipe(&session).contains("[step.reading]\nsmoothing_passes = 9\n"), "{}", recipe(&session));
    let by_hand = recipe(&session).replace("smoothing_passes = 9", "smoothing_passes = 0\ndenoise_rounds = 2");
    std::fs::write(session.join("recipe.toml"), &by_hand).unwrap();
    let built = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    let why = &built[0].1;
    assert!(built[0].0 == "tshirt/scan" && why.contains("smoothing_passes 9 0"), "{built:?}");
    assert!(why.contains("parameter denoise_rounds ") && why.contains(" 2"), "{built:?}");
    std::fs::write(session.join("recipe.toml"), by_hand.replace("denoise_rounds", "denoise_turns")).unwrap();
    let unknown = overcoat(&session, &["build"]);
    let line = 1 + recipe(&session).lines().position(|l| l.starts_with("denoise")).unwrap();
    let says = format!("recipe.toml, line {line}: the stage scan has no parameter 'denoise_turns'");
    assert!(unknown.code == 1 && unknown.stderr.contains(&says), "{unknown:?}");
}

#[test]
fn a_shape_from_all_scans_depends_on_every_scan() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let set = overcoat_ok(&session, &["fit", "body", "--shape-from", "all", "--json"]).json();
    let expected = [("body/fit", "parameter shape_from naked all"), ("body/register", "upstream fit")];
    assert_eq!(ran(&set), expected.map(|(stage, why)| (stage.into(), why.to_string())));
    let built = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    assert!(names(&built).contains(&"tshirt/pose"), "what is laid on the body is laid on it again: {built:?}");
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    let fit = status["steps"][0]["up_to_date"].as_array().unwrap().iter().find(|s| s["stage"] == "fit").unwrap();
    assert_eq!(fit["measures"]["scans_in_shape"], 2.0, "{fit}");
    let said = fit["findings"].as_array().unwrap().iter().filter_map(|line| line.as_str());
    assert!(said.clone().any(|line| line.starts_with("one shape from 2 scans: ")), "{fit}");

    // A garment's scan is now a reason for the body; where the naked scan alone makes the shape, it is none.
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/1-tshirt.ply");
    let again = ["scan", "tshirt", file.to_str().unwrap(), "--template", "tshirt", "--replace", "--faces", "5000"];
    overcoat_ok(&session, &again);
    let built = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    assert!(built.contains(&("body/fit".into(), "upstream the other scans".into())), "{built:?}");
    overcoat_ok(&session, &["fit", "body", "--shape-from", "naked"]);
    overcoat_ok(&session, &["build"]);
    overcoat_ok(&session, &[&again[..again.len() - 1], &["4000"]].concat());
    let built = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    assert!(names(&built).iter().all(|stage| !stage.starts_with("body/")), "{built:?}");
}

#[test]
fn a_failed_stage_or_an_impossible_value_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let before = fingerprint(&session);
    for (command, code, says) in [
        ("fit tshirt --refuse-above 0.0001", 1, "the figure does not match this scan"),
        ("stack tshirt --clearance -1", 2, "clearance of the stage stack cannot be '-1'"),
        ("stack tshirt --clearance nan", 2, "cannot be 'nan'"),
        ("stack tshirt --smoothing-lengths 0.01,", 2, "cannot be '0.01,'"),
        ("fit body --margin 0.001", 2, "margin is a parameter of garments (pose), not of 'body'"),
        ("fit tshirt --register-iterations 2", 2, "iterations is a parameter of the body's step (register)"),
        ("weigh body --greatest-share 0.3", 2, "greatest_share is a parameter of garments"),
        ("segment body", 2, "the step 'body' has no stage 'segment'"),
        ("segment coat", 2, "there is no step 'coat'"),
        ("segment --colour 1", 2, "--colour"),
    ] {
        let answer = overcoat(&session, &command.split(' ').collect::<Vec<_>>());
        assert!(answer.code == code && answer.stderr.contains(says), "{command}: {answer:?}");
        assert_eq!(answer.stderr.lines().count(), 2, "{answer:?}");
        let after = fingerprint(&session);
        assert!(before.iter().all(|(file, hash)| after.get(file) == Some(hash)), "{command} changed the session");
    }
}

#[test]
fn a_change_of_the_recipe_by_hand_is_named_as_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let built = recipe(&session);
    let edit = |from: &str, to: &str| {
        assert!(built.contains(from), "{built}");
        std::fs::write(session.join("recipe.toml"), built.replacen(from, to, 1)).unwrap();
        ran(&overcoat_ok(&session, &["build", "--json"]).json())
    };
    let longer = edit("template = \"tshirt\"\n", "template = \"tshirt\"\nuntil = \"hip\"\n");
    assert_eq!(longer[0], ("tshirt/pose".into(), "kind until  hip".to_string()));
    let coarser = edit("faces = 4000\n\n[step.pose]", "faces = 3500\n\n[step.pose]");
    assert_eq!(coarser[0], ("tshirt/scan".into(), "parameter faces 4000 3500".to_string()));
    assert!(coarser[1].1.starts_with("kind until hip; upstream scan"), "{coarser:?}");
    let unknown = overcoat(&session, &["status"]);
    assert_eq!(unknown.code, 0);
    std::fs::write(session.join("recipe.toml"), built.replace("samples = 300", "speed = 300")).unwrap();
    let unknown = overcoat(&session, &["build"]);
    assert_eq!(unknown.code, 1);
    let line = 1 + recipe(&session).lines().position(|l| l.starts_with("speed")).unwrap();
    assert!(unknown.stderr.contains(&format!("recipe.toml, line {line}: the stage ")), "{unknown:?}");
    assert!(unknown.stderr.contains("has no parameter 'speed'"), "{unknown:?}");
}

#[test]
fn a_build_with_nothing_to_do_reads_no_result() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    // Whoever reads one of these fails.
    for entry in std::fs::read_dir(session.join("artefacts")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            let length = std::fs::metadata(&path).unwrap().len() as usize;
            std::fs::write(&path, vec![0; length]).unwrap();
        }
    }
    assert_eq!(overcoat_ok(&session, &["build", "--json"]).json()["ran"], 0);
    let read = overcoat(&session, &["export", "out.glb"]);
    assert_eq!(read.code, 1, "an export reads them: {read:?}");
}
