//! Hair of the bare scan as a layer over the garments.

use crate::common::{mean_body, overcoat, overcoat_ok, write_mesh};
use overcoat::formats::read_ply;
use overcoat::geometry::{Aabb, Point, Vec3};
use std::path::Path;

/// How far the hair stands off the scalp, in metres.
const HAIR: f64 = 0.03;

/// The mean person, with hair on the upper and back half of the head, and in a wide shirt.
fn person(has_hair: bool, has_shirt: bool) -> overcoat::formats::RawMesh {
    let bare = mean_body(|p| p);
    let crown = bare.points.iter().map(|p| p[1]).fold(0.0, f64::max);
    let of_head = bare.points.iter().filter(|p| p[1] > crown - 0.22).map(|p| Point::from(*p));
    let head = Aabb::around(of_head.collect::<Vec<_>>().iter()).unwrap();
    let smooth = |x: f64| {
        let t = x.clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    mean_body(|p| {
        let at = (p - head.center()).component_div(&(head.extent() * 0.5));
        let on_scalp = if at.y > -1.0 { smooth((0.8 * at.y - 0.55 * at.z - 0.1) / 0.35) } else { 0.0 };
        let from_axis = Vec3::new(p.x, 0.0, p.z).try_normalize(1e-9).unwrap_or_else(Vec3::z);
        let on_trunk =
            smooth((p.y - 1.0) / 0.01) * smooth((crown - 0.32 - p.y) / 0.03) * smooth((0.45 - p.x.abs()) / 0.02);
        let off_scalp = (p - head.center()).normalize() * if has_hair { HAIR * on_scalp } else { 0.0 };
        p + off_scalp + from_axis * if has_shirt { 0.012 * on_trunk } else { 0.0 }
    })
}

fn names(session: &Path) -> Vec<String> {
    let listed = overcoat_ok(session, &["step", "list", "--json"]).json();
    listed["steps"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap().to_string()).collect()
}

fn highest(file: &Path) -> f64 {
    let mesh = read_ply(std::fs::read(file).unwrap().as_slice()).unwrap();
    mesh.points.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn hair_is_a_layer_over_the_garments_and_the_head_below_it_keeps_its_size() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str, has_hair: bool, has_shirt: bool| {
        write_mesh(dir.path().join(name), &person(has_hair, has_shirt)).display().to_string()
    };
    let (bald, bare) = (file("bald.ply", false, false), file("bare.ply", true, false));
    let dressed = file("dressed.ply", true, true);
    overcoat_ok(dir.path(), &["new", "alice"]);
    let session = dir.path().join("alice");
    overcoat_ok(&session, &["scan", "body", &bare, "--hair", "layer"]);
    overcoat_ok(&session, &["scan", "shirt", &dressed, "--template", "tshirt"]);
    assert_eq!(names(&session), ["body", "shirt", "hair"]);
    overcoat_ok(&session, &["build"]);
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    let hair = status["steps"].as_array().unwrap().iter().find(|s| s["name"] == "hair").unwrap().clone();
    assert_eq!(hair["verdict"], "good", "{hair}");
    overcoat_ok(&session, &["export", "out/"]);
    let out = session.join("out");
    let (skull, crown) = (highest(&out.join("body.ply")), highest(&out.join("hair.ply")));
    assert!((0.6 * HAIR..1.4 * HAIR).contains(&(crown - skull)), "hair to {crown}, head to {skull}");

    // A scan without hair in place of the first one: the step stays, without a layer, and says so.
    overcoat_ok(&session, &["scan", "body", &bald, "--replace", "--hair", "layer"]);
    assert_eq!(names(&session), ["body", "shirt", "hair"]);
    let built = overcoat_ok(&session, &["build"]);
    assert!(built.stderr.contains("hair: good (the bare scan shows none: no layer)"), "{built:?}");
    overcoat_ok(&session, &["export", "bald/"]);
    assert!(!session.join("bald/hair.ply").exists() && session.join("bald/shirt.ply").exists());
}

#[test]
fn hair_comes_from_the_bare_scan_alone() {
    let dir = tempfile::tempdir().unwrap();
    let bare = write_mesh(dir.path().join("bare.ply"), &person(true, false)).display().to_string();
    let other = write_mesh(dir.path().join("other.ply"), &person(true, true)).display().to_string();
    overcoat_ok(dir.path(), &["new", "alice"]);
    let session = dir.path().join("alice");
    overcoat_ok(&session, &["scan", "body", &bare]);
    let refused = |args: &[&str], says: &str| {
        let before = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
        let answer = overcoat(&session, args);
        assert!(answer.code == 2 && answer.stderr.contains(says), "{answer:?}");
        assert_eq!(std::fs::read_to_string(session.join("recipe.toml")).unwrap(), before);
    };
    refused(&["scan", "hair", &other, "--template", "hair"], "is not the bare scan");
    refused(&["scan", "outfit", &other, "--template", "tshirt,hair"], "no garment of an outfit");
    refused(&["scan", "shirt", &other, "--template", "tshirt", "--hair", "layer"], "shirt");
    overcoat_ok(&session, &["scan", "hair", &bare, "--template", "hair"]);
    assert_eq!(names(&session), ["body", "hair"]);
    assert!(std::fs::read_to_string(session.join("recipe.toml")).unwrap().contains("hair = \"drop\""));
    refused(&["step", "set", "body", "fit.hair=keep"], "keeps its hair");
    refused(&["step", "set", "hair", "faces=5000"], "differs from 'body'");
    overcoat_ok(&session, &["step", "set", "body", "faces=9000"]);
    assert_eq!(std::fs::read_to_string(session.join("recipe.toml")).unwrap().matches("faces = 9000").count(), 2);
    overcoat_ok(&session, &["scan", "shirt", &other, "--template", "tshirt"]);
    overcoat_ok(&session, &["scan", "hat", &other, "--template", "hat"]);
    assert_eq!(names(&session), ["body", "shirt", "hair", "hat"]);
    overcoat_ok(&session, &["step", "remove", "hair"]);
    overcoat_ok(&session, &["undo"]);
    assert_eq!(names(&session), ["body", "shirt", "hair", "hat"]);
}
