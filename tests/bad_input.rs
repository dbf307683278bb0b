//! Bad input gets one sentence (what, where), a hint, exit code 1 or 2, and leaves the session unchanged, byte by byte.
//!
//! The files of the corpus and the expected responses are in `bad_input/`; defective scans of a person are made here.

use crate::common::{fingerprint, mean_body, overcoat, overcoat_ok, session_with_two_scans, write_mesh};
use crate::rgbd::turntable::Turntable;
use overcoat::body::{Stance, embedded_model};
use overcoat::formats::{NpyArray, NpzCompression, RawMesh, read_npz, write_npy, write_npz};
use overcoat::geometry::{Point, Vec3};
use serde::Deserialize;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Runs the command in the session and checks everything that bad input is promised.
fn refused(session: &Path, args: &[&str], code: i32, says: &[&str]) {
    let before = fingerprint(session);
    let answer = overcoat(session, args);
    assert_eq!(fingerprint(session), before, "{args:?} changed the session");
    assert_eq!(answer.code, code, "{args:?}: {answer:?}");
    assert_eq!(answer.stdout, "", "{args:?}");
    let lines: Vec<&str> = answer.stderr.lines().collect();
    assert!(lines[0].starts_with("error: ") && lines.len() <= 2, "one sentence, one hint for {args:?}: {answer:?}");
    assert!(lines.get(1).is_none_or(|l| l.starts_with("hint: ")), "{args:?}: {answer:?}");
    for words in says {
        assert!(lines[0].contains(words), "{args:?} says '{}', without '{words}'", lines[0]);
    }
    let json = overcoat(session, &[args, &["--json"]].concat());
    assert_eq!((json.code, &fingerprint(session)), (code, &before));
    assert_eq!(format!("error: {}", json.json()["error"]["message"].as_str().unwrap()), lines[0]);
}

#[derive(Deserialize)]
struct Corpus {
    answer: Vec<Expected>,
}

#[derive(Deserialize)]
struct Expected {
    file: String,
    command: String,
    code: i32,
    says: Vec<String>,
}

#[test]
fn every_file_of_the_corpus_gets_the_expected_response() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_input");
    let corpus: Corpus = toml::from_str(&std::fs::read_to_string(folder.join("answers.toml")).unwrap()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    for Expected { file, command, code, says } in &corpus.answer {
        let path = folder.join(file).display().to_string();
        let args: Vec<&str> =
            command.split(' ').map(|word| if word == "{file}" { path.as_str() } else { word }).collect();
        refused(&session, &args, *code, &says.iter().map(String::as_str).collect::<Vec<_>>());
    }
    for entry in std::fs::read_dir(&folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(name == "answers.toml" || corpus.answer.iter().any(|a| a.file == name), "{name} has no answer");
    }
}

fn with_a_second(mesh: &RawMesh, map: impl Fn(Point) -> Point) -> RawMesh {
    let shift = mesh.points.len() as u32;
    let mut both = mesh.clone();
    both.points.extend(mesh.points.iter().map(|&p| <[f64; 3]>::from(map(Point::from(p)).coords)));
    both.faces.extend(mesh.faces.iter().map(|f| f.map(|v| v + shift)));
    both
}

/// Noise that only depends on the point: uniform per coordinate, with this standard deviation.
fn noise(p: &Point, deviation: f64) -> Vec3 {
    let uniform = |k: f64| ((p.coords.dot(&Vec3::new(127.1, 311.7, 74.7)) * 1e3 + k).sin() * 43_758.545).fract();
    Vec3::new(uniform(1.0), uniform(2.0), uniform(3.0)) * (deviation * 3f64.sqrt())
}

/// The mean body in a deep squat, turned about the vertical.
fn squatting(heading: f64) -> RawMesh {
    let model = embedded_model().unwrap();
    let (mesh, skeleton) = model.shaped(&model.mean_shape());
    let posed = model.posed(mesh.points(), &skeleton, &Stance::Squat.pose(&skeleton));
    let (sin, cos) = heading.sin_cos();
    let points = posed.iter().map(|p| [cos * p.x + sin * p.z, p.y, cos * p.z - sin * p.x]).collect();
    RawMesh { points, ..mean_body(|p| p) }
}

#[test]
fn scans_that_do_not_show_a_person_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let two_people = with_a_second(&mean_body(|p| p), |p| Point::new(p.x + 1.8, p.y, p.z));
    let cases = [
        ("two_people.ply", two_people, vec![], "two people"),
        ("millimetres.ply", mean_body(|p| p * 1000.0), vec!["--unit", "m"], "a person is 0.4 to 2.5 m tall"),
        (
            "lying.ply",
            mean_body(|p| Point::new(p.x, -p.z, p.y)),
            vec!["--up", "y", "--unit", "m"],
            "a person is 0.4 to 2.5 m tall",
        ),
        ("giant.ply", mean_body(|p| p * 40_000.0), vec![], "a person is 0.4 to 2.5 m tall"),
        ("flat.ply", mean_body(|_| Point::origin()), vec![], "area"),
        (
            "noisy.ply",
            mean_body(|p| p + noise(&p, 0.02)),
            vec![],
            "the surface is too noisy: its vertices scatter by about",
        ),
        ("squat.ply", squatting(0.0), vec![], "the knees of somebody who squats or sits"),
        (
            "squat_20.ply",
            squatting(0.35),
            vec![],
            "this is not one person standing upright: the surface is only 1.7 times",
        ),
        ("squat_turned.ply", squatting(0.8), vec![], "this is not one person standing upright"),
        ("squat_70.ply", squatting(1.22), vec![], "as of somebody who squats or sits on the floor"),
        ("decimetres.ply", mean_body(|p| p * 10.0), vec!["--unit", "mm"], "a person is 0.4 to 2.5 m tall"),
    ];
    for (name, mesh, options, says) in cases {
        let path = write_mesh(dir.path().join(name), &mesh);
        let args = [&["scan", "hat", path.to_str().unwrap(), "--template", "hat"], options.as_slice()].concat();
        refused(&session, &args, 1, &[name, says]);
    }
}

#[test]
fn scans_in_another_unit_or_frame_are_converted_and_reported() {
    let dir = tempfile::tempdir().unwrap();
    let cases = [
        ("millimetres.ply", mean_body(|p| p * 1000.0), "in mm"),
        ("decimetres.ply", mean_body(|p| p * 10.0), "in dm: the person is 1."),
        ("z_up.ply", mean_body(|p| Point::new(p.x, -p.z, p.y)), "z of the file points up"),
        ("upside_down.ply", mean_body(|p| Point::new(p.x, -p.y, -p.z)), "-y of the file points up"),
    ];
    for (name, mesh, says) in cases {
        let path = write_mesh(dir.path().join(name), &mesh);
        let session = name.trim_end_matches(".ply");
        overcoat_ok(dir.path(), &["new", session]);
        let said = overcoat_ok(dir.path(), &["-C", session, "scan", "body", path.to_str().unwrap()]).stdout;
        assert!(said.contains(says), "{name}: {said}");
    }
}

#[test]
fn impossible_arguments_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let scan = dir.path().join("body.ply").display().to_string();
    std::fs::write(dir.path().join("people.csv"), "subject\nanna\n").unwrap();
    for (command, code, says) in [
        ("scan hat nowhere.ply --template hat", 2, "there is no file 'nowhere.ply'"),
        ("scan hat . --template hat", 1, "holds no depth images"),
        ("scan hat {scan} --template hut", 2, "'hut'"),
        ("scan hat {scan}", 2, "needs a template"),
        ("scan hat {scan} --template tshirt --until nose", 2, "'nose'"),
        ("scan hat {scan} --template hat --sleeve short", 2, "--sleeve does not apply to the garment kind 'hat'"),
        ("scan hat {scan} --template hat --until knee", 2, "--until does not apply to the garment kind 'hat'"),
        ("scan jeans {scan} --template trousers --sleeve short", 2, "--sleeve does not apply"),
        ("watch shirt x.jsonl --view --bind 10.0.0.1", 2, "give 127.0.0.1 for this machine only"),
        ("watch shirt x.jsonl --bind 127.0.0.1", 2, "--view"),
        ("scan hat {scan} --template hat --unit furlong", 2, "'furlong'"),
        ("scan hat {scan} --template hat --up w", 2, "'w'"),
        ("scan shirt {scan} --template tshirt", 2, "there is already a step 'shirt'"),
        ("scan body {scan}", 2, "there is already a step 'body'"),
        ("scan a/b {scan} --template hat", 2, "'a/b' cannot be the name"),
        ("scan joints {scan} --template hat", 2, "'joints' cannot be the name"),
        ("scan Body {scan} --template hat", 2, "'Body' cannot be the name"),
        ("scan Labels {scan} --template hat", 2, "'Labels' cannot be the name"),
        ("scan SHIRT {scan} --template hat", 2, "'SHIRT' differs from the step 'shirt' only in upper and lower case"),
        ("scan SHIRT {scan} --template hat --replace", 2, "only in upper and lower case"),
        ("scan CON {scan} --template hat", 2, "'CON' cannot be the name"),
        ("scan com1 {scan} --template hat", 2, "'com1' cannot be the name"),
        (&format!("scan {} {{scan}} --template hat", "a".repeat(65)), 2, "cannot be the name"),
        ("scan body {scan} --template hat --replace", 2, "takes no template"),
        ("mask coat nowhere.jsonl", 2, "there is no step 'coat'"),
        ("mask body nowhere.jsonl", 2, "no labels"),
        ("mask shirt nowhere.jsonl", 2, "there is no file"),
        ("mask shirt {scan} --template out.ply", 2, "cannot be used with"),
        ("mask shirt --template out.ply", 1, "not built"),
        ("mask shirt --template {scan}", 2, "it is the scan of 'body'"),
        ("mask body --template out.ply", 2, "no labels"),
        ("mask list coat", 2, "there is no step 'coat'"),
        ("mask remove shirt 1", 2, "'shirt' has no mask '1'"),
        ("mask remove shirt --all", 2, "'shirt' has no mask"),
        ("mask remove coat --all", 2, "there is no step 'coat'"),
        ("export out.glb", 1, "not built"),
        ("export out.fbx", 2, "'out.fbx'"),
        ("export at/ --at coat", 2, "there is no step 'coat'"),
        ("export at/ --scan coat", 2, "there is no step 'coat'"),
        ("export out.glb --scan body", 2, "it cannot hold a scan"),
        ("view", 2, "nothing to write"),
        ("view --poster poster.png", 1, "not built"),
        ("view --weights weights.png", 1, "not built"),
        ("measure --truth nowhere", 2, "there is no folder 'nowhere'"),
        ("build --force coat", 2, "there is no step 'coat'"),
        ("build --force shirt/fit", 2, "no stage 'fit'"),
        ("build --force shirt/iron", 2, "no stage 'iron'"),
        ("new ../body.ply", 2, "'../body.ply' is a file, not the folder of a session"),
        ("-C ../body.ply status", 2, "is a file, not the folder of a session"),
        ("-C ../body.ply build", 2, "is a file, not the folder of a session"),
        ("replay . --into ../body.ply", 2, "is a file, not the folder of a session"),
        ("record ../body.ply", 2, "is a file, not the folder of a session"),
        ("export .glb", 2, "'.glb' is an extension without a name"),
        ("undo 9", 2, "there are only 2 changes to undo"),
        ("watch shirt x.txt", 2, "'x.txt' is no mask: the extension 'txt' is not known"),
        ("stack body", 2, "the step 'body' has no stage 'stack'"),
        ("segment body", 2, "the step 'body' has no stage 'segment'"),
        ("body show --beta 100 --mesh x.ply", 2, "100 is no shape coordinate of a person"),
        ("body show --beta nan --mesh x.ply", 2, "NaN is no shape coordinate"),
        ("body measure --beta 1,-100", 2, "-100 is no shape coordinate"),
        ("body show --beta a --mesh x.ply", 2, "invalid value 'a' for '--beta <B,B,…>': it is not a number"),
        ("replay . --into ../x --subjects ../people.csv --jobs 0", 2, "give 1 to 64"),
        ("studio make --seed x --garments hat --out ../x", 2, "it is not a whole number of 0 or more"),
        ("new .", 2, "there is already a session in '.'"),
        ("new ..", 2, "is not empty"),
    ] {
        let args: Vec<&str> = command.split(' ').map(|w| if w == "{scan}" { scan.as_str() } else { w }).collect();
        refused(&session, &args, code, &[says]);
    }
}

#[test]
fn a_garment_before_the_body_and_a_build_of_nothing_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let scan = write_mesh(dir.path().join("body.ply"), &mean_body(|p| p));
    overcoat_ok(dir.path(), &["new", "session"]);
    let session = dir.path().join("session");
    refused(&session, &["scan", "shirt", scan.to_str().unwrap(), "--template", "tshirt"], 2, &["before the body"]);
    refused(&session, &["build"], 1, &["no scan yet"]);
    refused(dir.path(), &["status"], 2, &["there is no session"]);
    refused(dir.path(), &["-C", "nowhere", "build"], 2, &["there is no session in 'nowhere'"]);
}

#[test]
fn bytes_that_are_no_text_are_not_quoted() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let noise: Vec<u8> = (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8 | 0x80).collect();
    for (name, format) in [("noise.ply", "PLY"), ("noise.off", "OFF"), ("noise.glb", "glTF")] {
        std::fs::write(dir.path().join(name), &noise).unwrap();
        let says = format!("this is not {format}: it begins with binary data");
        refused(&session, &["scan", "hat", &format!("../{name}"), "--template", "hat"], 1, &[name, &says]);
    }
    std::fs::write(dir.path().join("noise.npy"), &noise).unwrap();
    refused(&session, &["mask", "shirt", "../noise.npy"], 1, &["this is not NPY: it begins with binary data"]);
    image::save_buffer(dir.path().join("picture.png"), &[255; 12], 2, 2, image::ExtendedColorType::Rgb8).unwrap();
    std::fs::rename(dir.path().join("picture.png"), dir.path().join("picture.ply")).unwrap();
    let scan = ["scan", "hat", "../picture.ply", "--template", "hat"];
    refused(&session, &scan, 1, &["this is not PLY: it begins with a PNG picture's bytes"]);
}

#[test]
fn a_table_with_semicolons_is_refused_as_such() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    for (text, says) in [("subject;shirt\nanna;b.ply\n", "separated by semicolons"), ("subject\tshirt\n", "by tabs")] {
        std::fs::write(dir.path().join("people.csv"), text).unwrap();
        let replay = ["replay", ".", "--into", "../all", "--subjects", "../people.csv"];
        refused(&session, &replay, 1, &["people.csv, line 1", says]);
    }
}

#[test]
fn a_target_that_ends_with_a_slash_is_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    overcoat_ok(&session, &["export", "../figure.glb/", "--scan", "body"]);
    assert!(dir.path().join("figure.glb/scan.ply").is_file());
    overcoat_ok(&session, &["export", "../figure.glb/", "--scan", "body"]);
    refused(&session, &["export", "../figure.glb"], 2, &["is a folder, but its name is that of a .glb"]);
}

#[test]
fn a_mask_for_another_mesh_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let labels = dir.path().join("labels.npy");
    write_npy(&NpyArray::vector(vec![1.0_f64; 17]), File::create(&labels).unwrap()).unwrap();
    refused(&session, &["mask", "shirt", labels.to_str().unwrap()], 1, &["labels.npy", "17 labels"]);
    let bare = write_mesh(dir.path().join("bare.ply"), &mean_body(|p| p));
    refused(&session, &["mask", "shirt", bare.to_str().unwrap()], 1, &["bare.ply", "neither a 'label'"]);
    let beside = mean_body(|p| Point::new(p.x + 1.0, p.y, p.z));
    let label = vec![1.0; beside.points.len()];
    let beside = RawMesh { scalars: [("label".to_string(), label)].into(), ..beside };
    let beside = write_mesh(dir.path().join("beside.ply"), &beside);
    let count = mean_body(|p| p).points.len().to_string();
    refused(&session, &["mask", "shirt", beside.to_str().unwrap()], 1, &["beside.ply", "not on the scan", &count]);
    let painted = |color| RawMesh { colors: Some(vec![color; count.parse().unwrap()]), ..mean_body(|p| p) };
    let green = write_mesh(dir.path().join("green.ply"), &painted([20, 200, 20]));
    refused(&session, &["mask", "shirt", green.to_str().unwrap()], 1, &["green.ply", "neither red"]);
    let picture = dir.path().join("picture.png");
    image::save_buffer(&picture, &[255; 12], 2, 2, image::ExtendedColorType::Rgb8).unwrap();
    refused(&session, &["mask", "shirt", picture.to_str().unwrap()], 1, &["picture.png", "no texture coordinates"]);
}

#[test]
fn a_mask_that_leaves_nothing_of_the_garment_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let grey = RawMesh { colors: Some(vec![[150; 3]; mean_body(|p| p).points.len()]), ..mean_body(|p| p) };
    let grey = write_mesh(dir.path().join("grey.ply"), &grey);
    refused(&session, &["mask", "shirt", grey.to_str().unwrap()], 1, &["grey.ply", "nothing of the garment 'shirt'"]);
}

#[test]
fn a_body_model_whose_arrays_disagree_is_refused_and_no_folder_is_made() {
    let dir = tempfile::tempdir().unwrap();
    let embedded = read_npz(std::io::Cursor::new(overcoat::body::EMBEDDED_MODEL_FILE)).unwrap();
    let damaged = |name: &str, change: &dyn Fn(&mut overcoat::formats::Npz)| -> PathBuf {
        let mut model = embedded.clone();
        change(&mut model);
        let path = dir.path().join(name);
        write_npz(&model, NpzCompression::default(), File::create(&path).unwrap()).unwrap();
        path
    };
    let short = damaged("short_weights.npz", &|model| {
        model.insert("weights", NpyArray::try_new(&[3, 52], vec![0.0_f64; 156]).unwrap());
    });
    refused(
        dir.path(),
        &["new", "s", "--body", short.to_str().unwrap()],
        1,
        &["short_weights.npz", "'weights'", "[3, 52]"],
    );
    let cyclic = damaged("cyclic.npz", &|model| {
        model.insert("kintree_table", NpyArray::try_new(&[2, 52], vec![5_i64; 104]).unwrap());
    });
    refused(dir.path(), &["new", "s", "--body", cyclic.to_str().unwrap()], 1, &["cyclic.npz", "joint"]);
    refused(dir.path(), &["new", "s", "--body", "nowhere.npz"], 2, &["there is no file 'nowhere.npz'"]);
    assert!(!dir.path().join("s").exists());
}

#[test]
fn files_of_the_session_broken_by_hand_are_named_with_their_line() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let break_file = |name: &str, change: &dyn Fn(String) -> String, args: &[&str], says: &[&str]| {
        let path = session.join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, change(text.clone())).unwrap();
        refused(&session, args, 1, says);
        std::fs::write(&path, text).unwrap();
    };
    let line_3 = |text: String| text.replacen("version = 1", "version = = 1", 1);
    break_file("recipe.toml", &line_3, &["build"], &["recipe.toml, line 4"]);
    let unknown = |text: String| text.replace("template =", "tamplate =");
    break_file("recipe.toml", &unknown, &["status"], &["recipe.toml, line ", "tamplate"]);
    let newer = |text: String| text.replacen("version = 1", "version = 7", 1);
    break_file("recipe.toml", &newer, &["status"], &["recipe.toml", "layout 7"]);
    let body_last = |text: String| text.replace("\"body\"", "\"torso\"");
    break_file("recipe.toml", &body_last, &["status"], &["recipe.toml"]);
    let torn = |text: String| text.replacen("{\"change\"", "{\"chan", 1);
    break_file("journal.jsonl", &torn, &["status"], &["journal.jsonl, line 1"]);
}

#[test]
fn a_damaged_artefact_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let state: serde_json::Value =
        serde_json::from_slice(&std::fs::read(session.join("session.json")).unwrap()).unwrap();
    let name = state["steps"][0]["stages"]["scan"]["output"].as_str().unwrap();
    std::fs::write(session.join("artefacts").join(name), b"rust").unwrap();
    refused(&session, &["export", "scan/", "--scan", "body"], 1, &["artefact", name, "its content has changed"]);
}

#[test]
fn a_second_writer_is_refused_and_readers_are_not() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let scan = dir.path().join("body.ply").display().to_string();
    let held = File::options().read(true).write(true).open(session.join("lock")).unwrap();
    held.lock().unwrap();
    let answer = overcoat(&session, &["scan", "hat", &scan, "--template", "hat"]);
    let says = |what| assert!(answer.stderr.contains(what), "{answer:?}");
    says("waiting up to 8 s for another process, which is changing the session\n");
    says("is being changed by another process\nhint: wait until it has finished");
    assert_eq!(answer.code, 1);
    overcoat_ok(&session, &["status"]);
    // One that still waits gets the session when it is free.
    let mut undo = Command::new(env!("CARGO_BIN_EXE_overcoat"));
    let mut undo = undo.arg("undo").current_dir(&session).stderr(Stdio::piped()).spawn().unwrap();
    let mut note = String::new();
    BufReader::new(undo.stderr.as_mut().unwrap()).read_line(&mut note).unwrap();
    held.unlock().unwrap();
    assert!(undo.wait().unwrap().success() && note.contains("waiting"), "{note}");
    overcoat_ok(&session, &["scan", "hat", &scan, "--template", "hat"]);
}

#[test]
fn a_recipe_with_names_that_collide_is_refused_with_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let text = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    let third = "\n[[step]]\nname = \"Shirt\"\nscan = \"../body.ply\"\ntemplate = \"hat\"\n";
    std::fs::write(dir.path().join("third.toml"), text.clone() + third).unwrap();
    let replay = ["replay", "../third.toml", "--into", "../other"];
    refused(&session, &replay, 1, &["third.toml, line", "'Shirt' differs from the step 'shirt'"]);
    std::fs::write(dir.path().join("device.toml"), text.replace("\"shirt\"", "\"aux\"")).unwrap();
    let replay = ["replay", "../device.toml", "--into", "../other"];
    refused(&session, &replay, 1, &["device.toml, line", "'aux' cannot be the name"]);
    std::fs::write(dir.path().join("people.csv"), "subject\nanna\nAnna\n").unwrap();
    let subjects = ["replay", "recipe.toml", "--into", "../all", "--subjects", "../people.csv"];
    refused(&session, &subjects, 1, &["people.csv, line 3", "'Anna'"]);
    assert!(!dir.path().join("other").exists() && !dir.path().join("all").exists());
}

#[test]
fn a_stroke_in_the_air_is_refused_before_a_replay_makes_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let air = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_input/stroke_in_the_air.jsonl");
    std::fs::copy(air, dir.path().join("air.jsonl")).unwrap();
    let replay = ["replay", ".", "--into", "../other", "--set", "shirt.mask=../air.jsonl"];
    refused(&session, &replay, 1, &["air.jsonl': line 1"]);
    let text = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    let by_hand = text + "\n[[step.mask]]\nfile = \"../air.jsonl\"\n";
    std::fs::write(session.join("by_hand.toml"), by_hand).unwrap();
    refused(&session, &["replay", "by_hand.toml", "--into", "../other"], 1, &["air.jsonl': line 1"]);
    assert!(!dir.path().join("other").exists());
}

#[cfg(unix)]
#[test]
fn a_fifo_a_device_or_a_folder_in_place_of_a_file_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    for name in ["pipe.ply", "pipe.jsonl", "pipe.npz", "pipe.toml", "pipe.csv"] {
        assert!(std::process::Command::new("mkfifo").arg(dir.path().join(name)).status().unwrap().success());
    }
    std::fs::create_dir(dir.path().join("folder.jsonl")).unwrap();
    for (command, says) in [
        ("scan hat ../pipe.ply --template hat", "'../pipe.ply' cannot be read: it is a FIFO, not a file"),
        ("mask shirt ../pipe.jsonl", "it is a FIFO"),
        ("mask shirt ../folder.jsonl", "'../folder.jsonl' cannot be read: it is a folder, not a file"),
        ("new ../other --body ../pipe.npz", "it is a FIFO"),
        ("new ../other --body ..", "it is a folder"),
        ("replay ../pipe.toml --into ../other", "it is a FIFO"),
        ("replay . --into ../other --subjects ../pipe.csv", "it is a FIFO"),
        ("replay . --into ../other --set shirt=../pipe.ply", "it is a FIFO"),
        ("body measure ../pipe.ply", "it is a FIFO"),
        ("body show --model ../pipe.npz --mesh ../x.ply", "it is a FIFO"),
    ] {
        refused(&session, &command.split(' ').collect::<Vec<_>>(), 1, &[says]);
    }
    assert!(!dir.path().join("other").exists());
}

#[test]
fn a_broken_file_is_named_as_typed() {
    let dir = tempfile::tempdir().unwrap();
    session_with_two_scans(dir.path());
    std::fs::write(dir.path().join("broken.ply"), "hello").unwrap();
    let scan = ["-C", "session", "scan", "hat", "broken.ply", "--template", "hat"];
    for (file, shown) in [("broken.ply", "'broken.ply': "), ("./broken.ply", "'./broken.ply': ")] {
        let mut scan = scan;
        scan[4] = file;
        let answer = overcoat(dir.path(), &scan);
        assert!(answer.code == 1 && answer.stderr.starts_with(&format!("error: {shown}")), "{answer:?}");
    }
    let replay = ["replay", "session", "--into", "other", "--set", "shirt=broken.ply"];
    let answer = overcoat(dir.path(), &replay);
    assert!(answer.code == 1 && answer.stderr.contains("'broken.ply': "), "{answer:?}");
}

#[cfg(unix)]
#[test]
fn a_file_in_place_of_a_folder_cannot_be_written_to() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let file = dir.path().join("file");
    std::fs::write(&file, b"").unwrap();
    let below = file.join("new");
    refused(dir.path(), &["new", below.to_str().unwrap()], 1, &["cannot be written"]);
    refused(&session, &["export", file.join("x/").to_str().unwrap(), "--scan", "body"], 1, &["cannot be written"]);
}

/// A recording of somebody who turns, in a folder, changed for the worse.
fn recording(dir: &Path, turntable: &Turntable, harm: impl Fn(&Path)) -> String {
    turntable.write(dir);
    harm(dir);
    dir.display().to_string()
}

#[test]
fn unusable_recordings_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let quick = Turntable { frames: 10, turn_deg: 120.0, ..Turntable::default() };
    let write = |path: PathBuf, bytes: &[u8]| std::fs::write(path, bytes).unwrap();
    let edit = |dir: &Path, from: &str, to: &str| {
        let text = std::fs::read_to_string(dir.join("camera.json")).unwrap();
        assert!(text.contains(from));
        write(dir.join("camera.json"), text.replace(from, to).as_bytes());
    };
    let eight_bits = || {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::DynamicImage::new_luma8(160, 200).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let folder = |name: &str| dir.path().join(name);
    std::fs::create_dir(folder("empty")).unwrap();
    let cases: Vec<(String, &str)> = vec![
        (folder("empty").display().to_string(), "the folder is empty"),
        (
            recording(&folder("no_camera"), &quick, |d| std::fs::remove_file(d.join("camera.json")).unwrap()),
            "there is no camera.json beside the 10 depth images",
        ),
        (recording(&folder("no_focus"), &quick, |d| edit(d, "\"fx\"", "\"gx\"")), "camera.json has no 'fx'"),
        (
            recording(&folder("size"), &quick, |d| edit(d, "160", "200")),
            "frame 0_depth.png has 160 × 200 pixels, but camera.json says 200 × 200",
        ),
        (
            recording(&folder("bits"), &quick, |d| write(d.join("5_depth.png"), &eight_bits())),
            "frame 5_depth.png: the depth image has 1 channel of 8 bits",
        ),
        (
            recording(&folder("cut"), &quick, |d| {
                let whole = std::fs::read(d.join("3_depth.png")).unwrap();
                write(d.join("3_depth.png"), &whole[..whole.len() / 2]);
            }),
            "frame 3_depth.png: the PNG container is damaged",
        ),
        (
            recording(&folder("no_picture"), &quick, |d| write(d.join("4_rgb.jpg"), b"hello")),
            "frame 4_rgb.jpg: this is not JPEG: it begins with 'hello'",
        ),
        (
            recording(&folder("zero"), &Turntable { empty: true, room: false, ..quick.clone() }, |_| {}),
            "frame 0_depth.png holds no depth at all",
        ),
        (recording(&folder("unit"), &quick, |d| edit(d, "1000", "10")), "a person stands 0.3 to 8 m from the camera"),
        (
            recording(&folder("moved"), &Turntable { camera_moves: true, ..quick.clone() }, |_| {}),
            "the camera moved: the background is not where it was in frame 0_depth.png",
        ),
        (recording(&folder("nobody"), &Turntable { empty: true, ..quick.clone() }, |_| {}), "nobody is in view"),
        (
            recording(&folder("still"), &Turntable { turn_deg: 3.0, ..quick.clone() }, |_| {}),
            "the person does not turn",
        ),
        (
            recording(&folder("apart"), &Turntable { turn_deg: 810.0, ..quick.clone() }, |_| {}),
            "frame 1_depth.png does not overlap with the frames before it",
        ),
    ];
    for (path, says) in cases {
        refused(&session, &["scan", "hat", &path, "--template", "hat"], 1, &[says]);
    }
    let fine = recording(&folder("fine"), &quick, |_| {});
    refused(&session, &["scan", "hat", &fine, "--template", "hat", "--voxel", "0.2"], 2, &["voxels of 0.2 mm"]);
    refused(&session, &["scan", "hat", &fine, "--template", "hat", "--faces", "10"], 2, &["a scan of 10 faces"]);
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/0-body.ply").display().to_string();
    refused(&session, &["scan", "hat", &mesh, "--template", "hat", "--view"], 2, &["there is nothing to show"]);
    let watched = ["scan", "hat", &fine, "--template", "hat", "--view=fine.rrd"];
    if cfg!(feature = "rerun") {
        overcoat_ok(&session, &watched);
        assert!(std::fs::read(session.join("fine.rrd")).unwrap().starts_with(b"RRF2"));
    } else {
        refused(&session, &watched, 2, &["built without the viewer"]);
    }
}
