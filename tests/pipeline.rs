//! The whole pipeline on the shipped scans, by the built program.

use crate::common::{copy_folder, demo, overcoat, overcoat_ok};
use overcoat::formats::{RawMesh, read_ply};
use overcoat::geometry::{Point, SurfaceIndex, TriMesh};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

fn mesh_of(raw: &RawMesh) -> TriMesh {
    TriMesh::try_from_indices(raw.points.iter().map(|&p| Point::from(p)).collect(), &raw.faces).unwrap()
}

fn read(path: &Path) -> RawMesh {
    let file = std::fs::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    read_ply(std::io::BufReader::new(file)).unwrap()
}

/// Mean distance from the points of `from` to the nearest of `surfaces`.
fn mean_distance(from: &RawMesh, surfaces: &[TriMesh]) -> f64 {
    let indices: Vec<SurfaceIndex> = surfaces.iter().map(SurfaceIndex::prepare).collect();
    let nearest = |p: &Point| indices.iter().map(|i| i.closest(p).distance).fold(f64::INFINITY, f64::min);
    from.points.iter().map(|&p| nearest(&Point::from(p))).sum::<f64>() / from.points.len() as f64
}

#[test]
fn the_demo_writes_what_it_lists_and_corrects_a_garment() {
    let report = &demo().report;
    for file in report["files"].as_array().unwrap() {
        assert!(Path::new(file.as_str().unwrap()).exists(), "{file}");
    }
    let kept = demo().dir.path().join("kept").display().to_string();
    assert_eq!(report["remove"], format!("rm -r {kept}"));
    assert!(report["bytes"].as_u64() > Some(10_000_000) && report["file_count"].as_u64() > Some(50), "{report}");
    let corrected = report["corrections"].as_array().unwrap();
    assert!(!corrected.is_empty(), "a brush file corrects something");
    assert!(demo().dir.path().join("kept/poster.png").exists());
    let glb = std::fs::read(demo().dir.path().join("kept/character.glb")).unwrap();
    assert_eq!(&glb[..4], b"glTF");
}

#[test]
fn a_second_build_finds_nothing_to_do() {
    let again = overcoat_ok(&demo().session, &["build", "--json"]).json();
    assert_eq!(again["ran"], 0);
    assert!(overcoat_ok(&demo().session, &["status", "--json"]).json()["up_to_date"] == true);
}

#[test]
fn the_recipe_alone_gives_the_same_bytes_with_one_thread() {
    let again = demo().dir.path().join("again/session");
    std::fs::create_dir_all(&again).unwrap();
    std::fs::copy(demo().session.join("recipe.toml"), again.join("recipe.toml")).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(["build", "-q"])
        .env("RAYON_NUM_THREADS", "1")
        .current_dir(&again)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    for file in ["session.json", "recipe.toml"] {
        assert!(
            std::fs::read(demo().session.join(file)).unwrap() == std::fs::read(again.join(file)).unwrap(),
            "{file}"
        );
    }
    overcoat_ok(&again, &["export", "../character.glb"]);
    let glb = |folder: &str| std::fs::read(demo().dir.path().join(folder).join("character.glb")).unwrap();
    assert!(glb("kept") == glb("again"), "character.glb");
}

#[test]
fn a_step_is_exported_in_the_frame_of_its_scan_file() {
    let out = demo().dir.path().join("at");
    std::fs::create_dir_all(&out).unwrap();
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    for (step, file, worn) in [
        ("body", None, vec![]),
        ("tshirt", Some("1-tshirt.ply"), vec!["tshirt"]),
        ("skirt", Some("2-skirt.ply"), vec!["tshirt", "skirt"]),
        ("pullover", Some("3-pullover.ply"), vec!["tshirt", "skirt", "pullover"]),
        ("vest", Some("4-vest.ply"), vec!["tshirt", "skirt", "pullover", "vest"]),
    ] {
        let folder = out.join(step);
        let target = format!("{}/", folder.display());
        overcoat_ok(&demo().session, &["export", &target, "--at", step, "--scan", step]);
        let names: Vec<&str> = std::iter::once("body").chain(worn.iter().copied()).collect();
        let layers: Vec<TriMesh> = names.iter().map(|n| mesh_of(&read(&folder.join(format!("{n}.ply"))))).collect();
        let cleaned = read(&folder.join("scan.ply"));
        // The body comes from frames, whose fusion has a frame of its own.
        let scanned = file.map_or_else(|| cleaned.clone(), |file| read(&scans.join(file)));
        let apart = mean_distance(&scanned, &layers);
        assert!(apart < 0.006, "{step}: the file is {apart} m from what was made of it");
        let moved = mean_distance(&cleaned, &[mesh_of(&scanned)]);
        assert!(moved < 0.002, "{step}: cleaning moved the scan by {moved} m");
        let joints: BTreeMap<String, [f64; 3]> =
            serde_json::from_slice(&std::fs::read(folder.join("joints.json")).unwrap()).unwrap();
        assert_eq!(joints.len(), 52);
        assert!(joints["head"][1] > joints["hips"][1]);
        let Some(newest) = worn.last() else { continue };
        let labelled = read(&folder.join(format!("labels/{newest}.ply")));
        assert_eq!(labelled.points.len(), cleaned.points.len());
        let label = &labelled.scalars["label"];
        assert_eq!(label, &labelled.scalars["quality"]);
        assert!(labelled.colors.is_some());
        let share = label.iter().sum::<f32>() / label.len() as f32;
        assert!((0.1..0.6).contains(&share) && label.iter().all(|&l| l == 0.0 || l == 1.0), "{step}: {share}");
    }
}

#[test]
fn the_body_before_registration_differs_and_is_coarser() {
    let out = demo().dir.path().join("fit");
    std::fs::create_dir_all(&out).unwrap();
    let folder = |name: &str| format!("{}/{name}/", out.display());
    overcoat_ok(&demo().session, &["export", &folder("before"), "--stage", "fit"]);
    overcoat_ok(&demo().session, &["export", &folder("after"), "--at", "body", "--scan", "body"]);
    let scan = read(&out.join("after/scan.ply"));
    let apart = |name: &str| mean_distance(&scan, &[mesh_of(&read(&out.join(name).join("body.ply")))]);
    let (before, after) = (apart("before"), apart("after"));
    assert!(after < before && before < 0.008, "before {before}, after {after}");
}

#[test]
fn a_stroke_changes_its_garment_and_rebuilds_no_more_than_it_must() {
    let copy = demo().dir.path().join("corrected");
    copy_folder(&demo().session, &copy);
    let labelled = demo().dir.path().join("to_paint");
    overcoat_ok(&copy, &["export", &format!("{}/", labelled.display()), "--at", "vest"]);
    let vest = read(&labelled.join("labels/vest.ply"));
    let lowest = (0..vest.points.len()).filter(|&i| vest.scalars["label"][i] == 1.0);
    let lowest = lowest.min_by(|&a, &b| vest.points[a][1].total_cmp(&vest.points[b][1])).unwrap();
    let dab = format!(r#"{{"layer":"vest","op":"erase","radius":0.03,"points":[{:?}]}}"#, vest.points[lowest]);
    std::fs::write(copy.join("dab.jsonl"), dab).unwrap();
    overcoat_ok(&copy, &["mask", "vest", "dab.jsonl"]);
    let built = overcoat_ok(&copy, &["build", "--json"]).json();
    let ran: Vec<String> = built["stages"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|s| s["ran"] == true)
        .map(|s| format!("{}/{}", s["step"].as_str().unwrap(), s["stage"].as_str().unwrap()))
        .collect();
    assert_eq!(ran, ["vest/segment", "vest/cut", "vest/rig", "vest/stack", "vest/figure", "vest/press", "vest/check"]);
    let painted = demo().dir.path().join("painted");
    overcoat_ok(&copy, &["export", &format!("{}/", painted.display()), "--at", "vest"]);
    let after = read(&painted.join("labels/vest.ply"));
    assert_eq!(after.scalars["label"][lowest], 0.0);
    let changed = after.scalars["label"].iter().zip(&vest.scalars["label"]).filter(|(a, b)| a != b).count();
    assert!(changed > 5 && changed < vest.points.len() / 20, "{changed} labels changed");
}

/// A copy of the demo's session, and the labels of a garment's scan as they stand, in the frame of its file.
fn to_correct(name: &str, layer: &str) -> (PathBuf, RawMesh) {
    let copy = demo().dir.path().join(name);
    copy_folder(&demo().session, &copy);
    overcoat_ok(&copy, &["mask", layer, "--template", "found.ply"]);
    let found = read(&copy.join("found.ply"));
    (copy, found)
}

fn labels_of(session: &Path, layer: &str) -> RawMesh {
    let out = session.join("out/");
    overcoat_ok(session, &["export", &out.display().to_string(), "--at", layer]);
    read(&out.join(format!("labels/{layer}.ply")))
}

/// The lowest point of the garment in front: on the vest, near its hem.
fn low_in_front(found: &RawMesh) -> [f64; 3] {
    let label = &found.scalars["label"];
    let front = (0..found.points.len()).filter(|&i| label[i] == 1.0 && found.points[i][2] > 0.05);
    let lowest = front.min_by(|&a, &b| found.points[a][1].total_cmp(&found.points[b][1])).unwrap();
    found.points[lowest]
}

#[test]
fn a_mask_that_erases_the_whole_garment_is_refused_with_its_line() {
    let (copy, found) = to_correct("erased", "vest");
    let dab = |p: [f64; 3], radius: f64| {
        format!("{{\"layer\":\"vest\",\"op\":\"erase\",\"radius\":{radius},\"points\":[{p:?}]}}\n")
    };
    let low = low_in_front(&found);
    std::fs::write(copy.join("all.jsonl"), dab(low, 0.02) + &dab(low, 1.0) + &dab(low, 0.02)).unwrap();
    // The lock file names its last holder, or whoever held it when the session was copied.
    let files = || {
        crate::common::fingerprint(&copy).into_iter().filter(|(path, _)| path != Path::new("lock")).collect::<Vec<_>>()
    };
    let before = files();
    let answer = overcoat(&copy, &["mask", "vest", "all.jsonl"]);
    assert_eq!(answer.code, 1, "{answer:?}");
    assert!(files() == before, "the session was changed");
    let says = "error: all.jsonl, line 2: after this mask nothing of the garment 'vest' is left\n";
    assert!(answer.stderr.starts_with(says), "{answer:?}");
}

#[test]
fn an_unpainted_template_changes_nothing_and_a_painted_one_only_what_was_painted() {
    let (copy, found) = to_correct("painted_over", "vest");
    overcoat_ok(&copy, &["mask", "vest", "found.ply"]);
    let built = overcoat_ok(&copy, &["build", "--json"]).json();
    let measure = |name: &str| -> Value {
        let stages = built["stages"].as_array().unwrap();
        stages.iter().find(|s| s["step"] == "vest" && s["stage"] == "segment").unwrap()["measures"][name].clone()
    };
    assert_eq!(measure("by_hand_vertices"), 0.0);
    assert_eq!(labels_of(&copy, "vest").scalars["label"], found.scalars["label"]);
    // A spot of 3 cm across, grey, well above the hem: a hole that a person wants.
    let low = low_in_front(&found);
    let mut painted = found.clone();
    let spot: Vec<usize> = (0..found.points.len())
        .filter(|&i| {
            let gap = Point::from(found.points[i]) - Point::new(low[0], low[1] + 0.15, low[2]);
            gap.xy().norm() < 0.015 && found.points[i][2] > 0.0
        })
        .collect();
    assert!(spot.len() > 5);
    for &i in &spot {
        painted.colors.as_mut().unwrap()[i] = [140, 145, 150];
    }
    let out = std::fs::File::create(copy.join("found.ply")).unwrap();
    overcoat::formats::write_ply(&painted, &Default::default(), out).unwrap();
    overcoat_ok(&copy, &["mask", "vest", "found.ply"]);
    overcoat_ok(&copy, &["build", "-q"]);
    let after = labels_of(&copy, "vest").scalars["label"].clone();
    let changed: Vec<usize> = (0..after.len()).filter(|&i| after[i] != found.scalars["label"][i]).collect();
    assert_eq!(changed, spot);
    let garment = SurfaceIndex::prepare(&mesh_of(&read(&copy.join("out/vest.ply"))));
    let gaps = spot.iter().map(|&i| garment.closest(&Point::from(found.points[i])).distance);
    assert!(gaps.fold(0.0, f64::max) > 0.008, "the hole is still there");
}

#[test]
fn masks_apply_to_another_mesh_of_the_scan() {
    for mask in ["labels.npy", "labels.ply", "labels.jsonl"] {
        mask_holds_on_another_mesh(mask);
    }
}

fn mask_holds_on_another_mesh(mask: &str) {
    let (copy, found) = to_correct(&format!("decimated/{mask}"), "vest");
    let low = low_in_front(&found);
    let wanted = Point::new(low[0], low[1] + 0.15, 0.0);
    let off = |p: &[f64; 3]| (Point::from(*p) - wanted).xy().norm();
    let front = found.points.iter().filter(|p| p[2] > 0.05);
    let center = *front.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
    let gap = |p: &[f64; 3]| (Point::from(*p) - Point::from(center)).xy().norm();
    // The same correction three ways: as a stroke, as numbers, as a painted surface.
    let cleared = |p: &[f64; 3], label: f32| if gap(p) < 0.05 && p[2] > 0.0 { 0.0 } else { label };
    let labels: Vec<f32> = found.points.iter().zip(&found.scalars["label"]).map(|(p, &l)| cleared(p, l)).collect();
    let npy = overcoat::formats::NpyArray::vector(labels.clone());
    overcoat::formats::write_npy(&npy, std::fs::File::create(copy.join("labels.npy")).unwrap()).unwrap();
    let mut surface = found.clone();
    surface.colors = None;
    surface.scalars = [("label".to_string(), labels)].into();
    let out = std::fs::File::create(copy.join("labels.ply")).unwrap();
    overcoat::formats::write_ply(&surface, &Default::default(), out).unwrap();
    // A brush runs along the cloth, and the way through a fold is longer than it looks from the front.
    let stroke = format!(r#"{{"layer":"vest","op":"erase","radius":0.07,"points":[{center:?}]}}"#);
    std::fs::write(copy.join("labels.jsonl"), stroke).unwrap();
    overcoat_ok(&copy, &["mask", "vest", mask]);
    let recipe = std::fs::read_to_string(copy.join("recipe.toml")).unwrap();
    let coarser = recipe.replacen("template = \"vest\"\n", "template = \"vest\"\nfaces = 20000\n", 1);
    assert_ne!(coarser, recipe);
    std::fs::write(copy.join("recipe.toml"), coarser).unwrap();
    overcoat_ok(&copy, &["build", "-q"]);
    let after = labels_of(&copy, "vest");
    assert!(after.points.len() < found.points.len() / 2, "{mask}: {}", after.points.len());
    let front = || after.points.iter().zip(&after.scalars["label"]).filter(|(p, _)| p[2] > 0.0);
    let still = front().filter(|(p, l)| gap(p) < 0.035 && **l == 1.0).count();
    let kept = front().filter(|(p, l)| (0.08..0.12).contains(&gap(p)) && **l == 1.0).count();
    let all = front().filter(|(p, _)| gap(p) < 0.035).count();
    assert!(still == 0 && all > 20 && kept > 40, "{mask}: {still} of {all} in the spot, {kept} beside it");
}
