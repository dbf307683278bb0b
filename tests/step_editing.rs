//! `overcoat step`: the list of steps is edited without opening the recipe, and every edit can be undone.

use crate::common::{
    built_quick_session, copy_folder, fingerprint, mean_body, overcoat, overcoat_ok, ran, session_with_two_scans,
    write_mesh,
};
use overcoat::formats::{NpyArray, PlyOptions, RawMesh, read_ply, write_npy, write_ply};
use overcoat::geometry::Point;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A session of a body, a shirt with a stroke, and a coat, none of them built; `dir/again.ply` is another scan.
fn dressed(dir: &Path) -> PathBuf {
    let session = session_with_two_scans(dir);
    let scan = dir.join("body.ply");
    overcoat_ok(&session, &["scan", "coat", scan.to_str().unwrap(), "--template", "coat"]);
    let at = mean_body(|p| p).points[40];
    let stroke = format!(r#"{{"layer":"shirt","op":"erase","radius":0.03,"points":[{at:?}]}}"#);
    std::fs::write(dir.join("dab.jsonl"), stroke).unwrap();
    overcoat_ok(&session, &["mask", "shirt", "../dab.jsonl"]);
    write_mesh(dir.join("again.ply"), &mean_body(|p| p * 1.01));
    session
}

fn recipe(session: &Path) -> String {
    std::fs::read_to_string(session.join("recipe.toml")).unwrap()
}

fn names(session: &Path) -> Vec<String> {
    let listed = overcoat_ok(session, &["step", "list", "--json"]).json();
    listed["steps"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap().to_string()).collect()
}

#[test]
fn steps_are_listed_with_number_name_kind_file_and_masks() {
    let dir = tempfile::tempdir().unwrap();
    let session = dressed(dir.path());
    let lines = overcoat_ok(&session, &["step", "list"]).stdout;
    let words: Vec<Vec<&str>> = lines.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(words[0], ["1", "body", "-", "../body.ply", "no", "masks"]);
    assert_eq!(words[1], ["2", "shirt", "tshirt", "../body.ply", "1", "mask"]);
    assert_eq!(words[2], ["3", "coat", "coat", "../body.ply", "no", "masks"]);
    let from_outside = overcoat_ok(dir.path(), &["-C", "session", "step", "list", "--json"]).json();
    let shirt = json!({ "number": 2, "name": "shirt", "template": "tshirt", "file": "body.ply", "masks": 1 });
    assert_eq!(from_outside["steps"][1], shirt);
    assert_eq!(from_outside["steps"][0]["template"], Value::Null);
}

#[test]
fn every_edit_is_in_the_log_and_can_be_undone_and_redone() {
    let dir = tempfile::tempdir().unwrap();
    let session = dressed(dir.path());
    let before = recipe(&session);
    for (edit, says, logged) in [
        ("remove shirt", "removed shirt and its masks ../dab.jsonl", "step shirt removed"),
        ("rename shirt blouse", "renamed shirt to blouse", "step shirt renamed to blouse"),
        ("move coat --before shirt", "moved coat: body, coat, shirt", "step coat moved before shirt"),
        ("move shirt --after coat", "moved shirt: body, coat, shirt", "step shirt moved after coat"),
        ("set shirt template=blouse", "shirt.template tshirt → blouse", "set shirt.template tshirt → blouse"),
        ("set shirt until=hip sleeve=0.2", "shirt.sleeve default → 0.2", "set shirt.until default → hip"),
        ("set shirt segment.color=0.5", "shirt.segment.color ", "set shirt.segment.color"),
        ("set coat faces=5000 smoothing-passes=2", "coat.faces default → 5000", "set coat.faces default → 5000"),
        ("set body path=../again.ply", "body.path ../body.ply → ../again.ply", "set body.path"),
        ("set body surface=scan", "body.surface default → scan", "set body.surface"),
    ] {
        let args: Vec<&str> = ["step"].into_iter().chain(edit.split(' ')).collect();
        let answer = overcoat_ok(&session, &args);
        assert!(answer.stdout.contains(says), "{edit}: {answer:?}");
        let after = recipe(&session);
        assert_ne!(after, before, "{edit}");
        let log = overcoat_ok(&session, &["log"]).stdout;
        assert!(log.contains(logged), "{edit}: {log}");
        overcoat_ok(&session, &["undo"]);
        assert_eq!(recipe(&session), before, "undo of {edit}");
        overcoat_ok(&session, &["redo"]);
        assert_eq!(recipe(&session), after, "redo of {edit}");
        overcoat_ok(&session, &["undo"]);
    }
}

#[test]
fn an_empty_value_resets_a_key_and_a_value_that_is_there_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = dressed(dir.path());
    let before = recipe(&session);
    for key in ["until=knee", "sleeve=short", "faces=5000", "stack.clearance=0.004", "smoothing_passes=1"] {
        let name = key.split('=').next().unwrap();
        overcoat_ok(&session, &["step", "set", "shirt", key]);
        assert_ne!(recipe(&session), before, "{key}");
        overcoat_ok(&session, &["step", "set", "shirt", &format!("{name}=")]);
        assert_eq!(recipe(&session), before, "{key}");
    }
    let changes = overcoat_ok(&session, &["log", "--json"]).stdout;
    let again = overcoat_ok(&session, &["step", "set", "shirt", "template=tshirt", "until="]).stdout;
    assert!(again.contains("nothing changed"), "{again}");
    assert!(overcoat_ok(&session, &["step", "move", "coat", "--after", "shirt"]).stdout.contains("is there already"));
    let without_secs = |text: &str| {
        let mut log: Value = serde_json::from_str(text).unwrap();
        log["secs"] = Value::Null;
        log
    };
    assert_eq!(without_secs(&overcoat_ok(&session, &["log", "--json"]).stdout), without_secs(&changes));
}

#[test]
fn wrong_edits_are_refused_and_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = dressed(dir.path());
    std::fs::write(dir.path().join("broken.ply"), "ply\n").unwrap();
    let files = || fingerprint(&session).into_iter().filter(|(path, _)| path != Path::new("lock")).collect::<Vec<_>>();
    let before = files();
    for (edit, code, says) in [
        ("remove hat", 2, "there is no step 'hat'"),
        ("remove body", 2, "the body cannot be removed while garments are there: shirt, coat"),
        ("remove", 2, "required"),
        ("rename hat cap", 2, "there is no step 'hat'"),
        ("rename shirt coat", 2, "there is already a step 'coat'"),
        ("rename shirt Coat", 2, "only in upper and lower case"),
        ("rename shirt a/b", 2, "'a/b' cannot be"),
        ("rename body skin", 2, "cannot be renamed"),
        ("move hat --before coat", 2, "there is no step 'hat'"),
        ("move coat --before hat", 2, "there is no step 'hat'"),
        ("move coat --before body", 2, "cannot come before the body"),
        ("move body --after coat", 2, "'body' cannot be moved"),
        ("move coat --after coat", 2, "beside itself"),
        ("move coat", 2, "--before"),
        ("move coat --before shirt --after body", 2, "cannot be used with"),
        ("set hat template=hat", 2, "there is no step 'hat'"),
        ("set shirt", 2, "required"),
        ("set shirt template", 2, "'template' has no key or no ="),
        ("set shirt colour=red", 2, "'colour' is not a key of a step"),
        ("set shirt mask=../dab.jsonl", 2, "'mask' is not a key of a step"),
        ("set shirt stack.clearence=0.1", 2, "no parameter 'clearence'"),
        ("set shirt stack.clearance=wide", 2, "'wide'"),
        ("set shirt fit.samples=1000", 2, "has no stage 'fit'"),
        ("set shirt template=", 2, "needs a template"),
        ("set shirt template=hut", 2, "'hut'"),
        ("set body template=shirt", 2, "takes no template"),
        ("set body until=knee", 2, "does not apply to the body"),
        ("set shirt surface=scan", 2, "only the body has a surface"),
        ("set shirt until=nee", 2, "nee"),
        ("set shirt faces=10", 2, "a scan of 10 faces"),
        ("set shirt faces=many", 2, "faces cannot be 'many'"),
        ("set shirt voxel=0.2", 2, "voxels of 0.2 mm"),
        ("set shirt faces=5000 faces=6000", 2, "faces is set twice"),
        ("set shirt path=", 2, "path cannot be ''"),
        ("set shirt path=../nothing.ply", 2, "nothing.ply"),
        ("set shirt path=../broken.ply", 1, "broken.ply"),
        ("set shirt unit=mm", 1, "a person is 0.4 to 2.5 m tall"),
    ] {
        let args: Vec<&str> = ["step"].into_iter().chain(edit.split(' ')).collect();
        let answer = overcoat(&session, &args);
        assert_eq!(answer.code, code, "{edit}: {answer:?}");
        assert_eq!(answer.stdout, "", "{edit}");
        assert!(answer.stderr.lines().next().unwrap().contains(says), "{edit}: {answer:?}");
        assert!(files() == before, "{edit} changed the session");
    }
}

#[test]
fn a_step_renamed_to_its_own_name_is_not_said_to_be_renamed() {
    let dir = tempfile::tempdir().unwrap();
    let session = dressed(dir.path());
    let before = crate::common::fingerprint(&session);
    let said = overcoat_ok(&session, &["step", "rename", "shirt", "shirt"]).stdout;
    assert!(said.contains("nothing changed: the step is called shirt already"), "{said}");
    assert_eq!(crate::common::fingerprint(&session), before);
}

#[test]
fn strokes_go_along_with_a_renamed_garment() {
    let dir = tempfile::tempdir().unwrap();
    let session = dressed(dir.path());
    overcoat_ok(&session, &["step", "rename", "shirt", "blouse"]);
    let listed = overcoat_ok(&session, &["mask", "list", "--json"]).json();
    assert_eq!((&listed["masks"][0]["layer"], &listed["masks"][0]["file"]), (&json!("blouse"), &json!("../dab.jsonl")));
    // The file still names the shirt; it is edited and read again.
    let again = overcoat_ok(&session, &["mask", "blouse", "../dab.jsonl", "--json"]).json();
    assert_eq!(again["replaced"], true);
    let other = overcoat(&session, &["mask", "coat", "../dab.jsonl"]);
    assert!(other.code == 1 && other.stderr.contains("for the layer 'shirt'"), "{other:?}");
}

#[test]
fn a_renamed_garment_keeps_its_results_and_its_recipe_is_replayed() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["step", "rename", "tshirt", "blouse"]);
    let built = overcoat_ok(&session, &["build", "--json"]).json();
    let expected = [("blouse/figure", "parameter name tshirt blouse"), ("blouse/press", "upstream figure")];
    assert_eq!(ran(&built), expected.map(|(stage, why)| (stage.to_string(), why.to_string())));
    overcoat_ok(&session, &["export", "out/"]);
    assert!(session.join("out/blouse.ply").exists());

    overcoat_ok(&session, &["step", "set", "blouse", "faces=3500", "stack.clearance=0.004"]);
    overcoat_ok(&session, &["build", "-q"]);
    overcoat_ok(dir.path(), &["replay", "alice", "--into", "bob", "-q"]);
    assert_eq!(names(&dir.path().join("bob")), ["body", "blouse"]);
    let outputs = |session: &Path| {
        let state: Value =
            serde_json::from_str(&std::fs::read_to_string(session.join("session.json")).unwrap()).unwrap();
        state["steps"][1]["stages"]["figure"]["output"].clone()
    };
    assert_eq!(outputs(&dir.path().join("bob")), outputs(&session));
}

#[test]
fn steps_are_edited_at_the_prompt_of_record() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let mut child = Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(["record", "alice"])
        .current_dir(dir.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"step list\nstep rename tshirt blouse\nquit\n").unwrap();
    let output = child.wait_with_output().unwrap();
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success() && out.contains("tshirt  tshirt") && out.contains("renamed tshirt to blouse"),
        "{out}"
    );
    assert_eq!(names(&session), ["body", "blouse"]);
}

/// The labels of the garment as exported, in the order of the scan's vertices.
fn labels_of(session: &Path) -> RawMesh {
    overcoat_ok(session, &["build", "-q"]);
    overcoat_ok(session, &["mask", "tshirt", "--template", "now.ply"]);
    let labels = read_ply(std::fs::File::open(session.join("now.ply")).unwrap()).unwrap();
    std::fs::remove_file(session.join("now.ply")).unwrap();
    labels
}

/// What each program keeps of an exported file.
fn as_exported_by(program: &str, painted: &RawMesh) -> RawMesh {
    let mut kept = painted.clone();
    match program {
        "Blender" => kept.scalars.clear(),
        "MeshLab" => kept.scalars.retain(|name, _| name == "quality"),
        _ => {}
    }
    kept
}

#[test]
fn a_painted_file_pins_what_was_painted_and_a_later_template_applies_elsewhere() {
    let dir = tempfile::tempdir().unwrap();
    let plain = built_quick_session(dir.path(), "plain");
    let found = labels_of(&plain);
    // Erased on the chest, and added on a hip, below the T-shirt.
    let height = |p: &[f64; 3]| p[1];
    let front = |p: &&[f64; 3]| p[0].abs() < 0.1 && p[2] > 0.0;
    let nearest = |to: f64| {
        let off = |p: &[f64; 3]| (height(p) - to).abs();
        *found.points.iter().filter(front).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
    };
    let (chest, thigh) = (nearest(1.25), nearest(0.6));
    let near = |p: &[f64; 3], at: [f64; 3]| (Point::from(*p) - Point::from(at)).norm() < 0.06;
    let before = &found.scalars["label"];
    let mut painted = found.clone();
    let mut wanted: Vec<Option<f32>> = vec![None; found.points.len()];
    for (v, p) in found.points.iter().enumerate() {
        let label = match (near(p, chest), near(p, thigh)) {
            (true, _) => 0.0,
            (_, true) => 1.0,
            _ => continue,
        };
        painted.colors.as_mut().unwrap()[v] = if label == 1.0 { [230, 80, 60] } else { [150; 3] };
        wanted[v] = (label != before[v]).then_some(label);
    }
    let count = wanted.iter().flatten().count();
    assert!(count > 8 && wanted.contains(&Some(0.0)) && wanted.contains(&Some(1.0)), "{count} vertices");

    let plain_shirt = dir.path().join("shirt");
    copy_folder(&plain, &plain_shirt);
    overcoat_ok(&plain_shirt, &["step", "set", "tshirt", "template=shirt"]);
    let of_shirt = labels_of(&plain_shirt).scalars["label"].clone();
    assert_ne!(&of_shirt, before);
    for program in ["Blender", "MeshLab", "one that keeps everything"] {
        let session = dir.path().join(program);
        copy_folder(&plain, &session);
        let file = std::fs::File::create(session.join("found.ply")).unwrap();
        write_ply(&as_exported_by(program, &painted), &PlyOptions::default(), file).unwrap();
        let said = overcoat_ok(&session, &["mask", "tshirt", "found.ply", "--json"]).json();
        let marked = said["added_vertices"].as_u64().unwrap() + said["erased_vertices"].as_u64().unwrap();
        assert_eq!((marked, &said["pins_all"]), (count as u64, &json!(false)), "{program}");
        let with = |base: &[f32]| -> Vec<f32> { wanted.iter().zip(base).map(|(w, b)| w.unwrap_or(*b)).collect() };
        assert_eq!(labels_of(&session).scalars["label"], with(before), "{program}: only what was painted");
        overcoat_ok(&session, &["step", "set", "tshirt", "template=shirt"]);
        assert_eq!(labels_of(&session).scalars["label"], with(&of_shirt), "{program}: the shirt elsewhere");
    }
}

#[test]
fn numbers_pin_every_vertex_that_they_label_and_minus_1_leaves_it_to_the_template() {
    let dir = tempfile::tempdir().unwrap();
    let plain = built_quick_session(dir.path(), "plain");
    let found = labels_of(&plain);
    let before = found.scalars["label"].clone();
    let front = found.points.iter().filter(|p| p[0].abs() < 0.1 && p[2] > 0.0);
    let chest = Point::from(*front.min_by(|a, b| (a[1] - 1.25).abs().total_cmp(&(b[1] - 1.25).abs())).unwrap());
    let distance = |p: &[f64; 3]| (Point::from(*p) - chest).norm();
    let of = |session: &Path, template: &str| {
        overcoat_ok(session, &["step", "set", "tshirt", &format!("template={template}")]);
        labels_of(session).scalars["label"].clone()
    };
    let other = dir.path().join("other");
    copy_folder(&plain, &other);
    let of_shirt = of(&other, "shirt");
    assert_ne!(of_shirt, before);

    // A hole in the chest, with and without labels elsewhere.
    for (name, elsewhere) in [("few", false), ("all", true)] {
        let session = dir.path().join(name);
        copy_folder(&plain, &session);
        let label = |(p, l): (&[f64; 3], &f32)| match (distance(p) < 0.06, elsewhere) {
            (true, _) => 0.0,
            (_, true) => f64::from(*l),
            (_, false) => -1.0,
        };
        let numbers: Vec<f64> = found.points.iter().zip(&before).map(label).collect();
        let file = std::fs::File::create(session.join("labels.npy")).unwrap();
        write_npy(&NpyArray::vector(numbers), file).unwrap();
        let said = overcoat_ok(&session, &["mask", "tshirt", "labels.npy"]).stdout;
        assert_eq!(said.contains("all labels of the file are pinned: write -1"), elsewhere, "{said}");
        let now = of(&session, "shirt");
        let expected = if elsewhere { &before } else { &of_shirt };
        for (v, p) in found.points.iter().enumerate() {
            match distance(p) {
                d if d < 0.06 => assert_eq!(now[v], 0.0, "{name}: {p:?}"),
                d if d > 0.15 => assert_eq!(now[v], expected[v], "{name}: {p:?}"),
                _ => {}
            }
        }
    }
}

#[test]
fn painted_labels_of_a_garment_that_was_never_built_are_pinned_and_the_command_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let body = mean_body(|p| p);
    let red = |p: &[f64; 3]| if (1.0..1.4).contains(&p[1]) { [230, 80, 60] } else { [150; 3] };
    let colors = Some(body.points.iter().map(red).collect());
    write_mesh(dir.path().join("painted.ply"), &RawMesh { colors, ..body.clone() });
    let said = overcoat_ok(&session, &["mask", "shirt", "../painted.ply"]).stdout;
    assert!(said.contains("all labels of the file are pinned"), "{said}");
    let said = overcoat_ok(&session, &["mask", "shirt", "../painted.ply", "--json"]).json();
    let marked = said["added_vertices"].as_u64().unwrap() + said["erased_vertices"].as_u64().unwrap();
    assert_eq!((marked as usize, &said["pins_all"]), (body.points.len(), &json!(true)));
}
