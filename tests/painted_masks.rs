//! Label files that were painted in other programs: the fixtures in `painted/` come from Blender 3.4.1 and MeshLab 2020.09
//! themselves, by `painted/make.sh`.

use overcoat::formats::{PlyOptions, RawMesh, read_ply, write_ply};
use overcoat::geometry::{Point, TriMesh};
use overcoat::scan::{FileFrame, Scan};
use overcoat::segment::{LabelledSurface, Labels, Marks};
use std::f64::consts::TAU;
use std::path::Path;

/// A tube along Z, as a file has it that is in millimetres with Z up: 20 cm across, 40 cm high.
fn scan(rings: u32, sectors: u32) -> Scan {
    let frame = FileFrame {
        metres_per_unit: 1e-3,
        rotation: nalgebra::UnitQuaternion::from_euler_angles(-std::f64::consts::FRAC_PI_2, 0.0, 0.0),
    };
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for i in 0..=rings {
        for j in 0..sectors {
            let turn = TAU * f64::from(j) / f64::from(sectors);
            let in_file = Point::new(100.0 * turn.cos(), 100.0 * turn.sin(), 400.0 * f64::from(i) / f64::from(rings));
            points.push(frame.world_from_file(&in_file));
            if i > 0 {
                let [a, b] = [(i - 1) * sectors + j, (i - 1) * sectors + (j + 1) % sectors];
                faces.extend([[a, b, b + sectors], [a, b + sectors, a + sectors]]);
            }
        }
    }
    let mut scan = Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), None);
    scan.world_from_file = frame;
    scan
}

/// The garment as it was found: the upper half.
fn found(scan: &Scan) -> Labels {
    Labels(scan.mesh.points().iter().map(|p| p.y > 0.2).collect())
}

/// What both programs painted: red within 8 cm of a point of the lower half, grey within 8 cm of one of the upper half.
const RED_AT: [f64; 3] = [0.1, 0.1, 0.0];
const GREY_AT: [f64; 3] = [-0.1, 0.3, 0.0];
const BRUSH: f64 = 0.08;

fn fixture(name: &str) -> RawMesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/painted").join(name);
    read_ply(std::fs::File::open(&path).unwrap()).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn template() -> (Scan, RawMesh) {
    let scan = scan(32, 40);
    let mesh = LabelledSurface::of_marks(&scan, &Marks::of_labels(&found(&scan))).to_template();
    (scan, mesh)
}

#[test]
#[ignore = "writes the file that painted/make.sh has painted; PAINTED_TEMPLATE names it"]
fn write_the_template() {
    let out = std::fs::File::create(std::env::var("PAINTED_TEMPLATE").unwrap()).unwrap();
    write_ply(&template().1, &PlyOptions { double: true, ..PlyOptions::default() }, out).unwrap();
}

/// Every vertex not within `slack` of a limit has the label that was found or painted.
fn check(raw: &RawMesh, scan: &Scan, slack: f64, of: &str) {
    let marks = LabelledSurface::read(raw).unwrap().marks_on(scan, || None).unwrap();
    let (mut red, mut grey) = (0, 0);
    for (v, p) in scan.mesh.points().enumerate() {
        let [to_red, to_grey] = [RED_AT, GREY_AT].map(|c| (p - Point::from(c)).norm() - BRUSH);
        if [p.y - 0.2, to_red, to_grey].iter().any(|d| d.abs() < slack) {
            continue;
        }
        let expected = (p.y > 0.2 || to_red < 0.0) && to_grey > 0.0;
        assert_eq!(marks.0[v], Some(expected), "{of}: {p}");
        red += u32::from(to_red < 0.0);
        grey += u32::from(to_grey < 0.0);
    }
    assert!(red > 10 && grey > 10, "{of}: {red} {grey}");
}

#[test]
fn what_blender_and_meshlab_wrote_is_read_as_it_was_painted() {
    let (scan, template) = template();
    for (name, keeps_quality) in [("blender.ply", false), ("meshlab.ply", true)] {
        let raw = fixture(name);
        assert_eq!(raw.scalars.contains_key("quality"), keeps_quality, "{name}: {:?}", raw.scalars.keys());
        assert!(!raw.scalars.contains_key("label") && raw.colors.is_some(), "{name}");
        // Half an edge: the painted colours go from vertex to vertex.
        check(&raw, &scan, 1e-3, name);
        // The quality that MeshLab kept is what was there before.
        if let Some(quality) = raw.scalars.get("quality") {
            let before = &template.scalars["quality"];
            assert_eq!(quality, before, "painting colours leaves quality alone");
        }
    }
}

#[test]
fn painted_files_hold_on_another_mesh_of_the_same_surface() {
    for name in ["blender.ply", "meshlab.ply"] {
        for (rings, sectors) in [(21, 27), (50, 61)] {
            // An edge of the painted mesh is 16 mm.
            check(&fixture(name), &scan(rings, sectors), 0.013, name);
        }
    }
}
