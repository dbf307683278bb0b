//! Results that must not change: hashes of what fixed runs make, in `frozen/*.txt`. `just frozen` runs all of them,
//! `just freeze` rewrites the files after an intended change; the commit message then says what changed and why.
//!
//! A stage whose output changes although its inputs and its version did not needs a higher version: otherwise finished
//! sessions would keep the old result. That cannot be frozen away.
//!
//! Floating-point results may differ between processors, because some kernels are compiled for several instruction sets,
//! and between C libraries. A file records where it was made; elsewhere the test prints a notice and compares nothing.

mod record;

use crate::common::{Built, built_quick_session, demo, outfit_a, overcoat_ok, synthetic_outfit};
use record::{Entry, hash_of, must_match};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Every stage's output in a session.
fn stages(session: &Path) -> Vec<Entry> {
    let state: Value = serde_json::from_slice(&std::fs::read(session.join("session.json")).unwrap()).unwrap();
    let mut found = Vec::new();
    for step in state["steps"].as_array().unwrap() {
        for (stage, made) in step["stages"].as_object().unwrap() {
            let text = |key: &str| made[key].as_str().unwrap_or_else(|| panic!("{stage} has no {key}"));
            found.push(Entry {
                name: format!("{}/{stage}", step["name"].as_str().unwrap()),
                hash: text("output")[..16].into(),
                inputs: Some(text("inputs")[..16].into()),
            });
        }
    }
    assert!(found.len() > 5, "no stages in session.json");
    found
}

/// Every file below `dir`.
fn files(dir: &Path, prefix: &str) -> Vec<Entry> {
    let hashes = crate::common::fingerprint(dir);
    let name = |path: PathBuf| format!("{prefix}{}", path.display());
    hashes.into_iter().map(|(path, hash)| Entry::file(name(path), &hash)).collect()
}

/// Every stage's output, the GLB and the layers of a built session.
fn session(session: &Path) -> Vec<Entry> {
    let out = tempfile::tempdir().unwrap();
    let target = |name: &str| out.path().join(name).display().to_string();
    overcoat_ok(session, &["export", &target("character.glb")]);
    overcoat_ok(session, &["export", &format!("{}/", target("layers"))]);
    [stages(session), files(out.path(), "")].concat()
}

/// Builds a session from scans, given as step, file and kind of garment.
fn built(folder: &Path, scans: &[(&str, &str, Option<&str>)]) -> Vec<Entry> {
    let dir = tempfile::tempdir().unwrap();
    overcoat_ok(dir.path(), &["new", "session"]);
    let of = dir.path().join("session");
    for (step, file, template) in scans {
        let file = folder.join(file).display().to_string();
        let kind: Vec<&str> = template.iter().flat_map(|kind| ["--template", kind]).collect();
        overcoat_ok(&of, &[&["scan", step, &file], kind.as_slice()].concat());
    }
    overcoat_ok(&of, &["build", "-q"]);
    session(&of)
}

/// What `studio make` writes for a seed.
fn made_by_studio(seed: &str, garments: &str, options: &[&str]) -> Vec<Entry> {
    let dir = tempfile::tempdir().unwrap();
    let make = ["studio", "make", "--seed", seed, "--garments", garments, "--out", "made"];
    overcoat_ok(dir.path(), &[&make[..], options].concat());
    files(&dir.path().join("made"), &format!("seed-{seed}/"))
}

/// The scans of a synthetic person, and the session built from them.
fn outfit(built: &Built) -> Vec<Entry> {
    [files(&built.dir.path().join("scans"), "scans/"), session(&built.session)].concat()
}

#[test]
fn a_coarse_session() {
    let dir = tempfile::tempdir().unwrap();
    must_match("coarse", &session(&built_quick_session(dir.path(), "session")));
}

#[test]
fn a_small_recording_by_the_studio() {
    must_match(
        "studio-small",
        &made_by_studio("26", "socks", &["--views", "8", "--size", "212x256", "--faces", "8000"]),
    );
}

#[test]
fn the_demo() {
    let kept = demo().dir.path().join("kept");
    let pictures = ["character.glb", "poster.png", "sheet.png"];
    let pictures = pictures.map(|name| Entry::file(name.into(), &hash_of(&kept.join(name))));
    must_match("demo", &[session(&demo().session), pictures.to_vec()].concat());
}

#[test]
fn outfit_a_tshirt_jeans_jacket() {
    must_match("outfit-a", &outfit(outfit_a()));
}

#[test]
#[ignore = "takes minutes: `just frozen`"]
fn outfit_b_blouse_skirt_coat() {
    must_match("outfit-b", &outfit(&synthetic_outfit(22, &["blouse", "skirt", "coat"])));
}

#[test]
#[ignore = "takes minutes: `just frozen`"]
fn outfit_c_leggings_dress_scarf() {
    must_match("outfit-c", &outfit(&synthetic_outfit(23, &["leggings", "dress", "scarf"])));
}

#[test]
#[ignore = "takes minutes: `just frozen`"]
fn a_corpus_by_the_studio() {
    let coarse = ["--no-frames", "--faces", "20000", "--views", "16"];
    let made = [
        made_by_studio("21", "tshirt,jeans,jacket", &coarse),
        made_by_studio("24", "socks,shorts,tanktop", &coarse),
        made_by_studio("25", "leggings,shirt,vest", &coarse),
        made_by_studio("26", "tshirt", &["--views", "8"]),
    ];
    must_match("studio", &made.concat());
}

/// The folder of the foreign scans.
fn foreign() -> PathBuf {
    std::env::var_os("OVERCOAT_FOREIGN").expect("OVERCOAT_FOREIGN must name the folder of the foreign scans").into()
}

#[test]
#[ignore = "needs foreign scans: `OVERCOAT_FOREIGN=DIR just frozen`"]
fn foreign_man() {
    let steps = [
        ("body", "0-body.ply", None),
        ("trousers", "1-trousers.ply", Some("trousers")),
        ("pullover", "2-pullover.ply", Some("pullover")),
        ("jacket", "3-jacket.ply", Some("jacket")),
    ];
    must_match("man", &built(&foreign().join("man"), &steps));
}

#[test]
#[ignore = "needs foreign scans: `OVERCOAT_FOREIGN=DIR just frozen`"]
fn foreign_woman() {
    let steps = [
        ("body", "0-body.ply", None),
        ("blouse", "1-blouse.ply", Some("blouse")),
        ("skirt", "2-skirt.ply", Some("skirt")),
        ("coat", "3-coat.ply", Some("coat")),
    ];
    must_match("woman", &built(&foreign().join("woman"), &steps));
}

#[test]
#[ignore = "needs foreign scans: `OVERCOAT_FOREIGN=DIR just frozen`"]
fn foreign_man_from_frames() {
    let steps = [
        ("body", "0-body", None),
        ("trousers", "1-trousers", Some("trousers")),
        ("pullover", "2-pullover", Some("pullover")),
        ("jacket", "3-jacket", Some("jacket")),
    ];
    must_match("man-frames", &built(&foreign().join("man"), &steps));
}

#[test]
#[ignore = "needs foreign scans: `OVERCOAT_FOREIGN=DIR just frozen`"]
fn foreign_woman_from_frames() {
    // Her bare body was not recorded as frames.
    let steps =
        [("body", "0-body.ply", None), ("blouse", "1-blouse.ply", Some("blouse")), ("skirt", "2-skirt", Some("skirt"))];
    must_match("woman-frames", &built(&foreign().join("woman"), &steps));
}
