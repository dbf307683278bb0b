//! `tryon`: a garment from a file becomes a layer like any other, in any unit and frame; files without one are refused.

use crate::common::{built_quick_session, overcoat, overcoat_ok};
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
