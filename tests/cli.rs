//! The command line, as a person or a script uses it.

use crate::common::{fingerprint, mean_body, overcoat, overcoat_ok, session_with_two_scans, write_mesh};
use overcoat::formats::{NpyArray, write_npy, write_obj};
use serde_json::Value;

#[test]
fn help_names_every_command_and_succeeds() {
    let dir = tempfile::tempdir().unwrap();
    let help = overcoat_ok(dir.path(), &["--help"]).stdout;
    for command in [
        "demo",
        "new",
        "scan",
        "build",
        "mask",
        "watch",
        "record",
        "status",
        "export",
        "view",
        "measure",
        "templates",
        "fit",
        "segment",
        "stack",
        "weights",
        "undo",
        "redo",
        "log",
        "branch",
        "replay",
        "fsck",
    ] {
        assert!(help.contains(&format!("\n  {command} ")), "{command} is not in\n{help}");
        let own = overcoat_ok(dir.path(), &[command, "--help"]).stdout;
        assert!(own.contains("Usage: overcoat"), "{own}");
    }
}

#[test]
fn a_wrong_command_exits_with_2_and_a_hint_in_both_forms() {
    let dir = tempfile::tempdir().unwrap();
    for args in [vec![], vec!["bild"], vec!["scan", "body"], vec!["status", "--fast"], vec!["new"]] {
        let plain = overcoat(dir.path(), &args);
        assert_eq!(plain.code, 2, "{args:?}: {plain:?}");
        assert_eq!(plain.stdout, "");
        let lines: Vec<&str> = plain.stderr.lines().collect();
        assert_eq!(lines.len(), 2, "one sentence, one hint: {plain:?}");
        assert!(lines[0].starts_with("error: ") && lines[1].starts_with("hint: "), "{plain:?}");

        let as_json = overcoat(dir.path(), &[args.as_slice(), &["--json"]].concat());
        assert_eq!(as_json.code, 2);
        let error = &as_json.json()["error"];
        assert_eq!(format!("error: {}", error["message"].as_str().unwrap()), lines[0]);
        // The usage names what was given, --json too.
        assert_eq!(format!("hint: {}", error["hint"].as_str().unwrap().replace(" --json", "")), lines[1]);
    }
}

#[test]
fn help_explains_a_command_and_the_terms() {
    let dir = tempfile::tempdir().unwrap();
    let of_scan = overcoat_ok(dir.path(), &["help", "scan"]).stdout;
    assert_eq!(of_scan, overcoat_ok(dir.path(), &["scan", "--help"]).stdout);
    let words = overcoat_ok(dir.path(), &["help", "words"]).stdout;
    for word in ["hem loop", "bind pose", "verdict"] {
        assert!(words.to_lowercase().contains(word), "{word} is not in\n{words}");
    }
}

#[test]
fn a_wrong_stage_gets_the_list_of_all_stages() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let answer = overcoat(&session, &["build", "--force", "shirt/iron"]);
    assert!(answer.code == 2 && answer.stderr.contains("there is no stage 'iron'"), "{answer:?}");
    for stage in ["register", "pose", "segment", "stack", "press", "check"] {
        assert!(answer.stderr.contains(stage), "{stage}: {answer:?}");
    }
}

#[test]
fn a_session_is_created_scanned_and_reported() {
    let dir = tempfile::tempdir().unwrap();
    let scan = write_mesh(dir.path().join("body.ply"), &mean_body(|p| p));
    let begun = overcoat_ok(dir.path(), &["new", "alice", "--json"]).json();
    assert_eq!(begun["body_model"], "embedded");
    let session = dir.path().join("alice");
    assert!(session.join("recipe.toml").is_file());

    let said = overcoat_ok(&session, &["scan", "body", scan.to_str().unwrap()]);
    assert!(said.stdout.contains("scanned body from") && said.stdout.contains("\nnext: overcoat build"), "{said:?}");
    let status = overcoat_ok(dir.path(), &["-C", "alice", "status", "--json"]).json();
    assert_eq!(status["up_to_date"], false);
    let step = &status["steps"][0];
    assert_eq!((&step["name"], &step["up_to_date"][0]["stage"]), (&Value::from("body"), &Value::from("scan")));
    assert_eq!(step["out_of_date"], serde_json::json!(["fit", "register", "figure", "check"]));
    let recipe = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    assert!(recipe.contains("scan = \"../body.ply\""), "{recipe}");
    assert_eq!(overcoat_ok(&session, &["status", "-q"]).stdout, "");
}

#[test]
fn a_mask_is_added_once_and_makes_the_garment_out_of_date() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    // On the chest, in the frame of the file.
    let front = mean_body(|p| p).points.into_iter().filter(|p| (1.2..1.3).contains(&p[1]) && p[0].abs() < 0.05);
    let chest = front.max_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    let stroke = format!(r#"{{"layer":"shirt","op":"erase","radius":0.03,"points":[{chest:?}]}}"#);
    std::fs::write(dir.path().join("dab.jsonl"), stroke).unwrap();
    let said = overcoat_ok(&session, &["mask", "shirt", "../dab.jsonl", "--json"]).json();
    assert!(said["erased_vertices"].as_u64().unwrap() > 3, "{said}");
    assert_eq!(said["added_vertices"], 0);
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["steps"][1]["masks"], 1);
}

#[test]
fn masks_are_listed_replaced_and_removed() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let body = mean_body(|p| p);
    let count = body.points.len();
    // Labels from another program, one per vertex: they are anchored in space.
    let mut labels = vec![-1; count];
    labels[17] = 1;
    let npy = |labels: &[i32]| {
        let out = std::fs::File::create(dir.path().join("labels.npy")).unwrap();
        write_npy(&NpyArray::vector(labels.to_vec()), out).unwrap();
    };
    npy(&labels);
    let stroke = format!(r#"{{"layer":"shirt","op":"erase","radius":0.03,"points":[{:?}]}}"#, body.points[40]);
    std::fs::write(dir.path().join("dab.jsonl"), stroke).unwrap();
    for file in ["../labels.npy", "../dab.jsonl"] {
        overcoat_ok(&session, &["mask", "shirt", file]);
    }
    labels[18] = 0;
    npy(&labels);
    let again = overcoat_ok(&session, &["mask", "shirt", "../labels.npy", "--json"]).json();
    assert_eq!(
        (&again["replaced"], &again["added_vertices"], &again["erased_vertices"]),
        (&true.into(), &1.into(), &1.into())
    );
    let recipe = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    assert!(recipe.contains("from = \"../labels.npy\"") && recipe.contains("file = \"masks/shirt-"), "{recipe}");
    let listed = overcoat_ok(&session, &["mask", "list", "--json"]).json();
    let of = |i: usize, key: &str| listed["masks"][i][key].clone();
    assert_eq!((of(0, "file"), of(0, "added"), of(0, "erased")), ("../labels.npy".into(), 1.into(), 1.into()));
    assert_eq!((of(1, "file"), of(1, "kind"), of(2, "file")), ("../dab.jsonl".into(), "1 stroke".into(), Value::Null));
    let said = overcoat_ok(&session, &["mask", "remove", "shirt", "labels.npy"]).stdout;
    assert!(said.contains("../labels.npy no longer corrects shirt"), "{said}");
    assert!(overcoat_ok(&session, &["mask", "list", "shirt"]).stdout.contains("shirt        1  ../dab.jsonl"));
    overcoat_ok(&session, &["mask", "remove", "shirt", "--all"]);
    assert!(overcoat_ok(&session, &["mask", "list"]).stdout.contains("no masks"));
}

#[test]
fn a_picture_lies_on_the_texture_of_the_scan() {
    let dir = tempfile::tempdir().unwrap();
    // Texture coordinates by height: v = 0 at the feet.
    let mut body = mean_body(|p| p);
    body.uvs = Some(body.points.iter().map(|p| [0.5, (p[1] / 2.0).clamp(0.0, 1.0)]).collect());
    let scan = dir.path().join("body.obj");
    write_obj(&body, std::fs::File::create(&scan).unwrap()).unwrap();
    overcoat_ok(dir.path(), &["new", "session"]);
    let session = dir.path().join("session");
    overcoat_ok(&session, &["scan", "body", "../body.obj"]);
    overcoat_ok(&session, &["scan", "shirt", "../body.obj", "--template", "tshirt"]);
    // White from 1.2 to 1.4 m, clear elsewhere.
    let row = |y: usize| if (60..80).contains(&y) { [255u8; 4] } else { [0; 4] };
    let pixels: Vec<u8> = (0..200).flat_map(row).collect();
    image::save_buffer(dir.path().join("shirt.png"), &pixels, 1, 200, image::ExtendedColorType::Rgba8).unwrap();
    let said = overcoat_ok(&session, &["mask", "shirt", "../shirt.png", "--json"]).json();
    let expected = body.points.iter().filter(|p| (1.2..1.4).contains(&p[1])).count() as u64;
    let added = said["added_vertices"].as_u64().unwrap();
    assert!(added.abs_diff(expected) < 20 && added > 500, "{added} against {expected}");
}

#[test]
fn a_recipe_edited_by_hand_applies_and_keeps_its_comments() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let path = session.join("recipe.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let edited = text.replace("template = \"tshirt\"", "template = \"tshirt\" # too long\nuntil = \"hip\"");
    assert_ne!(edited, text);
    std::fs::write(&path, &edited).unwrap();
    std::fs::remove_file(session.join("session.json")).unwrap();
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["steps"][1]["name"], "shirt");
    assert_eq!(status["steps"][1]["up_to_date"][0]["stage"], "scan", "what was made still counts");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), edited);
}

#[test]
fn a_writer_killed_between_journal_and_files_is_completed_by_the_next() {
    let dir = tempfile::tempdir().unwrap();
    let session = dir.path().join("session");
    let scan = write_mesh(dir.path().join("body.ply"), &mean_body(|p| p));
    overcoat_ok(dir.path(), &["new", "session"]);
    let before: Vec<Vec<u8>> =
        ["recipe.toml", "session.json"].iter().map(|f| std::fs::read(session.join(f)).unwrap()).collect();
    overcoat_ok(&session, &["scan", "body", scan.to_str().unwrap()]);
    let after = fingerprint(&session);
    // The journal's line was written, the files were not, and a temporary file lies about.
    std::fs::write(session.join("recipe.toml"), &before[0]).unwrap();
    std::fs::write(session.join("session.json"), &before[1]).unwrap();
    std::fs::write(session.join("artefacts/.unfinished-x"), b"half").unwrap();
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["steps"][0]["name"], "body", "readers see the change already");
    let again = overcoat(&session, &["scan", "body", scan.to_str().unwrap()]);
    assert_eq!(again.code, 2, "the step is there: {again:?}");
    assert_eq!(fingerprint(&session), after);
}

#[test]
fn the_kinds_of_garment_are_listed_and_shown() {
    let dir = tempfile::tempdir().unwrap();
    let list = overcoat_ok(dir.path(), &["templates", "list", "--json"]).json();
    assert!(list["templates"].as_array().unwrap().len() >= 12);
    let shown = overcoat_ok(dir.path(), &["templates", "show", "tshirt", "--json"]).json();
    assert_eq!(shown["template"]["hems"].as_array().unwrap().len(), 4, "neck, two sleeves, waist: {shown}");
    assert_eq!(overcoat(dir.path(), &["templates", "show", "tshrt"]).code, 2);
}
