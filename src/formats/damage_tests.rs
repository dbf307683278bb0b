//! No reader panics on a file with a few bytes changed, and every mesh that it returns is consistent.

use super::{
    GlbAttribute, GlbMesh, GlbNode, GlbScene, GlbWriter, MeshKind, NpyArray, Npz, NpzCompression, PlyEncoding,
    PlyOptions, RawMesh, mesh_siblings, read_mesh_with, read_npz, write_npz, write_obj, write_ply,
};
use proptest::prelude::*;
use serde_json::Value;
use std::io::Cursor;

fn tetrahedron() -> RawMesh {
    RawMesh {
        points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        colors: Some(vec![[1, 2, 3]; 4]),
        ..RawMesh::default()
    }
}

fn glb() -> Vec<u8> {
    let mesh = tetrahedron();
    let mut glb = GlbWriter::new();
    let indices = glb.indices(&mesh.faces);
    let points: Vec<[f32; 3]> = mesh.points.iter().map(|p| p.map(|c| c as f32)).collect();
    let attributes = [
        (GlbAttribute::Positions, glb.positions(&points).unwrap()),
        (GlbAttribute::Colors(0), glb.colors(&[[1, 2, 3]; 4])),
    ];
    let mesh = GlbMesh { name: "m", indices, attributes: &attributes, material: None, extras: Value::Null };
    let mesh = glb.mesh(&mesh).unwrap();
    let node = glb.node(&GlbNode { name: "n", mesh: Some(mesh), ..GlbNode::default() });
    let mut bytes = Vec::new();
    glb.write(
        &GlbScene { generator: "test", name: "s", roots: &[node], extras: Value::Null, extensions: Default::default() },
        &mut bytes,
    )
    .unwrap();
    bytes
}

/// A triangle with a picture, its numbers in another file.
fn textured_gltf() -> Value {
    serde_json::json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "a.png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]},
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "a.bin"}],
    })
}

/// The files beside a textured mesh.
fn beside(name: &str) -> Option<Vec<u8>> {
    match name {
        "a.mtl" => Some(b"newmtl a\nKd 1 0 0\nnewmtl b\nmap_Kd a.png\n".to_vec()),
        "a.png" => Some(b"picture".to_vec()),
        "a.bin" => Some(vec![0; 36]),
        _ => None,
    }
}

fn files() -> Vec<(MeshKind, Vec<u8>)> {
    let mut files = vec![(MeshKind::Gltf, glb())];
    for encoding in [PlyEncoding::Ascii, PlyEncoding::LittleEndian, PlyEncoding::BigEndian] {
        let mut bytes = Vec::new();
        write_ply(&tetrahedron(), &PlyOptions { encoding, ..PlyOptions::default() }, &mut bytes).unwrap();
        files.push((MeshKind::Ply, bytes));
    }
    let mut obj = Vec::new();
    write_obj(&tetrahedron(), &mut obj).unwrap();
    files.push((MeshKind::Obj, obj));
    let textured =
        "mtllib a.mtl\nusemtl b\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 0.5 1\nf 1/1 2/2 -1/-1\nusemtl a\nf 3/2 2/1 1\n";
    files.push((MeshKind::Obj, textured.into()));
    files.push((MeshKind::Gltf, textured_gltf().to_string().into_bytes()));
    files.push((MeshKind::Off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".to_vec()));
    let mut stl = vec![0u8; 84 + 50];
    stl[80] = 1;
    files.push((MeshKind::Stl, stl));
    files
}

#[test]
fn the_textured_files_have_a_texture_before_they_are_damaged() {
    let textured = files().into_iter().filter(|(kind, bytes)| {
        read_mesh_with(*kind, bytes.as_slice(), &mut beside).unwrap().texture.is_some_and(|t| !t.pictures.is_empty())
    });
    assert_eq!(textured.count(), 2);
}

proptest! {
    #[test]
    fn changed_bytes_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        for (kind, mut bytes) in files() {
            for (place, byte) in &changes {
                let at = place.index(bytes.len());
                bytes[at] = *byte;
            }
            let _ = mesh_siblings(kind, bytes.as_slice(), &mut beside);
            if let Ok(mesh) = read_mesh_with(kind, bytes.as_slice(), &mut beside) {
                let count = mesh.points.len();
                if let Some(texture) = &mesh.texture {
                    prop_assert_eq!(texture.face_materials.len(), mesh.faces.len());
                    prop_assert!(texture.corners.as_ref().is_none_or(|c| c.len() == mesh.faces.len()));
                    let places = mesh.faces.iter().enumerate().filter_map(|(f, &face)| texture.coords_of(f, face));
                    prop_assert!(places.flatten().flatten().all(f64::is_finite));
                }
                prop_assert!(mesh.faces.as_flattened().iter().all(|&v| (v as usize) < count), "{kind:?}");
                prop_assert!(mesh.colors.is_none_or(|c| c.len() == count), "{kind:?}");
            }
        }
        let mut npz = Npz::new();
        npz.insert("v", NpyArray::rows(&[[1.0f64, 2.0, 3.0]; 4]));
        npz.insert("names", NpyArray::vector(vec!["a".to_string(), "bc".into()]));
        let mut bytes = Vec::new();
        write_npz(&npz, NpzCompression::Stored, &mut bytes).unwrap();
        for (place, byte) in &changes {
            let at = place.index(bytes.len());
            bytes[at] = *byte;
        }
        if let Ok(npz) = read_npz(Cursor::new(bytes)) && let Ok(rows) = npz.f64_rows::<3>("v") {
            prop_assert_eq!(rows.len(), npz.shape("v").unwrap()[0]);
        }
    }
}
