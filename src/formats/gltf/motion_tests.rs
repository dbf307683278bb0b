//! glTF animations: interpolations, rest poses, scales, and messages for damaged files.

use super::animation::GlbChannel;
use super::base64_for_tests::base64;
use super::read_motion::read_gltf_motion;
use super::write::{GlbNode, GlbScene, GlbWriter};
use crate::formats::motion::RawMotion;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::{Value, json};

/// A `.gltf` of two joints, hips and knee, with one animated property. The numbers of the output are given as floats.
fn file(interpolation: &str, path: &str, times: &[f32], values: &[f32], node: usize) -> Value {
    let width = if path == "rotation" { 4 } else { 3 };
    let bytes: Vec<u8> = times.iter().chain(values).flat_map(|x| x.to_le_bytes()).collect();
    let split = times.len() * 4;
    json!({
        "asset": { "version": "2.0" },
        "nodes": [
            { "name": "knee", "translation": [0, -0.5, 0] },
            { "name": "hips", "translation": [0, 1, 0], "scale": [2, 2, 2], "children": [0] },
        ],
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:x;base64,{}", base64(&bytes)) }],
        "bufferViews": [
            { "buffer": 0, "byteLength": split },
            { "buffer": 0, "byteOffset": split, "byteLength": bytes.len() - split },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": times.len(), "type": "SCALAR", "min": [0], "max": [9] },
            { "bufferView": 1, "componentType": 5126, "count": values.len() / width, "type": format!("VEC{width}") },
        ],
        "animations": [{
            "name": "bend",
            "samplers": [{ "input": 0, "interpolation": interpolation, "output": 1 }],
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
        }],
    })
}

fn read(value: &Value) -> RawMotion {
    read_gltf_motion(value.to_string().as_bytes(), None).unwrap()
}

/// Frame by frame the height of the knee relative to the hips.
fn heights(motion: &RawMotion) -> Vec<f64> {
    let knee = motion.joints.iter().position(|joint| joint.name == "knee").unwrap();
    motion.frames.iter().map(|frame| frame[knee].translation[1]).collect()
}

#[test]
fn every_interpolation_is_sampled_and_scales_apply_below() {
    let times = [0.0, 0.1, 0.2];
    let at = |y: f32| [0.0, y, 0.0];
    let values = [at(-1.0), at(-2.0), at(-4.0)].concat();
    // Gaps of 0.1 s are no usual rate, so 30 frames per second; the hips' scale doubles.
    let linear = read(&file("LINEAR", "translation", &times, &values, 0));
    assert_eq!((linear.name.as_deref(), linear.frames.len()), (Some("bend"), 7));
    for (found, expected) in heights(&linear).iter().zip([-2.0, -2.667, -3.333, -4.0, -5.333, -6.667, -8.0]) {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
    // Keys of times that f32 holds, so that a sample is at the key and not beside it.
    let step = heights(&read(&file("STEP", "translation", &[0.0, 0.5, 1.0], &values, 0)));
    assert_eq!((step.len(), step[14], step[15], step[29], step[30]), (31, -2.0, -4.0, -4.0, -8.0));
    // A spline with the tangents of a line is the line.
    let cubic: Vec<f32> =
        [at(-10.0), at(-1.0), at(-10.0), at(-10.0), at(-2.0), at(-20.0), at(-20.0), at(-4.0), at(0.0)].concat();
    let spline = read(&file("CUBICSPLINE", "translation", &times, &cubic, 0));
    for (found, expected) in heights(&spline).iter().zip(heights(&linear)) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
}

#[test]
fn rotations_take_the_shorter_way_and_the_rate_of_the_keys() {
    let turned = |degrees: f64| UnitQuaternion::from_scaled_axis(Vector3::x() * degrees.to_radians());
    let times: Vec<f32> = (0..4).map(|k| k as f32 / 24.0).collect();
    // One key has the opposite sign, which is the same rotation.
    let quaternions = [0.0, 20.0, 40.0, 60.0].map(|d| turned(d).into_inner().coords);
    let values: Vec<f32> = quaternions
        .iter()
        .enumerate()
        .flat_map(|(k, q)| q.map(|x| if k == 2 { -x } else { x } as f32).as_slice().to_vec())
        .collect();
    let motion = read(&file("LINEAR", "rotation", &times, &values, 1));
    assert_eq!((motion.frames.len(), motion.frame_secs), (4, Some(1.0 / 24.0)));
    for (k, frame) in motion.frames.iter().enumerate() {
        let found = UnitQuaternion::new_unchecked(Quaternion::from(frame[0].rotation));
        assert!(found.angle_to(&turned(20.0 * k as f64)) < 1e-3, "{k}");
    }
    let slow =
        read(&file("LINEAR", "rotation", &[0.0, 1.0], &[values[..4].to_vec(), values[8..12].to_vec()].concat(), 1));
    assert_eq!(slow.frames.len(), 31);
    let half = UnitQuaternion::new_unchecked(Quaternion::from(slow.frames[15][0].rotation));
    assert!(half.angle_to(&turned(20.0)) < 1e-6, "{half}");
}

#[test]
fn a_written_animation_is_read_back_with_the_rest_pose_of_its_skin() {
    let mut glb = GlbWriter::new();
    let knee = glb.node(&GlbNode { name: "knee", translation: Some([0.0, -0.5, 0.1]), ..GlbNode::default() });
    let hips = glb.node(&GlbNode {
        name: "hips",
        // A pose, which is not the rest pose.
        translation: Some([0.0, 1.0, 0.0]),
        rotation: Some([0.6, 0.0, 0.0, 0.8]),
        children: &[knee],
        ..GlbNode::default()
    });
    let other = glb.node(&GlbNode { name: "camera", ..GlbNode::default() });
    let inverse = |y: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -y, 0.0, 1.0];
    let matrices = glb.matrices("inverse bind matrices", &[inverse(0.9), inverse(0.4)]).unwrap();
    glb.skin("skeleton", hips, &[hips, knee], matrices);
    let times: Vec<f32> = (0..5).map(|k| k as f32 / 30.0).collect();
    let translations: Vec<[f32; 3]> = (0..5).map(|k| [0.1 * k as f32, 1.0, 0.0]).collect();
    let rotations: Vec<[f32; 4]> =
        (0..5).map(|k| [0.1 * k as f32, 0.0, 0.0, (1.0 - 0.01 * (k * k) as f32).sqrt()]).collect();
    let channels = [
        GlbChannel { node: hips, translations: translations.clone(), rotations: rotations.clone() },
        GlbChannel { node: knee, translations: Vec::new(), rotations: rotations.clone() },
    ];
    glb.animation("walk", &times, &channels, &[]).unwrap();
    assert!(
        glb.animation(
            "bad",
            &times,
            &[GlbChannel { node: hips, translations: vec![[f32::NAN; 3]; 5], rotations: vec![] }],
            &[]
        )
        .is_err()
    );
    let mut bytes = Vec::new();
    let scene = GlbScene {
        generator: "test",
        name: "s",
        roots: &[hips, other],
        extras: Value::Null,
        extensions: Default::default(),
    };
    glb.write(&scene, &mut bytes).unwrap();
    let motion = read_gltf_motion(bytes.as_slice(), None).unwrap();
    let names: Vec<_> = motion.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["hips", "knee"], "only the skin's joints");
    let rests: Vec<_> = motion.joints.iter().map(|joint| joint.rest).collect();
    assert!((rests[0].translation[1] - 0.9).abs() < 1e-6 && (rests[1].translation[1] + 0.5).abs() < 1e-6, "{rests:?}");
    assert!(rests.iter().all(|rest| rest.rotation == [0.0, 0.0, 0.0, 1.0]), "{rests:?}");
    assert_eq!((motion.frames.len(), motion.frame_secs), (5, Some(1.0 / 30.0)));
    for (k, frame) in motion.frames.iter().enumerate() {
        assert!((frame[0].translation[0] - f64::from(translations[k][0])).abs() < 1e-5);
        assert!((frame[1].translation[2] - 0.1).abs() < 1e-6, "not animated, so as the node has it");
        assert!((frame[1].rotation[0] - f64::from(rotations[k][0])).abs() < 1e-5);
    }
}

#[test]
fn damage_is_named() {
    let good = || file("LINEAR", "translation", &[0.0, 0.1], &[0.0; 6], 0);
    let error = |value: Value| read_gltf_motion(value.to_string().as_bytes(), None).unwrap_err().to_string();
    let mut none = good();
    none["animations"] = json!([]);
    assert_eq!(error(none), "the glTF file has no animation");
    let mut beyond = good();
    beyond["animations"][0]["channels"][0]["target"]["node"] = json!(7);
    assert_eq!(error(beyond), "glTF, animation 0: expected nodes below 2, found node 7");
    let mut two_parents = good();
    two_parents["nodes"] = json!([{}, { "children": [0] }, { "children": [0] }]);
    assert!(error(two_parents).contains("node 0 has two parents"));
    let mut cycle = good();
    cycle["nodes"] = json!([{ "children": [1] }, { "children": [0] }]);
    assert_eq!(error(cycle), "the glTF file has no node to animate");
    assert!(error(file("LINEAR", "translation", &[0.1, 0.0], &[0.0; 6], 0)).contains("expected times that increase"));
    assert!(
        error(file("LINEAR", "translation", &[0.0, f32::NAN], &[0.0; 6], 0)).contains("expected times that increase")
    );
    assert!(
        error(file("LINEAR", "translation", &[0.0, 0.1], &[0.0; 9], 0))
            .contains("expected 2 translations for 2 times, found 3")
    );
    assert!(error(file("CUBICSPLINE", "translation", &[0.0, 0.1], &[0.0; 6], 0)).contains("expected 6 translations"));
    assert!(
        error(file("LINEAR", "translation", &[0.0, 0.1], &[f32::INFINITY; 6], 0))
            .contains("expected finite translations")
    );
    assert!(
        error(file("LINEAR", "translation", &[0.0, 1e9], &[0.0; 6], 0)).contains("an animation of 1000000000 seconds")
    );
    // A joint below a cycle that it is not part of.
    let mut below = good();
    below["nodes"] = json!([{}, { "children": [2, 0] }, { "children": [1] }]);
    below["skins"] = json!([{ "joints": [0] }]);
    assert_eq!(error(below), "the glTF file has no node to animate");
}

#[test]
fn further_animations_are_reported() {
    let mut two = file("LINEAR", "translation", &[0.0, 0.1], &[0.0; 6], 0);
    let first = two["animations"][0].clone();
    two["animations"].as_array_mut().unwrap().push(first);
    assert_eq!(
        read(&two).notes,
        ["the file has 2 animations, 'bend', 'bend'; the first is used: --clip-name takes another"]
    );
}
