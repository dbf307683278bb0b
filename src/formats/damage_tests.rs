//! No reader panics on a file with a few bytes changed, and every mesh that it returns is consistent.

use super::{
    GlbAttribute, GlbMesh, GlbNode, GlbScene, GlbWriter, MeshKind, NpyArray, Npz, NpzCompression, PlyEncoding,
    PlyOptions, RawMesh, read_mesh, read_npz, write_npz, write_obj, write_ply,
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
    glb.write(&GlbScene { generator: "test", name: "s", roots: &[node], extras: Value::Null }, &mut bytes).unwrap();
    bytes
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
    files.push((MeshKind::Off, b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".to_vec()));
    let mut stl = vec![0u8; 84 + 50];
    stl[80] = 1;
    files.push((MeshKind::Stl, stl));
    files
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
            if let Ok(mesh) = read_mesh(kind, bytes.as_slice()) {
                let count = mesh.points.len();
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
