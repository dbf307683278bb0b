//! `export --quads`: layers as quads that keep their hems, their values, and clear of each other.

use crate::common::glb::Glb;
use crate::common::{body_of_demo, demo, demo_scan, overcoat, overcoat_ok};
use overcoat::formats::{RawMesh, read_gltf, read_ply};
use overcoat::geometry::{Adjacency, Point, TriMesh};
use overcoat::stack::crossing_places;
use std::path::Path;

const LAYERS: [&str; 5] = ["body", "tshirt", "skirt", "pullover", "vest"];

fn mesh(raw: &RawMesh) -> TriMesh {
    TriMesh::try_from_indices(raw.points.iter().map(|p| Point::from(*p)).collect(), &raw.faces).unwrap()
}

fn layers(folder: &Path) -> Vec<RawMesh> {
    LAYERS.map(|name| read_ply(std::fs::read(folder.join(format!("{name}.ply"))).unwrap().as_slice()).unwrap()).into()
}

#[test]
fn layers_become_quads_that_keep_their_hems_and_cross_nowhere() {
    let out = tempfile::tempdir().unwrap();
    let [before, after] = ["before", "after"].map(|name| out.path().join(name));
    let export = |folder: &Path, options: &[&str]| {
        let target = format!("{}/", folder.display());
        overcoat_ok(&demo().session, &[&["export", &target, "--json"], options].concat()).json()
    };
    export(&before, &[]);
    let done = export(&after, &["--quads=30000"]);
    let header = std::fs::read(after.join("vest.ply")).unwrap();
    let (before, after) = (layers(&before), layers(&after));
    let said = done["quads"].as_array().unwrap();
    let mut quads = 0;
    for ((name, said), (before, after)) in LAYERS.iter().zip(said).zip(before.iter().zip(&after)) {
        assert_eq!(said["layer"], *name, "{done}");
        let count = said["quads"].as_u64().unwrap_or_else(|| panic!("{name} keeps its triangles: {done}"));
        quads += count;
        assert_eq!(after.faces.len() as u64, 2 * count, "the reader splits quads");
        // The demo's T-shirt is crumpled in the armpits.
        assert!(said["poor_quads"].as_u64().unwrap() * 100 <= count, "{name}: {said}");
        assert_eq!(before.colors.is_some(), after.colors.is_some());
        let loops = |raw: &RawMesh| Adjacency::prepare(&mesh(raw)).boundary_loops().len();
        assert_eq!(loops(before), loops(after), "{name}");
    }
    assert!((27_000..45_000).contains(&quads), "{quads}");
    let body = mesh(&after[0]);
    let halves = body.faces().as_slice().split_at(body.face_count() / 2);
    let is_of = |face: &[overcoat::geometry::VertexId; 3], sign: f64| {
        face.iter().map(|v| sign * body.points()[*v].x).sum::<f64>() > -0.02
    };
    assert!(halves.0.iter().all(|face| is_of(face, 1.0)) && halves.1.iter().all(|face| is_of(face, -1.0)));
    let text = String::from_utf8_lossy(&header[..400]).into_owned();
    let count = said[4]["quads"].as_u64().unwrap();
    assert!(text.contains(&format!("element face {count}")), "four corners each: {text}");
    let crossings = crossing_places(&after.iter().map(mesh).collect::<Vec<_>>()).unwrap();
    assert!(crossings.is_empty(), "{crossings:?}");
}

/// Slow: it re-meshes the demo's five layers twice.
#[test]
#[ignore = "slow: `just quads`"]
fn a_glb_of_quads_has_pairs_of_triangles_and_all_attributes() {
    let out = tempfile::tempdir().unwrap();
    let [file, again] = ["quads.glb", "again.glb"].map(|name| out.path().join(name));
    let export = |file: &Path| {
        let options = ["export", file.to_str().unwrap(), "--quads=20000", "--texture", "none", "--json"];
        let said = overcoat_ok(&demo().session, &options).json();
        (std::fs::read(file).unwrap(), said["quads"].clone())
    };
    let (bytes, said) = export(&file);
    assert!(bytes == export(&again).0, "equal bytes");
    let glb = Glb::new(&bytes);
    for name in ["JOINTS_0", "WEIGHTS_0", "COLOR_0", "_PHYSW", "_LAYER", "_COVERED"] {
        let primitives = glb.json["meshes"].as_array().unwrap().iter().map(|mesh| &mesh["primitives"][0]["attributes"]);
        assert!(primitives.into_iter().all(|attributes| attributes.get(name).is_some()), "{name}");
    }
    let raw = read_gltf(bytes.as_slice()).unwrap();
    let is_pair = |pair: &[[u32; 3]]| pair[0].iter().filter(|v| pair[1].contains(v)).count() == 2;
    let mut quads = 0;
    for (rank, layer) in said.as_array().unwrap().iter().enumerate() {
        // A layer whose quads would cross others keeps its triangles, and says so.
        let Some(count) = layer["quads"].as_u64() else { continue };
        let of_layer = |face: &&[u32; 3]| raw.scalars["_LAYER"][face[0] as usize] == rank as f32;
        let faces: Vec<[u32; 3]> = raw.faces.iter().filter(of_layer).copied().collect();
        assert!(faces.len() as u64 == 2 * count && faces.chunks(2).all(is_pair), "{layer}");
        quads += 1;
    }
    assert!(quads >= 4, "{said}");
}

#[test]
fn counts_that_make_no_sense_get_a_sentence() {
    for (count, problem) in [("10", "too few"), ("10000000", "too many"), ("0", "too few"), ("many", "invalid value")] {
        let answer = overcoat(&demo().session, &["export", "out/", &format!("--quads={count}")]);
        assert!(answer.code != 0 && answer.stderr.contains(problem), "{count}: {}", answer.stderr);
        assert!(!answer.stderr.contains("panicked"));
    }
    let answer = overcoat(&demo().session, &["export", "out/", "--quads", "--at", "vest"]);
    assert!(answer.code == 2 && answer.stderr.contains("cannot be used with"), "{}", answer.stderr);
}

#[test]
fn a_scan_of_quads_gives_a_garment_and_takes_corrections() {
    let dir = tempfile::tempdir().unwrap();
    let session = body_of_demo(dir.path());
    let tshirt = demo_scan("1-tshirt.ply").display().to_string();
    let said = overcoat_ok(&session, &["scan", "tshirt", &tshirt, "--template", "tshirt", "--remesh", "quads:12000"]);
    assert!(said.stdout.contains("re-meshed with 1"), "{}", said.stdout);
    overcoat_ok(&session, &["build"]);
    let cut = |name: &str| {
        overcoat_ok(&session, &["export", &format!("{name}/"), "--layers", "tshirt"]);
        mesh(&read_ply(std::fs::read(session.join(name).join("tshirt.ply")).unwrap().as_slice()).unwrap())
    };
    overcoat_ok(&session, &["export", "scan/", "--scan", "tshirt"]);
    let scan = mesh(&read_ply(std::fs::read(session.join("scan/scan.ply")).unwrap().as_slice()).unwrap());
    assert!((20_000..30_000).contains(&scan.face_count()), "{}", scan.face_count());
    let faces = scan.faces().as_slice();
    assert!(faces.chunks(2).all(|pair| pair[0].iter().filter(|v| pair[1].contains(v)).count() == 2));
    // A brush at the hem works as on the scan's own triangles.
    let before = cut("before");
    let stroke = r#"{"layer":"tshirt","op":"erase","radius":0.03,"points":[[0.0,0.85,0.075],[0.03,0.85,0.072]]}"#;
    std::fs::write(session.join("dabs.jsonl"), stroke).unwrap();
    overcoat_ok(&session, &["mask", "tshirt", "dabs.jsonl"]);
    overcoat_ok(&session, &["build"]);
    let after = cut("after");
    let lost = before.area() - after.area();
    assert!((5e-4..2e-2).contains(&lost), "{lost} m² of {}", before.area());
    let answer = overcoat(&session, &["scan", "skirt", &tshirt, "--template", "skirt", "--remesh", "tris"]);
    assert!(answer.code == 2 && answer.stderr.contains("quads:COUNT"), "{}", answer.stderr);
}
