//! Synthetic files of the SMPL family in the published layouts, read and used in the whole pipeline.

mod layout;

use crate::common::{overcoat, overcoat_ok, write_mesh};
use layout::{Kin, smpl_like, smpl_of};
use nalgebra::UnitQuaternion;
use overcoat::body::HumanJoint::{Hand, LowerArm, UpperArm};
use overcoat::body::Side::{Left, Right};
use overcoat::body::{BodyModel, HumanJoint, Pose, Shape, Side, embedded_model, read_model, skin, unskin};
use overcoat::fit::{NakedParams, fit_naked};
use overcoat::formats::{MeshKind, Npz, NpzCompression, RawMesh, SmplMotion, read_mesh, write_npz};
use overcoat::geometry::{PerVertex, Point, TriMesh, Vec3};
use overcoat::scan::Scan;
use std::path::Path;

fn bytes_of(npz: &Npz) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    write_npz(npz, NpzCompression::Stored, &mut bytes).unwrap();
    bytes.into_inner()
}

fn read(npz: &Npz) -> BodyModel {
    read_model(std::io::Cursor::new(bytes_of(npz))).unwrap()
}

#[test]
fn smpl_and_star_files_are_read_with_their_corrective_offsets() {
    let turned = |model: &BodyModel| {
        // The last joint in SMPL's order: a finger joint that moves no vertex, but the correction.
        let mut pose = Pose::bind(24);
        pose.rotations[23] = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4);
        let bind = model.posed(model.template.points(), &model.skeleton, &Pose::bind(24));
        let posed = model.posed(model.template.points(), &model.skeleton, &pose);
        (posed.0[29] - bind.0[29]).y
    };
    let smpl = read(&smpl_like(9 * 23));
    assert_eq!(smpl.skeleton.names[16], UpperArm(Left).name());
    assert_eq!((smpl.component_count(), smpl.weights.rows().0[29][0].0.index()), (10, 16));
    // Feature 206 is R(2, 2) − 1 of joint 23, which a turn about z leaves at 0; about x it is cos − 1.
    assert!(turned(&smpl).abs() < 1e-12);
    let star = read(&smpl_like(4 * 23));
    assert!((turned(&star) - 0.5 * (0.2f64.cos() - 1.0)).abs() < 1e-9, "w − 1 of the quaternion");
    // STAR's own files have one feature more, times the second shape coordinate.
    let by_mass = read(&smpl_like(4 * 23 + 1));
    let mut shape = by_mass.mean_shape();
    shape.0[1] = 1.0;
    let lifted = by_mass.shaped(&shape).0.points().0[29].y - by_mass.template.points().0[29].y;
    assert!((lifted - 0.51).abs() < 1e-6, "{lifted}");
    assert!(turned(&by_mass).abs() < 1e-12);
}

#[test]
fn each_kind_is_read_with_its_own_joints_components_and_offsets() {
    for kin in [Kin::SMPL, Kin::SMPL_H, Kin::SMPL_X, Kin::SMPL_X_OLD, Kin::STAR] {
        let model = read(&kin.published(60));
        let names = &model.skeleton.names;
        assert_eq!(model.skeleton.len(), kin.joints, "{kin:?}");
        assert!(HumanJoint::BODY.iter().all(|j| names.iter().any(|m| m == j.name())), "{kin:?}: {names:?}");
        assert_eq!(model.component_count(), kin.shape_dirs.min(15).min(if kin.shape_dirs == 20 { 10 } else { 15 }));
        let per_joint = if kin == Kin::STAR { 4 } else { 9 };
        let dirs = model.weights.pose_dirs().unwrap();
        assert_eq!(dirs.feature_count(), per_joint * (kin.joints - 1), "{kin:?}");
        assert_eq!(model.uvs.is_some(), kin.joints == 55, "SMPL-X alone has texture coordinates");
        if kin.joints > 24 {
            let tip = model.skeleton.find_name("rightThumbDistal").unwrap();
            let hand = model.skeleton.find(Hand(Right)).unwrap();
            assert_eq!(tip.index(), kin.joints - 1);
            assert!(model.skeleton.is_below(tip, hand) && !model.skeleton.is_below(hand, tip));
        }
    }
}

fn turned(model: &BodyModel, turns: &[(HumanJoint, [f64; 3])]) -> Pose {
    let mut pose = Pose::bind(model.skeleton.len());
    for &(joint, [x, y, z]) in turns {
        let j = model.skeleton.find(joint).unwrap();
        pose.rotations[j.index()] =
            nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(x, y, z) * std::f64::consts::PI / 180.0);
    }
    pose
}

/// Mean distance, in metres, of vertices near the shoulders: where the offsets of the made-up model are largest.
fn off_at_the_shoulders(model: &BodyModel, found: &PerVertex<Point>, truth: &PerVertex<Point>) -> f64 {
    let joints = &model.skeleton;
    let shoulders = Side::BOTH.map(|side| joints.joints_in_bind[joints.find(UpperArm(side)).unwrap().index()]);
    let near = |p: &Point| shoulders.iter().any(|shoulder| (shoulder - p).norm() < 0.10);
    let of: Vec<f64> = model
        .template
        .points()
        .enumerate()
        .filter(|(_, p)| near(p))
        .map(|(v, _)| (found[v] - truth[v]).norm())
        .collect();
    of.iter().sum::<f64>() / of.len() as f64
}

/// Mean distance of the vertices near a shoulder from its joint, in metres: how swollen it is, wherever the arm points.
fn thickness(model: &BodyModel, points: &PerVertex<Point>, joints: [Point; 2]) -> f64 {
    let skeleton = &model.skeleton;
    let mut distances = Vec::new();
    for (side, joint) in Side::BOTH.into_iter().zip(joints) {
        let in_bind = skeleton.joints_in_bind[skeleton.find(UpperArm(side)).unwrap().index()];
        let near = model.template.points().enumerate().filter(|(_, p)| (in_bind - *p).norm() < 0.08);
        distances.extend(near.map(|(v, _)| (points[v] - joint).norm()));
    }
    distances.iter().sum::<f64>() / distances.len() as f64
}

fn as_file(mesh: &TriMesh) -> RawMesh {
    RawMesh {
        points: mesh.points().iter().map(|p| p.coords.into()).collect(),
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        ..RawMesh::default()
    }
}

fn read_ply(path: &Path) -> PerVertex<Point> {
    let raw = read_mesh(MeshKind::Ply, std::io::Cursor::new(std::fs::read(path).unwrap())).unwrap();
    raw.points.iter().copied().map(Point::from).collect()
}

/// Somebody made by a T-posed model of 24 joints whose shoulders swell as the arms sink; a bare scan, and one with a
/// shirt and the arms held otherwise.
#[test]
fn corrective_offsets_are_honoured_from_the_naked_fit_to_the_dressed_figure() {
    let file = smpl_of(&embedded_model().unwrap());
    let model = read(&file);
    let shape = Shape((0..model.component_count()).map(|k| if k < 4 { 0.6 - 0.3 * k as f64 } else { 0.0 }).collect());
    let (mesh, skeleton) = model.shaped(&shape);
    let posed = |sink: f64| {
        let pose = turned(
            &model,
            &[
                (UpperArm(Left), [0.0, 0.0, -sink]),
                (UpperArm(Right), [0.0, 0.0, sink]),
                (LowerArm(Left), [0.0, -15.0, 0.0]),
                (LowerArm(Right), [0.0, 15.0, 0.0]),
            ],
        );
        (mesh.with_points(model.posed(mesh.points(), &skeleton, &pose)), pose)
    };
    let (naked, naked_pose) = posed(55.0);
    let (below, dressed_pose) = posed(25.0);
    let cloth = layout::shirt_over(&model, &below, &skeleton.joints_in_world(&dressed_pose));

    // The same file without its offsets explains the same scan worse, just where they are.
    let scan = Scan::from_clean_mesh(naked.clone(), None);
    let fitted_off = |model: &BodyModel| {
        let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {}).unwrap();
        let posed = model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
        off_at_the_shoulders(model, &posed, naked.points())
    };
    let mut rigid = Npz::new();
    for name in file.names().filter(|n| *n != "posedirs") {
        rigid.insert(name, file.get(name).unwrap().clone());
    }
    let (with, without) = (fitted_off(&model), fitted_off(&read(&rigid)));
    assert!(with < 0.003 && with < 0.5 * without, "{with:.4} m with, {without:.4} m without");

    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("smpl.npz"), bytes_of(&file)).unwrap();
    write_mesh(here.join("0.ply"), &as_file(&naked));
    write_mesh(here.join("1.ply"), &as_file(&cloth));
    overcoat_ok(here, &["new", "s", "--body", "smpl.npz"]);
    let session = here.join("s");
    overcoat_ok(&session, &["scan", "body", "../0.ply"]);
    overcoat_ok(&session, &["scan", "tshirt", "../1.ply", "--template", "tshirt"]);
    overcoat_ok(&session, &["build"]);
    let exported = |args: &[&str], file: &str| {
        overcoat_ok(&session, &[&["export", "out/"], args].concat());
        let points = read_ply(&session.join("out").join(file));
        std::fs::remove_dir_all(session.join("out")).unwrap();
        points
    };
    let fit = off_at_the_shoulders(&model, &exported(&["--at", "body", "--stage", "fit"], "body.ply"), naked.points());
    assert!((fit - with).abs() < 1e-3, "{fit:.4} m exported, {with:.4} m fitted");
    let registered = off_at_the_shoulders(&model, &exported(&["--at", "body"], "body.ply"), naked.points());
    assert!(registered < 0.002, "{registered:.4} m");
    // Under the shirt's sleeves the arms are 30° higher, and the shoulders swell half as much. A figure that gave way no
    // more would keep the swelling of the naked scan.
    let rigid = model.weights.clone().rigid();
    let in_bind = unskin(naked.points(), &rigid, &skeleton, &naked_pose);
    let stiff = skin(&in_bind, &rigid, &skeleton, &dressed_pose);
    overcoat_ok(&session, &["export", "worn/", "--at", "tshirt"]);
    let worn = read_ply(&session.join("worn/body.ply"));
    let joints: serde_json::Value =
        serde_json::from_slice(&std::fs::read(session.join("worn/joints.json")).unwrap()).unwrap();
    let shoulder = |side| Point::from([0, 1, 2].map(|c| joints[UpperArm(side).name()][c].as_f64().unwrap()));
    let girth = thickness(&model, &worn, Side::BOTH.map(shoulder));
    let in_truth = skeleton.joints_in_world(&dressed_pose);
    let of_truth = Side::BOTH.map(|side| in_truth[skeleton.find(UpperArm(side)).unwrap().index()]);
    let (truth, stiff) = (thickness(&model, below.points(), of_truth), thickness(&model, &stiff, of_truth));
    assert!(
        (girth - truth).abs() < 0.4 * (stiff - truth),
        "{girth:.4} m around the shoulder, {truth:.4} m in truth, {stiff:.4} m for a figure that does not give way"
    );
    overcoat_ok(&session, &["export", "figure.glb"]);
    parameters_reproduce_the_body(&model, &session);
}

/// What another program makes of the exported parameters with the same model is the exported body; as a clip the file moves
/// the figure as the clip did.
fn parameters_reproduce_the_body(model: &BodyModel, session: &Path) {
    let exported = |file: &str| {
        overcoat_ok(session, &["export", file]);
        SmplMotion::read(&std::fs::read(session.join(file)).unwrap()).unwrap()
    };
    assert_eq!((exported("still.npz").rotations.len(), exported("still.npz").fps), (1, None));
    overcoat_ok(session, &["animate", "walk", "--frames", "60..75", "--mode", "lbs"]);
    let walk = exported("walk.npz");
    assert_eq!((walk.rotations.len(), walk.rotations[0].len(), walk.fps), (15, 24, Some(30.0)));
    let (mesh, skeleton) = model.shaped(&Shape(walk.betas.clone()));
    overcoat_ok(session, &["export", "frames/", "--sequence", "ply"]);
    let folders: Vec<_> = std::fs::read_dir(session.join("frames")).unwrap().map(|e| e.unwrap().path()).collect();
    let lead = folders.iter().filter(|path| path.is_dir()).count() - 15;
    let y_up = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -std::f64::consts::FRAC_PI_2);
    for frame in [0, 14] {
        let rotations =
            walk.rotations[frame].iter().map(|r| UnitQuaternion::from_scaled_axis(Vec3::from(*r))).collect();
        let pose = Pose { translation: Vec3::from(walk.translations[frame]), rotations };
        let ours = model.posed(mesh.points(), &skeleton, &pose);
        let folder = folders.iter().find(|f| f.ends_with(format!("{:04}", lead + frame))).unwrap();
        let theirs = read_ply(&folder.join("body.ply"));
        let off = |(a, b): (&Point, &Point)| (y_up * a - b).norm();
        let mean = ours.iter().zip(theirs.iter()).map(off).sum::<f64>() / ours.len() as f64;
        assert!(mean < 0.002, "frame {frame}: {mean:.4} m");
    }
    overcoat_ok(session, &["animate", "walk.npz", "--name", "again", "--mode", "lbs"]);
    let again = exported("again.npz");
    assert_eq!(again.rotations.len(), 15);
    let turn = |(a, b): (&[f64; 3], &[f64; 3])| {
        let [a, b] = [a, b].map(|r| UnitQuaternion::from_scaled_axis(Vec3::from(*r)));
        a.angle_to(&b).to_degrees()
    };
    let turns = walk.rotations.concat().iter().zip(&again.rotations.concat()).map(turn).collect::<Vec<_>>();
    let worst = (0..turns.len()).max_by(|&a, &b| turns[a].total_cmp(&turns[b])).unwrap();
    // Feet are planted again, and the trunk's bend is shared out anew.
    assert!(turns[worst] < 10.0, "{:.1}° at joint {}", turns[worst], worst % 24);
    assert!(turns.iter().sum::<f64>() / (turns.len() as f64) < 2.0, "{turns:?}");
    let refusal = overcoat(session, &["export", "layers.npz", "--layers", "body"]);
    assert!(refusal.code == 2 && refusal.stderr.contains("--layers changes nothing"), "{refusal:?}");
}
