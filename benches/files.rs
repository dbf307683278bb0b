//! Reading and writing meshes beside the crates that could do it, on one mesh of 1 000 000 vertices and 2 000 000 faces.
//!
//! ```sh
//! cargo bench --bench files              # times, and what each reader makes of unusual files
//! cargo bench --bench files -- python3   # also beside trimesh, if that Python has it
//! ```
//!
//! Times are the least of three runs, in milliseconds. Ratios are the other's time by ours: above 1 ours is faster.

use overcoat::formats::{
    GlbAttribute, GlbMesh, GlbNode, GlbScene, GlbWriter, PlyEncoding, PlyOptions, RawMesh, read_gltf, read_obj,
    read_off, read_ply, read_stl, write_obj, write_ply,
};
use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{BeginList, PropertyAccess, PropertyAccessResult};
use std::io::Cursor;
use std::process::Command;
use std::time::Instant;

/// Vertices along one side of the mesh.
const SIDE: usize = 1000;
const RUNS: usize = 3;

/// A square with waves, 1 × 1 m.
fn waves() -> RawMesh {
    let height = |x: usize, y: usize| 0.05 * (x as f64 / 37.0).sin() * (y as f64 / 29.0).cos();
    let point = |i: usize| {
        let (x, y) = (i % SIDE, i / SIDE);
        [x as f64 / SIDE as f64, y as f64 / SIDE as f64, height(x, y)].map(|c| f64::from(c as f32))
    };
    let corner = |x: usize, y: usize| (y * SIDE + x) as u32;
    let cell = |i: usize| {
        let (x, y) = (i % (SIDE - 1), i / (SIDE - 1));
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
        [[a, b, d], [b, c, d]]
    };
    RawMesh {
        points: (0..SIDE * SIDE).map(point).collect(),
        faces: (0..(SIDE - 1) * (SIDE - 1)).flat_map(cell).collect(),
        ..RawMesh::default()
    }
}

/// The least time of a few runs, in milliseconds.
fn time<T>(mut run: impl FnMut() -> T) -> f64 {
    let once = |_| {
        let began = Instant::now();
        std::hint::black_box(run());
        1e3 * began.elapsed().as_secs_f64()
    };
    (0..RUNS).map(once).fold(f64::INFINITY, f64::min)
}

fn beside(task: &str, ours: f64, name: &str, other: f64) {
    println!("{task:<24} {ours:8.0} ms   {name:<9} {other:8.0} ms   ratio {:.2}", other / ours);
}

#[derive(Default)]
struct Vertex([f32; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.0[axis] = value;
        PropertyAccessResult::Set
    }
}

#[derive(Default)]
struct Face(Vec<u32>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }
    fn begin_list_uint(&mut self, _name: &str, _length: usize) -> BeginList<'_, u32> {
        BeginList::Fill(&mut self.0)
    }
}

/// The payload parser of `ply-rs`, into typed structs; counts of vertices and faces.
fn typed_ply(bytes: &[u8]) -> Result<[usize; 2], String> {
    let fault = |e: ply_rs::parser::ParseError| e.to_string();
    let (vertices, faces) = (Parser::<Vertex>::new(), Parser::<Face>::new());
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = vertices.read_header(&mut reader).map_err(fault)?;
    let mut counts = [0; 2];
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                counts[0] = vertices.read_payload_for_element(&mut reader, element, &header).map_err(fault)?.len();
            }
            _ => counts[1] = faces.read_payload_for_element(&mut reader, element, &header).map_err(fault)?.len(),
        }
    }
    Ok(counts)
}

fn tobj_counts(bytes: &[u8]) -> Result<[usize; 2], String> {
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, no_materials).map_err(|e| e.to_string())?;
    let sum = |of: fn(&tobj::Mesh) -> usize| models.iter().map(|m| of(&m.mesh)).sum::<usize>();
    Ok([sum(|m| m.positions.len() / 3), sum(|m| m.indices.len() / 3)])
}

fn stl_io_counts(bytes: &[u8]) -> Result<[usize; 2], String> {
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| e.to_string())?;
    Ok([mesh.vertices.len(), mesh.faces.len()])
}

fn off_counts(bytes: &[u8]) -> Result<[usize; 2], String> {
    let mesh = off_rs::parse(&String::from_utf8_lossy(bytes), off_rs::parser::options::Options::default());
    mesh.map(|m| [m.vertex_count(), m.face_count()]).map_err(|e| e.to_string())
}

/// Counts of vertices and faces, or the message.
type ReadFn = fn(&[u8]) -> Result<[usize; 2], String>;

fn counts(mesh: Result<RawMesh, overcoat::formats::FormatError>) -> Result<[usize; 2], String> {
    mesh.map(|m| [m.points.len(), m.faces.len()]).map_err(|e| e.to_string())
}

fn stl_of(mesh: &RawMesh, title: &[u8]) -> Vec<u8> {
    let mut bytes = title.to_vec();
    bytes.resize(80, 0);
    bytes.extend((mesh.faces.len() as u32).to_le_bytes());
    for face in &mesh.faces {
        let numbers = [0.0; 3].into_iter().chain(face.iter().flat_map(|&v| mesh.points[v as usize]));
        bytes.extend(numbers.flat_map(|c| (c as f32).to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn glb_of(mesh: &RawMesh) -> Vec<u8> {
    let points: Vec<[f32; 3]> = mesh.points.iter().map(|p| p.map(|c| c as f32)).collect();
    let mut glb = GlbWriter::new();
    let indices = glb.indices(&mesh.faces);
    let attributes = [(GlbAttribute::Positions, glb.positions(&points).expect("finite"))];
    let extras = serde_json::Value::Null;
    let mesh = GlbMesh { name: "waves", indices, attributes: &attributes, material: None, extras: extras.clone() };
    let mesh = Some(glb.mesh(&mesh).expect("no extras"));
    let node = glb.node(&GlbNode { name: "waves", mesh, ..GlbNode::default() });
    let mut bytes = Vec::new();
    glb.write(
        &GlbScene { generator: "bench", name: "scene", roots: &[node], extras, extensions: Default::default() },
        &mut bytes,
    )
    .expect("written");
    bytes
}

fn ply_of(mesh: &RawMesh, encoding: PlyEncoding) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_ply(mesh, &PlyOptions { encoding, ..PlyOptions::default() }, &mut bytes).expect("written");
    bytes
}

fn beside_crates(mesh: &RawMesh) {
    for (task, encoding) in [("PLY read, binary", PlyEncoding::LittleEndian), ("PLY read, ascii", PlyEncoding::Ascii)] {
        let bytes = ply_of(mesh, encoding);
        assert_eq!(typed_ply(&bytes), counts(read_ply(bytes.as_slice())));
        beside(task, time(|| read_ply(bytes.as_slice())), "ply-rs", time(|| typed_ply(&bytes)));
    }
    let mut obj = Vec::new();
    write_obj(mesh, &mut obj).expect("written");
    assert_eq!(tobj_counts(&obj), counts(read_obj(obj.as_slice())));
    beside("OBJ read", time(|| read_obj(obj.as_slice())), "tobj", time(|| tobj_counts(&obj)));
    let stl = stl_of(mesh, b"waves");
    assert_eq!(stl_io_counts(&stl), counts(read_stl(stl.as_slice())));
    beside("STL read, binary", time(|| read_stl(stl.as_slice())), "stl_io", time(|| stl_io_counts(&stl)));
}

/// What both sides make of small files that people have: `Ok([vertices, faces])`, or the message.
fn unusual_files() {
    let tetrahedron = RawMesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..RawMesh::default()
    };
    let solid = stl_of(&tetrahedron, b"solid made by a CAD program");
    let cut = &stl_of(&tetrahedron, b"tetrahedron")[..200];
    let ply = |rows: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n{rows}"
        )
    };
    let (ply_nan, ply_dot, ply_bad) = (ply("0 0 nan\n1 1 1\n"), ply("0 .5 1.\n1 1 1\n"), ply("0 0 0\n1 1 x\n"));
    let mut latin = b"ply\nformat ascii 1.0\ncomment caf\xe9\n".to_vec();
    latin.extend(b"element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n");
    let ours_ply: ReadFn = |b| counts(read_ply(b));
    let ours_obj: ReadFn = |b| counts(read_obj(b));
    let ours_stl: ReadFn = |b| counts(read_stl(b));
    let ours_off: ReadFn = |b| counts(read_off(b));
    let cases: Vec<(&str, &[u8], ReadFn, ReadFn)> = vec![
        ("PLY ascii, NaN", ply_nan.as_bytes(), ours_ply, typed_ply),
        ("PLY ascii, '.5' and '1.'", ply_dot.as_bytes(), ours_ply, typed_ply),
        ("PLY, comment in Latin-1", &latin, ours_ply, typed_ply),
        ("PLY ascii, 'x' on line 9", ply_bad.as_bytes(), ours_ply, typed_ply),
        ("OBJ, a vertex no face uses", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n", ours_obj, tobj_counts),
        ("OBJ, a point cloud", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", ours_obj, tobj_counts),
        ("OBJ, a texture seam", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt .5 .5\nf 1/1 2/2 3/3\nf 1/4 3/3 4/2\n", ours_obj, tobj_counts),
        ("OBJ, two groups", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng a\nf 1 2 3\ng b\nf 1 3 4\n", ours_obj, tobj_counts),
        ("OBJ, damage on line 2", b"v 0 0 0\nv 1 0\n", ours_obj, tobj_counts),
        ("OFF, counts on the first line", b"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", ours_off, off_counts),
        (
            "OFF, colours per vertex",
            b"COFF\n3 1 0\n0 0 0 9 9 9 255\n1 0 0 9 9 9 255\n0 1 0 9 9 9 255\n3 0 1 2\n",
            ours_off,
            off_counts,
        ),
        ("OFF, an index beyond the vertices", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", ours_off, off_counts),
        ("STL binary, title 'solid …'", &solid, ours_stl, stl_io_counts),
        ("STL binary, cut", cut, ours_stl, stl_io_counts),
        ("STL ascii, 'solid' alone", b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n", ours_stl, stl_io_counts),
        ("STL ascii, damage on line 4", b"solid a\nfacet normal 0 0 1\nouter loop\nvortex 0 0 0\n", ours_stl, stl_io_counts),
    ];
    for (name, bytes, ours, other) in cases {
        println!("{name}\n    ours   {:?}\n    crate  {:?}", ours(bytes), other(bytes));
    }
}

/// Reads the files with trimesh, each the least of three runs.
const TRIMESH: &str = "
import sys, time, trimesh
folder = sys.argv[1]
def least(run): return min((lambda t: (run(), time.perf_counter() - t)[1])(time.perf_counter()) for _ in range(3)) * 1e3
mesh = trimesh.load(folder + '/binary.ply', process=False)
for name in ('binary.ply', 'ascii.ply', 'waves.glb'):
    print(least(lambda: trimesh.load(folder + '/' + name, process=False)))
print(least(lambda: mesh.export(file_type='glb')))
";

fn beside_trimesh(mesh: &RawMesh, python: &str) -> std::io::Result<()> {
    let dir = tempfile::tempdir()?;
    let (binary, ascii) = (ply_of(mesh, PlyEncoding::LittleEndian), ply_of(mesh, PlyEncoding::Ascii));
    let glb = glb_of(mesh);
    for (name, bytes) in [("binary.ply", &binary), ("ascii.ply", &ascii), ("waves.glb", &glb)] {
        std::fs::write(dir.path().join(name), bytes)?;
    }
    let done = Command::new(python).args(["-c", TRIMESH]).arg(dir.path()).output()?;
    let times: Vec<f64> = String::from_utf8_lossy(&done.stdout).lines().filter_map(|l| l.parse().ok()).collect();
    let [ply, text, load, write] = times[..] else {
        println!("trimesh could not be asked: {}", String::from_utf8_lossy(&done.stderr));
        return Ok(());
    };
    let read = |name: &str| std::fs::read(dir.path().join(name)).expect("just written");
    beside("PLY load, binary", time(|| read_ply(read("binary.ply").as_slice())), "trimesh", ply);
    beside("PLY load, ascii", time(|| read_ply(read("ascii.ply").as_slice())), "trimesh", text);
    beside("GLB load", time(|| read_gltf(read("waves.glb").as_slice())), "trimesh", load);
    beside("GLB write", time(|| glb_of(mesh)), "trimesh", write);
    Ok(())
}

fn main() -> std::io::Result<()> {
    let mesh = waves();
    beside_crates(&mesh);
    unusual_files();
    match std::env::args().skip(1).find(|a| !a.starts_with("--")) {
        Some(python) => beside_trimesh(&mesh, &python),
        None => Ok(()),
    }
}
