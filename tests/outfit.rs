//! An outfit: several garments that one scan shows for the first time.

use crate::common::{
    built_outfit, copy_folder, demo_scan, fingerprint, mean_body, outfit_scanned, overcoat, overcoat_ok, ran,
    write_mesh,
};
use overcoat::formats::read_npy;
use serde_json::Value;
use std::path::Path;

fn recipe(session: &Path) -> String {
    std::fs::read_to_string(session.join("recipe.toml")).unwrap()
}

fn names(session: &Path) -> Vec<String> {
    let listed = overcoat_ok(session, &["step", "list", "--json"]).json();
    listed["steps"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap().to_string()).collect()
}

/// The labels of a garment, one per vertex of the scan.
fn labels(session: &Path, garment: &str) -> Vec<bool> {
    let file = session.join(format!("{garment}-labels.npy"));
    overcoat_ok(session, &["mask", garment, "--template", file.to_str().unwrap(), "--force"]);
    let array = read_npy(std::fs::File::open(&file).unwrap()).unwrap();
    array.to_i64("labels").unwrap().iter().map(|&label| label == 1).collect()
}

/// What the stages made, by step and stage.
fn outputs(session: &Path) -> Vec<(String, String)> {
    let state: Value = serde_json::from_slice(&std::fs::read(session.join("session.json")).unwrap()).unwrap();
    let mut found = Vec::new();
    for step in state["steps"].as_array().unwrap() {
        for (stage, record) in step["stages"].as_object().unwrap() {
            found.push((format!("{}/{stage}", step["name"].as_str().unwrap()), record["output"].to_string()));
        }
    }
    found.sort();
    found
}

#[test]
fn an_outfit_is_one_scan_one_fit_and_one_layer_per_garment() {
    let dir = tempfile::tempdir().unwrap();
    let session = outfit_scanned(dir.path(), "alice", "tshirt,skirt");
    let text = recipe(&session);
    assert_eq!(text.matches("outfit = \"outfit\"").count(), 2, "{text}");
    assert!(text.find("name = \"skirt\"").unwrap() < text.find("name = \"tshirt\"").unwrap(), "inside out: {text}");
    assert_eq!(names(&session), ["body", "skirt", "tshirt"]);
    let lines = overcoat_ok(&session, &["step", "list"]).stdout;
    assert_eq!(lines.matches("outfit outfit").count(), 2, "{lines}");
    let stages = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    let ran: Vec<&str> = stages.iter().map(|(stage, _)| stage.as_str()).collect();
    for once in ["pose", "evidence"] {
        assert!(ran.contains(&format!("skirt/{once}").as_str()) && !ran.contains(&format!("tshirt/{once}").as_str()));
    }
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    for step in status["steps"].as_array().unwrap() {
        assert_eq!(step["out_of_date"].as_array().unwrap().len(), 0, "{step}");
        let warnings = step["warnings"].to_string();
        for wrong in ["is the same as", "not listed", "shows no", "another person"] {
            assert!(!warnings.contains(wrong), "{warnings}");
        }
    }
    assert_eq!(ran_again(&session), 0);
    let (skirt, tshirt) = (labels(&session, "skirt"), labels(&session, "tshirt"));
    let count = |labels: &[bool]| labels.iter().filter(|l| **l).count();
    assert!(count(&skirt) > 200 && count(&tshirt) > 200, "{} {}", count(&skirt), count(&tshirt));
    assert!(!skirt.iter().zip(&tshirt).any(|(a, b)| *a && *b), "a vertex belongs to one garment at most");
    overcoat_ok(&session, &["export", "layers/"]);
    for layer in ["body", "skirt", "tshirt"] {
        assert!(session.join("layers").join(format!("{layer}.ply")).is_file());
    }
    overcoat_ok(&session, &["undo", "2"]);
    assert_eq!(names(&session), ["body"]);
}

fn ran_again(session: &Path) -> usize {
    ran(&overcoat_ok(session, &["build", "--json"]).json()).len()
}

#[test]
fn a_listed_garment_that_the_scan_does_not_show_is_reported_and_the_others_are_built() {
    let dir = tempfile::tempdir().unwrap();
    let session = outfit_scanned(dir.path(), "alice", "tshirt,skirt,underpants");
    overcoat_ok(&session, &["step", "set", "underpants", "pose.samples=300", "pose.iterations=4"]);
    overcoat_ok(&session, &["build"]);
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    let says = |name: &str| {
        let step = status["steps"].as_array().unwrap().iter().find(|step| step["name"] == name).unwrap();
        (step["verdict"].as_str().unwrap().to_string(), step["warnings"].to_string())
    };
    let (verdict, warnings) = says("underpants");
    assert!(verdict.starts_with("check it"), "{verdict}");
    assert!(warnings.contains("the scan shows nothing of the underpants, which is listed"), "{warnings}");
    assert!(!says("skirt").0.starts_with("failed") && !says("tshirt").0.starts_with("failed"));
    overcoat_ok(&session, &["export", "layers/"]);
    let has = |layer: &str| session.join("layers").join(format!("{layer}.ply")).is_file();
    assert!(has("skirt") && has("tshirt") && !has("underpants"));
    overcoat_ok(&session, &["export", "character.glb"]);
    overcoat_ok(&session, &["view", "--sheet", "sheet.png", "--weights", "weights.png", "--poster", "poster.png"]);
    assert_eq!(ran_again(&session), 0);
    // Painted, it is there.
    let count = labels(&session, "skirt").len();
    let skirt = labels(&session, "skirt");
    let below: Vec<i32> = (0..count).map(|v| if skirt[v] { 1 } else { -1 }).collect();
    let file = dir.path().join("below.npy");
    let array = overcoat::formats::NpyArray::vector(below);
    overcoat::formats::write_npy(&array, std::fs::File::create(&file).unwrap()).unwrap();
    overcoat_ok(&session, &["mask", "underpants", file.to_str().unwrap()]);
    overcoat_ok(&session, &["build"]);
    assert!(labels(&session, "underpants").iter().filter(|l| **l).count() > 200);
}

#[test]
fn the_order_of_the_templates_changes_nothing_and_a_replay_gives_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let alice = built_outfit(dir.path(), "alice");
    let other = outfit_scanned(dir.path(), "other", "skirt,tshirt");
    overcoat_ok(&other, &["build"]);
    assert_eq!(outputs(&other), outputs(&alice));
    overcoat_ok(dir.path(), &["replay", "alice/recipe.toml", "--into", "again"]);
    assert_eq!(outputs(&dir.path().join("again")), outputs(&alice));
    for session in ["alice", "again"] {
        overcoat_ok(&dir.path().join(session), &["export", "character.glb"]);
    }
    let glb = |of: &str| std::fs::read(dir.path().join(of).join("character.glb")).unwrap();
    assert!(glb("alice") == glb("again"));
}

#[test]
fn a_mask_of_one_garment_takes_from_the_other() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_outfit(dir.path(), "alice");
    let (skirt, tshirt) = (labels(&session, "skirt"), labels(&session, "tshirt"));
    // Paint a few vertices of the skirt as the T-shirt.
    let mut numbers: Vec<i32> = vec![-1; skirt.len()];
    let painted: Vec<usize> = (0..skirt.len()).filter(|&v| skirt[v]).step_by(7).take(20).collect();
    painted.iter().for_each(|&v| numbers[v] = 1);
    let file = dir.path().join("more.npy");
    let array = overcoat::formats::NpyArray::vector(numbers);
    overcoat::formats::write_npy(&array, std::fs::File::create(&file).unwrap()).unwrap();
    overcoat_ok(&session, &["mask", "tshirt", file.to_str().unwrap()]);
    let stages = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    assert!(stages.iter().any(|(stage, why)| stage == "skirt/segment" && why.contains("masks")), "{stages:?}");
    assert!(!stages.iter().any(|(stage, _)| stage.ends_with("/pose")), "{stages:?}");
    let (skirt_now, tshirt_now) = (labels(&session, "skirt"), labels(&session, "tshirt"));
    assert!(painted.iter().all(|&v| tshirt_now[v] && !skirt_now[v]));
    assert!(!skirt_now.iter().zip(&tshirt_now).any(|(a, b)| *a && *b));
    overcoat_ok(&session, &["mask", "remove", "tshirt", "--all"]);
    overcoat_ok(&session, &["build"]);
    assert_eq!((labels(&session, "skirt"), labels(&session, "tshirt")), (skirt, tshirt));
}

#[test]
fn steps_of_an_outfit_are_edited_one_by_one_and_share_their_scan() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_outfit(dir.path(), "alice");
    overcoat_ok(&session, &["step", "set", "tshirt", "up=+y", "segment.color=0.5", "stack.clearance=0.004"]);
    let text = recipe(&session);
    for (key, count) in [("up = \"y\"", 2), ("color = 0.5", 2), ("clearance = 0.004", 1)] {
        assert_eq!(text.matches(key).count(), count, "{key}: {text}");
    }
    overcoat_ok(&session, &["undo"]);
    overcoat_ok(&session, &["step", "rename", "tshirt", "top"]);
    overcoat_ok(&session, &["step", "move", "top", "--before", "skirt"]);
    assert_eq!(names(&session), ["body", "top", "skirt"]);
    overcoat_ok(&session, &["build"]);
    // A jacket over the outfit, in a scan of its own.
    let pullover = demo_scan("3-pullover.ply").display().to_string();
    let jacket = ["scan", "jacket", &pullover, "--template", "jacket", "--faces", "4000"];
    overcoat_ok(&session, &jacket);
    let apart = overcoat(&session, &["step", "move", "jacket", "--before", "skirt"]);
    assert!(apart.code == 2 && apart.stderr.contains("have another step between them"), "{apart:?}");
    overcoat_ok(&session, &["step", "set", "jacket", "pose.samples=300", "pose.iterations=4"]);
    overcoat_ok(&session, &["build"]);
    overcoat_ok(&session, &["step", "remove", "top"]);
    overcoat_ok(&session, &["build"]);
    assert_eq!(names(&session), ["body", "skirt", "jacket"]);
    let outfit = demo_scan("2-skirt.ply").display().to_string();
    let again = ["scan", "outfit", &outfit, "--template", "tshirt,skirt", "--replace"];
    overcoat_ok(&session, &again);
    assert_eq!(names(&session), ["body", "skirt", "tshirt", "jacket"]);
}

#[test]
fn a_garment_that_is_not_listed_is_named_and_one_that_is_absent_too() {
    let dir = tempfile::tempdir().unwrap();
    // Without the skirt; and with shoes, which she does not wear.
    for (name, templates, says) in [
        ("unlisted", "tshirt,shoes", "belong to no listed garment, perhaps"),
        ("absent", "tshirt,skirt,shoes", "the scan seems to show no shoes"),
    ] {
        let session = dir.path().join(name);
        copy_folder(&built_outfit(dir.path(), &format!("{name}-before")), &session);
        let outfit = demo_scan("2-skirt.ply").display().to_string();
        let again = ["scan", "outfit", &outfit, "--template", templates, "--faces", "4000", "--replace"];
        overcoat_ok(&session, &again);
        overcoat_ok(&session, &["step", "set", "shoes", "pose.samples=300", "pose.iterations=4"]);
        // Crossing layers make a step fail; all steps are built.
        overcoat(&session, &["build"]);
        let status = overcoat_ok(&session, &["status", "--json"]).json();
        let shoes = status["steps"].as_array().unwrap().last().unwrap();
        assert!(shoes["warnings"].to_string().contains(says), "{name}: {shoes}");
    }
}

#[test]
fn a_single_garment_is_a_step_like_any_other() {
    let dir = tempfile::tempdir().unwrap();
    let scan = write_mesh(dir.path().join("body.ply"), &mean_body(|p| p));
    let scan = scan.to_str().unwrap();
    for name in ["one", "two"] {
        overcoat_ok(dir.path(), &["new", name]);
        overcoat_ok(&dir.path().join(name), &["scan", "body", scan]);
    }
    overcoat_ok(&dir.path().join("one"), &["scan", "outfit", scan, "--template", "tshirt"]);
    overcoat_ok(&dir.path().join("two"), &["scan", "tshirt", scan, "--template", "tshirt"]);
    assert_eq!(recipe(&dir.path().join("one")), recipe(&dir.path().join("two")));
}

#[test]
fn impossible_outfits_are_refused_and_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let scan = write_mesh(dir.path().join("body.ply"), &mean_body(|p| p));
    let scan = scan.to_str().unwrap();
    overcoat_ok(dir.path(), &["new", "session"]);
    let session = dir.path().join("session");
    overcoat_ok(&session, &["scan", "body", scan]);
    overcoat_ok(&session, &["scan", "coat", scan, "--template", "coat"]);
    overcoat_ok(&session, &["scan", "summer", scan, "--template", "shorts,tshirt"]);
    let files = || fingerprint(&session).into_iter().filter(|(path, _)| path != Path::new("lock")).collect::<Vec<_>>();
    let before = files();
    for (typed, says) in [
        ("outfit FILE --template shirt,trousers,shirt", "the template 'shirt' is given twice"),
        ("outfit FILE --template shirt,T-shirt,tshirt", "the template 'tshirt' is given twice"),
        ("outfit FILE --template shirt,trowsers", "there is no garment template 'trowsers'"),
        ("outfit FILE --template shirt,", "there is no garment template ''"),
        ("outfit FILE --template shirt,coat", "there is already a step 'coat'"),
        ("outfit FILE --template shirt,skirt --names a,a", "there is already a step 'a'"),
        ("outfit FILE --template shirt,skirt --names a,b/c", "'b/c' cannot be the name of a garment"),
        ("outfit FILE --template shirt,skirt --names a", "1 name for 2 templates"),
        ("shirt FILE --template shirt,skirt", "'shirt' cannot be the name of the outfit and of one of its garments"),
        ("summer FILE --template shirt,skirt", "there is already an outfit 'summer'"),
        ("body FILE --template shirt,skirt", "takes no template"),
        ("outfit FILE --template shirt,skirt --over shirt", "does not say what is over what"),
        ("outfit FILE --template shirt,skirt --over hat:skirt", "names 'hat', but the garments of the outfit are"),
        ("outfit FILE --template shirt,skirt --over skirt:skirt", "over itself"),
        ("outfit FILE --template shirt,skirt --over shirt:skirt,skirt:shirt", "there is no order in which"),
        ("outfit FILE --template shirt,skirt --until knee", "--until is for one garment"),
        ("outfit FILE --template shirt,skirt --hair drop", "--hair is for the bare body only"),
        ("outfit nothing.ply --template shirt,skirt", "there is no file"),
        ("outfit FILE --over shirt:skirt", "--template"),
    ] {
        let args: Vec<&str> =
            ["scan"].into_iter().chain(typed.split(' ').map(|word| if word == "FILE" { scan } else { word })).collect();
        let answer = overcoat(&session, &args);
        assert_eq!(answer.code, 2, "{typed}: {answer:?}");
        assert!(answer.stderr.contains(says), "{typed}: {answer:?}");
        assert_eq!(files(), before, "{typed}");
    }
}
