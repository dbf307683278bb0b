//! Scans with faults that the triangles tell, and scans that lack what the garment needs.

use crate::common::{body_of_demo, demo_mesh, demo_tshirt_as_thin_as_a_pole, overcoat, overcoat_ok, write_mesh};
use overcoat::formats::{RawMesh, read_ply};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn tshirt() -> RawMesh {
    demo_mesh("1-tshirt.ply")
}

/// A session of the demo's body, which is built, and this scan of its T-shirt.
fn session_of(dir: &Path, scan: &RawMesh) -> PathBuf {
    let session = body_of_demo(dir);
    let scan = write_mesh(dir.join("tshirt.ply"), scan);
    overcoat_ok(&session, &["scan", "tshirt", scan.to_str().unwrap(), "--template", "tshirt"]);
    session
}

/// The T-shirt's warnings from a build, which must do its work.
fn warnings(session: &Path) -> Vec<String> {
    let built = overcoat_ok(session, &["build", "--json"]).json();
    built["steps"][1]["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap().to_string()).collect()
}

/// Whether every edge of the exported T-shirt belongs to at most two faces, one on each side.
fn is_manifold(session: &Path) -> bool {
    overcoat_ok(session, &["export", "../layers/"]);
    let file = session.parent().unwrap().join("layers/tshirt.ply");
    let mesh = read_ply(std::fs::File::open(file).unwrap()).unwrap();
    let mut sides = BTreeSet::new();
    let all = mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    !mesh.faces.is_empty() && all.into_iter().all(|side| sides.insert(side))
}

#[test]
fn fins_doubled_and_flat_triangles_do_not_harm_a_garment_nor_does_an_inside_out_scan() {
    let dir = tempfile::tempdir().unwrap();
    let mut scan = tshirt();
    let own = scan.faces.clone();
    for &[a, b, c] in own.iter().step_by(40) {
        let [p, q] = [a, b].map(|v| scan.points[v as usize]);
        // A fin of 8 mm on an edge, a triangle given twice, one without area, and one that is a line.
        let color = scan.colors.as_ref().map(|colors| colors[a as usize]);
        let tip = scan.points.len() as u32;
        let middle = [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]));
        scan.points.extend([[middle[0], middle[1] + 0.008, middle[2]], middle]);
        if let (Some(colors), Some(color)) = (&mut scan.colors, color) {
            colors.extend([color; 2]);
        }
        scan.faces.extend([[a, b, tip], [b, c, a], [a, a, b], [a, tip + 1, b]]);
    }
    scan.faces.iter_mut().for_each(|face| face.swap(0, 1));
    let session = session_of(dir.path(), &scan);
    // The sleeves of the scan as it is are ragged at the armpits.
    let warnings = warnings(&session);
    assert!(warnings.iter().all(|what| what.contains("ragged")), "{warnings:?}");
    assert!(is_manifold(&session));
}

#[test]
fn a_hem_that_the_scan_does_not_show_is_named_with_its_height() {
    let dir = tempfile::tempdir().unwrap();
    let mut scan = tshirt();
    // A band without data around the hips, where the T-shirt ends.
    let middle = |face: &[u32; 3], k: usize| face.iter().map(|&v| scan.points[v as usize][k]).sum::<f64>() / 3.0;
    let floor = scan.points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let seen = |face: &&[u32; 3]| !(0.70..0.98).contains(&(middle(face, 1) - floor)) || middle(face, 0).abs() > 0.3;
    scan.faces = scan.faces.iter().filter(seen).copied().collect();
    let warnings = warnings(&session_of(dir.path(), &scan));
    let said = "m above the floor, is where the scan ends: its cloth may be longer";
    let of_hems: Vec<&String> = warnings.iter().filter(|what| what.contains(said)).collect();
    assert!(of_hems.len() == 1 && of_hems[0].contains("a hem of the tshirt, 0.9"), "{warnings:?}");
}

#[test]
fn cloth_inside_the_body_is_refused_and_the_body_stays() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_of(dir.path(), &demo_tshirt_as_thin_as_a_pole());
    let build = overcoat(&session, &["build"]);
    assert_eq!(build.code, 1, "{build:?}");
    assert!(build.stderr.contains("step 'tshirt', pose: the figure does not fit into this scan"), "{build:?}");
    assert!(overcoat_ok(&session, &["status"]).stdout.contains("\nbody: good\n"));
    // What is built can be had; nothing of the T-shirt is.
    let export = overcoat_ok(&session, &["export", "../figure/"]);
    assert!(export.stderr.contains("'tshirt' failed and is not in the figure"), "{export:?}");
    let is_there = |layer: &str| dir.path().join(format!("figure/{layer}.ply")).exists();
    assert!(is_there("body") && !is_there("tshirt"));
}
