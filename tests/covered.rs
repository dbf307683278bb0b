//! `_COVERED`, and `export --hide-covered`.

use crate::common::glb::Glb;
use crate::common::{demo, overcoat, overcoat_ok};
use overcoat::formats::{RawMesh, read_gltf, read_ply};
use std::collections::BTreeSet;
use std::path::Path;

fn glb(path: &Path) -> RawMesh {
    read_gltf(std::fs::read(path).unwrap().as_slice()).unwrap()
}

fn faces_of_layer(mesh: &RawMesh, rank: f32) -> usize {
    mesh.faces.iter().filter(|f| mesh.scalars["_LAYER"][f[0] as usize] == rank).count()
}

#[test]
fn what_is_covered_is_marked_and_can_be_removed() {
    let out = tempfile::tempdir().unwrap();
    let [whole, lean] = ["whole.glb", "lean.glb"].map(|name| out.path().join(name));
    overcoat_ok(&demo().session, &["export", whole.to_str().unwrap()]);
    let done = overcoat_ok(&demo().session, &["export", lean.to_str().unwrap(), "--hide-covered", "--json"]).json();
    let (whole, lean) = (glb(&whole), glb(&lean));

    let (covered, layer) = (&whole.scalars["_COVERED"], &whole.scalars["_LAYER"]);
    assert!(covered.iter().all(|&c| c == 0.0 || c == 1.0));
    let share = |rank: f32| {
        let of: Vec<f32> = (0..covered.len()).filter(|&v| layer[v] == rank).map(|v| covered[v]).collect();
        of.iter().sum::<f32>() / of.len() as f32
    };
    let outermost = layer.iter().copied().fold(0.0, f32::max);
    assert_eq!((outermost, share(outermost)), (4.0, 0.0), "nothing covers the vest");
    assert!(share(0.0) > 0.1 && share(0.0) < 0.8, "{} of the body", share(0.0));

    let (before, after) = (faces_of_layer(&whole, 0.0), faces_of_layer(&lean, 0.0));
    assert!(after < before && after > before / 5, "{after} of {before} faces of the body");
    assert_eq!(faces_of_layer(&lean, outermost), faces_of_layer(&whole, outermost));
    // All that any pose shows is still there.
    let shown = |mesh: &RawMesh| {
        let is_shown = |f: &&[u32; 3]| f.iter().any(|&v| mesh.scalars["_COVERED"][v as usize] == 0.0);
        mesh.faces.iter().filter(is_shown).count()
    };
    assert_eq!(shown(&lean), shown(&whole));
    let places = |mesh: &RawMesh| mesh.points.iter().map(|p| p.map(f64::to_bits)).collect::<BTreeSet<_>>();
    assert!(places(&lean).is_subset(&places(&whole)));
    let used: BTreeSet<u32> = lean.faces.iter().flatten().copied().collect();
    assert_eq!(used.len(), lean.points.len(), "a vertex without faces");

    let removed = done["removed"].as_array().unwrap();
    let names: Vec<&str> = removed.iter().map(|part| part["layer"].as_str().unwrap()).collect();
    assert_eq!(names, ["body", "tshirt", "skirt", "pullover", "vest"]);
    assert!(removed[0]["removed_percent"].as_f64().unwrap() > 3.0, "{done}");
    assert_eq!(removed[4]["removed_percent"], 0.0, "{done}");
}

#[test]
fn covered_parts_are_removed_from_the_layers_of_a_folder_too() {
    let out = tempfile::tempdir().unwrap();
    let export = |name: &str, options: &[&str]| {
        let folder = format!("{}/{name}/", out.path().display());
        overcoat_ok(&demo().session, &[&["export", &folder], options].concat()).stdout
    };
    let body =
        |name: &str| read_ply(std::fs::read(out.path().join(name).join("body.ply")).unwrap().as_slice()).unwrap();
    export("whole", &[]);
    let said = export("lean", &["--hide-covered"]);
    assert!(said.contains("\nremoved what is covered in every pose: "), "{said}");
    assert!(body("lean").faces.len() < body("whole").faces.len());
    assert_eq!(body("lean").colors.map(|colors| colors.len()), body("whole").colors.map(|_| body("lean").points.len()));
    export("posed", &["--at", "skirt"]);
    let said = export("posed-lean", &["--at", "skirt", "--hide-covered", "-v"]);
    assert!(said.contains("\nbody: removed ") && said.contains("\nskirt: removed 0.0 % "), "{said}");
    assert!(body("posed-lean").faces.len() < body("posed").faces.len());
    assert!(out.path().join("posed-lean/labels/skirt.ply").is_file());
}

#[test]
fn eight_influences_are_written_where_they_are_asked_for() {
    let out = tempfile::tempdir().unwrap();
    let file = |name: &str, options: &[&str]| {
        let path = out.path().join(name);
        overcoat_ok(&demo().session, &[&["export", path.to_str().unwrap()], options].concat());
        let glb = Glb::new(&std::fs::read(&path).unwrap());
        glb.check();
        glb
    };
    let sets = |glb: &Glb| {
        let all = glb.json["meshes"].as_array().unwrap().iter().flat_map(|m| m["primitives"].as_array().unwrap());
        all.filter(|primitive| primitive["attributes"].get("JOINTS_1").is_some()).count()
    };
    let (four, eight) = (file("four.glb", &[]), file("eight.glb", &["--influences", "8"]));
    let garments = four.json["meshes"].as_array().unwrap().len() - 1;
    assert_eq!(sets(&four), 0);
    assert!((1..=garments).contains(&sets(&eight)), "{} of {garments} garments", sets(&eight));
    let folder = format!("{}/layers/", out.path().display());
    let refused = overcoat(&demo().session, &["export", &folder, "--influences", "8"]);
    assert!(refused.code == 2 && refused.stderr.contains("--influences"), "{refused:?}");
    assert!(!out.path().join("layers").exists());
}

#[test]
fn neither_a_scan_nor_the_fit_has_covered_parts() {
    let out = tempfile::tempdir().unwrap();
    let folder = format!("{}/layers/", out.path().display());
    for options in [["--scan", "tshirt"], ["--stage", "fit"]] {
        let answer = overcoat(&demo().session, &[&["export", &folder, "--hide-covered"], &options[..]].concat());
        assert!(answer.code == 2 && answer.stderr.contains("--hide-covered"), "{answer:?}");
    }
    assert!(!out.path().join("layers").exists());
}
