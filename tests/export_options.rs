//! What an export may change of a figure: its axes, its bind pose, the number of its faces; and what it adds.

use crate::common::{demo, overcoat_ok};
use overcoat::formats::{RawMesh, read_obj, read_ply};
use overcoat::geometry::{Point, TriMesh};
use serde_json::Value;
use std::path::Path;

const LAYERS: [&str; 5] = ["body", "tshirt", "skirt", "pullover", "vest"];

/// Exports the demo's figure and says what the command did.
fn export(out: &Path, name: &str, options: &[&str]) -> Value {
    let target = format!("{}/{name}", out.display());
    overcoat_ok(&demo().session, &[&["export", target.as_str(), "--json"], options].concat()).json()
}

fn mesh(raw: &RawMesh) -> TriMesh {
    TriMesh::try_from_indices(raw.points.iter().map(|p| Point::from(*p)).collect(), &raw.faces).unwrap()
}

fn layers(folder: &Path) -> Vec<TriMesh> {
    LAYERS.map(|name| mesh(&read_ply(&*std::fs::read(folder.join(format!("{name}.ply"))).unwrap()).unwrap())).into()
}

#[test]
fn files_and_folders_have_the_axes_that_are_requested() {
    let out = tempfile::tempdir().unwrap();
    for (name, options) in [("y", &[][..]), ("z", &["--up", "z", "--unit", "cm"])] {
        export(out.path(), &format!("{name}.obj"), &[&["--texture", "none"], options].concat());
        export(out.path(), &format!("{name}.usda"), &[&["--texture", "none"], options].concat());
        export(out.path(), &format!("{name}/"), options);
    }
    let is_turned = |(p, q): (&[f64; 3], &[f64; 3])| {
        let expected = [100.0 * p[0], -100.0 * p[2], 100.0 * p[1]];
        (0..3).all(|k| (expected[k] - q[k]).abs() < 1e-3)
    };
    let read = |name: &str| read_obj(&*std::fs::read(out.path().join(name)).unwrap()).unwrap().points;
    assert!(read("y.obj").iter().zip(&read("z.obj")).all(is_turned));
    for (before, after) in layers(&out.path().join("y")).iter().zip(&layers(&out.path().join("z"))) {
        let points = |mesh: &TriMesh| mesh.points().iter().map(|p| p.coords.into()).collect::<Vec<[f64; 3]>>();
        assert!(points(before).iter().zip(&points(after)).all(is_turned));
    }
    let joints = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(out.path().join(name).join("joints.json")).unwrap()).unwrap()
    };
    assert_eq!(
        joints("z")["head"][2].as_f64().map(|z| z as f32),
        joints("y")["head"][1].as_f64().map(|y| 100.0 * y as f32)
    );
    let text = std::fs::read_to_string(out.path().join("z.usda")).unwrap();
    assert!(text.contains("upAxis = \"Z\"") && text.contains("metersPerUnit = 0.01\n"));
}
