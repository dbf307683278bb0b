//! Label files that were painted in other programs: the fixtures in `painted/` come from Blender 3.4.1 and MeshLab 2020.09
//! themselves, by `painted/make.sh`.

use crate::common::{body_of_demo, built_quick_session, demo_mesh, overcoat, overcoat_ok, quick_session, write_mesh};
use overcoat::formats::{NpyArray, PlyOptions, RawMesh, read_npy, read_ply, read_rgba_png, write_npy, write_ply};
use overcoat::geometry::{Point, TriMesh};
use overcoat::scan::{FileFrame, Scan};
use overcoat::segment::{LabelledSurface, Labels, Marks};
use std::f64::consts::TAU;
use std::path::Path;

/// A tube along Z, as a file has it that is in millimetres with Z up: 20 cm across, 40 cm high.
fn scan(rings: u32, sectors: u32) -> Scan {
    let frame = FileFrame {
        origin: nalgebra::Vector3::zeros(),
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
    let marks = LabelledSurface::read(raw).unwrap().marks_on(scan, None).unwrap();
    let (mut red, mut grey) = (0, 0);
    for (v, p) in scan.mesh.points().enumerate() {
        let [to_red, to_grey] = [RED_AT, GREY_AT].map(|c| (p - Point::from(c)).norm() - BRUSH);
        if [p.y - 0.2, to_red, to_grey].iter().any(|d| d.abs() < slack) {
            continue;
        }
        let expected = (p.y > 0.2 || to_red < 0.0) && to_grey > 0.0;
        assert_eq!(marks.labels[v], Some(expected), "{of}: {p}");
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
fn painted_files_apply_to_another_mesh_of_the_same_surface() {
    for name in ["blender.ply", "meshlab.ply"] {
        for (rings, sectors) in [(21, 27), (50, 61)] {
            // An edge of the painted mesh is 16 mm.
            check(&fixture(name), &scan(rings, sectors), 0.013, name);
        }
    }
}

/// A session whose T-shirt has texture coordinates: each vertex of its file in a cell of its own.
fn session_with_coordinates(dir: &Path) -> (std::path::PathBuf, RawMesh) {
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/1-tshirt.ply");
    let mut file = read_ply(std::fs::File::open(&scan).unwrap()).unwrap();
    let side = (file.points.len() as f64).sqrt().ceil() as usize;
    let cell = |k: usize| (k as f64 + 0.5) / side as f64;
    file.uvs = Some((0..file.points.len()).map(|k| [cell(k % side), cell(k / side)]).collect());
    let out = std::fs::File::create(dir.join("atlas.ply")).unwrap();
    write_ply(&file, &PlyOptions::default(), out).unwrap();
    let session = quick_session(dir, "alice");
    let recipe = std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    let atlas = dir.join("atlas.ply").display().to_string();
    std::fs::write(session.join("recipe.toml"), recipe.replace(&scan.display().to_string(), &atlas)).unwrap();
    overcoat_ok(&session, &["build"]);
    (session, file)
}

#[test]
fn a_picture_over_texture_coordinates_is_written_painted_and_read() {
    let dir = tempfile::tempdir().unwrap();
    let (session, file) = session_with_coordinates(dir.path());
    let measures = || {
        let status = overcoat_ok(&session, &["status", "--json"]).json();
        let stages = status["steps"][1]["up_to_date"].as_array().unwrap().clone();
        let of = |name: &str| stages.iter().find(|s| s["stage"] == "segment").unwrap()["measures"][name].as_f64();
        (of("garment_vertices").unwrap(), of("by_hand_vertices"))
    };
    let before = measures().0;
    overcoat_ok(&session, &["mask", "tshirt", "--template", "found.png"]);
    // Unpainted, it contains the current labels.
    overcoat_ok(&session, &["mask", "tshirt", "found.png"]);
    overcoat_ok(&session, &["build"]);
    assert_eq!(measures(), (before, Some(0.0)));

    // Black over a spot of 7 cm on the chest: the mesh is coarse.
    let uvs = file.uvs.as_ref().unwrap();
    let front = file.points.iter().filter(|p| (1.2..1.3).contains(&p[1]) && p[0].abs() < 0.05);
    let chest = *front.max_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    let bytes = std::fs::read(session.join("found.png")).unwrap();
    let mut picture = read_rgba_png(bytes.as_slice()).unwrap();
    for (p, uv) in file.points.iter().zip(uvs) {
        if (Point::from(*p) - Point::from(chest)).norm() < 0.07 {
            picture.set_nearest(uv[0], 1.0 - uv[1], [0, 0, 0, 255]);
        }
    }
    picture.write_png(std::fs::File::create(session.join("found.png")).unwrap()).unwrap();
    overcoat_ok(&session, &["mask", "tshirt", "found.png"]);
    overcoat_ok(&session, &["build"]);
    let (after, by_hand) = measures();
    assert!(by_hand > Some(5.0) && after < before - 4.0, "{before} {after} {by_hand:?}");
    let status = overcoat_ok(&session, &["status", "--json"]).stdout;
    assert!(status.contains("1 hole made by hand"), "{status}");
}

#[test]
fn a_picture_for_a_scan_without_texture_coordinates_is_refused_and_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let session = body_of_demo(dir.path());
    let plain = write_mesh(dir.path().join("plain.ply"), &demo_mesh("1-tshirt.ply"));
    overcoat_ok(&session, &["scan", "tshirt", plain.to_str().unwrap(), "--template", "tshirt"]);
    overcoat_ok(&session, &["build"]);
    let answer = overcoat(&session, &["mask", "tshirt", "--template", "found.png"]);
    assert_eq!(answer.code, 1, "{answer:?}");
    let says = "plain.ply': the scan has no texture coordinates, so a picture cannot be placed on it";
    assert!(answer.stderr.contains(says) && answer.stderr.lines().count() == 2, "{answer:?}");
    assert!(!session.join("found.png").exists());
}

#[test]
fn labels_are_a_truth_too_also_those_of_several_classes() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let path = session.join("true.npy");
    let write =
        |numbers: Vec<i32>| write_npy(&NpyArray::vector(numbers), std::fs::File::create(&path).unwrap()).unwrap();
    overcoat_ok(&session, &["mask", "tshirt", "--template", "found.npy"]);
    let found = read_npy(std::fs::read(session.join("found.npy")).unwrap().as_slice()).unwrap();
    let found: Vec<i32> = found.to_f64("labels").unwrap().into_iter().map(|label| label as i32).collect();
    let measured = |classes: &[&str]| {
        let args = [&["measure", "--labels", "true.npy", "--layer", "tshirt", "--json"], classes].concat();
        overcoat_ok(&session, &args).json()
    };
    write(found.clone());
    let same = measured(&[]);
    assert_eq!(["iou", "precision", "recall"].map(|name| same[name].as_f64().unwrap()), [1.0; 3]);
    assert_eq!(same["vertices"], found.len());

    // Class 3 is the garment, 7 all else; a quarter of the garment is said to be something else, 100 vertices have no label.
    let garment: Vec<usize> = (0..found.len()).filter(|&v| found[v] == 1).collect();
    let mut classes: Vec<i32> = found.iter().map(|&label| if label == 1 { 3 } else { 7 }).collect();
    garment.iter().step_by(4).for_each(|&v| classes[v] = 5);
    garment.iter().skip(1).step_by(4).take(100).for_each(|&v| classes[v] = -1);
    write(classes);
    let differs = measured(&["--class", "3"]);
    let (other, left) = (garment.len().div_ceil(4), garment.len() - 100);
    let share = (left - other) as f64 / left as f64;
    assert!((differs["iou"].as_f64().unwrap() - share).abs() < 1e-12, "{differs} {share}");
    assert_eq!((&differs["precision"], &differs["recall"]), (&differs["iou"], &1.0.into()));
    assert_eq!(differs["vertices"], found.len() - 100);
    let both = measured(&["--class", "3,5"]);
    assert_eq!(both["iou"], 1.0);

    for (args, says) in [
        (&["measure", "--labels", "true.npy", "--layer", "tshirt", "--class", "4"][..], "has the class 4"),
        (&["measure", "--labels", "true.npy", "--layer", "tshirt"], "label"),
        (&["measure", "--labels", "true.npy"], "--layer"),
        (&["measure", "--labels", "true.npy", "--layer", "coat"], "there is no step 'coat'"),
        (&["measure", "--labels", "true.npy", "--layer", "body"], "body"),
        (&["measure"], "--truth"),
    ] {
        let answer = overcoat(&session, args);
        assert!(matches!(answer.code, 1 | 2) && answer.stderr.contains(says), "{args:?} {answer:?}");
    }
}
