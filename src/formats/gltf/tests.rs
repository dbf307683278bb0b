//! glTF: round trips, node transforms, and messages for damaged files.

use super::read::read_gltf;
use super::write::{GlbAttribute, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, NodeId};
use crate::formats::error::FormatError;
use serde_json::json;

const POINTS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const COLORS: [[u8; 3]; 4] = [[255, 0, 0], [0, 128, 3], [1, 2, 254], [77, 77, 77]];

fn written(glb: GlbWriter, root: NodeId) -> Vec<u8> {
    let mut bytes = Vec::new();
    let scene = GlbScene {
        generator: "test",
        name: "scene",
        roots: &[root],
        extras: json!(null),
        extensions: Default::default(),
    };
    glb.write(&scene, &mut bytes).unwrap();
    bytes
}

/// A tetrahedron with everything, below a node that turns it by 90° about Y and lifts it by 10.
fn built() -> Vec<u8> {
    let mut glb = GlbWriter::new();
    let indices = glb.indices(&FACES);
    let attributes = [
        (GlbAttribute::Positions, glb.positions(&POINTS).unwrap()),
        (GlbAttribute::Normals, glb.floats("normals", &[[1.0f32, 0.0, 0.0]; 4]).unwrap()),
        (GlbAttribute::TexCoords(0), glb.floats("uvs", &[[0.25f32, 0.75]; 4]).unwrap()),
        (GlbAttribute::Colors(0), glb.colors(&COLORS)),
        (
            GlbAttribute::Extras("PHYSW".into()),
            glb.floats("physics weights", &[[0.0f32], [0.25], [0.5], [1.0]]).unwrap(),
        ),
    ];
    let material = glb.material(&GlbMaterial {
        name: "cloth",
        color: [255; 3],
        texture: None,
        normal_map: None,
        roughness: 0.9,
        double_sided: true,
    });
    let extras = json!({ "fabric": "denim" });
    let mesh = glb
        .mesh(&GlbMesh { name: "shirt", indices, attributes: &attributes, material: Some(material), extras })
        .unwrap();
    let leaf = glb.node(&GlbNode { name: "shirt", mesh: Some(mesh), ..GlbNode::default() });
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let root = glb.node(&GlbNode {
        name: "root",
        translation: Some([0.0, 10.0, 0.0]),
        rotation: Some([0.0, half, 0.0, half]),
        children: &[leaf],
        ..GlbNode::default()
    });
    written(glb, root)
}

fn with_json(edit: impl Fn(String) -> String) -> Vec<u8> {
    let whole = built();
    let json_len = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let mut text = edit(String::from_utf8(whole[20..20 + json_len].to_vec()).unwrap()).into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &whole[20 + json_len..];
    let total = (20 + text.len() + rest.len()) as u32;
    let head = [b"glTF", &2u32.to_le_bytes()[..], &total.to_le_bytes(), &(text.len() as u32).to_le_bytes(), b"JSON"];
    [head.concat(), text, rest.to_vec()].concat()
}

#[test]
fn a_written_mesh_is_read_back_in_world_coordinates() {
    let mesh = read_gltf(built().as_slice()).unwrap();
    assert_eq!(mesh.faces, FACES);
    // +X goes to -Z, +Z to +X.
    for (found, expected) in
        mesh.points.iter().zip([[0.0, 10.0, 0.0], [0.0, 10.0, -1.0], [0.0, 12.0, 0.0], [3.0, 10.0, 0.0]])
    {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
    }
    let normal = mesh.normals.unwrap()[0];
    assert!((normal[2] + 1.0).abs() < 1e-6, "{normal:?}");
    assert_eq!(mesh.colors.unwrap(), COLORS);
    assert_eq!(mesh.uvs.unwrap(), [[0.25, 0.25]; 4]);
    assert_eq!(mesh.scalars["_PHYSW"], [0.0, 0.25, 0.5, 1.0]);
    assert_eq!(built(), built());
}

#[test]
fn a_mirrored_node_flips_the_faces() {
    let bytes = with_json(|t| t.replace("\"translation\":[0.0,10.0,0.0]", "\"scale\":[-1.0,1.0,1.0]"));
    assert_eq!(read_gltf(bytes.as_slice()).unwrap().faces, FACES.map(|[a, b, c]| [a, c, b]));
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let whole = built();
    for cut in (0..whole.len()).step_by(7).chain([whole.len() - 1]) {
        let err = read_gltf(&whole[..cut]).expect_err("cut short");
        assert!(cut < 4 || matches!(err, FormatError::Truncated { .. }), "cut at {cut}: {err}");
    }
}

#[test]
fn a_json_that_claims_more_than_there_is_never_panics() {
    for (from, to, says) in [
        ("\"byteLength\":48", "\"byteLength\":99999999", "beyond"),
        ("\"byteOffset\":24", "\"byteOffset\":18446744073709551000", "beyond"),
        ("\"count\":4,\"max\"", "\"count\":400000000,\"max\"", "beyond"),
        ("\"type\":\"VEC3\"", "\"type\":\"VEC2\"", "positions of 3 numbers"),
        (
            "\"buffers\":[{",
            "\"buffers\":[{\"uri\":\"a.bin\",",
            "the file 'a.bin', which holds the mesh's numbers, is not beside it",
        ),
        ("\"buffers\":[{", "\"buffers\":[{\"uri\":\"data:x;base64,AAAA\",", "byte of buffer 0, 3 of"),
        ("\"POSITION\":1", "\"POSITION\":7", "mesh 0: expected accessors below 6, found accessor 7"),
        ("\"children\":[0]", "\"children\":[1]", "node 1 is reached twice"),
        ("\"asset\"", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"asset\"", "compressed with Draco"),
    ] {
        assert!(String::from_utf8_lossy(&built()).contains(from), "{from}");
        let err = read_gltf(with_json(|t| t.replacen(from, to, 1)).as_slice()).unwrap_err();
        assert!(err.to_string().contains(says), "{err}\nshould say: {says}");
    }
}

#[test]
fn an_index_beyond_the_vertices_is_named() {
    let mut glb = GlbWriter::new();
    let indices = glb.indices(&[[0, 1, 4]]);
    let attributes = [(GlbAttribute::Positions, glb.positions(&POINTS).unwrap())];
    let mesh = glb
        .mesh(&GlbMesh { name: "m", indices, attributes: &attributes, material: None, extras: json!(null) })
        .unwrap();
    let node = glb.node(&GlbNode { name: "n", mesh: Some(mesh), ..GlbNode::default() });
    let err = read_gltf(written(glb, node).as_slice()).unwrap_err();
    assert_eq!(err.to_string(), "glTF, index 2: expected vertices below 4, found vertex 4");
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let err = GlbWriter::new().positions(&[[0.0; 3], [0.0, f32::NAN, 0.0]]).unwrap_err();
    assert!(matches!(err, FormatError::Element { index: 1, .. }), "{err}");
}
