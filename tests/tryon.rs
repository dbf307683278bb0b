//! `tryon`: a garment from a file becomes a layer like any other, in any unit and frame; files without one are refused.

use crate::common::{body_of_demo, built_quick_session, overcoat, overcoat_ok};
use overcoat::formats::{RawMesh, read_ply};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The garment that comes with the demo.
fn garment() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/try-on-tshirt.obj")
}

/// The lines of the garment, vertices changed and faces kept by index.
fn changed(vertex: impl Fn([f64; 3]) -> [f64; 3], keep: impl Fn(usize) -> bool) -> String {
    let text = std::fs::read_to_string(garment()).unwrap();
    let (mut out, mut face) = (String::new(), 0);
    for line in text.lines() {
        match line.split_once(' ') {
            Some(("v", rest)) => {
                let p: Vec<f64> = rest.split(' ').map(|x| x.parse().unwrap()).collect();
                let [x, y, z] = vertex([p[0], p[1], p[2]]);
                writeln!(out, "v {x} {y} {z}").unwrap();
            }
            Some(("f", _)) => {
                if keep(face) {
                    writeln!(out, "{line}").unwrap();
                }
                face += 1;
            }
            _ => {}
        }
    }
    out
}

/// Whether the step did not fail. On a coarse figure the shirt is at the limit of what is too small.
fn is_put_on(worn: &serde_json::Value) -> bool {
    worn["steps"][0]["verdict"].as_str().is_some_and(|verdict| !verdict.starts_with("failed"))
}

#[test]
fn a_garment_of_a_file_becomes_a_layer_like_any_other() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let file = garment();
    let file = file.to_str().unwrap();
    let worn = overcoat_ok(&session, &["tryon", file, "--name", "tee", "--fabric", "jersey", "--json"]).json();
    assert_eq!(worn["step"], "tee");
    assert!(is_put_on(&worn), "{worn}");
    assert!(worn["findings"].to_string().contains("in cm"), "{worn}");
    let status = overcoat_ok(&session, &["status", "--json"]).json().to_string();
    assert!(status.contains("tee"), "{status}");
    overcoat_ok(&session, &["export", "out.glb", "--force"]);
    let moved = overcoat_ok(&session, &["animate", "walk", "--frames", "60..62", "--mode", "lbs", "--json"]).json();
    assert_eq!(moved["measures"]["frames"], 2.0, "{moved}");
    // No scan, no labels.
    std::fs::write(
        session.join("dab.jsonl"),
        "{\"layer\":\"tee\",\"op\":\"erase\",\"radius\":0.02,\"points\":[[0,1.2,0]]}\n",
    )
    .unwrap();
    let refused = overcoat(&session, &["mask", "tee", "dab.jsonl"]);
    assert!(refused.code != 0 && refused.stderr.contains("hint:"), "{}", refused.stderr);
    // The recipe gives the same figure again.
    let copy = dir.path().join("copy");
    let recipe = session.join("recipe.toml");
    overcoat_ok(dir.path(), &["replay", recipe.to_str().unwrap(), "--into", copy.to_str().unwrap()]);
    overcoat_ok(&copy, &["export", "out.glb"]);
    assert!(std::fs::read(session.join("out.glb")).unwrap().len() > 100_000);
    overcoat_ok(&session, &["undo", "--json"]);
}

#[test]
fn unit_and_frame_do_not_matter_and_other_meshes_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let all = |_: usize| true;
    // Upside down, in inches, far away.
    let turned = changed(|[x, y, z]| [z / 2.54 + 900.0, -x / 2.54, -y / 2.54], all);
    std::fs::write(session.join("turned.obj"), turned).unwrap();
    let worn = overcoat_ok(&session, &["tryon", "turned.obj", "--name", "tee", "--json"]).json();
    assert!(worn["findings"].to_string().contains("in in"), "{worn}");
    assert!(is_put_on(&worn), "{worn}");
    overcoat_ok(&session, &["undo"]);
    let before = overcoat_ok(&session, &["log"]).stdout;
    let doll = changed(|p| p.map(|x| x * 0.3), all);
    let tetrahedron = "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    let one = changed(|p| p, all);
    let vertices = one.lines().filter(|line| line.starts_with("v ")).count();
    let mut two = one.clone() + &changed(|[x, y, z]| [x + 500.0, y, z], |_| false);
    for line in one.lines().filter(|line| line.starts_with("f ")) {
        let corners = line.split(' ').skip(1).map(|v| (v.parse::<usize>().unwrap() + vertices).to_string());
        writeln!(two, "f {}", corners.collect::<Vec<_>>().join(" ")).unwrap();
    }
    for (name, text, expected) in [
        ("closed.obj", tetrahedron.to_string(), "closed"),
        ("empty.obj", "v 0 0 0\n".to_string(), "no faces"),
        ("doll.obj", doll, "fits no adult"),
        ("two.obj", two, "2 large parts"),
        ("text.obj", "nothing".to_string(), ""),
    ] {
        std::fs::write(session.join(name), text).unwrap();
        let unit: &[&str] = if name == "doll.obj" { &["--unit", "cm"] } else { &[] };
        let refused = overcoat(&session, &[&["tryon", name], unit].concat());
        assert_eq!(refused.code, 1, "{name}: {}", refused.stderr);
        assert!(refused.stderr.contains(expected) && refused.stderr.contains("hint:"), "{name}: {}", refused.stderr);
        assert_eq!(overcoat_ok(&session, &["log"]).stdout, before, "{name} changed the session");
    }
}

#[test]
fn studio_sews_sizes_and_forms_that_can_be_put_on() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let sizes = ["studio", "garment", "--kind", "tshirt", "--sizes", "S,XL", "--out", "sizes", "--json"];
    let sewn = overcoat_ok(&session, &sizes).json();
    assert_eq!(sewn["files"].as_array().map(Vec::len), Some(2), "{sewn}");
    let girth = |size: &str| {
        let text = std::fs::read_to_string(session.join(format!("sizes/tshirt-{size}.obj"))).unwrap();
        let xs = text.lines().filter_map(|line| line.strip_prefix("v ")?.split(' ').nth(2)?.parse::<f64>().ok());
        let (low, high) = xs.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    };
    // Three sizes are 12 cm of girth: about 4 cm of depth.
    assert!((2.0..6.0).contains(&(girth("XL") - girth("S"))), "{} {}", girth("S"), girth("XL"));
    for (form, said) in [("thick", "thick cloth"), ("buttoned", "buttons"), ("split", "seams")] {
        overcoat_ok(&session, &["studio", "garment", "--kind", "vest", "--form", form, "--out", form]);
        let file = format!("{form}/vest-M.obj");
        let stopped = overcoat_ok(&session, &["tryon", &file, "--stop-after", "rims", "--json"]).json();
        assert!(stopped["notes"].to_string().contains(said), "{form}: {stopped}");
    }
    for (argument, value) in [("--kind", "cape"), ("--sizes", "S,36"), ("--sizes", "S,S")] {
        let kind = if argument == "--kind" { value } else { "tshirt" };
        let sizes = if argument == "--sizes" { value } else { "M" };
        let wrong = ["studio", "garment", "--kind", kind, "--sizes", sizes, "--out", "wrong"];
        let refused = overcoat(&session, &wrong);
        assert!(refused.code != 0 && refused.stderr.contains("hint:"), "{}", refused.stderr);
    }
}

#[test]
fn sizes_get_verdicts_by_their_width_and_one_is_kept() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let write = |name: &str, wider: f64| {
        std::fs::write(session.join(name), changed(|[x, y, z]| [x * wider, y * wider, z * wider], |_| true)).unwrap();
    };
    write("s.obj", 0.8);
    write("l.obj", 1.1);
    let sizes = ["tryon", "--size", "S=s.obj", "--size", "L=l.obj", "--unit", "cm", "--fabric", "cotton"];
    let tried = overcoat_ok(&session, &[&sizes[..], &["--picture", "sizes.png", "--json"]].concat()).json();
    let [small, large] = [0, 1].map(|k| tried["sizes"][k].clone());
    assert!(small["verdict_text"].as_str().unwrap().contains("too tight at the"), "{small}");
    let waist = |size: &serde_json::Value| {
        let girths = size["girths"].as_array().unwrap();
        girths.iter().find(|girth| girth["name"] == "waist").unwrap()["own"].as_f64().unwrap()
    };
    let wider = waist(&large) / waist(&small);
    assert!((wider - 1.1 / 0.8).abs() < 0.15, "{wider}");
    assert!(session.join("sizes.png").exists());
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert!(!status.to_string().contains("\"tee\""), "nothing became a layer: {status}");
    overcoat_ok(&session, &[&sizes[..], &["--keep", "L", "--name", "tee"]].concat());
    let status = overcoat_ok(&session, &["status", "--json"]).json().to_string();
    assert!(status.contains("waist_ease_mm"), "{status}");
    let ease = overcoat_ok(&session, &["view", "--ease", "ease.png", "--json"]).json();
    assert!(ease["ease"]["tee"]["girths"][0]["gap"].as_f64().unwrap() > 0.0, "{ease}");
    for (wrong, says) in [
        (&["--size", "S=s.obj", "--size", "S=l.obj"][..], "the size S is given twice"),
        (&["--size", "S=s.obj", "--size", "M=s.obj"], "the files are equal"),
        (&["--size", "S=s.obj", "--keep", "M"], "there is no size M"),
        (&["--size", "s.obj"], "expected SIZE=FILE"),
        (&["--size", "S=none.obj"], "none.obj"),
        (&["s.obj", "--picture", "x.png"], "--picture draws"),
    ] {
        let answer = overcoat(&session, &[&["tryon"], wrong].concat());
        assert!(answer.code != 0 && answer.stderr.contains(says), "{wrong:?}: {answer:?}");
    }
}

#[test]
fn the_steps_of_the_paper_run_alone_and_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let file = garment();
    let file = file.to_str().unwrap();
    let before = overcoat_ok(&session, &["log"]).stdout;
    let all = ["tryon", file, "--stop-after", "clear", "--picture", "steps.png", "--mesh", "worn.ply"];
    let tried = overcoat_ok(&session, &[&all[..], &["--pose", "walk:20", "--json"]].concat()).json();
    assert_eq!(tried["stopped_after"], "clear", "{tried}");
    let inside = |at: usize| tried["inside"][at].as_u64().unwrap();
    assert!(inside(1) < 10 && inside(0) > inside(1), "{tried}");
    assert!(std::fs::read(session.join("steps.png")).unwrap().len() > 10_000);
    assert!(std::fs::read(session.join("worn.ply")).unwrap().len() > 10_000);
    let without = ["tryon", file, "--stop-after", "bend", "--without", "planes,torso", "--picture", "rough.png"];
    overcoat_ok(&session, &without);
    for (arguments, said) in [
        (&["--stop-after", "sew"][..], "skeleton"),
        (&["--stop-after", "bend", "--pose", "walk"][..], "walk:60"),
        (&["--stop-after", "bend", "--pose", "walk:99999"][..], "frame from 0"),
        (&["--stop-after", "bend", "--pose", "dance:3"][..], "walk, turn"),
        (&["--picture", "x.png"][..], "--stop-after"),
    ] {
        let refused = overcoat(&session, &[&["tryon", file][..], arguments].concat());
        assert!(refused.code != 0 && refused.stderr.contains(said), "{arguments:?}: {}", refused.stderr);
    }
    assert_eq!(overcoat_ok(&session, &["log"]).stdout, before);
}

#[test]
fn a_garment_is_shown_in_a_pose_and_laid_on_by_the_paper() {
    let dir = tempfile::tempdir().unwrap();
    let session = body_of_demo(dir.path());
    overcoat_ok(&session, &["build"]);
    let file = garment();
    let file = file.to_str().unwrap();
    let recipe = || std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    let before = recipe();
    let pose = ["tryon", file, "--pose", "walk:4", "--picture", "posed.png", "--mesh", "posed.ply", "--json"];
    let posed = overcoat_ok(&session, &pose).json();
    assert_eq!((&posed["crossing_pairs"], &posed["crossing_clothes"]), (&0.into(), &0.into()), "{posed}");
    assert!(session.join("posed.png").is_file() && session.join("posed.ply").is_file());
    assert_eq!(recipe(), before, "nothing is kept");
    let laid = overcoat_ok(&session, &["tryon", file, "--name", "tee", "--method", "paper", "--json"]).json();
    assert!(is_put_on(&laid), "{laid}");
    assert!(recipe().contains("method = \"paper\""), "{}", recipe());
    for (options, says) in [
        (&["--pose", "walk:4", "--method", "paper"][..], "cannot be used with"),
        (&["--pose", "walk:4", "--name", "tee"][..], "cannot be used with"),
        (&["--mesh", "x.ply"][..], "--stop-after or --pose"),
        (&["--method", "ours"][..], "paper"),
    ] {
        let answer = overcoat(&session, &[&["tryon", file], options].concat());
        assert!(answer.code == 2 && answer.stderr.contains(says), "{options:?}: {answer:?}");
    }
    let scanned = recipe().replacen("name = \"body\"", "name = \"body\"\nmethod = \"paper\"", 1);
    std::fs::write(session.join("recipe.toml"), scanned).unwrap();
    let answer = overcoat(&session, &["status"]);
    assert!(answer.code != 0 && answer.stderr.contains("'method'") && answer.stderr.contains("hint:"), "{answer:?}");
}

#[test]
fn buttons_are_a_layer_that_the_cloth_carries() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["studio", "garment", "--kind", "vest", "--form", "buttoned", "--out", "sewn"]);
    let worn = overcoat_ok(&session, &["tryon", "sewn/vest-M.obj", "--name", "vest", "--json"]).json();
    assert!(is_put_on(&worn), "{worn}");
    assert!(worn["findings"].to_string().contains("5 small parts"), "{worn}");
    overcoat_ok(&session, &["export", "layers/"]);
    let bind = ply(&session.join("layers/vest-trim.ply"));
    overcoat_ok(&session, &["animate", "walk", "--frames", "20..24"]);
    overcoat_ok(&session, &["export", "frames/", "--sequence", "ply"]);
    let cloth = ply(&session.join("frames/0003/vest.ply"));
    let moved = ply(&session.join("frames/0003/vest-trim.ply"));
    assert_eq!((bind.points.len(), moved.points.len()), (80, 80));
    let apart = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    for (button, was) in moved.points.chunks(16).zip(bind.points.chunks(16)) {
        // As wide and as high as it was, and a few millimetres off the cloth.
        assert!((1..16).all(|k| (apart(&button[0], &button[k]) - apart(&was[0], &was[k])).abs() < 1e-5));
        let off = cloth.points.iter().map(|p| apart(p, &button[0])).fold(f64::MAX, f64::min);
        assert!(off < 0.03, "{off}");
        assert!(apart(&button[0], &was[0]) > 1e-4, "it stayed where it was");
    }
    overcoat_ok(&session, &["export", "one.glb", "--layers", "vest"]);
    let file = std::fs::read(session.join("one.glb")).unwrap();
    assert!(String::from_utf8_lossy(&file).contains("vest-trim"), "the trim is chosen with its garment");
}

fn ply(path: &Path) -> RawMesh {
    read_ply(std::fs::File::open(path).unwrap()).unwrap()
}
