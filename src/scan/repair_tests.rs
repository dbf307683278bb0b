//! Scans as programs and scanners spoil them, each made from the figure of `tests.rs`: one person comes out, and it is said.

use super::tests::{BODY, Limb, body, cleaned, figure};
use super::{Scan, ScanParams, clean};
use crate::formats::RawMesh;
use crate::geometry::{Point, Vec3};

fn height(scan: &Scan) -> f64 {
    scan.mesh.bounds().unwrap().extent().y
}

fn says(scan: &Scan, what: &str) -> bool {
    scan.findings.iter().any(|finding| finding.contains(what))
}

/// A cleaned figure of this area and height, with a finding.
fn assert_one_person(raw: &RawMesh, what: &str, area_off: f64) -> Scan {
    let (whole, scan) = (cleaned(&body()).unwrap(), cleaned(raw).unwrap_or_else(|e| panic!("{what}: {e}")));
    assert!(says(&scan, what), "{what}: {:?}", scan.findings);
    assert!((height(&scan) - height(&whole)).abs() < 0.03, "{what}: {} m tall", height(&scan));
    let area = scan.mesh.area() / whole.mesh.area();
    assert!((area - 1.0).abs() < area_off, "{what}: {area} of the area; {:?}", scan.findings);
    scan
}

/// Each triangle with corners of its own, moved by up to `jitter`.
fn soup(raw: &RawMesh, jitter: f64) -> RawMesh {
    let mut soup = RawMesh::default();
    for face in &raw.faces {
        let base = soup.points.len() as u32;
        for &v in face {
            let k = soup.points.len() as f64;
            let off = [12.9898, 78.233, 37.719].map(|a| ((k * a).sin() * 43758.5453).fract() * jitter);
            soup.points.push([0, 1, 2].map(|i| raw.points[v as usize][i] + off[i]));
        }
        soup.faces.push([base, base + 1, base + 2]);
    }
    soup
}

#[test]
fn a_vertex_of_no_face_may_have_no_place() {
    let mut raw = body();
    raw.points.push([f64::NAN; 3]);
    raw.colors.as_mut().unwrap().push([0; 3]);
    assert_eq!(cleaned(&raw).unwrap().mesh, cleaned(&body()).unwrap().mesh);
}

#[test]
fn a_scan_in_metres_of_a_survey_is_cleaned_as_at_the_origin() {
    let far = Vec3::new(4e5, 5e6, 120.0);
    let raw = RawMesh { points: body().points.iter().map(|&p| (Point::from(p) + far).into()).collect(), ..body() };
    let (here, there) = (cleaned(&body()).unwrap(), cleaned(&raw).unwrap());
    assert!(says(&there, "far from its file's origin"), "{:?}", there.findings);
    assert!((height(&there) - height(&here)).abs() < 1e-6);
    assert!(there.mesh.bounds().unwrap().center().coords.norm() < 3.0);
    let smoothed = ScanParams { smoothing_passes: 0, ..ScanParams::default() };
    let there = clean(&raw, &smoothed, &mut |_| {}).unwrap();
    for (v, p) in there.mesh.points().enumerate() {
        let in_file = there.world_from_file.file_from_world(p);
        assert!((in_file - Point::from(raw.points[there.file_vertices[v] as usize])).norm() < 1e-8);
    }
}

#[test]
fn seams_that_nearly_meet_are_joined() {
    for jitter in [1e-6, 1e-5, 5e-5] {
        let scan = assert_one_person(&soup(&body(), jitter), "along open seams", 0.01);
        let off = scan.mesh.vertex_count().abs_diff(cleaned(&body()).unwrap().mesh.vertex_count());
        assert!(off < 10, "{jitter}: {off}");
    }
    // Two halves, 0.1 mm apart.
    let mut halves = RawMesh::default();
    for side in [-1.0, 1.0] {
        let raw = body();
        let base = halves.points.len() as u32;
        halves.points.extend(raw.points.iter().map(|p| [p[0] + side * 5e-5, p[1], p[2]]));
        let middle = |face: &[u32; 3]| face.iter().map(|&v| raw.points[v as usize][0]).sum::<f64>() * side >= 0.0;
        halves.faces.extend(raw.faces.iter().filter(|face| middle(face)).map(|face| face.map(|v| v + base)));
    }
    assert_one_person(&halves, "along open seams", 0.01);
}

#[test]
fn bands_and_limbs_that_a_scanner_cut_are_one_person() {
    /// A coordinate, and where it is cut.
    type Cut = (fn(&[f64; 3]) -> f64, f64);
    let without = |cuts: &[Cut]| {
        let mut raw = body();
        let points = raw.points.clone();
        let is_cut = |face: &[u32; 3], (of, at): &Cut| {
            let values = face.map(|v| of(&points[v as usize]) - at);
            values.iter().any(|v| *v <= 0.0) && values.iter().any(|v| *v >= 0.0)
        };
        raw.faces.retain(|face| !cuts.iter().any(|cut| is_cut(face, cut)));
        raw
    };
    let bands = [0.35, 0.7, 0.87, 1.05, 1.3, 1.45].map(|y| ((|p| p[1]) as fn(&[f64; 3]) -> f64, y));
    assert_one_person(&without(&bands), "separate pieces", 0.2);
    assert_one_person(&without(&[(|p| p[0].abs(), 0.3), (|p| p[1], 0.75)]), "separate pieces", 0.15);
}

/// The surface twice: as it is, and moved inwards and turned.
fn thick(wall: f64) -> RawMesh {
    let raw = body();
    let points = raw.points.iter().map(|&p| Point::from(p)).collect();
    let mesh = crate::geometry::TriMesh::try_from_indices(points, &raw.faces).unwrap();
    let normals = mesh.vertex_normals();
    let count = raw.points.len() as u32;
    let inner: Vec<[f64; 3]> = mesh.points().iter().zip(normals.iter()).map(|(p, n)| (p - n * wall).into()).collect();
    let mut faces = raw.faces.clone();
    faces.extend(raw.faces.iter().map(|&[a, b, c]| [a + count, c + count, b + count]));
    RawMesh { points: raw.points.iter().copied().chain(inner).collect(), faces, ..RawMesh::default() }
}

#[test]
fn a_second_surface_is_dropped() {
    for wall in [0.0, 2e-4, 0.004, 0.012] {
        assert_one_person(&thick(wall), "two surfaces", 0.03);
    }
}

#[test]
fn what_the_person_stands_on_is_cut_off() {
    let floor = |half: f64, deep: f64| -> Vec<Limb> {
        let rows = (2.0 * half / 0.03) as usize;
        let row = |z: f64| ([-half, 0.0 - deep, z], [half, 0.0 - deep, z], 0.05, 0.05);
        (0..=rows).map(|k| row(-half + 0.03 * k as f64)).collect()
    };
    for (half, deep) in [(0.3, 0.04), (0.6, 0.04), (0.35, 0.1)] {
        let raw = figure(&[BODY.to_vec(), floor(half, deep)].concat());
        let scan = cleaned(&raw).unwrap_or_else(|e| panic!("{half}: {e}"));
        assert!(says(&scan, "cut off the floor or pedestal"), "{half} {deep}: {:?}", scan.findings);
        let bounds = scan.mesh.bounds().unwrap();
        assert!((1.6..1.72).contains(&bounds.extent().y), "{half} {deep}: {bounds:?}");
        assert!(bounds.extent().z < 0.4, "{half} {deep}: {bounds:?}");
    }
    assert!(!says(&cleaned(&body()).unwrap(), "cut off"));
}

#[test]
fn a_stated_height_scales_what_is_in_no_usual_unit_and_is_compared_else() {
    let scaled = |by: f64, height: f64| {
        let raw = RawMesh { points: body().points.iter().map(|p| p.map(|c| c * by)).collect(), ..body() };
        clean(&raw, &ScanParams { height: Some(height), ..ScanParams::default() }, &mut |_| {})
    };
    let scan = scaled(3.1, 1.7).unwrap();
    assert!(says(&scan, "scaled to the given height of 1.700 m"), "{:?}", scan.findings);
    assert!((height(&scan) - 1.7).abs() < 0.02);
    // In millimetres, where the height only says so.
    let scan = scaled(1000.0, 1.72).unwrap();
    assert!(says(&scan, "the file is in mm: the person is 1.696 m tall (1.720 m as given)"), "{:?}", scan.findings);
    let scan = scaled(1000.0, 1.9).unwrap();
    assert!(says(&scan, "check the unit and the height"), "{:?}", scan.findings);
    assert!(matches!(scaled(1.0, 17.0), Err(super::ScanError::BadHeight { .. })));
}
