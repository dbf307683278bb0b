//! Faults that are made in a sound file are found, each by the check that is for it.

use super::*;
use crate::body::Figure;
use crate::export::axes::FileAxes;
use crate::export::encoded::Check;
use crate::export::encoded::Encoded;
use crate::export::formats::format_of;
use crate::export::tests::figure;
use crate::export::{CharacterOptions, ExportError};
use crate::formats::{UsdInterpolation, UsdLayer, UsdPrim, UsdValue};
use serde_json::{Value, json};
use std::collections::BTreeMap;

fn sound() -> Figure {
    let mut figure = figure();
    for layer in &mut figure.layers {
        // The tubes hover.
        let points: Vec<_> = layer.mesh.points().iter().map(|p| p - nalgebra::Vector3::new(0.0, 0.7, 0.0)).collect();
        layer.mesh = layer.mesh.with_points(points);
    }
    figure
}

fn encoded(figure: &Figure) -> Result<Encoded, ExportError> {
    let glb = format_of("glb").unwrap();
    glb.encode(figure, &CharacterOptions { pose: None, ..CharacterOptions::default() })
}

fn faults(checks: &[Check]) -> Vec<String> {
    checks.iter().flat_map(|check| check.faults.iter().map(|fault| format!("{}: {fault}", check.what))).collect()
}

/// The file with its JSON or its arrays changed.
fn changed(bytes: &[u8], change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let mut bin = bytes[28 + length..].to_vec();
    change(&mut json, &mut bin);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let header = [&bytes[..12], &(text.len() as u32).to_le_bytes(), b"JSON"].concat();
    [header, text, [&(bin.len() as u32).to_le_bytes()[..], b"BIN\0"].concat(), bin].concat()
}

/// Where the numbers of an attribute of a layer begin.
fn start(json: &Value, mesh: usize, attribute: &str) -> usize {
    let accessor = json["meshes"][mesh]["primitives"][0]["attributes"][attribute].as_u64().unwrap() as usize;
    let view = json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
    json["bufferViews"][view]["byteOffset"].as_u64().unwrap_or(0) as usize
}

fn put(bin: &mut [u8], at: usize, value: f32) {
    bin[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn a_sound_file_has_one_fault_of_its_figure_and_what_is_made_wrong_is_found() {
    let encoded = encoded(&sound()).unwrap();
    // The test's bones lie along X.
    let found = faults(&encoded.checks);
    assert!(found.len() == 1 && found[0].contains("the head is not above the hips"), "{found:#?}");
    type Fault = (&'static str, fn(&mut Value, &mut Vec<u8>));
    let made: [Fault; 11] = [
        ("two names of kind mesh are equal but for case: 'sleeve'", |json, _| {
            json["meshes"][0]["name"] = json!("Sleeve")
        }),
        ("is not at the scene's root", |json, _| {
            let nodes = json["nodes"].as_array_mut().unwrap();
            nodes.iter_mut().find(|node| node.get("mesh").is_some()).unwrap()["scale"] = json!([1, 1, 1]);
        }),
        ("joint 'spine' is elsewhere", |json, _| {
            let nodes = json["nodes"].as_array_mut().unwrap();
            nodes.iter_mut().find(|node| node["name"] == "spine").unwrap()["translation"][1] = json!(0.9);
        }),
        ("NORMAL has", |json, _| {
            let accessor = json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"].as_u64().unwrap() as usize;
            json["accessors"][accessor]["count"] = json!(3);
        }),
        ("POSITION is not finite: vertex 0", |json, bin| put(bin, start(json, 0, "POSITION"), f32::NAN)),
        ("invalid skin weights: vertex 1", |json, bin| put(bin, start(json, 0, "WEIGHTS_0") + 16, 0.5)),
        ("_PHYSW is not a share", |json, bin| put(bin, start(json, 1, "_PHYSW"), 0.7)),
        ("_LAYER is not the layer's rank: vertex 0", |json, bin| put(bin, start(json, 1, "_LAYER"), 2.0)),
        ("a doubled vertex differs", |json, bin| {
            let at = start(json, 1, "POSITION");
            let (first, last) = (bin[at..at + 12].to_vec(), at + 12 * 35);
            bin[last..last + 12].copy_from_slice(&first);
        }),
        ("no material", |json, _| drop(json["materials"].take())),
        ("m high", |json, bin| put(bin, start(json, 0, "POSITION") + 4, 180.0)),
    ];
    for (expected, make) in made {
        let found = faults(&lint_glb(&changed(&encoded.bytes, make), true));
        assert!(found.iter().any(|fault| fault.contains(expected)), "{expected}: {found:#?}");
    }
    let found = faults(&lint_glb(&encoded.bytes[..encoded.bytes.len() / 2], true));
    assert!(!found.is_empty(), "half a file");
}

#[test]
fn springs_that_importers_refuse_or_ignore_are_found() {
    // 0 → 1 → 2 → 3, and 4 beside them.
    let parents = [None, Some(0), Some(1), Some(2), Some(0)];
    let capsule = json!({ "node": 1, "shape": { "capsule": { "radius": 0.1 } } });
    let chain = |nodes: &[usize]| -> Value {
        let joints: Vec<Value> = nodes.iter().map(|node| json!({ "node": node })).collect();
        json!({ "name": "hem", "joints": joints, "colliderGroups": [0] })
    };
    let sound = json!({
        "colliders": [capsule], "colliderGroups": [{ "colliders": [0] }], "springs": [chain(&[1, 2, 3])],
    });
    assert_eq!(springs::springs(&sound, &parents), Vec::<String>::new());
    let with = |key: &str, value: Value, expected: &str| {
        let mut wrong = sound.clone();
        wrong[key] = value;
        let found = springs::springs(&wrong, &parents);
        assert!(found.iter().any(|fault| fault.contains(expected)), "{expected}: {found:?}");
    };
    with("springs", json!([chain(&[2, 1])]), "node 1 is not below node 2");
    with("springs", json!([chain(&[1, 2]), chain(&[2, 3])]), "node 2 is in two springs");
    with("springs", json!([chain(&[1, 9])]), "does not exist");
    with("springs", json!([]), "no spring names collider group 0");
    with("colliderGroups", json!([{ "colliders": [] }]), "collider 0 is in no group");
    with("colliderGroups", json!([]), "a collider group that does not exist");
    with("colliders", json!([{ "node": 1, "shape": { "sphere": { "radius": 0.0 } } }]), "no radius");
}

/// A triangle on one joint.
fn scene(change: impl FnOnce(&mut UsdPrim, &mut UsdPrim)) -> Vec<Check> {
    let unit = |y: f64| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, y, 0.0, 1.0];
    let mut root = UsdPrim::new("figure", "SkelRoot", &[]);
    let mut skeleton = UsdPrim::new("skeleton", "Skeleton", &["SkelBindingAPI"]);
    skeleton.uniform("joints", UsdValue::Tokens(vec!["hips".into(), "hips/head".into()]));
    skeleton.uniform("bindTransforms", UsdValue::Matrices(vec![unit(1.0), unit(1.5)]));
    skeleton.uniform("restTransforms", UsdValue::Matrices(vec![unit(1.0), unit(0.5)]));
    let mut mesh = UsdPrim::new("body", "Mesh", &["SkelBindingAPI"]);
    mesh.attribute("points", UsdValue::Points(vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 1.7, 0.0]]));
    mesh.attribute("faceVertexCounts", UsdValue::Ints(vec![3]));
    mesh.attribute("faceVertexIndices", UsdValue::Ints(vec![0, 1, 2]));
    let one = UsdInterpolation::Vertex(1);
    mesh.interpolated("primvars:skel:jointIndices", UsdValue::Ints(vec![0, 1, 0]), one);
    mesh.interpolated("primvars:skel:jointWeights", UsdValue::Floats(vec![1.0; 3]), one);
    mesh.relationship("skel:skeleton", "/figure/skeleton");
    change(&mut skeleton, &mut mesh);
    root.add(skeleton);
    root.add(mesh);
    let layer = UsdLayer {
        root,
        up_axis: "Y",
        meters_per_unit: 1.0,
        time_codes: None,
        documentation: String::new(),
        extras: BTreeMap::new(),
    };
    lint_usd(&layer, &[], true, FileAxes::default())
}

#[test]
fn prims_that_usd_would_not_use_are_found() {
    assert_eq!(faults(&scene(|_, _| {})), Vec::<String>::new());
    let vertex = UsdInterpolation::Vertex(1);
    type Fault = (&'static str, fn(&mut UsdPrim, &mut UsdPrim));
    let made: [Fault; 8] = [
        ("/figure/nobody, which does not exist", |_, mesh| mesh.relationship("skel:other", "/figure/nobody")),
        ("has no MaterialBindingAPI", |_, mesh| mesh.relationship("material:binding", "/figure/skeleton")),
        ("1 skeletons and 0 joints", |skeleton, _| *skeleton = UsdPrim::new("skeleton", "Skeleton", &[])),
        ("_SEEN has 2 values, not 3", |_, mesh| {
            mesh.interpolated("primvars:_SEEN", UsdValue::Floats(vec![1.0; 2]), UsdInterpolation::Vertex(1));
        }),
        ("_SEEN is not 0 or 1: vertex 2", |_, mesh| {
            let values = UsdValue::Floats(vec![1.0, 0.0, 0.5]);
            mesh.interpolated("primvars:_SEEN", values, UsdInterpolation::Vertex(1));
        }),
        ("st has 2 indices for 3 corners", |_, mesh| {
            mesh.interpolated("primvars:st", UsdValue::TexCoords(vec![[0.0; 2]]), UsdInterpolation::FaceVarying);
            mesh.attribute("primvars:st:indices", UsdValue::Ints(vec![0, 0]));
        }),
        ("x.png, which does not exist", |_, mesh| mesh.attribute("inputs:file", UsdValue::Asset("x.png".into()))),
        ("two names of kind prim are equal but for case: 'Body'", |_, mesh| {
            *mesh = {
                let mut both = mesh.clone();
                for name in ["body", "Body"] {
                    both.add(UsdPrim::new(name, "Scope", &[]));
                }
                both
            }
        }),
    ];
    for (expected, make) in made {
        let found = faults(&scene(make));
        assert!(found.iter().any(|fault| fault.contains(expected)), "{expected}: {found:#?}");
    }
    let two = faults(&scene(|_, mesh| {
        *mesh = UsdPrim::new("body", "Mesh", &["SkelBindingAPI"]);
        mesh.attribute("points", UsdValue::Points(vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 1.7, 0.0]]));
        mesh.interpolated("primvars:skel:jointIndices", UsdValue::Ints(vec![0, 7, 0]), vertex);
        mesh.interpolated("primvars:skel:jointWeights", UsdValue::Floats(vec![1.0, 0.3, 1.0]), vertex);
    }));
    for expected in ["a joint that does not exist", "do not add up to 1", "corners"] {
        assert!(two.iter().any(|fault| fault.contains(expected)), "{expected}: {two:#?}");
    }
}
