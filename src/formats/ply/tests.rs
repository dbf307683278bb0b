//! PLY: round trips in all encodings, files of other programs, and messages for damaged files.

use super::read::read_ply;
use super::write::{PlyEncoding, PlyOptions, write_ply};
use crate::formats::error::FormatError;
use crate::formats::raw_mesh::RawMesh;
use proptest::prelude::*;

const ENCODINGS: [PlyEncoding; 3] = [PlyEncoding::Ascii, PlyEncoding::LittleEndian, PlyEncoding::BigEndian];

fn options(encoding: PlyEncoding) -> PlyOptions {
    PlyOptions { encoding, double: true, comments: vec!["two\nlines".into()] }
}

fn written(mesh: &RawMesh, encoding: PlyEncoding) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_ply(mesh, &options(encoding), &mut bytes).unwrap();
    bytes
}

prop_compose! {
    fn any_mesh()(vertex_count in 0usize..40)(
        points in prop::collection::vec(prop::array::uniform3(-1e6f64..1e6), vertex_count),
        normals in prop::option::of(prop::collection::vec(prop::array::uniform3(-1f64..1.0), vertex_count)),
        uvs in prop::option::of(prop::collection::vec(prop::array::uniform2(0f64..1.0), vertex_count)),
        colors in prop::option::of(prop::collection::vec(any::<[u8; 3]>(), vertex_count)),
        label in prop::option::of(prop::collection::vec(any::<i16>().prop_map(f32::from), vertex_count)),
        faces in prop::collection::vec(prop::array::uniform3(0..vertex_count.max(1) as u32),
            if vertex_count == 0 { 0..1 } else { 0..60 }),
    ) -> RawMesh {
        let scalars = label.into_iter().map(|l| ("label".to_string(), l)).collect();
        RawMesh { points, faces, colors, normals, uvs, scalars, ..RawMesh::default() }
    }
}

proptest! {
    #[test]
    fn a_written_mesh_is_read_back_exactly(mesh in any_mesh()) {
        for encoding in ENCODINGS {
            let read = read_ply(written(&mesh, encoding).as_slice()).unwrap();
            // Texture coordinates without a picture are said.
            prop_assert_eq!(RawMesh { unread: Vec::new(), ..read }, mesh.clone());
        }
    }

    #[test]
    fn arbitrary_bytes_after_a_header_never_panic(body in prop::collection::vec(any::<u8>(), 0..200)) {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let mut file = format!("ply\nformat {format} 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nelement face 3\nproperty list int int vertex_index\nend_header\n").into_bytes();
            file.extend(&body);
            if let Ok(mesh) = read_ply(file.as_slice()) {
                prop_assert_eq!(mesh.points.len(), 2);
            }
        }
    }
}

/// A strip of `2 n` vertices with colours, normals and a scalar.
fn strip(n: u32) -> RawMesh {
    let points: Vec<_> = (0..2 * n).map(|i| [f64::from(i / 2) * 0.1, f64::from(i % 2), 0.25]).collect();
    let count = points.len();
    RawMesh {
        faces: (0..2 * n - 2).map(|i| [i, i + 1 + i % 2, i + 2 - i % 2]).collect(),
        colors: Some((0..count).map(|i| [i as u8, 255 - i as u8, 7]).collect()),
        normals: Some(vec![[0.0, 0.0, 1.0]; count]),
        uvs: None,
        scalars: [("quality".to_string(), vec![0.5; count])].into(),
        points,
        ..RawMesh::default()
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    for encoding in ENCODINGS {
        let whole = written(&strip(60), encoding);
        // In text, a cut within the last number leaves a number.
        let last_token = whole.iter().rposition(|&b| b == b' ').unwrap();
        let end = if encoding == PlyEncoding::Ascii { last_token + 2 } else { whole.len() };
        for cut in (0..end).step_by(97).chain([end - 1]) {
            let err = read_ply(&whole[..cut]).expect_err("cut short");
            if cut > 400 {
                assert!(matches!(err, FormatError::Truncated { .. }), "{encoding:?} cut at {cut}: {err}");
                assert!(err.hint().is_some());
            }
        }
    }
}

#[test]
fn the_first_missing_element_is_named() {
    let whole = written(&strip(60), PlyEncoding::LittleEndian);
    let one_face = 1 + 3 * 4;
    let err = read_ply(&whole[..whole.len() - 2 * one_face + 1]).unwrap_err();
    assert_eq!(err.to_string(), "the PLY data end too early: face 116 of 118 is the first that is missing or cut");
}

#[test]
fn nan_is_kept() {
    let mut mesh = strip(2);
    mesh.points[1][2] = f64::NAN;
    for encoding in ENCODINGS {
        assert!(read_ply(written(&mesh, encoding).as_slice()).unwrap().points[1][2].is_nan());
    }
}

const FOREIGN: &str = "ply\r
format ascii 1.0\r
comment made by caf\u{e9}\r
obj_info anything 1 2 3\r
element camera 1\r
property list uint8 float32 stuff\r
property int view\r
element face 2\r
property uchar flags\r
property list uint8 int32 vertex_index\r
property list uchar float texcoord\r
element vertex 4\r
property float confidence\r
property float64 z\r
property float diffuse_red\r
property float diffuse_green\r
property float diffuse_blue\r
property float32 y\r
property double x\r
property list uchar int rings\r
end_header\r
2 0.5 1. 7\r
\r
0 4 0 1 2 3 0\r
0 3\t3 2 1 2 .5 .5\r
0.5 3 1 0.5 0 2 1 0\r
0.5 -.3e1 1 0.5 0 2 1 2 5 6\r
0.5 3 1 0.5 0 +2 1 0\r
0.5 -nan 1 0.5 0 2 1 0\r
";

#[test]
fn order_types_and_unknown_parts_are_the_files_own() {
    // Latin-1, as older programs write their comments.
    let bytes: Vec<u8> = FOREIGN.chars().map(|c| c as u8).collect();
    let mesh = read_ply(bytes.as_slice()).unwrap();
    assert_eq!(mesh.points[0], [1.0, 2.0, 3.0]);
    assert_eq!(mesh.points[1], [1.0, 2.0, -3.0]);
    assert!(mesh.points[3][2].is_nan());
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
    assert_eq!(mesh.colors.unwrap(), [[255, 128, 0]; 4]);
    assert_eq!(mesh.scalars["confidence"], [0.5; 4]);
    assert_eq!((mesh.normals, mesh.uvs, mesh.scalars.len()), (None, None, 1));
}

#[test]
fn damage_is_named_by_its_line() {
    for (from, to, says) in [
        ("0.5 -.3e1", "0.5 three", "line 27: expected a number, found 'three'"),
        ("3\t3 2 1", "3\t3 2 -1", "line 25: expected a vertex index, found '-1'"),
        ("3\t3 2 1", "3\t3 2 9", "face 2: expected vertices below 4, found vertex 9"),
        (
            "2 0.5 1. 7",
            "2 0.5 1. 7 8",
            "line 22: expected the numbers of one camera, as the header declares, found 'also '8''",
        ),
        (
            "property double x",
            "property dubble x",
            "line 19: expected a line of a PLY header, found 'property dubble x'",
        ),
        ("property double x", "property double y", "a name used twice"),
        ("property double x", "property double w", "x, y and z"),
        ("element vertex", "element corner", "an element 'vertex'"),
        ("end_header\r\n", "", "ends with 'end_header'"),
        ("ply\r\n", "solid cube\r\n", "this is not PLY: it begins with 'solid cube"),
    ] {
        assert!(FOREIGN.contains(from), "{from}");
        let err = read_ply(FOREIGN.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(err.to_string().contains(says), "{err}\nshould say: {says}");
    }
}

#[test]
fn a_promise_beyond_all_memory_is_only_a_truncated_file() {
    let file = "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\n\
        property float y\nproperty float z\nend_header\n";
    assert!(matches!(read_ply(file.as_bytes()).unwrap_err(), FormatError::Truncated { index: 0, .. }));
}

#[test]
fn arrays_of_different_lengths_are_not_written() {
    let mut mesh = strip(3);
    mesh.colors = Some(vec![[0; 3]; 2]);
    let err = write_ply(&mesh, &PlyOptions::default(), Vec::new()).unwrap_err();
    assert!(matches!(&err, FormatError::ArrayShape { name, .. } if name == "colors"), "{err}");
}

#[test]
fn texture_coordinates_of_corners_become_those_of_vertices() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 .5 0 .5 1\n3 0 2 3 6 .25 0 .75 1 0 1\n";
    let mesh = read_ply(text.as_bytes()).unwrap();
    assert_eq!(mesh.uvs.unwrap(), [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]]);
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]]);
}
