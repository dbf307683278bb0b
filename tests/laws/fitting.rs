//! Fitting: a body made by the model is found again, from any heading and with any number of threads.

use nalgebra::UnitQuaternion;
use overcoat::body::HumanJoint::{Foot, Hand, Head, Toes, UpperArm};
use overcoat::body::{BodyModel, Figure, JointId, Layer, Pose, Shape, Side, embedded_model, skin};
use overcoat::fit::{Cover, InsideParams, NakedParams, RegisterParams, fit_inside, fit_naked, register};
use overcoat::geometry::{PerVertex, Point, TriMesh, Vec3};
use overcoat::scan::Scan;

/// A body of the model's own family, somewhere, in a pose a few degrees off.
fn posed(model: &BodyModel, heading: f64, arms: f64) -> (TriMesh, Vec<Point>) {
    let (mesh, skeleton) = model.shaped(&Shape(vec![0.8, -0.6, 0.7, 0.3]));
    let mut pose = Pose::bind(skeleton.len());
    pose.translation = Vec3::new(0.4, 0.02, -0.3);
    pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), heading);
    for side in Side::BOTH {
        let j = skeleton.find(UpperArm(side)).expect("a humanoid");
        pose.rotations[j.index()] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), side.sign() * arms);
    }
    let points = skin(mesh.points(), &model.weights, &skeleton, &pose);
    (mesh.with_points(points), skeleton.joints_in_world(&pose))
}

fn fitted_joint_error(model: &BodyModel, heading: f64, arms: f64) -> f64 {
    let (mesh, joints) = posed(model, heading, arms);
    let fit =
        fit_naked(&Scan::from_clean_mesh(mesh, None), model, &NakedParams::default(), &mut |_| {}).expect("a fit");
    let found = fit.skeleton.joints_in_world(&fit.pose);
    joints.iter().zip(&found).map(|(a, b)| (a - b).norm()).sum::<f64>() / joints.len() as f64
}

#[test]
fn a_body_of_the_family_is_found_from_any_heading_and_arm_spread() {
    let model = embedded_model().unwrap();
    for (heading, arms) in [(0.0, 0.0), (2.2, 0.45), (-1.3, -0.45)] {
        let error = fitted_joint_error(&model, heading, arms);
        assert!(error < 0.015, "heading {heading}, arms {arms}: joints {:.1} mm off", error * 1e3);
    }
}

#[test]
fn one_thread_and_many_fit_the_same_bits() {
    let model = embedded_model().unwrap();
    let (mesh, _) = posed(&model, 0.3, 0.1);
    let scan = Scan::from_clean_mesh(mesh, None);
    let params = NakedParams { samples: 1500, iterations: 4, ..NakedParams::default() };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let fit = fit_naked(&scan, &model, &params, &mut |_| {}).expect("a fit");
            let body = register(&scan, &model, &fit, &RegisterParams::default(), &mut |_| {}).expect("a surface");
            (fit, body)
        })
    };
    assert!(with(1) == with(3));
}

/// A body, and itself grown by `ease` along its normals where it is covered: cloth as even as can be.
fn dressed(model: &BodyModel, ease: f64, cover: &PerVertex<Cover>) -> (Figure, Pose, Scan) {
    let (mesh, skeleton) = model.shaped(&model.mean_shape());
    let figure = Figure {
        skeleton: skeleton.clone(),
        layers: vec![Layer {
            name: "body".into(),
            template: None,
            mesh: mesh.clone(),
            weights: model.weights.clone(),
            colors: None,
            is_seen: None,
            uvs: None,
            physics: None,
            fabric: None,
        }],
    };
    let normals = mesh.vertex_normals();
    let grown: PerVertex<Point> = mesh
        .points()
        .iter()
        .zip(normals.iter())
        .zip(cover.iter())
        .map(|((p, n), c)| if *c == Cover::Bare { *p } else { p + n * ease })
        .collect();
    (figure, Pose::bind(skeleton.len()), Scan::from_clean_mesh(mesh.with_points(grown), None))
}

fn tight_everywhere_but_head_and_hands(model: &BodyModel) -> PerVertex<Cover> {
    let skeleton = &model.skeleton;
    let is_bare = |joint: JointId| {
        skeleton.is_finger(joint) || matches!(skeleton.human_joint(joint), Some(Head | Hand(_) | Foot(_) | Toes(_)))
    };
    let bare: Vec<bool> = skeleton.ids().map(is_bare).collect();
    model.weights.rows().iter().map(|r| if bare[r[0].0.index()] { Cover::Bare } else { Cover::Tight }).collect()
}

#[test]
fn under_cloth_the_body_is_inside_and_a_scan_that_is_too_small_is_reported() {
    let model = embedded_model().unwrap();
    let cover = tight_everywhere_but_head_and_hands(&model);
    let run = |ease: f64| {
        let (figure, start, scan) = dressed(&model, ease, &cover);
        fit_inside(&scan, &figure, &start, &cover, &model.limits, &InsideParams::default(), &mut |_| {})
            .expect("a pose")
    };
    let roomy = run(0.006);
    assert!(roomy.report.outside_share < 0.002, "{:?}", roomy.report);
    let shrunk = run(-0.012);
    assert!(shrunk.report.outside_share > 0.3 && shrunk.report.outside_depth > 0.004, "{:?}", shrunk.report);
    assert!(shrunk.offsets.iter().all(|o| *o >= -0.006 - 1e-9), "the offset stays bounded");
}
