//! The module table: which module of `src` may import which, and which module owns which crate.

use std::collections::{BTreeMap, BTreeSet};

/// What every stage may import.
const BASE: &[&str] = &["parameters", "numerics", "geometry", "formats"];
/// The stages on the main path, in the order of the data: each may import all before it.
const PATH: &[&str] = &["body", "scan", "fit", "segment", "cut", "rig", "stack"];
/// The stages beside that path.
const BRANCHES: &[&str] = &["train", "motion", "cloth", "tryon", "drive", "photo", "bake"];
/// Modules that `session` may import, but no stage.
const OUTER: &[&str] = &["mannequin", "measure", "check", "export", "view"];

/// The folders of `session`: each may import those before it.
pub const SESSION_FOLDERS: &[&str] = &["store", "recipe", "open", "pipeline", "results", "change"];

/// For each module the others that it may import; its own files are always allowed.
pub fn may_import() -> BTreeMap<&'static str, BTreeSet<&'static str>> {
    let set = |lists: &[&[&'static str]]| lists.iter().flat_map(|list| list.iter().copied()).collect::<BTreeSet<_>>();
    let stages = set(&[BASE, PATH, BRANCHES]);
    let mut table = BTreeMap::from([
        ("parameters", set(&[])),
        ("numerics", set(&[])),
        ("geometry", set(&[&["numerics"]])),
        ("formats", set(&[])),
        ("body", set(&[BASE])),
        ("scan", set(&[BASE])),
        ("train", set(&[BASE, &PATH[..3]])),
        ("mannequin", set(&[BASE, &["body"]])),
        ("motion", set(&[BASE, &["body"]])),
        ("cloth", set(&[BASE, PATH, &["motion"]])),
        ("tryon", set(&[BASE, PATH, &["motion", "cloth"]])),
        ("drive", set(&[BASE, PATH, &["motion"]])),
        ("photo", set(&[BASE, &["body", "motion"]])),
        ("bake", set(&[BASE, &PATH[..2]])),
        ("measure", stages.clone()),
        ("check", stages.clone()),
        ("export", stages.clone()),
        ("view", stages.clone()),
        ("studio", &stages | &set(&[&["measure"]])),
        ("cli", set(&[BASE, PATH, BRANCHES, &["measure", "check", "export", "view", "studio", "session", "desk"]])),
        ("desk", set(&[BASE, PATH, BRANCHES, &["check", "view", "session"]])),
        ("session", set(&[BASE, PATH, BRANCHES, OUTER])),
    ]);
    for k in 2..PATH.len() {
        table.insert(PATH[k], set(&[BASE, &PATH[..k]]));
    }
    table
}

/// Crates that any module may use: arithmetic, threads, serialization, errors and temporary files, which have no domain
/// of their own. `tempfile` opens files, so it is for those modules only that may do so.
pub const GENERAL_CRATES: &[&str] =
    &["bytemuck", "nalgebra", "rayon", "serde", "serde_json", "tempfile", "thiserror", "toml"];

/// Crates that are only listed in `Cargo.toml` to switch on features of other crates' dependencies.
pub const UNNAMED_CRATES: &[&str] = &["getrandom", "regex_syntax"];

/// Every other crate, as the source names it, and the modules that may use it: one, except that both `cli` and `session`
/// quote words for a shell, that both `cli` and `desk` compress, and that `meshopt` both simplifies meshes and unpacks
/// their files.
pub const CRATE_OWNERS: &[(&str, &[&str])] = &[
    ("ab_glyph", &["view"]),
    ("anyhow", &["cli"]),
    ("base64", &["desk"]),
    ("bevy_mikktspace", &["bake"]),
    ("blake3", &["session"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("clarabel", &["numerics"]),
    ("csv", &["session"]),
    ("faer", &["numerics"]),
    ("flate2", &["cli", "desk"]),
    ("gltf", &["formats"]),
    ("image", &["formats"]),
    ("indicatif", &["cli"]),
    ("kiddo", &["geometry"]),
    ("linfa", &["drive"]),
    ("linfa_svm", &["drive"]),
    ("meshopt", &["formats", "geometry"]),
    ("ndarray", &["drive"]),
    ("lz4_flex", &["formats"]),
    ("npyz", &["formats"]),
    ("parry3d", &["geometry"]),
    ("ply_rs", &["formats"]),
    ("postcard", &["session"]),
    ("pulp", &["numerics"]),
    ("rerun", &["view"]),
    ("robust", &["geometry"]),
    ("rosc", &["drive"]),
    ("rustyline", &["cli"]),
    ("shlex", &["cli", "session"]),
    ("signal_hook", &["cli"]),
    ("smartcore", &["drive"]),
    ("tiny_http", &["desk"]),
    ("uvunwrap", &["bake"]),
    ("zip", &["formats"]),
];
