//! `overcoat body photo`: a body from keypoints, its files, and what is refused.

use crate::common::{overcoat, overcoat_ok};
use overcoat::body::{Pose, Stance, embedded_model};
use overcoat::formats::{Intrinsics, MeshKind, read_color_picture, read_mesh, write_color_png};
use overcoat::photo::{Keypoints, Layout, PhotoCamera, exact_keypoints};
use serde_json::{Value, json};
use std::path::Path;

/// A level camera 1.1 m above the floor, 3.5 m in front of the world's origin.
const CAMERA_FROM_WORLD: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.1], [0.0, 0.0, -1.0, 3.5]];

/// The mean body upright, its keypoints.
fn keypoints() -> Keypoints {
    let model = embedded_model().unwrap();
    let mut pose: Pose = Stance::Upright.pose(&model.skeleton);
    let posed = model.posed(model.template.points(), &model.skeleton, &pose);
    pose.translation.y -= posed.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let intrinsics =
        Intrinsics { width: 720, height: 1280, pinhole: [1150.0, 1150.0, 360.0, 640.0], distortion: [0.0; 5] };
    let rows: Vec<f64> = CAMERA_FROM_WORLD.concat();
    let camera = PhotoCamera::try_new(&intrinsics, rows.first_chunk().copied()).unwrap();
    exact_keypoints(&model, &model.mean_shape(), &pose, &camera, Layout::Body25).unwrap()
}

fn triples(keypoints: &Keypoints) -> Vec<f64> {
    keypoints.seen.iter().flat_map(|k| [k.at.x, k.at.y, k.confidence]).collect()
}

fn people(people: &[Vec<f64>]) -> Value {
    let people: Vec<Value> = people.iter().map(|p| json!({ "pose_keypoints_2d": p })).collect();
    json!({ "version": 1.3, "people": people })
}

fn write(here: &Path, name: &str, json: &Value) {
    std::fs::write(here.join(name), json.to_string()).unwrap();
}

fn write_cameras(here: &Path) {
    let mut camera = json!({ "width": 720, "height": 1280, "fx": 1150, "fy": 1150, "cx": 360, "cy": 640 });
    write(here, "camera.json", &camera);
    camera["camera_from_world"] = json!(CAMERA_FROM_WORLD);
    write(here, "posed.json", &camera);
    camera["distortion"] = json!([0.2]);
    write(here, "lens.json", &camera);
}

#[test]
fn a_photo_becomes_a_mesh_a_picture_and_measures_with_their_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let good = triples(&keypoints());
    write(here, "kp.json", &people(std::slice::from_ref(&good)));
    write_cameras(here);
    std::fs::write(here.join("photo.png"), write_color_png([720, 1280], &[[90, 120, 80]; 720 * 1280]).unwrap())
        .unwrap();
    let command = ["body", "photo", "kp.json", "--camera", "posed.json", "--image", "photo.png"];
    let files = ["--mesh", "a.ply", "--picture", "a.png", "--json"];
    let answer = overcoat_ok(here, &[&command[..], &files[..]].concat()).json();
    let stature = answer["measures_cm"]["stature"].as_f64().unwrap();
    let own = overcoat_ok(here, &["body", "measure", "--beta", "0", "--json"]).json();
    let truth = own["measures_cm"]["stature"].as_f64().unwrap();
    assert!((stature - truth).abs() < 2.0, "{stature} cm, true {truth} cm");
    assert!((4.0..15.0).contains(&answer["deviations_cm"]["chest girth"].as_f64().unwrap()), "{answer}");
    assert!(answer["limits"].as_array().unwrap().iter().any(|l| l.as_str().unwrap().contains("girths")));

    let mesh = read_mesh(MeshKind::Ply, std::fs::File::open(here.join("a.ply")).unwrap()).unwrap();
    let ys = || mesh.points.iter().map(|p| p[1]);
    let (low, high) = (ys().fold(f64::INFINITY, f64::min), ys().fold(f64::NEG_INFINITY, f64::max));
    assert!(low.abs() < 0.03 && (100.0 * (high - low) - truth).abs() < 4.0, "{low} {high}");
    let picture = read_color_picture(&std::fs::read(here.join("a.png")).unwrap()).unwrap();
    assert_eq!([picture.width, picture.height], [720, 1280]);
    assert_eq!(picture.pixels[5], [90, 120, 80], "the photo is below");
    let drawn = picture.pixels.iter().filter(|p| **p != [90, 120, 80]).count();
    assert!((20_000..250_000).contains(&drawn), "{drawn} pixels");

    // The same request gives the same bytes.
    overcoat_ok(here, &[&command[..], &["--mesh", "b.ply", "--picture", "b.png"]].concat());
    for (a, b) in [("a.ply", "b.ply"), ("a.png", "b.png")] {
        assert_eq!(std::fs::read(here.join(a)).unwrap(), std::fs::read(here.join(b)).unwrap(), "{a}");
    }
    // The mesh is that of a person to `body measure`.
    let measured = overcoat_ok(here, &["body", "measure", "a.ply", "--json"]).json();
    let off = measured["measures_cm"]["stature"].as_f64().unwrap() - stature;
    assert!(off.abs() < 2.0, "{off} cm");
}

#[test]
fn a_given_height_needs_no_camera_and_a_camera_alone_leaves_the_stature_uncertain() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "kp.json", &people(&[triples(&keypoints())]));
    write_cameras(here);
    let given = overcoat_ok(here, &["body", "photo", "kp.json", "--height", "1.72", "--json"]).json();
    assert!((given["measures_cm"]["stature"].as_f64().unwrap() - 172.0).abs() < 0.5, "{given}");
    assert!(given["limits"].to_string().contains("the camera is unknown"));
    let guessed = overcoat_ok(here, &["body", "photo", "kp.json", "--camera", "camera.json"]);
    assert!(guessed.stdout.contains("limit: one view does not show the size"), "{guessed:?}");
}

#[test]
fn bad_input_of_body_photo_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let good = triples(&keypoints());
    let changed = |change: &dyn Fn(usize, &mut [f64])| {
        let mut numbers = good.clone();
        numbers.chunks_mut(3).enumerate().for_each(|(k, triple)| change(k, triple));
        people(&[numbers])
    };
    write(here, "good.json", &people(std::slice::from_ref(&good)));
    write(here, "two.json", &people(&[good.clone(), good.clone()]));
    write(here, "short.json", &people(&[good[..72].to_vec()]));
    write(here, "unseen.json", &changed(&|_, t| t[2] = 0.0));
    write(
        here,
        "half.json",
        &changed(&|k, t| {
            if (9..15).contains(&k) || k > 18 {
                t[2] = 0.0;
            }
        }),
    );
    write(here, "upside.json", &changed(&|_, t| t[1] = 1280.0 - t[1]));
    write(here, "scattered.json", &changed(&|k, t| t[0] += 300.0 * (7.0 * k as f64).sin()));
    let text = people(std::slice::from_ref(&good)).to_string();
    std::fs::write(here.join("nan.json"), text.replacen(&good[3].to_string(), "NaN", 1)).unwrap();
    std::fs::write(here.join("mesh.json"), "ply\nformat ascii 1.0\n").unwrap();
    std::fs::write(here.join("small.png"), write_color_png([72, 128], &[[0; 3]; 72 * 128]).unwrap()).unwrap();
    let landmarks: Vec<Value> =
        (0..33).map(|k| json!({ "x": 0.5, "y": 0.03 * f64::from(k), "visibility": 1 })).collect();
    write(here, "mediapipe.json", &json!({ "pose_landmarks": landmarks }));
    write_cameras(here);
    let tall = "--height 1.7";
    for (arguments, code, said) in [
        ("two.json --height 1.7", 2, "the keypoints show 2 people"),
        ("two.json --height 1.7 --person 3", 2, "there is no person 3"),
        ("good.json", 2, "neither the camera nor the person's height is known"),
        ("good.json --height 17", 2, "a height of 17 m is not that of an adult"),
        ("good.json --height nan", 2, "a height of NaN m is not that of an adult"),
        ("mediapipe.json --height 1.7", 2, "whose size is unknown"),
        ("good.json --camera camera.json --image small.png", 2, "has 72 × 128 pixels, but the camera has 720 × 1280"),
        ("good.json --height 1.7 --mesh good.json", 2, "good.ply"),
        ("short.json --height 1.7", 1, "person 1 has 72 numbers; 25 (OpenPose BODY_25)"),
        ("unseen.json --height 1.7", 1, "all confidences are 0"),
        ("half.json --height 1.7", 1, "only part of a person: no ankle"),
        ("upside.json --height 1.7", 1, "the picture is upside down"),
        ("scattered.json --height 1.7", 1, "no body agrees with the keypoints"),
        ("nan.json --height 1.7", 1, "the keypoints are not JSON: NaN in line 1"),
        ("mesh.json --height 1.7", 1, "the keypoints are not JSON"),
        ("camera.json --height 1.7", 1, "the file has no keypoints"),
        ("good.json --camera lens.json", 1, "the camera's lens distorts the picture"),
        ("good.json --camera good.json", 1, "camera.json has no 'width'"),
    ] {
        let words: Vec<&str> = ["body", "photo"].into_iter().chain(arguments.split(' ')).collect();
        let answer = overcoat(here, &words);
        assert_eq!(answer.code, code, "{arguments}: {answer:?}");
        let lines: Vec<&str> = answer.stderr.lines().collect();
        assert!(lines.len() == 2 && lines[1].starts_with("hint: "), "{arguments}: {answer:?}");
        assert!(answer.stderr.contains(said), "{arguments}: {answer:?}");
    }
    let chosen = format!("two.json {tall} --person 2");
    let words: Vec<&str> = ["body", "photo"].into_iter().chain(chosen.split(' ')).collect();
    overcoat_ok(here, &words);
}

#[test]
fn a_photo_becomes_the_body_of_a_session_and_its_uncertainty_is_in_the_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "kp.json", &people(&[triples(&keypoints())]));
    write_cameras(here);
    overcoat_ok(here, &["new", "alice"]);
    let in_session = |arguments: &str| {
        let words: Vec<&str> = ["-C", "alice"].into_iter().chain(arguments.split(' ')).collect();
        overcoat(here, &words)
    };
    for (arguments, said) in [
        ("scan body --photo kp.json", "neither the camera nor the person's height is known"),
        ("scan shirt --photo kp.json --height 1.7", "a photo gives the body, not 'shirt'"),
        ("scan body kp.json --height 1.7", "--photo"),
        ("scan body x.ply --photo kp.json --height 1.7", "a scan and --photo are two bodies"),
    ] {
        let answer = in_session(arguments);
        assert!(answer.code == 2 && answer.stderr.contains(said), "{arguments}: {answer:?}");
    }
    let alone = in_session("scan body kp.json");
    assert!(alone.code != 0 && alone.stderr.contains("keypoints of a tracker"), "{alone:?}");
    let scanned = in_session("scan body --photo kp.json --height 1.8 --camera camera.json");
    assert!(scanned.code == 0 && scanned.stdout.contains("computed from one photo: stature 180 ± 1 cm"), "{scanned:?}");
    // The photo is kept: neither file is needed any more.
    std::fs::remove_file(here.join("kp.json")).unwrap();
    std::fs::remove_file(here.join("alice/photo.json")).unwrap();
    let built = in_session("build");
    assert_eq!(built.code, 0, "{built:?}");
    let measured = in_session("body measure --json").json();
    let stature = measured["measures_cm"]["stature"].as_f64().unwrap();
    assert!((stature - 180.0).abs() < 1.0, "{measured}");
    assert!(measured["warnings"].to_string().contains("computed from one photo"), "{measured}");
}

/// A skirt of rings, wider at the hem and wider than deep, as .obj in metres.
fn skirt() -> String {
    use std::fmt::Write;
    let (around, rings) = (36, 12);
    let mut obj = String::new();
    for ring in 0..rings {
        for k in 0..around {
            let (share, turn) = (f64::from(ring) / f64::from(rings - 1), std::f64::consts::TAU * f64::from(k) / 36.0);
            let [x, z] = [(0.15 + 0.07 * share) * turn.cos(), (0.11 + 0.07 * share) * turn.sin()];
            writeln!(obj, "v {x} {} {z}", 1.0 - 0.35 * share - 0.01 * turn.sin() * (1.0 - share)).unwrap();
        }
    }
    for ring in 0..rings - 1 {
        for k in 0..around {
            let [a, b] = [ring * around + k + 1, ring * around + (k + 1) % around + 1];
            writeln!(obj, "f {a} {b} {}\nf {b} {} {}", a + around, b + around, a + around).unwrap();
        }
    }
    obj
}

#[test]
fn the_body_of_a_photo_wears_a_garment_in_the_pose_of_the_photo() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write(here, "kp.json", &people(&[triples(&keypoints())]));
    write_cameras(here);
    std::fs::write(here.join("skirt.obj"), skirt()).unwrap();
    std::fs::write(here.join("closed.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        .unwrap();
    let command = ["body", "photo", "kp.json", "--camera", "posed.json"];
    let worn = |args: &[&str]| overcoat(here, &[&command[..], args].concat());
    let answer = worn(&["--wear", "skirt.obj", "--picture", "worn.png", "--json"]);
    assert_eq!(answer.code, 0, "{answer:?}");
    let garment = &answer.json()["garment"];
    assert_eq!((&garment["kind"], &garment["crossing_pairs"]), (&json!("skirt"), &json!(0)), "{garment}");
    let picture = read_color_picture(&std::fs::read(here.join("worn.png")).unwrap()).unwrap();
    assert_eq!([picture.width, picture.height], [1440, 1280], "the photo, and beside it the dressed body");
    let blue = |p: &[u8; 3]| i32::from(p[2]) - i32::from(p[0]) > 40;
    let cloth = picture.pixels.chunks(1440).map(|row| row[720..].iter().filter(|p| blue(p)).count()).sum::<usize>();
    assert!((5_000..80_000).contains(&cloth), "{cloth} pixels of cloth");
    for (args, says) in [
        (&["--wear", "skirt.obj"][..], "--picture"),
        (&["--wear", "no.obj", "--picture", "a.png"], "no.obj"),
        (&["--wear", "closed.obj", "--picture", "a.png"], "closed.obj"),
        (&["--wear", "skirt.obj", "--fabric", "tin", "--picture", "a.png"], "tin"),
        (&["--fabric", "wool"], "--wear"),
    ] {
        let answer = worn(args);
        assert!(matches!(answer.code, 1 | 2) && answer.stderr.contains(says), "{args:?} {answer:?}");
    }
}
