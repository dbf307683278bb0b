//! What an export may change of a figure: its axes, its bind pose, the number of its faces; and what it adds.

use crate::common::glb::Glb;
use crate::common::{built_quick_session, demo, overcoat_ok};
use overcoat::formats::{RawMesh, read_obj, read_ply};
use overcoat::geometry::{Point, TriMesh};
use overcoat::stack::crossing_places;
use serde_json::Value;
use std::path::Path;

const LAYERS: [&str; 5] = ["body", "tshirt", "skirt", "pullover", "vest"];

/// Exports the demo's figure and says what the command did.
fn export(out: &Path, name: &str, options: &[&str]) -> Value {
    let target = format!("{}/{name}", out.display());
    overcoat_ok(&demo().session, &[&["export", target.as_str(), "--json"], options].concat()).json()
}

fn mesh(raw: &RawMesh) -> TriMesh {
    TriMesh::try_from_indices(raw.points.iter().map(|p| Point::from(*p)).collect(), &raw.faces).unwrap()
}

fn layers(folder: &Path) -> Vec<TriMesh> {
    LAYERS.map(|name| mesh(&read_ply(&*std::fs::read(folder.join(format!("{name}.ply"))).unwrap()).unwrap())).into()
}

#[test]
fn files_and_folders_have_the_axes_that_are_requested() {
    let out = tempfile::tempdir().unwrap();
    for (name, options) in [("y", &[][..]), ("z", &["--up", "z", "--unit", "cm"])] {
        export(out.path(), &format!("{name}.obj"), &[&["--texture", "none"], options].concat());
        export(out.path(), &format!("{name}.usda"), &[&["--texture", "none"], options].concat());
        export(out.path(), &format!("{name}/"), options);
    }
    let is_turned = |(p, q): (&[f64; 3], &[f64; 3])| {
        let expected = [100.0 * p[0], -100.0 * p[2], 100.0 * p[1]];
        (0..3).all(|k| (expected[k] - q[k]).abs() < 1e-3)
    };
    let read = |name: &str| read_obj(&*std::fs::read(out.path().join(name)).unwrap()).unwrap().points;
    assert!(read("y.obj").iter().zip(&read("z.obj")).all(is_turned));
    for (before, after) in layers(&out.path().join("y")).iter().zip(&layers(&out.path().join("z"))) {
        let points = |mesh: &TriMesh| mesh.points().iter().map(|p| p.coords.into()).collect::<Vec<[f64; 3]>>();
        assert!(points(before).iter().zip(&points(after)).all(is_turned));
    }
    let joints = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(out.path().join(name).join("joints.json")).unwrap()).unwrap()
    };
    assert_eq!(
        joints("z")["head"][2].as_f64().map(|z| z as f32),
        joints("y")["head"][1].as_f64().map(|y| 100.0 * y as f32)
    );
    let text = std::fs::read_to_string(out.path().join("z.usda")).unwrap();
    assert!(text.contains("upAxis = \"Z\"") && text.contains("metersPerUnit = 0.01\n"));
}

#[test]
fn another_bind_pose_keeps_what_moves_where_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["animate", "walk", "--frames", "30..34", "--mode", "lbs"]);
    let read = |name: &str, options: &[&str]| {
        let target = dir.path().join(name);
        let args = ["export", target.to_str().unwrap(), "--texture", "none", "--bones", "up"];
        overcoat_ok(&session, &[&args, options].concat());
        let glb = Glb::new(&std::fs::read(target).unwrap());
        glb.check();
        glb
    };
    let [bind, t, a] = ["bind", "t", "a"].map(|rest| read(&format!("{rest}.glb"), &["--rest", rest]));
    let same = read("usual.glb", &[]);
    assert_eq!(same.json, bind.json);
    // How far the forearm's end is below its begin, as a share of its length.
    let drop = |glb: &Glb| {
        let nodes = glb.json["nodes"].as_array().unwrap();
        let hand = nodes.iter().find(|node| node["name"] == "leftHand").unwrap();
        let [x, y, z] = [0, 1, 2].map(|k| hand["translation"][k].as_f64().unwrap());
        -y / (x * x + y * y + z * z).sqrt()
    };
    assert!(drop(&t).abs() < 0.01 && (0.6..0.8).contains(&drop(&a)), "{} {}", drop(&t), drop(&a));
    let lowest = |glb: &Glb| {
        let of_mesh = |mesh: &Value| glb.rows(&mesh["primitives"][0]["attributes"]["POSITION"]);
        let meshes = glb.json["meshes"].as_array().unwrap();
        meshes.iter().flat_map(of_mesh).map(|p| p[1]).fold(f64::INFINITY, f64::min)
    };
    assert!(lowest(&t).abs() < 1e-3, "soles on the floor: {}", lowest(&t));
    // The root moves as before, and so does everything below it: a test of the skeleton says so.
    let root = |glb: &Glb| {
        let animation = &glb.json["animations"][0];
        let moves = |channel: &&Value| channel["target"]["path"] == "translation";
        let channel = animation["channels"].as_array().unwrap().iter().find(moves).unwrap();
        glb.rows(&animation["samplers"][channel["sampler"].as_u64().unwrap() as usize]["output"])
    };
    for other in [&t, &a] {
        let pairs = root(&bind).into_iter().zip(root(other));
        assert!(pairs.into_iter().all(|(p, q)| (0..3).all(|k| (p[k] - q[k]).abs() < 1e-5)));
    }
}

#[test]
fn simulated_cloth_is_in_a_glb_on_request_and_its_size_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["animate", "squat", "--frames", "40..46", "--ease-secs", "0.2"]);
    let bytes = |name: &str, options: &[&str]| {
        let target = dir.path().join(name);
        let args = ["export", target.to_str().unwrap(), "--texture", "none"];
        let said = overcoat_ok(&session, &[&args, options].concat());
        (std::fs::read(target).unwrap(), said.stderr)
    };
    let (usual, quiet) = bytes("usual.glb", &[]);
    let (baked, said) = bytes("baked.glb", &["--bake-cloth"]);
    assert!(!quiet.contains("writing") && said.contains("the cloth of 'squat' in 12 frames: writing "), "{said}");
    let glb = Glb::new(&baked);
    glb.check();
    for mesh in glb.json["meshes"].as_array().unwrap() {
        assert_eq!(mesh["primitives"][0]["targets"].as_array().unwrap().len(), 12);
    }
    assert!(Glb::new(&usual).json["meshes"][0]["primitives"][0].get("targets").is_none());
    assert!(baked.len() > usual.len() && baked == bytes("again.glb", &["--bake-cloth=squat"]).0);
}

#[test]
fn fewer_faces_cross_nowhere_and_layers_that_would_stay_finer() {
    let out = tempfile::tempdir().unwrap();
    for (count, most) in [(20_000, 26_000), (5_000, 20_000)] {
        let name = format!("{count}/");
        let said = export(out.path(), &name, &["--faces", &count.to_string()]);
        let after = layers(&out.path().join(name));
        let faces: usize = after.iter().map(TriMesh::face_count).sum();
        assert!((count * 9 / 10..most).contains(&faces), "{faces} for {count}: {said}");
        assert!(crossing_places(&after).unwrap().is_empty());
        for (said, mesh) in said["faces"].as_array().unwrap().iter().zip(&after) {
            assert_eq!(said["triangles"], mesh.face_count(), "{said}");
            assert!(said["farthest_mm"].as_f64().unwrap() < 20.0, "{said}");
        }
    }
}

#[test]
fn a_reduced_figure_has_its_textures_and_normal_maps() {
    let out = tempfile::tempdir().unwrap();
    let options = ["--faces", "20k", "--normal-map", "--texture", "1k"];
    export(out.path(), "a.glb", &options);
    export(out.path(), "b.glb", &options);
    let bytes = std::fs::read(out.path().join("a.glb")).unwrap();
    assert!(bytes == std::fs::read(out.path().join("b.glb")).unwrap(), "what is kept is what was baked");
    let glb = Glb::new(&bytes);
    glb.check();
    for material in glb.json["materials"].as_array().unwrap() {
        assert!(material["pbrMetallicRoughness"]["baseColorTexture"].is_object(), "{material}");
        assert!(material["normalTexture"].is_object(), "{material}");
    }
    for mesh in glb.json["meshes"].as_array().unwrap() {
        let tangents = glb.rows(&mesh["primitives"][0]["attributes"]["TANGENT"]);
        let length = |t: &[f64]| t[..3].iter().map(|c| c * c).sum::<f64>().sqrt();
        assert!(tangents.iter().all(|t| (length(t) - 1.0).abs() < 1e-4 && t[3].abs() == 1.0));
    }
    export(out.path(), "a.usdc", &options);
    let pictures = std::fs::read_dir(out.path().join("a_usdc_textures")).unwrap();
    let names: Vec<String> = pictures.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(names.iter().filter(|name| name.ends_with("_normals.png")).count(), 5, "{names:?}");
}
