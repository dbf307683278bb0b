//! Chains of a skirt of our own: around it, clear of the legs, at rest where nothing moves.

use super::chains::Capsule;
use super::simulation::SpringSimulation;
use super::{SpringFigure, SpringParams, fitted_springs, with_spring_bones};
use crate::body::{Figure, HumanJoint, JointId, Layer, Pose, Side, Skeleton, SkinWeights};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use nalgebra::UnitQuaternion;

/// A cone around the vertical axis from a height to another; open in front if so requested.
fn cone(top: f64, bottom: f64, radii: [f64; 2], is_open: bool) -> TriMesh {
    const AROUND: u32 = 48;
    const DOWN: u32 = 20;
    let point = |i: u32| {
        let (ring, step) = (i / AROUND, i % AROUND);
        let share = f64::from(ring) / f64::from(DOWN - 1);
        // Half a step: no vertex is between two sectors.
        let angle = (f64::from(step) + 0.5) * std::f64::consts::TAU / f64::from(AROUND);
        let radius = radii[0] + (radii[1] - radii[0]) * share;
        Point::new(radius * angle.sin(), top + (bottom - top) * share, radius * angle.cos())
    };
    let faces: Vec<[u32; 3]> = (0..(DOWN - 1) * AROUND)
        .filter(|i| !is_open || !(i % AROUND < 4 || i % AROUND >= AROUND - 4))
        .flat_map(|i| {
            let next = i / AROUND * AROUND + (i + 1) % AROUND;
            [[i, i + AROUND, next], [next, i + AROUND, next + AROUND]]
        })
        .collect();
    let mesh = TriMesh::try_from_indices((0..DOWN * AROUND).map(point).collect(), &faces).unwrap();
    let keep = mesh.faces().iter().map(|_| true).collect();
    mesh.part(&keep).0
}

fn figure(is_open: bool) -> (Figure, Vec<PerVertex<bool>>) {
    let mut skeleton = Skeleton { names: Vec::new(), parents: Vec::new(), joints_in_bind: Vec::new() };
    let mut joint = |human: HumanJoint, parent: Option<u16>, x: f64, y: f64| {
        skeleton.names.push(human.name().into());
        skeleton.parents.push(parent.map(JointId));
        skeleton.joints_in_bind.push(Point::new(x, y, 0.0));
    };
    joint(HumanJoint::Hips, None, 0.0, 1.0);
    joint(HumanJoint::UpperChest, Some(0), 0.0, 1.4);
    for (k, side) in (0..).zip(Side::BOTH) {
        let x = 0.1 * side.sign();
        joint(HumanJoint::UpperLeg(side), Some(0), x, 0.95);
        joint(HumanJoint::LowerLeg(side), Some(2 + 3 * k), x, 0.5);
        joint(HumanJoint::Foot(side), Some(3 + 3 * k), x, 0.1);
    }
    let follow = |mesh: &TriMesh, joint: fn(&Point) -> u16| {
        SkinWeights::from_rows(mesh.points().iter().map(|p| vec![(JointId(joint(p)), 1.0)]))
    };
    let leg = |side: Side| -> TriMesh {
        let thin = cone(0.95, 0.1, [0.07, 0.05], false);
        thin.map_points(|p| p + Vec3::x() * (0.1 * side.sign()))
    };
    let [left, right] = Side::BOTH.map(leg);
    let points = [left.points().0.as_slice(), right.points().0.as_slice()].concat();
    let further = right.faces().iter().map(|face| face.map(|v| v.0 + left.vertex_count() as u32));
    let faces: Vec<[u32; 3]> = left.faces().iter().map(|face| face.map(|v| v.0)).chain(further).collect();
    let legs = TriMesh::try_from_indices(points, &faces).unwrap();
    let of_leg = |p: &Point| if p.x > 0.0 { 2 } else { 5 } + u16::from(p.y < 0.5);
    let of_leg: fn(&Point) -> u16 = of_leg;
    let body = Layer::plain("body", legs.clone(), follow(&legs, of_leg));
    let skirt = cone(1.0, 0.45, [0.17, 0.3], is_open);
    let weights = follow(&skirt, |p| if p.x > 0.0 { 2 } else { 5 });
    let loose = vec![PerVertex::filled(false, legs.vertex_count()), skirt.points().iter().map(|p| p.y < 0.9).collect()];
    let skirt = Layer::plain("skirt", skirt, weights);
    (Figure { skeleton, layers: vec![body, skirt] }, loose)
}

fn of(is_open: bool) -> SpringFigure {
    let (figure, loose) = figure(is_open);
    with_spring_bones(&figure, &loose, 1.0)
}

/// Where the joints of all chains are in a pose, without the first of each.
fn tails_in(rigged: &SpringFigure, pose: &Pose) -> Vec<Point> {
    let joints = rigged.figure.skeleton.joints_in_world(pose);
    rigged.chains.iter().flat_map(|chain| chain.joints[1..].iter().map(|j| joints[j.index()])).collect()
}

/// The figure with the left thigh raised so far.
fn raised(rigged: &SpringFigure, angle: f64) -> Pose {
    let mut pose = Pose::bind(rigged.figure.skeleton.len());
    pose.rotations[2] = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -angle);
    pose
}

#[test]
fn chains_go_around_a_skirt_from_top_to_hem_and_leave_an_opening_out() {
    let (closed, open) = (of(false), of(true));
    assert_eq!(closed.chains.len(), 12);
    assert_eq!(open.chains.len(), 11);
    let skeleton = &closed.figure.skeleton;
    for chain in &closed.chains {
        let heights: Vec<f64> = chain.joints.iter().map(|j| skeleton.joints_in_bind[j.index()].y).collect();
        assert!(heights.windows(2).all(|pair| pair[0] > pair[1] + 0.1), "{heights:?}");
        assert_eq!(skeleton.parents[chain.joints[0].index()], Some(JointId(0)));
        assert!(chain.joints.windows(2).all(|pair| skeleton.parents[pair[1].index()] == Some(pair[0])));
    }
    assert_eq!(closed.capsules.len(), 4);
}

#[test]
fn the_bind_pose_and_what_is_not_loose_stay() {
    let (before, loose) = figure(false);
    let after = of(false).figure;
    let rest = Pose::bind(after.skeleton.len());
    for (layer, mesh) in before.layers.iter().zip(after.posed(&rest)) {
        let moves = layer.mesh.points().iter().zip(mesh.points().iter()).map(|(p, q)| (p - q).norm());
        assert!(moves.fold(0.0, f64::max) < 1e-12);
    }
    let rows = before.layers[1].weights.rows().iter().zip(after.layers[1].weights.rows().iter());
    for ((old, new), is_loose) in rows.zip(loose[1].iter()) {
        assert!((new.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-9);
        assert!(*is_loose || old == new);
    }
    // The hem follows no leg.
    let hem = before.layers[1].mesh.points().iter().position(|p| p.y < 0.46).unwrap();
    assert!(after.layers[1].weights.rows().0[hem].iter().all(|&(j, w)| j.index() >= 8 || w == 0.0));
}

#[test]
fn chains_at_rest_stay_and_swing_back_where_they_were() {
    let rigged = of(false);
    let skeleton = &rigged.figure.skeleton;
    let rest = Pose::bind(skeleton.len());
    let at_rest = tails_in(&rigged, &rest);
    let mut simulation = SpringSimulation::at_rest(&rigged, SpringParams::default(), &rest);
    let moves = |pose: &Pose| {
        let tails = tails_in(&rigged, pose);
        tails.iter().zip(&at_rest).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
    };
    assert!(moves(&simulation.step(&rest, 1.0 / 60.0)) < 1e-9);
    let pushed = (1..=20).map(|k| moves(&simulation.step(&raised(&rigged, 0.04 * f64::from(k)), 1.0 / 60.0)));
    let pushed = pushed.fold(0.0, f64::max);
    assert!(pushed > 0.03, "the thigh pushes the front: {pushed}");
    let mut last = rest.clone();
    for _ in 0..240 {
        last = simulation.step(&rest, 1.0 / 60.0);
    }
    assert!(moves(&last) < 1e-3, "{}", moves(&last));
}

#[test]
fn tails_stay_out_of_the_legs_and_bones_keep_their_lengths() {
    let rigged = of(false);
    let skeleton = &rigged.figure.skeleton;
    let mut simulation = SpringSimulation::at_rest(&rigged, SpringParams::default(), &Pose::bind(skeleton.len()));
    for k in 0..30 {
        let pose = simulation.step(&raised(&rigged, 0.03 * f64::from(k)), 1.0 / 60.0);
        let frames = skeleton.world_from_bind(&pose);
        let joints = skeleton.joints_in_world(&pose);
        for chain in &rigged.chains {
            for pair in chain.joints.windows(2) {
                let [head, tail] = [pair[0], pair[1]].map(|j| j.index());
                let length = (skeleton.joints_in_bind[tail] - skeleton.joints_in_bind[head]).norm();
                assert!(((joints[tail] - joints[head]).norm() - length).abs() < 1e-9);
            }
        }
        let depth = |p: &Point| {
            let depth = |capsule: &Capsule| {
                let ends = capsule.ends.map(|p| frames[capsule.joint.index()] * p);
                capsule.radius - (p - super::chains::nearest_on_segment(p, &ends)).norm()
            };
            rigged.capsules.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)
        };
        let deepest = tails_in(&rigged, &pose).iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
        // Two capsules in turn, and the bone's length after them: a little remains.
        assert!(deepest < 0.01, "{deepest} at {k}");
    }
}

#[test]
fn a_part_of_the_motion_stays_with_the_legs() {
    let (mut figure, loose) = figure(false);
    figure.layers[1].physics = Some(PerVertex::filled(0.25, loose[1].len()));
    let half = with_spring_bones(&figure, &loose, 1.0).figure;
    let hem = figure.layers[1].mesh.points().iter().position(|p| p.y < 0.46).unwrap();
    let of_legs: f64 = half.layers[1].weights.rows().0[hem].iter().filter(|(j, _)| j.index() < 8).map(|(_, w)| w).sum();
    assert!((of_legs - 0.5).abs() < 1e-9, "{of_legs}");
}

#[test]
fn the_springs_that_moved_cloth_are_found_again() {
    let (figure, loose) = figure(false);
    let rigged = with_spring_bones(&figure, &loose, 0.5);
    let skeleton = &rigged.figure.skeleton;
    let swaying = |k: i32| {
        let mut pose = raised(&rigged, 0.2);
        pose.translation = Vec3::new((f64::from(k) * 0.35).sin(), 0.0, (f64::from(k) * 0.23).cos()) * 0.25;
        pose
    };
    let poses: Vec<Pose> = (0..60).map(swaying).collect();
    let truth = SpringParams { share: 0.5, stiffness: 0.5, drag: 0.25, ..SpringParams::default() };
    let mut simulation = SpringSimulation::at_rest(&rigged, truth, &poses[0]);
    let moved: Vec<Pose> = (0..poses.len())
        .map(|k| {
            let before = &poses[k.saturating_sub(1)];
            simulation.step(&before.toward(&poses[k], 0.5), 1.0 / 60.0);
            simulation.step(&poses[k], 1.0 / 60.0)
        })
        .collect();
    let frames = |rank: usize| -> Vec<PerVertex<Point>> {
        let layer = &rigged.figure.layers[rank];
        moved.iter().map(|pose| layer.posed(skeleton, pose).points().clone()).collect()
    };
    let own = |pose: &Pose| Pose { rotations: pose.rotations[..8].to_vec(), translation: pose.translation };
    let own: Vec<Pose> = poses.iter().map(own).collect();
    let found = fitted_springs(&figure, &loose, &own, 30.0, &[frames(0), frames(1)]).unwrap();
    assert_eq!(found.params, truth, "{found:?}");
    assert!(found.mean_distance < 1e-6 && found.skinned_distance > 0.005, "{found:?}");
}
