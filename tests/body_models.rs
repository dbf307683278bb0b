//! Building, measuring and refusing body models, through the calls that `overcoat body` makes.

#[path = "../examples/shared/embedded_body.rs"]
mod embedded_body;

use crate::common::{mean_body, overcoat, overcoat_ok, write_mesh};
use overcoat::body::HumanJoint::{Hips, UpperArm, UpperLeg};
use overcoat::body::Side::{Left, Right};
use overcoat::body::{BodyModel, Pose, Shape, embedded_model, read_model};
use overcoat::cli::bodies::{BodiesError, BuildBody, BuiltBody, ShowBody, build_body, model_measures, show_body};
use overcoat::formats::{NpyArray, Npz, NpzCompression, write_npz};
use overcoat::geometry::{Point, TriMesh};
use overcoat::session::Outputs;
use overcoat::train::{BuildParams, TrainParams};
use std::path::{Path, PathBuf};

/// The `k`-th synthetic adult: shape within 1.5 standard deviations, arms and legs in a slightly different pose each time.
fn body(model: &BodyModel, k: usize) -> TriMesh {
    let wave = |f: f64| (f * (k as f64 + 1.0)).sin();
    let shape = Shape((0..model.component_count()).map(|c| 1.5 * wave(1.3 + 0.7 * c as f64)).collect());
    let (mesh, skeleton) = model.shaped(&shape);
    let mut pose = Pose::bind(skeleton.len());
    for (joint, angle) in
        [(UpperArm(Left), 0.2 * wave(2.1)), (UpperArm(Right), 0.2 * wave(3.7)), (UpperLeg(Left), 0.1 * wave(5.3))]
    {
        let j = skeleton.find(joint).unwrap();
        pose.rotations[j.index()] = nalgebra::UnitQuaternion::from_euler_angles(0.5 * angle, 0.0, angle);
    }
    mesh.with_points(model.posed(mesh.points(), &skeleton, &pose))
}

fn stacked(bodies: &[TriMesh]) -> Npz {
    let mut npz = Npz::new();
    let vertices: Vec<f32> =
        bodies.iter().flat_map(|b| b.points().iter().flat_map(|p| [p.x as f32, p.y as f32, p.z as f32])).collect();
    npz.insert("vertices", NpyArray::try_new(&[bodies.len(), bodies[0].vertex_count(), 3], vertices).unwrap());
    let faces: Vec<[u32; 3]> = bodies[0].faces().iter().map(|f| f.map(|v| v.0)).collect();
    npz.insert("faces", NpyArray::rows(&faces));
    npz
}

fn write(folder: &Path, name: &str, npz: &Npz) -> PathBuf {
    let mut bytes = std::io::Cursor::new(Vec::new());
    write_npz(npz, NpzCompression::Stored, &mut bytes).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes.into_inner()).unwrap();
    path
}

fn built(inputs: &[PathBuf], components: usize, leave_out: usize) -> Result<BuiltBody, BodiesError> {
    let train = TrainParams { components, leave_out, ..TrainParams::default() };
    let params = BuildParams { train, ..BuildParams::default() };
    build_body(&BuildBody { inputs: inputs.to_vec(), params, ..BuildBody::default() }, &mut |_| {})
}

fn refused(inputs: &[PathBuf], components: usize) -> String {
    let Err(error) = built(inputs, components, 0) else { panic!("{inputs:?} were taken") };
    assert!(error.hint().is_some(), "{error}");
    let text = error.to_string();
    assert!(!text.contains('\n'), "one sentence: {text}");
    text
}

#[test]
fn a_model_trained_on_posed_bodies_reproduces_the_held_out_ones() {
    let model = embedded_model().unwrap();
    let bodies: Vec<TriMesh> = (0..36).map(|k| body(&model, k)).collect();
    let folder = tempfile::tempdir().unwrap();
    let input = write(folder.path(), "bodies.npz", &stacked(&bodies));
    let built = built(&[input], 15, 6).unwrap();
    let left = built.trained.left_out.clone().unwrap();
    assert_eq!((built.trained.bodies, left.bodies), (30, 6));
    // The family has 15 components; what is left is what posture adds.
    assert!(left.vertex_mean < 0.003, "{left:?}");
    assert!(left.joint_mean < 0.008, "{left:?}");
    assert!(built.trained.explained.is_sorted() && built.trained.explained[14] > 0.98);

    let out = folder.path().join("model.npz");
    built.write(&out, &mut Outputs::without_session(folder.path(), false)).unwrap();
    let again = read_model(std::fs::File::open(&out).unwrap()).unwrap();
    assert_eq!(again.component_count(), 15);
    assert_eq!(again.skeleton.names, model.skeleton.names);
    assert!(again.uvs.is_some() && again.mirror.is_some(), "the template's own are kept");
    let measures = model_measures(Some(&out), &[]).unwrap();
    let stature = measures.iter().find(|m| m.name == "stature").unwrap().metres;
    assert!((1.5..1.9).contains(&stature), "{stature}");
}

#[test]
fn bodies_of_different_topology_are_refused_in_one_sentence() {
    let model = embedded_model().unwrap();
    let bodies: Vec<TriMesh> = (0..3).map(|k| body(&model, k)).collect();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let good = write(here, "good.npz", &stacked(&bodies));

    let few = refused(std::slice::from_ref(&good), 15);
    assert!(few.contains("15 components need at least 16 bodies") && few.contains("there are 3"), "{few}");

    let fewer_vertices = bodies[0].part(&(0..bodies[0].face_count()).map(|f| f > 100).collect()).0;
    let other = write(here, "other.npz", &stacked(std::slice::from_ref(&fewer_vertices)));
    let text = refused(&[good.clone(), other], 2);
    assert!(text.contains("not of one topology") && text.contains("body 0 of other.npz"), "{text}");

    let turned = write(here, "turned.npz", &stacked(&[bodies[0].flipped()]));
    let text = refused(&[good.clone(), turned], 2);
    assert!(text.contains("faces of body 0 of turned.npz are not those"), "{text}");

    let mut points: Vec<Point> = bodies[0].points().0.clone();
    points.reverse();
    let shuffled = write(here, "shuffled.npz", &stacked(&[bodies[0].with_points(points)]));
    let text = refused(&[good.clone(), shuffled], 2);
    assert!(text.contains("in another order"), "{text}");

    let open: Vec<TriMesh> = bodies.iter().map(|b| b.part(&(0..b.face_count()).map(|f| f > 3).collect()).0).collect();
    let text = refused(&[write(here, "open.npz", &stacked(&open))], 1);
    assert!(text.contains("template is open"), "{text}");

    let mut wrong = stacked(&bodies);
    wrong.insert("joints", NpyArray::try_new(&[2, 1, 3], vec![0f32; 6]).unwrap());
    wrong.insert("joint_names", NpyArray::vector(vec![Hips.name().to_string()]));
    let text = refused(&[write(here, "wrong.npz", &wrong)], 1);
    assert!(text.contains("'joints'") && text.contains("[2, 1, 3]"), "{text}");

    std::fs::create_dir(here.join("empty")).unwrap();
    assert!(refused(&[here.join("empty")], 1).contains("no body in"));
}

/// Raw scans: meshes that share nothing, turned, shifted, in other units, with holes; one has landmarks.
#[test]
fn a_model_is_trained_on_raw_scans_with_holes_and_a_landmark() {
    let model = embedded_model().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for k in 0..3 {
        let whole = body(&model, k);
        // The soles, and a patch of the back, are not seen.
        let floor = whole.bounds().unwrap().min.y;
        let is_seen = |p: &Point| p.y > floor + 0.004 && (p - Point::new(0.0, floor + 1.2, -0.1)).norm() > 0.05;
        let keep = whole.faces().iter().map(|f| f.iter().all(|&v| is_seen(&whole.points()[v])));
        let open = whole.part(&keep.collect()).0;
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.0, 1.1 * k as f64, 0.0);
        let unit = if k == 1 { 1000.0 } else { 1.0 };
        let placed = |p: &Point| (turn * p + nalgebra::Vector3::new(0.3, 0.0, -0.2)) * unit;
        let raw = overcoat::formats::RawMesh {
            points: open.points().iter().map(|p| placed(p).coords.into()).collect(),
            faces: open.faces().iter().map(|f| f.map(|v| v.0)).collect(),
            ..Default::default()
        };
        write_mesh(here.join(format!("{k}.ply")), &raw);
        if k == 2 {
            let nose = placed(&whole.points().0[100]);
            std::fs::write(here.join("2.landmarks.json"), format!("{{\"100\": [{}, {}, {}]}}", nose.x, nose.y, nose.z))
                .unwrap();
        }
    }
    let build = |components| {
        let train = TrainParams { components, ..TrainParams::default() };
        let params = BuildParams { register: true, train, ..BuildParams::default() };
        let asked = BuildBody { inputs: vec![here.to_path_buf()], params, ..BuildBody::default() };
        build_body(&asked, &mut |_| {})
    };
    let built = build(2).unwrap();
    assert!(built.findings[2].contains("by 1 landmark"), "{:?}", built.findings);
    let made = &built.trained.model;
    assert_eq!(made.template.faces(), model.template.faces());
    let mean_stature = (0..3)
        .map(|k| {
            let wave = |f: f64| (f * (k as f64 + 1.0)).sin();
            let shape = Shape((0..15).map(|c| 1.5 * wave(1.3 + 0.7 * c as f64)).collect());
            model.shaped(&shape).0.bounds().unwrap().extent().y / 3.0
        })
        .sum::<f64>();
    let stature = made.template.bounds().unwrap().extent().y;
    assert!((stature - mean_stature).abs() < 0.01, "{stature} m, the scans' mean is {mean_stature} m");

    assert!(build(3).err().unwrap().to_string().contains("at least 4 bodies"));
    assert!(build(0).err().unwrap().to_string().contains("0 components"));
    std::fs::write(here.join("2.landmarks.json"), "{\"9999\": [0, 0, 0]}").unwrap();
    assert!(build(2).err().unwrap().to_string().contains("names vertex 9999, but the template has"));
    std::fs::write(here.join("2.landmarks.json"), "{\"nose\": [0, 0, 0]}").unwrap();
    assert!(build(2).err().unwrap().to_string().contains("'nose' is no vertex"));
}

#[test]
fn models_whose_arrays_disagree_are_refused_with_their_shapes() {
    let npz = embedded_model().unwrap().to_npz().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let said = |change: &dyn Fn(&mut Npz)| {
        let mut wrong = npz.clone();
        change(&mut wrong);
        let path = write(folder.path(), "model.npz", &wrong);
        let Err(error) = show_body(&ShowBody { model: Some(path), ..ShowBody::default() }) else { panic!("taken") };
        error.to_string()
    };
    let text = said(&|n| n.insert("posedirs", NpyArray::try_new(&[2, 3, 7], vec![0f32; 42]).unwrap()));
    assert!(text.contains("'posedirs'") && text.contains("[2, 3, 7]") && text.contains("459"), "{text}");
    let text = said(&|n| n.insert("weights", NpyArray::try_new(&[5, 52], vec![0f32; 260]).unwrap()));
    assert!(text.contains("'weights'") && text.contains("[5, 52]"), "{text}");
    let text = said(&|n| {
        let mut tree: Vec<u32> = std::iter::once(u32::MAX).chain(std::iter::repeat_n(0, 51)).collect();
        tree[4] = 9;
        n.insert(
            "kintree_table",
            NpyArray::try_new(&[2, 52], tree.into_iter().chain(0..52).collect::<Vec<u32>>()).unwrap(),
        );
    });
    assert!(text.contains("joint 4") && text.contains("cycle"), "{text}");

    let pickle = folder.path().join("model.pkl");
    std::fs::write(&pickle, b"\x80\x02}q\x00.").unwrap();
    let Err(error) = show_body(&ShowBody { model: Some(pickle), ..ShowBody::default() }) else { panic!("taken") };
    assert!(error.to_string().contains("pickle") && error.hint().unwrap().contains("savez"), "{error}");
}

#[test]
fn shapes_and_poses_that_the_model_does_not_have_are_refused() {
    let said = |shape: Vec<f64>, pose: &str| {
        let pose = if pose.is_empty() { vec![] } else { vec![pose.to_string()] };
        show_body(&ShowBody { shape, pose, model: None }).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert!(said(vec![0.0; 16], "").contains("16 shape coordinates for a model with 15"));
    assert!(said(vec![], "handstand").contains("no stance 'handstand'"));
    assert!(said(vec![], "tail=0,0,1").contains("no joint 'tail'"));
    assert!(said(vec![], "head=0,0").contains("no turn of head"));
    assert_eq!(said(vec![1.0, -2.0], "arms-up"), "");
}

#[test]
fn the_body_is_the_template_with_a_texture_or_the_scan_itself() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut scan = mean_body(|p| p);
    scan.colors = Some(scan.points.iter().map(|p| [200, (100.0 * p[1]) as u8, 90]).collect());
    write_mesh(here.join("body.ply"), &scan);
    let build = |surface: &str| {
        let session = here.join(surface);
        overcoat_ok(here, &["new", surface]);
        overcoat_ok(&session, &["scan", "body", "../body.ply", "--surface", surface]);
        overcoat_ok(&session, &["build"]);
        overcoat_ok(&session, &["export", "figure.glb"]);
        let glb = std::fs::read(session.join("figure.glb")).unwrap();
        let json = glb[20..].split(|b| *b == 0).next().unwrap_or_default();
        let text = String::from_utf8_lossy(json).into_owned();
        let measured = overcoat_ok(&session, &["body", "measure", "--json"]).json();
        (text, measured["measures_cm"]["stature"].as_f64().unwrap())
    };
    let (template, by_template) = build("template");
    assert!(template.contains("baseColorTexture") && template.contains("TEXCOORD_0"));
    let (scanned, by_scan) = build("scan");
    assert!(scanned.contains("baseColorTexture") && !scanned.contains("COLOR_0"));
    assert!((by_template - by_scan).abs() < 1.0 && (160.0..180.0).contains(&by_scan), "{by_template} {by_scan}");

    overcoat_ok(&here.join("scan"), &["export", "fit/", "--at", "body", "--stage", "fit"]);
    assert!(here.join("scan/fit/body.ply").is_file());
    let answer = overcoat(&here.join("scan"), &["scan", "shirt", "../body.ply", "-t", "shirt", "--surface", "scan"]);
    assert_eq!(answer.code, 2, "{answer:?}");
    assert!(answer.stderr.contains("only the body has a surface to choose"), "{answer:?}");
}

/// Takes about half a minute in release; run it after any change of the mannequin or of the training.
#[test]
#[ignore = "builds the whole model"]
fn generator_reproduces_the_shipped_file() {
    let (trained, adults) = embedded_body::embedded_body(&mut |_, _, _| ()).unwrap();
    for (name, _, most) in &adults.girth_errors {
        assert!(*most < 0.01, "{name} misses what was asked by {most} m");
    }
    let mut bytes = Vec::new();
    write_npz(&trained.model.to_npz().unwrap(), NpzCompression::Deflated, &mut bytes).unwrap();
    let shipped = include_bytes!("../templates/body/adult.npz");
    assert!(bytes == shipped, "run the example build_body_model and commit templates/body/adult.npz");
}

#[test]
fn an_export_that_the_licence_of_the_body_model_forbids_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/templates/body/adult.npz");
    overcoat_ok(
        dir,
        &["body", "import", model, "--out", "strict.npz", "--license", "research only", "--forbid-export", "vrm,.glb"],
    );
    // What is forbidden stays so in a model that is made from it.
    overcoat_ok(dir, &["body", "import", "strict.npz", "--out", "again.npz"]);
    overcoat_ok(dir, &["new", "me", "--body", "again.npz"]);
    let session = dir.join("me");
    for target in ["avatar.vrm", "figure.GLB"] {
        let answer = overcoat(&session, &["export", target]);
        assert_eq!(answer.code, 2, "{answer:?}");
        let errors = &answer.stderr;
        assert!(errors.contains("again.npz") && errors.contains("(research only) forbids"), "{errors}");
        assert!(!session.join(target).exists());
    }
    // Nothing is built yet, which is another matter.
    let answer = overcoat(&session, &["export", "figure.obj"]);
    assert!(!answer.stderr.contains("forbids"), "{answer:?}");
}
