//! Textured glTF: pictures embedded, in data URIs and in other files; transforms and wrapping.

use super::read::read_gltf_with;
use super::siblings::gltf_siblings;
use crate::formats::error::FormatError;
use crate::formats::raw_mesh::RawMesh;
use crate::formats::texture::{RawTexture, Wrap};
use serde_json::{Value, json};

/// Three vertices: positions, coordinates, a second set of coordinates, indices, and five bytes of a picture.
fn numbers() -> Vec<u8> {
    let points: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let coords: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.25, 0.5, 0.25, 0.5, 0.25, 0.5];
    let floats = points.iter().chain(&coords).flat_map(|x| x.to_le_bytes());
    floats.chain([0, 0, 1, 0, 2, 0]).chain(*b"\0\0hello").collect()
}

fn document() -> Value {
    let floats = |view: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 3, "type": kind});
    let mut points = floats(0, "VEC3");
    (points["min"], points["max"]) = (json!([0, 0, 0]), json!([1, 1, 0]));
    let attributes = json!({"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2});
    let triangle = |material: usize| json!({"attributes": attributes, "indices": 3, "material": material});
    json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [triangle(0), triangle(1), {"attributes": {"POSITION": 0}, "indices": 3}]}],
        "materials": [
            {"name": "skin", "pbrMetallicRoughness": {
                "baseColorFactor": [1.0, 0.5, 0.25, 1.0], "baseColorTexture": {"index": 0}}},
            {"name": "cloth", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1,
                "extensions": {"KHR_texture_transform": {
                    "offset": [0.0, 1.0], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5]}}}}},
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648}],
        "images": [{"bufferView": 4, "mimeType": "image/png"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24},
            {"buffer": 0, "byteOffset": 60, "byteLength": 24}, {"buffer": 0, "byteOffset": 84, "byteLength": 6},
            {"buffer": 0, "byteOffset": 92, "byteLength": 5},
        ],
        "accessors": [points, floats(1, "VEC2"), floats(2, "VEC2"),
            {"bufferView": 3, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "buffers": [{"byteLength": 97, "uri": "my%20scan.bin"}],
    })
}

fn read(document: &Value, picture: Option<&[u8]>) -> Result<RawMesh, FormatError> {
    read_gltf_with(document.to_string().as_bytes(), &mut |name| match name {
        "my scan.bin" => Some(numbers()),
        "tex/skin.png" => picture.map(<[u8]>::to_vec),
        _ => None,
    })
}

#[test]
fn materials_have_colour_picture_and_wrapping() {
    let mesh = read(&document(), None).unwrap();
    let texture = mesh.texture.unwrap();
    assert_eq!(texture.pictures.len(), 1);
    assert_eq!(texture.pictures[0].bytes, b"hello");
    assert_eq!(texture.face_materials, [0, 1, RawTexture::NO_MATERIAL]);
    let skin = &texture.materials[0];
    assert_eq!((skin.color, skin.picture, skin.wrap), ([1.0, 0.5, 0.25], Some(0), [Wrap::Clamp, Wrap::Mirror]));
    assert_eq!(texture.coords_of(0, mesh.faces[0]), Some([[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]), "from the lower left");
    // The second set of coordinates, in the lower left quadrant: (0.25, 0.5) is turned and halved to (0.25, 0.875) from the
    // upper left.
    let coords = texture.coords_of(1, mesh.faces[1]).unwrap();
    assert!(coords.iter().all(|c| (c[0] - 0.25).abs() < 1e-6 && (c[1] - 0.125).abs() < 1e-6), "{coords:?}");
    assert_eq!(texture.coords_of(2, mesh.faces[2]), None);
    assert!(mesh.unread.is_empty());
}

#[test]
fn a_picture_may_be_in_a_file_or_in_the_text() {
    let mut document = document();
    for (uri, expected) in [("tex/skin.png", b"world".as_slice()), ("data:image/png;base64,aGVsbG8=", b"hello")] {
        document["images"] = json!([{ "uri": uri }]);
        let texture = read(&document, Some(b"world")).unwrap().texture.unwrap();
        assert_eq!(texture.pictures[0].bytes, expected);
    }
    document["images"] = json!([{"uri": "../../tex/skin.png"}]);
    let mesh = read(&document, Some(b"world")).unwrap();
    assert_eq!(mesh.unread[0].what, "the picture '../../tex/skin.png' of the material 'skin' is missing");
    assert_eq!(mesh.unread.len(), 1, "said once for both materials");
    let texture = mesh.texture.unwrap();
    assert_eq!((texture.pictures.len(), texture.materials[0].picture), (0, None), "the plain colours remain");
}

#[test]
fn numbers_in_a_file_that_is_not_there_are_an_error() {
    let text = document().to_string();
    let err = read_gltf_with(text.as_bytes(), &mut |_| None).unwrap_err();
    assert_eq!(err.to_string(), "glTF: the file 'my scan.bin', which holds the mesh's numbers, is not beside it");
}

#[test]
fn the_files_of_a_scan_are_listed_without_reading_its_numbers() {
    let mut document = document();
    document["images"] = json!([{"uri": "tex/skin.png"}, {"uri": "normals.png"}]);
    let list = |bytes: &[u8]| gltf_siblings(bytes, &mut |name| Some(name.into())).unwrap();
    assert_eq!(list(document.to_string().as_bytes()), ["my scan.bin", "tex/skin.png", "tex/skin.png"]);
    let json = document.to_string();
    let head = [b"glTF".as_slice(), &2u32.to_le_bytes(), &9999u32.to_le_bytes(), &(json.len() as u32).to_le_bytes()];
    let glb = [head.concat(), b"JSON".to_vec(), json.into_bytes(), b"no chunk".to_vec()].concat();
    assert_eq!(list(&glb).len(), 3);
    assert!(list(b"").is_empty() && list(b"glTF").is_empty() && list(b"{").is_empty());
}

#[test]
fn a_picture_without_a_type_is_read_and_one_without_a_source_is_refused() {
    let mut document = document();
    document["images"] = json!([{"bufferView": 4}]);
    assert_eq!(read(&document, None).unwrap().texture.unwrap().pictures[0].bytes, b"hello");
    document["images"] = json!([{"name": "skin"}]);
    let error = read(&document, None).unwrap_err().to_string();
    assert!(error.contains("image") && error.contains("neither"), "{error}");
}
