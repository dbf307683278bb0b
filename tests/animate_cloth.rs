//! `animate` with cloth, the default: it never crosses, is recorded, exported, replayed; and what it refuses.

use crate::common::{built_quick_session, fingerprint, overcoat, overcoat_ok};
use overcoat::formats::read_ply;
use overcoat::geometry::{Point, TriMesh, intersecting_pairs, self_intersecting_pairs};
use std::path::{Path, PathBuf};

/// A built session of a body and a T-shirt, with a quarter of a second of a squat, in cloth.
fn squatting(dir: &Path) -> PathBuf {
    let session = built_quick_session(dir, "alice");
    let how = ["--frames", "40..46", "--ease-secs", "0.2", "--name", "squat"];
    overcoat_ok(&session, &[&["animate", "squat"][..], &how].concat());
    session
}

fn crossings(body: &TriMesh, shirt: &TriMesh) -> usize {
    let within: usize = [body, shirt].iter().map(|mesh| self_intersecting_pairs(mesh).len()).sum();
    within + intersecting_pairs(body, shirt).len()
}

#[test]
fn no_exported_frame_of_cloth_has_a_crossing() {
    let dir = tempfile::tempdir().unwrap();
    let session = squatting(dir.path());
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    let squat = &status["animations"][0];
    assert_eq!((&squat["mode"], &status["up_to_date"]), (&"coupled".into(), &true.into()), "{squat}");
    assert_eq!(squat["cloth"]["measures"]["crossing_pairs"], 0.0, "{squat}");
    overcoat_ok(&session, &["export", "../frames", "--sequence", "ply"]);
    overcoat_ok(&session, &["export", "../caches", "--sequence", "pc2"]);
    let frames = std::fs::read_dir(dir.path().join("frames")).unwrap().count();
    assert_eq!(frames, 12, "six of the lead-in, six of the clip");
    let cache = std::fs::read(dir.path().join("caches/tshirt.pc2")).unwrap();
    let floats: Vec<f32> = cache[32..].as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    for frame in 0..frames {
        let [body, shirt] = ["body", "tshirt"].map(|layer| {
            let path = dir.path().join(format!("frames/{frame:04}/{layer}.ply"));
            let mesh = read_ply(std::fs::File::open(path).unwrap()).unwrap();
            let faces: Vec<[u32; 3]> = mesh.faces.iter().map(|f| [f[0], f[1], f[2]]).collect();
            TriMesh::try_from_indices(mesh.points.iter().map(|&p| Point::from(p)).collect(), &faces).unwrap()
        });
        assert_eq!(crossings(&body, &shirt), 0, "frame {frame}");
        let of_frame = floats[frame * shirt.vertex_count() * 3..].chunks(3);
        assert!(shirt.points().iter().zip(of_frame).all(|(p, q)| (0..3).all(|k| p[k] as f32 == q[k])));
    }
}

#[test]
fn cloth_is_made_again_to_the_same_bytes_and_can_be_undone() {
    let dir = tempfile::tempdir().unwrap();
    let session = squatting(dir.path());
    let recipe = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    assert!(recipe.contains("mode = \"coupled\""), "{recipe}");
    let made = fingerprint(&session);
    overcoat_ok(&session, &["build", "--force"]);
    let lost: Vec<_> = made
        .iter()
        .filter(|(path, hash)| path.starts_with("artefacts") && fingerprint(&session).get(*path) != Some(hash))
        .collect();
    assert!(lost.is_empty(), "{lost:?}");
    // Another coupling is another result; the poses stay.
    overcoat_ok(&session, &["animate", "squat", "--mode", "lbs", "--frames", "40..46", "--ease-secs", "0.2"]);
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert!(status["animations"][0]["cloth"].is_null() && status["animations"][0]["mode"] == "lbs");
    overcoat_ok(&session, &["undo"]);
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!((&status["animations"][0]["mode"], &status["up_to_date"]), (&"coupled".into(), &true.into()));
}

#[test]
fn the_other_modes_count_what_crosses_and_fabrics_are_kept_and_undone() {
    let dir = tempfile::tempdir().unwrap();
    let session = squatting(dir.path());
    let made = |how: &[&str]| {
        let clip = ["animate", "squat", "--frames", "40..46", "--ease-secs", "0.2", "--json"];
        overcoat_ok(&session, &[&clip[..], how].concat()).json()
    };
    let coupled = made(&["--mode", "coupled"]);
    let post = made(&["--mode", "post"]);
    let physics = made(&["--mode", "physics", "--fabric", "tshirt=leather"]);
    let springs = made(&["--mode", "post", "--solver", "rk4"]);
    for (answer, crosses) in [(&coupled, false), (&post, true), (&physics, false), (&springs, true)] {
        let pairs = answer["measures"]["crossing_pairs"].as_f64().unwrap();
        assert_eq!(pairs > 0.0, crosses, "{answer}");
        let warned = answer["findings"].as_array().unwrap().iter().any(|f| f.as_str().unwrap().contains("faces cross"));
        assert_eq!(warned, crosses, "{answer}");
    }
    overcoat_ok(&session, &["undo"]);
    let recipe = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    assert!(recipe.contains("[animation.fabrics]\ntshirt = \"leather\""), "{recipe}");
    // A draft does not claim what nobody looked at.
    let draft = made(&["--draft"]);
    assert!(
        draft["measures"]["crossing_pairs"].is_null()
            && draft["measures"]["swing_mm"] != coupled["measures"]["swing_mm"],
        "{draft}"
    );
    assert!(draft["findings"][0].as_str().unwrap().contains("a draft: nobody looked"), "{draft}");
    assert!(overcoat_ok(&session, &["status"]).stdout.contains("with cloth, a draft"));
    overcoat_ok(&session, &["undo"]);
    assert!(overcoat_ok(&session, &["status", "--json"]).json()["up_to_date"] == true);
    // A layer of another fabric moves in another way.
    let denim = made(&["--mode", "physics", "--fabric", "tshirt=denim"]);
    assert!(denim["ran"] == true && denim["measures"]["swing_mm"] != physics["measures"]["swing_mm"], "{denim}");
    overcoat_ok(&session, &["step", "rename", "tshirt", "shirt"]);
    let recipe = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    assert!(recipe.contains("[animation.fabrics]\nshirt = \"denim\""), "{recipe}");
}

#[test]
fn a_figure_without_garments_is_skinned() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["step", "remove", "tshirt"]);
    let made = overcoat_ok(&session, &["animate", "idle", "--frames", "0..2", "--ease-secs", "0", "--json"]).json();
    assert_eq!((&made["animation"]["mode"], &made["layers"]), (&"lbs".into(), &"skinned only".into()), "{made}");
}

#[test]
fn impossible_cloth_is_refused_in_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    for (wrong, says) in [
        (&["--mode", "rubber"][..], "give lbs, physics, post or coupled"),
        (&["--mode", "coupled", "--swing-hz", "-1"], "--swing-hz cannot be '-1'"),
        (&["--mode", "coupled", "--damping", "NaN"], "--damping cannot be 'NaN'"),
        (&["--mode", "coupled", "--solver", "euler"], "give xpbd or rk4"),
        (&["--draft", "--solver", "xpbd"], "cannot be used with"),
        (&["--mode", "coupled", "--fabric", "tshirt"], "give LAYER=FABRIC"),
        (&["--mode", "coupled", "--fabric", "tshirt=moonshine"], "denim"),
        (&["--mode", "coupled", "--fabric", "cape=denim"], "the garments are tshirt"),
    ] {
        let before = fingerprint(&session);
        let answer = overcoat(&session, &[&["animate", "walk"], wrong].concat());
        assert!(answer.code == 2 && answer.stderr.contains(says), "{wrong:?}: {answer:?}");
        assert_eq!(fingerprint(&session), before);
    }
}
