//! Files for other programs: USD, VRM, `.gltf`, and what the cloth of engines needs.

use crate::common::glb::Glb;
use crate::common::{demo, overcoat, overcoat_ok};
use overcoat::formats::{read_gltf, read_ply};
use overcoat::geometry::{Point, TriMesh};
use overcoat::stack::crossing_places;
use serde_json::Value;
use std::path::Path;

fn export(out: &Path, name: &str, options: &[&str]) -> Value {
    let target = out.join(name).display().to_string();
    let args = [&["export", target.as_str(), "--texture", "none", "--json"], options].concat();
    overcoat_ok(&demo().session, &args).json()
}

#[test]
fn usd_has_every_layer_skinned_and_is_the_same_as_text_and_in_a_package() {
    let out = tempfile::tempdir().unwrap();
    for name in ["a.usda", "a.usdc", "a.usdz"] {
        export(out.path(), name, &[]);
    }
    let text = std::fs::read_to_string(out.path().join("a.usda")).unwrap();
    assert!(text.starts_with("#usda 1.0\n"));
    for part in ["def SkelRoot \"figure\"", "def Skeleton \"skeleton\"", "metersPerUnit = 1\n", "upAxis = \"Y\""] {
        assert_eq!(text.matches(part).count(), 1, "{part}");
    }
    for layer in ["body", "tshirt", "skirt", "pullover", "vest"] {
        assert_eq!(text.matches(&format!("def Mesh \"{layer}\"")).count(), 1, "{layer}");
    }
    for part in ["primvars:skel:jointIndices", "primvars:_PHYSW", "rel skel:skeleton", "rel material:binding"] {
        assert_eq!(text.lines().filter(|line| line.trim_start().contains(part)).count(), 5, "{part}");
    }
    let binary = std::fs::read(out.path().join("a.usdc")).unwrap();
    assert!(binary.starts_with(b"PXR-USDC") && binary.len() * 3 < text.len() * 2);
    let package = std::fs::read(out.path().join("a.usdz")).unwrap();
    let at = package.windows(8).position(|window| window == b"PXR-USDC").unwrap();
    assert_eq!((at % 64, &package[at..at + binary.len()]), (0, &binary[..]), "stored as it is");
}

#[test]
fn an_avatar_stands_in_the_t_pose_without_a_crossing_and_its_skirt_swings() {
    let out = tempfile::tempdir().unwrap();
    export(out.path(), "a.vrm", &["--author", "Ann", "--author", "Bo", "--name", "Fay"]);
    let bytes = std::fs::read(out.path().join("a.vrm")).unwrap();
    let glb = Glb::new(&bytes);
    glb.check();
    let avatar = &glb.json["extensions"]["VRMC_vrm"];
    assert_eq!(avatar["meta"]["authors"], serde_json::json!(["Ann", "Bo"]));
    assert_eq!(avatar["meta"]["name"], "Fay");
    let nodes = glb.json["nodes"].as_array().unwrap();
    assert!(nodes.iter().all(|node| node.get("rotation").is_none()), "all axes are the world's");
    // Where a bone is in the world: the sum of what is above it.
    let place = |bone: &str| -> [f64; 3] {
        let mut at = avatar["humanoid"]["humanBones"][bone]["node"].as_u64().unwrap();
        let mut sum = [0.0; 3];
        loop {
            let own = nodes[at as usize]["translation"].as_array().unwrap();
            (0..3).for_each(|k| sum[k] += own[k].as_f64().unwrap());
            let is_parent = |node: &Value| node["children"].as_array().is_some_and(|c| c.contains(&Value::from(at)));
            match nodes.iter().position(is_parent) {
                Some(parent) => at = parent as u64,
                None => return sum,
            }
        }
    };
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        let along = |from: String, to: String| {
            let (from, to) = (place(&from), place(&to));
            let bone: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
            let length = bone.iter().map(|c| c * c).sum::<f64>().sqrt();
            bone.map(|c| c / length)
        };
        let arm = along(format!("{side}UpperArm"), format!("{side}Hand"));
        let leg = along(format!("{side}UpperLeg"), format!("{side}Foot"));
        assert!(arm[0] * sign > 0.9998 && leg[1] < -0.9998, "{side}: {arm:?} {leg:?}");
    }
    let springs = &glb.json["extensions"]["VRMC_springBone"];
    let count = springs["springs"].as_array().unwrap().len();
    assert!((6..=12).contains(&count), "{count} chains");
    assert_eq!(springs["colliders"].as_array().unwrap().len(), 4);

    let whole = read_gltf(bytes.as_slice()).unwrap();
    let points: Vec<Point> = whole.points.iter().map(|p| Point::from(*p)).collect();
    let lowest = points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    assert!(lowest.abs() < 1e-3, "soles at {lowest}");
    let layers: Vec<TriMesh> = (0..5)
        .map(|rank| {
            let of_layer = |face: &&[u32; 3]| whole.scalars["_LAYER"][face[0] as usize] == rank as f32;
            let faces: Vec<[u32; 3]> = whole.faces.iter().filter(of_layer).copied().collect();
            let mesh = TriMesh::try_from_indices(points.clone(), &faces).unwrap();
            mesh.part(&mesh.faces().iter().map(|_| true).collect()).0
        })
        .collect();
    let crossings = crossing_places(&layers).unwrap();
    assert!(crossings.is_empty(), "{crossings:?}");
}

#[test]
fn a_gltf_has_its_arrays_beside_it_and_the_same_surface() {
    let out = tempfile::tempdir().unwrap();
    let said = export(out.path(), "a.gltf", &[]);
    export(out.path(), "a.glb", &[]);
    assert_eq!(said["files"].as_array().unwrap().len(), 2, "{said}");
    let json: Value = serde_json::from_slice(&std::fs::read(out.path().join("a.gltf")).unwrap()).unwrap();
    let bin = std::fs::read(out.path().join("a.bin")).unwrap();
    assert_eq!(json["buffers"][0]["uri"], "a.bin");
    assert_eq!(json["buffers"][0]["byteLength"], bin.len());
    let glb = Glb::new(&std::fs::read(out.path().join("a.glb")).unwrap());
    for key in ["meshes", "accessors", "nodes", "skins", "materials"] {
        assert_eq!(json[key], glb.json[key], "{key}");
    }
}

#[test]
fn the_cloth_of_engines_has_a_value_for_every_vertex() {
    let out = tempfile::tempdir().unwrap();
    export(out.path(), "b.glb", &["--for", "blender"]);
    let folder = format!("{}/layers/", out.path().display());
    overcoat_ok(&demo().session, &["export", &folder]);
    let json = std::fs::read(out.path().join("b.cloth.json")).unwrap();
    let json: Value = serde_json::from_slice(&json).unwrap();
    let mut names = Vec::new();
    for layer in json["layers"].as_array().unwrap() {
        let name = layer["name"].as_str().unwrap();
        let mesh = read_ply(std::fs::read(out.path().join(format!("layers/{name}.ply"))).unwrap().as_slice()).unwrap();
        for key in ["position", "maxDistance", "collisionSphereDistance"] {
            assert_eq!(layer[key].as_array().unwrap().len(), mesh.points.len(), "{name}, {key}");
        }
        let within = |key: &str, most: f64| {
            layer[key].as_array().unwrap().iter().all(|value| (0.0..=most).contains(&value.as_f64().unwrap()))
        };
        assert!(within("maxDistance", 0.3001) && within("collisionSphereDistance", 0.5), "{name}");
        names.push(name.to_string());
    }
    assert!(names.contains(&"skirt".to_string()) && !names.contains(&"body".to_string()), "{names:?}");
    let script = std::fs::read_to_string(out.path().join("b.blender.py")).unwrap();
    assert!(script.contains("STEM = \"b\"") && !script.contains("@STEM@"));

    export(out.path(), "u.glb", &["--for", "unreal", "--layers", "skirt,vest"]);
    let glb = Glb::new(&std::fs::read(out.path().join("u.glb")).unwrap());
    glb.check();
    let meshes = glb.json["meshes"].as_array().unwrap();
    assert_eq!(meshes.iter().map(|mesh| mesh["name"].as_str().unwrap()).collect::<Vec<_>>(), ["skirt", "vest"]);
    let masks = glb.rows(&meshes[0]["primitives"][0]["attributes"]["COLOR_0"]);
    assert!(masks.iter().flatten().all(|share| (0.0..=1.0).contains(share)));
    assert!(masks.iter().any(|mask| mask[0] > 0.5), "the hem of the skirt may move");
}

#[test]
fn what_a_format_cannot_hold_is_refused_and_nothing_is_written() {
    let out = tempfile::tempdir().unwrap();
    for (name, options, word) in [
        ("a.obj", &["--bake-cloth"][..], "simulated cloth"),
        ("a.glb", &["--bake-cloth"], "no animation"),
        ("a.glb", &["--up", "z"], "+Y up"),
        ("a.vrm", &["--unit", "cm"], "metres"),
        ("a.vrm", &["--rest", "a"], "T-pose"),
        ("layers/", &["--rest", "t"], "--rest"),
        ("a.npz", &["--up", "z"], "--up"),
        ("a.usdc", &["--at", "skirt", "--up", "z"], "--up"),
        ("a.glb", &["--faces", "4k"], "at least 5000"),
        ("a.glb", &["--faces", "10m"], "such as 20k"),
        ("a.glb", &["--faces", "20k", "--quads"], "cannot be used with"),
        ("a.obj", &["--normal-map"], "normal maps"),
        ("layers/", &["--normal-map"], "--normal-map"),
        ("a.usdz", &["--for", "unity"], "--for"),
        ("a.usdc", &["--author", "Ann"], "authors"),
        ("a.vrm", &["--at", "skirt"], "--at"),
        ("a.vrm", &["--influences", "8"], "--influences"),
        ("a.usdc", &["--layers", "body,hat"], "no layer 'hat'"),
        ("layers/", &["--layers", "hat"], "no layer 'hat'"),
        ("a.obj", &["--at", "skirt"], "--at"),
        ("a.obj", &["--bones", "up"], "--bones"),
        ("a.npz", &[], "SMPL family"),
        ("layers/", &["--lint"], "--lint"),
        ("a.abc", &[], "a.abc"),
        ("none/a.usdz", &[], "no folder"),
    ] {
        let target = format!("{}/{name}", out.path().display());
        let answer = overcoat(&demo().session, &[&["export", target.as_str()], options].concat());
        assert!([1, 2].contains(&answer.code) && answer.stderr.contains(word), "{name} {options:?}: {answer:?}");
        let left: Vec<_> = std::fs::read_dir(out.path()).unwrap().collect();
        assert!(left.is_empty(), "{name}: {left:?}");
    }
}

#[test]
fn files_of_two_formats_keep_their_pictures_apart_and_every_coloured_layer_has_one() {
    let out = tempfile::tempdir().unwrap();
    for name in ["a.usdc", "a.obj", "a.gltf"] {
        let target = out.path().join(name).display().to_string();
        overcoat_ok(&demo().session, &["export", &target, "--texture", "1k"]);
    }
    for folder in ["a_usdc_textures", "a_obj_textures", "a_gltf_textures"] {
        // Also of layers from which others have taken crumpled parts.
        assert_eq!(std::fs::read_dir(out.path().join(folder)).unwrap().count(), 5, "{folder}");
    }
}
