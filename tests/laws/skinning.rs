//! The embedded model, and invariances of skinning.

use nalgebra::UnitQuaternion;
use overcoat::body::{Pose, Shape, bone_positions, embedded_model, skin, unskin};
use overcoat::geometry::{Adjacency, Vec3, self_intersecting_pairs};

fn bent(joints: usize, radians: f64) -> Pose {
    let mut pose = Pose::bind(joints);
    for (j, r) in pose.rotations.iter_mut().enumerate() {
        let t = j as f64;
        *r = UnitQuaternion::from_scaled_axis(Vec3::new((t * 1.7).sin(), (t * 0.9).cos(), (t * 2.3).sin()) * radians);
    }
    pose
}

#[test]
fn weights_sum_to_one_and_name_joints_that_exist() {
    let model = embedded_model().unwrap();
    for row in model.weights.rows().iter() {
        assert!((row.iter().map(|r| r.1).sum::<f64>() - 1.0).abs() < 1e-6);
        assert!(row.iter().all(|(j, w)| j.index() < model.skeleton.len() && *w >= 0.0));
    }
}

#[test]
fn rotating_the_root_rotates_everything() {
    let model = embedded_model().unwrap();
    let (mesh, skeleton) = model.shaped(&Shape(vec![1.0, -1.0, 0.5]));
    let pose = bent(skeleton.len(), 0.2);
    let turn = UnitQuaternion::from_scaled_axis(Vec3::new(0.3, 1.1, -0.4));
    let mut turned = pose.clone();
    turned.rotations[0] = turn * pose.rotations[0];
    let root = skeleton.joints_in_bind[0];
    let (a, b) = (
        skin(mesh.points(), &model.weights, &skeleton, &pose),
        skin(mesh.points(), &model.weights, &skeleton, &turned),
    );
    for (p, q) in a.iter().zip(b.iter()) {
        assert!((root + turn * (p - root) - q).norm() < 1e-9);
    }
}

#[test]
fn unposing_undoes_posing_over_the_whole_body() {
    let model = embedded_model().unwrap();
    let (mesh, skeleton) = model.shaped(&model.mean_shape());
    let pose = bent(skeleton.len(), 0.25);
    let there = skin(mesh.points(), &model.weights, &skeleton, &pose);
    let back = unskin(&there, &model.weights, &skeleton, &pose);
    assert!(mesh.points().iter().zip(back.iter()).all(|(p, q)| (p - q).norm() < 1e-9));
}

#[test]
fn the_embedded_body_is_one_closed_symmetric_surface_seen_from_outside() {
    let model = embedded_model().unwrap();
    let mesh = &model.template;
    let adjacency = Adjacency::prepare(mesh);
    assert!(adjacency.boundary_edges().is_empty());
    assert_eq!(adjacency.face_components().1, 1);
    assert!(mesh.signed_volume() > 0.04, "litres of an adult, in cubic metres: {}", mesh.signed_volume());
    let mirror = model.mirror.as_ref().expect("a mirror map");
    for (v, p) in mesh.points().enumerate() {
        let q = mesh.points()[mirror[v]];
        assert!((p.x + q.x).abs() < 1e-4 && (p.y - q.y).abs() < 1e-4 && (p.z - q.z).abs() < 1e-4);
        assert_eq!(mirror[mirror[v]], v);
    }
    assert!(self_intersecting_pairs(mesh).len() < 20, "{}", self_intersecting_pairs(mesh).len());
}

#[test]
fn every_joint_of_the_mean_body_lies_inside_it() {
    let model = embedded_model().unwrap();
    let field = overcoat::geometry::WindingField::prepare(&model.template);
    for (name, joint) in model.skeleton.names.iter().zip(&model.skeleton.joints_in_bind) {
        assert!(field.winding(joint) > 0.5, "{name} at {joint}");
    }
}

#[test]
fn places_along_bones_are_the_same_left_and_right() {
    let model = embedded_model().unwrap();
    let mirror = model.mirror.as_ref().expect("a mirror map");
    let places = bone_positions(model.template.points(), &model.weights, &model.skeleton);
    let unequal =
        model.template.vertex_ids().filter(|&v| (places[v].along - places[mirror[v]].along).abs() > 0.02).count();
    // On the seam between two parts rounding may choose either.
    assert!(unequal * 100 < model.template.vertex_count(), "{unequal}");
}
