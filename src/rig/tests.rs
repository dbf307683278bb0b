//! A doll of tubes (trunk, two legs, one arm beside the trunk) and what it wears.

use super::*;
use crate::body::{HumanJoint, Layer, Pose, Side, Stance, embedded_model, skin};
use crate::geometry::{FaceId, Vec3};
use nalgebra::UnitQuaternion;

/// An outward tube around the segment `from`–`to`, open at both ends; `radii` at its two ends.
pub(super) fn tube(from: Point, to: Point, radii: [f64; 2], rings: usize, sectors: usize) -> TriMesh {
    let axis = (to - from).normalize();
    let side = axis.cross(&Vec3::z()).normalize();
    let front = side.cross(&axis);
    let mut points = Vec::new();
    let mut faces = Vec::new();
    for i in 0..=rings {
        let t = i as f64 / rings as f64;
        for s in 0..sectors {
            let angle = std::f64::consts::TAU * s as f64 / sectors as f64;
            let radius = radii[0] + (radii[1] - radii[0]) * t;
            points.push(from + (to - from) * t + (side * angle.cos() + front * angle.sin()) * radius);
            if i < rings {
                let at = |i: usize, s: usize| (i * sectors + s % sectors) as u32;
                faces.push([at(i, s), at(i + 1, s), at(i + 1, s + 1)]);
                faces.push([at(i, s), at(i + 1, s + 1), at(i, s + 1)]);
            }
        }
    }
    let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
    let outward = mesh.face_normal(FaceId(0)).dot(&(mesh.triangle(FaceId(0))[0] - from));
    if outward > 0.0 { mesh } else { mesh.flipped() }
}

pub(super) fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut points = Vec::new();
    let mut faces = Vec::new();
    for part in parts {
        let first = points.len() as u32;
        points.extend(part.points().iter().copied());
        faces.extend(part.faces().iter().map(|f| f.map(|v| v.0 + first)));
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

pub(super) const HIPS: usize = 0;
pub(super) const LEFT_LEG: usize = 1;
pub(super) const RIGHT_LEG: usize = 4;
pub(super) const LEFT_ARM: usize = 7;

pub(super) fn doll() -> Figure {
    use HumanJoint::{Foot, Hips, LowerLeg, UpperArm, UpperLeg};
    use Side::{Left, Right};
    let joints = [
        Hips,
        UpperLeg(Left),
        LowerLeg(Left),
        Foot(Left),
        UpperLeg(Right),
        LowerLeg(Right),
        Foot(Right),
        UpperArm(Left),
    ];
    let p = Point::new;
    let skeleton = Skeleton {
        names: joints.map(|joint| joint.name().to_string()).to_vec(),
        parents: [None, Some(0), Some(1), Some(2), Some(0), Some(4), Some(5), Some(0)].map(|j| j.map(JointId)).to_vec(),
        joints_in_bind: vec![
            p(0.0, 0.9, 0.0),
            p(0.1, 0.85, 0.0),
            p(0.12, 0.45, 0.0),
            p(0.14, 0.05, 0.0),
            p(-0.1, 0.85, 0.0),
            p(-0.12, 0.45, 0.0),
            p(-0.14, 0.05, 0.0),
            p(0.21, 1.4, 0.0),
        ],
    };
    let parts = [
        tube(p(0.0, 0.8, 0.0), p(0.0, 1.5, 0.0), [0.16, 0.15], 24, 40),
        tube(p(0.14, 0.05, 0.0), p(0.1, 0.8, 0.0), [0.06, 0.08], 24, 24),
        tube(p(-0.14, 0.05, 0.0), p(-0.1, 0.8, 0.0), [0.06, 0.08], 24, 24),
        tube(p(0.24, 0.9, 0.0), p(0.21, 1.45, 0.0), [0.04, 0.04], 20, 20),
    ];
    let rows = [(HIPS, HIPS, 0), (LEFT_LEG, LEFT_LEG + 1, 1), (RIGHT_LEG, RIGHT_LEG + 1, 2), (LEFT_ARM, LEFT_ARM, 3)]
        .into_iter()
        .flat_map(|(upper, lower, part)| {
            parts[part].points().0.iter().map(move |q| {
                let knee = ((q.y - 0.4) / 0.1).clamp(0.0, 1.0);
                let hip = if part == 1 || part == 2 { ((q.y - 0.72) / 0.08).clamp(0.0, 1.0) } else { 0.0 };
                let limb = 1.0 - hip;
                vec![
                    (JointId(HIPS as u16), hip),
                    (JointId(upper as u16), if upper == lower { limb } else { limb * knee }),
                    (JointId(lower as u16), if upper == lower { 0.0 } else { limb * (1.0 - knee) }),
                ]
            })
        })
        .collect::<Vec<_>>();
    let mesh = joined(&parts);
    let weights = SkinWeights::from_rows(rows);
    Figure::bare(skeleton, mesh, weights)
}

fn in_bind(figure: &Figure) -> PoseInside {
    let pose = Pose::bind(figure.skeleton.len());
    PoseInside { pose, offsets: PerVertex(vec![]), report: Default::default() }
}

fn legs_apart(figure: &Figure, degrees: f64) -> Pose {
    let mut pose = Pose::bind(figure.skeleton.len());
    for (leg, sign) in [(LEFT_LEG, 1.0), (RIGHT_LEG, -1.0)] {
        pose.rotations[leg] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), sign * degrees.to_radians() / 2.0);
    }
    pose
}

fn skirt() -> TriMesh {
    tube(Point::new(0.0, 0.4, 0.0), Point::new(0.0, 0.95, 0.0), [0.3, 0.19], 30, 80)
}

#[test]
fn a_skirt_does_not_split_between_legs_40_degrees_apart() {
    let figure = doll();
    let params = RigParams::default();
    let stretched = |method| {
        let rigged = rig(&skirt(), None, &figure, &in_bind(&figure), &RigParams { method, ..params.clone() }).unwrap();
        let apart = skin(rigged.mesh.points(), &rigged.weights, &figure.skeleton, &legs_apart(&figure, 40.0));
        (stretch(&rigged.mesh, &rigged.mesh.with_points(apart), 1.0), rigged.report)
    };
    let (worst, report) = stretched(RigMethod::Inpaint);
    assert!(report.bridging_share > 0.4, "{report:?}");
    assert!(worst < 1.6, "an edge is stretched {worst:.2} times");
    assert!(stretched(RigMethod::Closest).0 > 3.0, "the closest triangle alone does split it");
}

#[test]
fn trouser_legs_are_no_bridge() {
    let figure = doll();
    let trousers = joined(&[
        tube(Point::new(0.14, 0.1, 0.0), Point::new(0.1, 0.8, 0.0), [0.075, 0.095], 30, 30),
        tube(Point::new(-0.14, 0.1, 0.0), Point::new(-0.1, 0.8, 0.0), [0.075, 0.095], 30, 30),
    ]);
    let rigged = rig(&trousers, None, &figure, &in_bind(&figure), &RigParams::default()).unwrap();
    assert_eq!(rigged.report.bridging_share, 0.0);
    for (p, row) in trousers.points().iter().zip(rigged.weights.rows().iter()) {
        let other = if p.x > 0.0 { [RIGHT_LEG, RIGHT_LEG + 1] } else { [LEFT_LEG, LEFT_LEG + 1] };
        let strayed: f64 = row.iter().filter(|(j, _)| other.contains(&j.index())).map(|r| r.1).sum();
        assert!(strayed < 1e-6);
    }
}

#[test]
fn a_sleeve_does_not_stick_to_the_torso_that_it_touches() {
    let figure = doll();
    let sleeve = tube(Point::new(0.235, 1.0, 0.0), Point::new(0.21, 1.4, 0.0), [0.072, 0.062], 20, 40);
    let torso_share = |method| {
        let params = RigParams { method, ..RigParams::default() };
        let rigged = rig(&sleeve, None, &figure, &in_bind(&figure), &params).unwrap();
        rigged
            .weights
            .rows()
            .iter()
            .map(|row| row.iter().filter(|(j, _)| j.index() == HIPS).map(|r| r.1).sum())
            .fold(0.0, f64::max)
    };
    assert!(torso_share(RigMethod::Inpaint) < 1e-3);
    assert!(torso_share(RigMethod::Closest) > 0.9, "the closest triangle is the torso's");
}

#[test]
fn weights_change_slowly_enough_not_to_tear_cloth_at_a_raised_thigh() {
    let model = embedded_model().unwrap();
    let (mesh, skeleton) = model.shaped(&model.mean_shape());
    let figure = Figure::bare(skeleton, mesh, model.weights.clone());
    let joint = |joint| figure.skeleton.joints_in_bind[figure.skeleton.find(joint).unwrap().index()];
    let (hip, knee) = (joint(HumanJoint::UpperLeg(Side::Left)), joint(HumanJoint::LowerLeg(Side::Left)));
    let leg = tube(knee, hip + (hip - knee) * 0.6, [0.11, 0.15], 60, 40);
    let body = figure.body();
    let centers = &figure.skeleton.joints_in_bind;
    let params = RigParams::default();
    let (steep, _) = skin_garment(&leg, &body.mesh, &body.weights, &figure.skeleton, centers, &params).unwrap();
    let gentle = rig(&leg, None, &figure, &in_bind(&figure), &params).unwrap().weights;
    let raised = Stance::ThighRaised.pose(&figure.skeleton);
    let longest = |weights: &SkinWeights| {
        let posed = skin(leg.points(), weights, &figure.skeleton, &raised);
        let of_edge = |[a, b]: [crate::geometry::VertexId; 2]| {
            (posed[a] - posed[b]).norm() / (leg.points()[a] - leg.points()[b]).norm()
        };
        Adjacency::prepare(&leg).edges().iter().map(|(ends, _)| of_edge(*ends)).fold(0.0, f64::max)
    };
    let (before, after) = (longest(&steep), longest(&gentle));
    assert!(before > 2.0 && after < 1.85, "stretched {before:.2} times, and {after:.2} times");
}

#[test]
fn posing_the_rigged_garment_gives_back_the_scan() {
    let figure = doll();
    let mut pose = legs_apart(&figure, 20.0);
    pose.translation = Vec3::new(0.4, -0.1, 0.2);
    pose.rotations[HIPS] = UnitQuaternion::from_euler_angles(0.1, 1.2, -0.2);
    let posed_skirt = {
        let weights = rig(&skirt(), None, &figure, &in_bind(&figure), &RigParams::default()).unwrap().weights;
        skirt().with_points(skin(skirt().points(), &weights, &figure.skeleton, &pose))
    };
    let inside = PoseInside { pose: pose.clone(), ..in_bind(&figure) };
    let colors = PerVertex::filled([9, 8, 7], posed_skirt.vertex_count());
    let rigged = rig(&posed_skirt, Some(&colors), &figure, &inside, &RigParams::default()).unwrap();
    let back = skin(rigged.mesh.points(), &rigged.weights, &figure.skeleton, &pose);
    for (p, q) in back.iter().zip(posed_skirt.points().iter()) {
        assert!((p - q).norm() < 1e-9);
    }
    assert!(rigged.report.stretch_p99 < 1.3, "{:?}", rigged.report);
    assert_eq!(rigged.colors, Some(colors));
}

#[test]
fn what_cannot_be_rigged_is_said() {
    let figure = doll();
    let nothing = TriMesh::try_from_indices(vec![Point::origin()], &[]).unwrap();
    let params = RigParams::default();
    assert!(matches!(rig(&nothing, None, &figure, &in_bind(&figure), &params), Err(RigError::EmptyGarment)));
    let elsewhere = skirt().map_points(|p| p + Vec3::x() * 5.0);
    let error = rig(&elsewhere, None, &figure, &in_bind(&figure), &params).unwrap_err();
    assert!(matches!(error, RigError::FarFromBody { nearest } if nearest > 4.0) && error.hint().is_some());
    let offsets = PoseInside { offsets: PerVertex(vec![0.0; 3]), ..in_bind(&figure) };
    assert!(matches!(rig(&skirt(), None, &figure, &offsets, &params), Err(RigError::WrongLength { given: 3, .. })));
    let mut pose = in_bind(&figure);
    pose.pose.rotations.pop();
    let short = rig(&skirt(), None, &figure, &pose, &params).unwrap_err();
    assert!(matches!(short, RigError::WrongLength { what: "rotations of the pose", .. }), "{short}");
    let mut other = figure.clone();
    other.layers[0].weights = SkinWeights::from_rows([]);
    let bare = rig(&skirt(), None, &other, &in_bind(&figure), &params).unwrap_err();
    assert!(matches!(bare, RigError::WrongLength { what: "skin weights of the body", given: 0, .. }), "{bare}");
    let unknown = RigParams { smoothing_length: f64::NAN, ..params };
    assert!(matches!(rig(&skirt(), None, &figure, &in_bind(&figure), &unknown), Err(RigError::Parameter(_))));
}

#[test]
fn skin_weights_for_another_skeleton_are_refused() {
    let figure = doll();
    let (body, joints) = (&figure.layers[0], figure.skeleton.len());
    let far = SkinWeights::from_rows((0..body.mesh.vertex_count()).map(|_| vec![(JointId(joints as u16), 1.0)]));
    let centers = &figure.skeleton.joints_in_bind;
    let error = skin_garment(&skirt(), &body.mesh, &far, &figure.skeleton, centers, &RigParams::default());
    assert!(matches!(error, Err(RigError::NoSuchJoint { joint, .. }) if joint == joints));
    let few = skin_garment(&skirt(), &body.mesh, &body.weights, &figure.skeleton, &centers[1..], &RigParams::default());
    assert!(matches!(few, Err(RigError::WrongLength { what: "joint centres", .. })));
}

/// A flat sheet at the heights given, one strip a height, over a large flat floor: the distances are the heights.
fn sheet_over_floor(heights: &[f64]) -> (TriMesh, TriMesh) {
    let grid = |rows: &[f64], width: f64| {
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for (i, h) in rows.iter().enumerate() {
            points.push(Point::new(0.0, *h, i as f64 * width));
            points.push(Point::new(width, *h, i as f64 * width));
            if i + 1 < rows.len() {
                let a = 2 * i as u32;
                faces.push([a, a + 2, a + 1]);
                faces.push([a + 1, a + 2, a + 3]);
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap()
    };
    let floor = grid(&[0.0; 2], 100.0).map_points(|p| p - Vec3::new(50.0, 0.0, 50.0));
    (grid(heights, 0.5), floor)
}

#[test]
fn physics_weights_are_equation_9() {
    let (sheet, floor) = sheet_over_floor(&[0.01, 0.02, 0.03, 0.06, 0.04, 0.09, 0.1]);
    let loose: PerVertex<bool> = (0..14).map(|v| v >= 8).collect();
    let found = physics_weights(&sheet, &floor, &loose, &PhysicsParams::default()).unwrap();
    let mean = (0.01 + 0.02 + 0.03 + 0.06) / 4.0;
    assert!((found.fitted_part.unwrap() - (mean - 0.01) / 0.05).abs() < 1e-9);
    assert_eq!(found.loose_part, Some(0.5), "(0.0767 − 0.04) / 0.06 is above one half");
    assert!(found.per_vertex.iter().all(|w| (0.0..=0.5).contains(w)));
    assert!(found.per_vertex.0[0] < 0.05 && found.per_vertex.0[12] > 0.45);
    assert_eq!(found.per_part(&loose).0[7..9], [found.fitted_part.unwrap(), 0.5]);
}

#[test]
fn cloth_everywhere_equally_far_has_no_physics() {
    let (sheet, floor) = sheet_over_floor(&[0.02; 5]);
    let found = physics_weights(&sheet, &floor, &PerVertex::filled(false, 10), &PhysicsParams::default()).unwrap();
    assert_eq!((found.fitted_part, found.loose_part), (Some(0.0), None));
    assert!(physics_weights(&sheet, &floor, &PerVertex::filled(false, 3), &PhysicsParams::default()).is_err());
    let fitted = PerVertex::filled(false, 10);
    let nothing = TriMesh::try_from_indices(vec![Point::origin()], &[]).unwrap();
    let no_body = physics_weights(&sheet, &nothing, &fitted, &PhysicsParams::default());
    assert!(matches!(no_body, Err(RigError::EmptyBody)));
    let params = PhysicsParams { smoothing_length: f64::INFINITY, ..PhysicsParams::default() };
    assert!(matches!(physics_weights(&sheet, &floor, &fitted, &params), Err(RigError::Parameter(_))));
}

#[test]
fn cloth_on_cloth_moves_with_the_cloth_below() {
    let sleeve =
        |radius, y: [f64; 2]| tube(Point::new(0.23, y[0], 0.0), Point::new(0.22, y[1], 0.0), [radius; 2], 20, 24);
    let least_and_most = |figure: &Figure| {
        let rigged = rig(&sleeve(0.06, [1.0, 1.3]), None, figure, &in_bind(figure), &RigParams::default()).unwrap();
        let of_arm =
            |row: &crate::body::SkinRow| row.iter().filter(|(j, _)| j.index() == LEFT_ARM).map(|(_, w)| w).sum();
        let shares: Vec<f64> = rigged.weights.rows().iter().map(of_arm).collect();
        (shares.iter().copied().fold(1.0, f64::min), shares.iter().copied().fold(0.0, f64::max))
    };
    let mut figure = doll();
    let (least, _) = least_and_most(&figure);
    assert!(least > 0.9, "a sleeve moves with the arm: {least}");

    let below = sleeve(0.05, [0.95, 1.35]);
    let half = vec![(JointId(HIPS as u16), 0.5), (JointId(LEFT_ARM as u16), 0.5)];
    let weights = SkinWeights::from_rows(vec![half; below.vertex_count()]);
    figure.layers.push(Layer::plain("sleeve", below, weights));
    let (least, most) = least_and_most(&figure);
    assert!(least > 0.4 && most < 0.6, "it moves with the sleeve below: {least} to {most}");
}
