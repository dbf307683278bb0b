//! Extensions of glTF that phone scanners, optimisers and VRM programs require.

use super::base64_for_tests::base64;
use super::read::read_gltf;
use super::read_motion::read_gltf_motion;
use crate::formats::error::FormatError;
use crate::formats::read_texture_picture;
use serde_json::{Value, json};

fn uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64(bytes))
}

/// A triangle with quantized positions, 1000 units per metre, and their texture coordinates.
fn triangle(required: &[&str]) -> Value {
    let rows = [[0i16, 0, 0, 0], [1000, 0, 0, 0], [0, 2000, 0, 0]];
    let bytes: Vec<u8> = rows.iter().flatten().flat_map(|n| n.to_le_bytes()).chain([0; 24]).collect();
    json!({
        "asset": {"version": "2.0"}, "extensionsUsed": required, "extensionsRequired": required,
        "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "scale": [0.001, 0.001, 0.001]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": uri(b"picture")}],
        "accessors": [
            {"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1000, 2000, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}, {"buffer": 0, "byteOffset": 24, "byteLength": 24}],
        "buffers": [{"byteLength": 48, "uri": uri(&bytes)}],
    })
}

fn points(file: &Value) -> Result<Vec<[f64; 3]>, FormatError> {
    let near = |p: [f64; 3]| p.map(|c| (c * 1e6).round() / 1e6);
    read_gltf(file.to_string().as_bytes()).map(|mesh| mesh.points.into_iter().map(near).collect())
}

const TRIANGLE: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

#[test]
fn quantized_numbers_are_read_and_looks_are_ignored_with_a_note() {
    let file = triangle(&["KHR_mesh_quantization", "KHR_materials_clearcoat"]);
    assert_eq!(points(&file).unwrap(), TRIANGLE);
    let mesh = read_gltf(file.to_string().as_bytes()).unwrap();
    assert_eq!(mesh.notes, ["ignored what KHR_materials_clearcoat says about materials"]);
    let error = points(&triangle(&["KHR_draco_mesh_compression"])).unwrap_err().to_string();
    assert!(error.contains("compressed with Draco"), "{error}");
    assert!(points(&triangle(&["EXT_feature_nobody_knows"])).is_err());
}

#[test]
fn buffers_compressed_by_meshopt_are_unpacked() {
    let rows = [[0i16, 0, 0, 0], [1000, 0, 0, 0], [0, 2000, 0, 0]];
    let vertices = meshopt::encode_vertex_buffer(&rows).unwrap();
    let indices = meshopt::encode_index_buffer(&[0, 1, 2], 3).unwrap();
    let (first, second) = (vertices.len(), indices.len());
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut file = triangle(&[name, "KHR_mesh_quantization"]);
        let view = |offset: usize, length: usize, stride: usize, mode: &str| {
            let packed = json!({"buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride,
                "count": 3, "mode": mode});
            json!({"buffer": 1, "byteLength": 3 * stride, "extensions": {name: packed}})
        };
        file["bufferViews"][0] = view(0, first, 8, "ATTRIBUTES");
        file["bufferViews"][1] = view(first, second, 4, "TRIANGLES");
        file["accessors"][1] = json!({"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"});
        file["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "indices": 1});
        let bytes = [vertices.clone(), indices.clone()].concat();
        file["buffers"] = json!([
            {"byteLength": bytes.len(), "uri": uri(&bytes)}, {"byteLength": 36, "extensions": {name: {"fallback": true}}},
        ]);
        assert_eq!(points(&file).unwrap(), TRIANGLE, "{name}");
        assert_eq!(read_gltf(file.to_string().as_bytes()).unwrap().faces.len(), 1);
        // Another promise than the bytes keep, and one beyond all memory.
        for count in [6, 3_000_000_000u64] {
            let mut damaged = file.clone();
            damaged["bufferViews"][0]["extensions"][name]["count"] = json!(count);
            assert!(points(&damaged).is_err(), "{count}");
        }
        let mut beyond = file.clone();
        beyond["bufferViews"][0]["extensions"][name]["byteLength"] = json!(1 << 20);
        assert!(points(&beyond).unwrap_err().to_string().contains("beyond its buffer"));
    }
}

#[test]
fn pictures_of_other_formats_are_found() {
    for name in ["EXT_texture_webp", "KHR_texture_basisu"] {
        let mut file = triangle(&[name, "KHR_mesh_quantization"]);
        file["textures"][0] = json!({"extensions": {name: {"source": 1}}});
        file["images"] = json!([{"uri": uri(b"other")}, {"uri": uri(b"picture")}]);
        let mesh = read_gltf(file.to_string().as_bytes()).unwrap();
        assert_eq!(mesh.texture.unwrap().pictures[0].bytes, b"picture", "{name}");
        // With a usual picture too, that one is read.
        file["textures"][0]["source"] = json!(0);
        let mesh = read_gltf(file.to_string().as_bytes()).unwrap();
        assert_eq!(mesh.texture.unwrap().pictures[0].bytes, b"other", "{name}");
    }
    let mut webp = Vec::new();
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut webp);
    encoder.encode(&[10, 20, 30, 40, 50, 60], 2, 1, image::ExtendedColorType::Rgb8).unwrap();
    assert_eq!(read_texture_picture(&webp).unwrap().pixels, [[10, 20, 30], [40, 50, 60]]);
    assert!(read_texture_picture(&webp[..webp.len() - 3]).is_err());
}

/// Hips and two legs, each leg in a skin of its own, and two animations that turn the hips.
fn two_skins() -> Value {
    let floats = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let bytes = [floats(&[0.0, 0.1]), floats(&[0.0, 0.0, 0.0, 1.0]), floats(&[0.0, 1.0, 0.0, 0.0])].concat();
    let animation = |name: &str| {
        json!({"name": name, "samplers": [{"input": 0, "output": 1}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}]})
    };
    json!({
        "asset": {"version": "2.0"},
        "nodes": [{"name": "a", "children": [1, 2]}, {"name": "b"}, {"name": "c"}, {"name": "lamp"}],
        "skins": [{"joints": [0, 1]}, {"joints": [0, 2]}],
        "animations": [animation("idle"), animation("walk")],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [0.1]},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC4"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 8, "byteLength": 32}],
        "buffers": [{"byteLength": 40, "uri": uri(&bytes)}],
    })
}

#[test]
fn several_skins_are_joined_and_of_several_animations_one_is_chosen() {
    let file = two_skins().to_string();
    let motion = read_gltf_motion(file.as_bytes(), None).unwrap();
    assert_eq!(motion.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>(), ["a", "b", "c"]);
    assert_eq!(motion.name.as_deref(), Some("idle"));
    let note = "the file has 2 animations, 'idle', 'walk'; the first is used: --clip-name takes another";
    assert_eq!(motion.notes, [note]);
    let motion = read_gltf_motion(file.as_bytes(), Some("walk")).unwrap();
    assert_eq!((motion.name.as_deref(), motion.notes.len()), (Some("walk"), 0));
    let error = read_gltf_motion(file.as_bytes(), Some("run")).unwrap_err();
    assert_eq!(error.to_string(), "the file has no animation 'run'");
    assert_eq!(error.hint().unwrap(), "it has idle, walk");
}

#[test]
fn vrm_names_the_bones() {
    let mut file = two_skins();
    file["extensions"] = json!({"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": {
        "hips": {"node": 0}, "leftUpperLeg": {"node": 1}, "rightUpperLeg": {"node": 2}}}}});
    file["extensionsUsed"] = json!(["VRMC_vrm_animation"]);
    let motion = read_gltf_motion(file.to_string().as_bytes(), None).unwrap();
    let names: Vec<&str> = motion.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["hips", "leftUpperLeg", "rightUpperLeg"]);
}
