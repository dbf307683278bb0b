//! Fits of synthetic people: in poses far from the bind pose, with limbs missing, and of unusable scans.

use super::*;
use crate::body::HumanJoint::{
    self, Chest, Hand, Hips, LowerArm, LowerLeg, Shoulder, Spine, UpperArm, UpperChest, UpperLeg,
};
use crate::body::Side::{Left, Right};
use crate::body::{BodyModel, Figure, Limb, Pose, Shape, SkinRow, dominant_body_joint, embedded_model, skin};
use crate::geometry::{
    Aabb, Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, noise, smoothed_normals,
};
use crate::scan::Scan;
use nalgebra::UnitQuaternion;

/// A scanned subject of the model's family with bumps that the model cannot express. The vertices are shifted along the surface, with noise.
struct Invented {
    scan: TriMesh,
    joints: Vec<Point>,
    /// The true figure in the bind pose, and its true pose.
    figure: Figure,
    pose: Pose,
    /// For each vertex the joint that moves it most.
    moved_by: Vec<HumanJoint>,
}

fn invented(model: &BodyModel, seed: u64, turns: &[(HumanJoint, Vec3)]) -> Invented {
    invented_in(model, seed, turns, 0.0)
}

/// A synthetic person with something over the trunk that is `ease` metres thick.
fn invented_in(model: &BodyModel, seed: u64, turns: &[(HumanJoint, Vec3)], ease: f64) -> Invented {
    strong_armed_in(model, seed, turns, ease, 0.0)
}

/// A synthetic person whose right arm is thicker than any of the model, by `swollen` metres all around.
fn strong_armed_in(model: &BodyModel, seed: u64, turns: &[(HumanJoint, Vec3)], ease: f64, swollen: f64) -> Invented {
    let mut next = noise(seed);
    let shape = Shape((0..model.component_count()).map(|_| 1.5 * next()).collect());
    let (mesh, skeleton) = model.shaped(&shape);
    let mut pose = Pose::bind(skeleton.len());
    for rotation in pose.rotations.iter_mut().skip(1) {
        *rotation = UnitQuaternion::from_scaled_axis(Vec3::new(next(), next(), next()) * 0.06);
    }
    for &(joint, turn_deg) in turns {
        let j = skeleton.find(joint).unwrap().index();
        pose.rotations[j] = UnitQuaternion::from_scaled_axis(turn_deg.map(f64::to_radians)) * pose.rotations[j];
    }
    pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), 3.0 * next());
    let normals = mesh.vertex_normals();
    let waves = |p: &Point| 0.003 * ((31.0 * p.y).sin() * (23.0 * p.x).cos() + (27.0 * p.z).sin()) * 0.5;
    let body_joints = skeleton.body_joints();
    let mover = |row: &SkinRow| skeleton.human_joint(dominant_body_joint(row, &body_joints)).unwrap();
    let moved_by: Vec<HumanJoint> = model.weights.rows().iter().map(mover).collect();
    let more = |v: VertexId| if of_right_arm(moved_by[v.index()]) { swollen } else { 0.0 };
    let bumpy: Vec<Point> = mesh.points().enumerate().map(|(v, p)| p + normals[v] * (waves(p) + more(v))).collect();
    let body = mesh.with_points(PerVertex(bumpy));
    let worn = |(v, p): (VertexId, &Point)| if is_trunk(moved_by[v.index()]) { p + normals[v] * ease } else { *p };
    let figure_surface: PerVertex<Point> = body.points().enumerate().map(worn).collect();
    let posed = mesh.with_points(skin(&figure_surface, &model.weights, &skeleton, &pose));
    let (adjacency, normals) = (Adjacency::prepare(&posed), posed.vertex_normals());
    let scanned: Vec<Point> = posed
        .points()
        .enumerate()
        .map(|(v, p)| {
            let ring = adjacency.neighbours_of(v);
            let other = posed.points()[ring[(next().abs() * ring.len() as f64) as usize % ring.len()]];
            p + (other - p) * (0.4 * next().abs()) + normals[v] * (0.0015 * next())
        })
        .collect();
    Invented {
        scan: posed.with_points(scanned),
        joints: skeleton.joints_in_world(&pose),
        figure: Figure::bare(skeleton, body, model.weights.clone()),
        pose,
        moved_by,
    }
}

fn of_right_arm(joint: HumanJoint) -> bool {
    [UpperArm(Right), LowerArm(Right)].contains(&joint)
}

fn is_trunk(joint: HumanJoint) -> bool {
    [Hips, Spine, Chest, UpperChest].contains(&joint)
}

impl Invented {
    fn without(&self, gone: impl Fn(HumanJoint) -> bool) -> TriMesh {
        let keep: Vec<bool> =
            self.scan.faces().iter().map(|f| !f.iter().any(|v| gone(self.moved_by[v.index()]))).collect();
        self.scan.part(&keep.into()).0
    }
}

fn fit(model: &BodyModel, scan: TriMesh) -> Result<FittedBody, FitError> {
    let params = NakedParams { samples: 2500, ..NakedParams::default() };
    fit_naked(&Scan::from_clean_mesh(scan, None), model, &params, &mut |_| {})
}

/// Greatest distance of the joints that `counts` selects from their truth, in metres.
fn off(fitted: &FittedBody, truth: &Invented, counts: impl Fn(HumanJoint) -> bool) -> f64 {
    let found = fitted.skeleton.joints_in_world(&fitted.pose);
    (found.iter().zip(&truth.joints).zip(fitted.skeleton.ids()))
        .filter(|(_, j)| fitted.skeleton.human_joint(*j).is_some_and(&counts))
        .map(|((p, q), _)| (p - q).norm())
        .fold(0.0, f64::max)
}

#[test]
fn poses_far_from_the_bind_pose_are_found() {
    let model = embedded_model().unwrap();
    let z = Vec3::z();
    let poses: [(&str, Vec<(HumanJoint, Vec3)>); 4] = [
        ("T", vec![(UpperArm(Left), z * 45.0), (UpperArm(Right), z * -45.0)]),
        ("arms down", vec![(UpperArm(Left), z * -33.0), (UpperArm(Right), z * 33.0)]),
        ("one arm raised", vec![(UpperArm(Left), z * 118.0)]),
        ("a stride", vec![(UpperLeg(Left), Vec3::x() * -28.0), (UpperLeg(Right), Vec3::x() * 24.0)]),
    ];
    for (seed, (name, turns)) in poses.iter().enumerate() {
        let truth = invented(&model, 40 + seed as u64, turns);
        let fitted = fit(&model, truth.scan.clone()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let most = off(&fitted, &truth, |_| true);
        assert!(most < 0.015, "{name}: a joint is {:.0} mm off", most * 1e3);
        assert!(fitted.report.confidence > 0.95, "{name}: {:?}", fitted.report);
    }
}

#[test]
fn arms_in_poses_that_nobody_asked_for_are_found_or_the_scan_is_refused() {
    let model = embedded_model().unwrap();
    let across = |side: f64| [Vec3::new(-18.0, -30.0 * side, -28.0 * side), Vec3::new(-25.0, -95.0 * side, 0.0)];
    let hip = |side: f64| [Vec3::new(0.0, 25.0 * side, 12.0 * side), Vec3::new(0.0, -30.0 * side, -62.0 * side)];
    let poses: [(&str, [[Vec3; 2]; 2], bool); 3] = [
        ("one arm across", [across(1.0), [Vec3::zeros(); 2]], true),
        ("hands near the hips", [hip(1.0), hip(-1.0)], true),
        // A hand that the pose puts into the trunk shows nowhere.
        ("hands in the trunk", [[Vec3::zeros(), Vec3::new(0.0, -40.0, -105.0)], [Vec3::zeros(); 2]], false),
    ];
    for (seed, (name, [left, right], must_be_found)) in poses.iter().enumerate() {
        let turns = [
            (UpperArm(Left), left[0]),
            (LowerArm(Left), left[1]),
            (UpperArm(Right), right[0]),
            (LowerArm(Right), right[1]),
        ];
        let truth = invented(&model, 60 + seed as u64, &turns);
        match fit(&model, truth.scan.clone()) {
            Ok(fitted) => {
                let most = off(&fitted, &truth, |_| true);
                assert!(most < 0.03, "{name}: a joint is {:.0} mm off: {:?}", most * 1e3, fitted.report);
            }
            Err(error) => {
                assert!(!must_be_found && matches!(error, FitError::LimbNotFound { .. }), "{name}: {error}");
            }
        }
    }
}

#[test]
fn a_missing_arm_is_named_and_spoils_nothing_else() {
    let model = embedded_model().unwrap();
    let truth = invented(&model, 7, &[]);
    let of_arm = |joint: HumanJoint| joint.limb() == Limb::Arm(Right);
    let fitted = fit(&model, truth.without(of_arm)).unwrap();
    assert!(fitted.report.log.iter().any(|line| line.contains("does not show the right arm")), "{:?}", fitted.report);
    let most = off(&fitted, &truth, |joint| !of_arm(joint) && joint != Shoulder(Right));
    assert!(most < 0.015, "{:.0} mm", most * 1e3);
    assert!(off(&fitted, &truth, of_arm) < 0.12, "the arm hangs as the other one does");
    assert!((0.8..0.95).contains(&fitted.report.confidence), "{}", fitted.report.confidence);
    let whole = fit(&model, truth.scan.clone()).unwrap();
    assert!(!whole.report.log.iter().any(|line| line.contains("does not show")), "{:?}", whole.report.log);
}

#[test]
fn what_is_no_whole_grown_up_alone_is_refused_with_a_figure() {
    let model = embedded_model().unwrap();
    let truth = invented(&model, 11, &[]);
    let is_lower = |joint: HumanJoint| matches!(joint, Hips | Spine) || matches!(joint.limb(), Limb::Leg(_));
    let legs_alone = truth.without(|joint| !is_lower(joint));
    let error = fit(&model, legs_alone).unwrap_err();
    assert!(!matches!(error, FitError::EmptyScan | FitError::Singular { .. }), "{error}");

    // A box as large as a suitcase in the left hand.
    let hand = truth.joints[model.skeleton.find(Hand(Left)).unwrap().index()];
    let corner = |i: usize| hand + Vec3::new([-0.1, 0.1][i & 1], [-0.55, -0.05][i >> 1 & 1], [-0.3, 0.3][i >> 2 & 1]);
    let mut points: Vec<Point> = truth.scan.points().0.clone();
    let mut faces: Vec<[u32; 3]> = truth.scan.faces().iter().map(|f| f.map(|v| v.0)).collect();
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for [a, b, c, d] in sides {
        const STEPS: usize = 12;
        let first = points.len() as u32;
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let (s, t) = (i as f64 / STEPS as f64, j as f64 / STEPS as f64);
                points.push(corner(a) + (corner(b) - corner(a)) * s + (corner(d) - corner(a)) * t);
            }
        }
        debug_assert!((corner(c) - corner(b) - (corner(d) - corner(a))).norm() < 1e-9);
        for i in 0..STEPS as u32 {
            for j in 0..STEPS as u32 {
                let at = first + i * (STEPS as u32 + 1) + j;
                let next = at + STEPS as u32 + 1;
                faces.extend([[at, next, at + 1], [at + 1, next, next + 1]]);
            }
        }
    }
    let error = fit(&model, TriMesh::try_from_indices(points, &faces).unwrap()).unwrap_err();
    assert!(matches!(&error, FitError::Unexplained { percent, .. } if *percent > 10.0), "{error}");

    let child = truth.scan.map_points(|p| Point::from(p.coords * 0.58));
    let error = fit(&model, child).unwrap_err();
    assert!(error.hint().is_some_and(|hint| hint.contains("--unit")), "{error}");
}

/// Fits the figure of one scan inside another scan of the same person.
fn fit_figure(model: &BodyModel, from: &Invented, scan: TriMesh) -> Result<PoseInside, FitError> {
    let cover = from.moved_by.iter().map(|&joint| if is_trunk(joint) { Cover::Tight } else { Cover::Bare }).collect();
    let params = InsideParams { samples: 2500, ..InsideParams::default() };
    let scan = Scan::from_clean_mesh(scan, None);
    fit_inside(&scan, &from.figure, &from.pose, &cover, &model.limits, &params, &mut |_| {})
}

/// Greatest distance of the joints that `counts` selects from their truth, in metres.
fn figure_off(inside: &PoseInside, truth: &Invented, counts: impl Fn(HumanJoint) -> bool) -> f64 {
    let skeleton = &truth.figure.skeleton;
    let found = skeleton.joints_in_world(&inside.pose);
    (found.iter().zip(&truth.joints).zip(skeleton.ids()))
        .filter(|(_, j)| skeleton.human_joint(*j).is_some_and(&counts))
        .map(|((p, q), _)| (p - q).norm())
        .fold(0.0, f64::max)
}

#[test]
fn what_was_seen_badly_draws_less() {
    let model = embedded_model().unwrap();
    let truth = invented(&model, 31, &[]);
    // A shin that a fusion saw from too few sides lies 15 mm too far out.
    let normals = truth.scan.vertex_normals();
    let is_bad = |v: VertexId| truth.moved_by[v.index()] == LowerLeg(Left);
    let off = |v: VertexId| if is_bad(v) { 0.015 } else { 0.0 };
    let bulged = truth.scan.points().enumerate().map(|(v, p)| p + normals[v] * off(v)).collect::<PerVertex<Point>>();
    let confidence = truth.scan.vertex_ids().map(|v| if is_bad(v) { 0.0 } else { 1.0 }).collect();
    let params = NakedParams { samples: 2500, ..NakedParams::default() };
    let shin_off = |confidence| {
        let scan = Scan { confidence, ..Scan::from_clean_mesh(truth.scan.with_points(bulged.clone()), None) };
        let fitted = fit_naked(&scan, &model, &params, &mut |_| {}).unwrap();
        let posed = model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
        let shin = truth.scan.vertex_ids().filter(|&v| is_bad(v));
        let off: Vec<f64> = shin.map(|v| normals[v].dot(&(posed[v] - truth.scan.points()[v]))).collect();
        off.iter().sum::<f64>() / off.len() as f64
    };
    let (believed, doubted) = (shin_off(None), shin_off(Some(confidence)));
    assert!(
        believed > 0.0015 && doubted.abs() < 0.6 * believed,
        "{:.1} mm, {:.1} mm without a word of it",
        doubted * 1e3,
        believed * 1e3
    );
}

#[test]
fn a_figure_is_laid_into_its_next_scan_and_a_missing_arm_hangs_as_before() {
    let model = embedded_model().unwrap();
    let before = invented(&model, 21, &[]);
    // The same seed is the same person.
    let next = invented_in(&model, 21, &[(UpperArm(Left), Vec3::z() * -8.0)], 0.012);
    let whole = fit_figure(&model, &before, next.scan.clone()).unwrap();
    let most = figure_off(&whole, &next, |_| true);
    assert!(most < 0.012 && whole.report.converged, "{:.0} mm: {:?}", most * 1e3, whole.report);
    assert!(whole.report.outside_share == 0.0 && whole.report.confidence > 0.95, "{:?}", whole.report);
    assert!(!whole.report.log.iter().any(|line| line.contains("does not show")), "{:?}", whole.report.log);

    let of_arm = |joint: HumanJoint| joint.limb() == Limb::Arm(Right);
    let cut = fit_figure(&model, &before, next.without(of_arm)).unwrap();
    assert!(cut.report.log.iter().any(|line| line.contains("does not show the right arm")), "{:?}", cut.report.log);
    assert!((0.75..0.95).contains(&cut.report.confidence), "an arm less is less sure: {}", cut.report.confidence);
    let rest = figure_off(&cut, &next, |joint| !of_arm(joint) && joint != Shoulder(Right));
    assert!(rest < 0.012 && figure_off(&cut, &next, of_arm) < 0.05, "{:.0} mm", rest * 1e3);
}

#[test]
fn a_figure_is_not_laid_wrongly_into_what_it_does_not_fit() {
    let model = embedded_model().unwrap();
    let before = invented(&model, 22, &[]);
    let across = [(UpperArm(Left), Vec3::new(0.0, -95.0, -20.0)), (LowerArm(Left), Vec3::new(0.0, -70.0, 0.0))];
    let crossed = invented_in(&model, 22, &across, 0.012);
    match fit_figure(&model, &before, crossed.scan.clone()) {
        Err(FitError::LimbNotFound { limb, .. }) => assert!(limb.contains("left"), "{limb}"),
        Err(FitError::Outside { near, .. }) => assert!(!near.contains("leg"), "{near}"),
        Err(other) => panic!("{other}"),
        Ok(inside) => assert!(figure_off(&inside, &crossed, |_| true) < 0.03, "{:?}", inside.report),
    }
    // A trunk that is slightly too small is reported; one that is much too small belongs to another person.
    let slim = invented_in(&model, 22, &[], -0.009);
    let tight = fit_figure(&model, &before, slim.scan.clone()).unwrap();
    assert!(figure_off(&tight, &slim, |_| true) < 0.015, "what is too thick turns no limb: {:?}", tight.report);
    assert!(tight.report.converged && !tight.report.is_confident(), "{:?}", tight.report);
    assert!(tight.report.outside_depth > 0.001 && tight.report.outside_share > 0.01, "{:?}", tight.report);
    for said in ["the scan is smaller there", "doubtful"] {
        assert!(tight.report.log.iter().any(|line| line.contains(said)), "{:?}", tight.report.log);
    }
    let thin = invented_in(&model, 22, &[], -0.04);
    let refused = fit_figure(&model, &before, thin.scan).map(|inside| inside.report).unwrap_err();
    assert!(matches!(refused, FitError::Outside { .. } | FitError::NotThisPerson { .. }), "{refused}");
}

/// The cover of the subjects of `invented_in`: close cloth over the trunk.
fn shirt(truth: &Invented) -> PerVertex<Cover> {
    truth.moved_by.iter().map(|&joint| if is_trunk(joint) { Cover::Tight } else { Cover::Bare }).collect()
}

/// The body fitted to a naked scan and others and registered to the naked one, and the fit.
fn together(model: &BodyModel, naked: TriMesh, worn: &[&Invented]) -> (RegisteredBody, FittedBody) {
    let params = NakedParams { samples: 2500, ..NakedParams::default() };
    let scans: Vec<Scan> = worn.iter().map(|w| Scan::from_clean_mesh(w.scan.clone(), None)).collect();
    let naked = Scan::from_clean_mesh(naked, None);
    let mut fitted = fit_naked(&naked, model, &params, &mut |_| {}).unwrap();
    let inside = InsideParams { samples: 2500, ..InsideParams::default() };
    let others: Vec<OtherScan> = (scans.iter().zip(worn))
        .map(|(scan, worn)| OtherScan { name: "shirt", scan, cover: shirt(worn), params: inside.clone() })
        .collect();
    if !others.is_empty() {
        fitted = fit_together(&naked, &fitted, &others, model, &params, &mut |_| {}).unwrap();
    }
    let fill_in: Vec<FillInView> = (others.into_iter().zip(&fitted.poses_in_others))
        .filter_map(|(other, pose)| Some(FillInView { scan: other.scan, pose: pose.as_ref()?, cover: other.cover }))
        .collect();
    let hints = RegisterHints { fill_in: &fill_in, ..RegisterHints::default() };
    let registered =
        register_with_hints(&naked, model, &fitted, &hints, &RegisterParams::default(), &mut |_| {}).unwrap();
    (registered, fitted)
}

/// Mean distance, in metres, of vertices that these joints move, from the true surface, both in the true pose.
fn astray(found: &RegisteredBody, truth: &Invented, counts: impl Fn(HumanJoint) -> bool) -> f64 {
    let weights = &truth.figure.body().weights;
    let posed = skin(found.surface.points(), weights, &found.skeleton, &truth.pose);
    let mine = found.skeleton.joints_in_world(&truth.pose);
    let there = TriMesh::try_new(
        truth.figure.body().posed(&truth.figure.skeleton, &truth.pose).points().0.clone(),
        found.surface.faces().0.clone(),
    );
    let surface = crate::geometry::SurfaceIndex::prepare(&there.unwrap());
    // A displaced joint would displace its whole limb, so vertices are compared relative to their joint.
    let distances: Vec<f64> = (posed.iter().zip(&truth.moved_by))
        .filter(|(_, joint)| counts(**joint))
        .map(|(p, joint)| {
            let j = truth.figure.skeleton.find(*joint).unwrap().index();
            surface.closest(&(p + (truth.joints[j] - mine[j]))).distance
        })
        .collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}

#[test]
fn other_scans_say_where_the_arm_lies_that_the_naked_one_lacks() {
    let model = embedded_model().unwrap();
    const SWOLLEN: f64 = 0.008;
    let truth = strong_armed_in(&model, 31, &[], 0.0, SWOLLEN);
    // The same seed is the same person.
    let worn = [
        strong_armed_in(&model, 31, &[(UpperArm(Right), Vec3::z() * 8.0)], 0.012, SWOLLEN),
        strong_armed_in(&model, 31, &[(UpperArm(Right), Vec3::new(0.0, 6.0, -5.0))], 0.02, SWOLLEN),
    ];
    let naked = truth.without(|joint| of_right_arm(joint) || joint == Hand(Right));
    let (alone, before) = together(&model, naked.clone(), &[]);
    let (all, after) = together(&model, naked, &[&worn[0], &worn[1]]);
    let (off_alone, off_all) = (astray(&alone, &truth, of_right_arm), astray(&all, &truth, of_right_arm));
    assert!(off_all < 0.4 * off_alone, "{:.2} mm of {:.2}", off_all * 1e3, off_alone * 1e3);
    assert!(all.report.log.iter().any(|line| line.contains("more on other scans")), "{:?}", all.report.log);
    let rest = |joint: HumanJoint| joint.side() != Some(Right);
    let (rest_alone, rest_all) = (astray(&alone, &truth, rest), astray(&all, &truth, rest));
    assert!(rest_all < rest_alone + 2e-4, "{:.2} mm, {:.2} alone", rest_all * 1e3, rest_alone * 1e3);
    assert!(after.poses_in_others.iter().all(Option::is_some) && before.poses_in_others.is_empty());

    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let naked = truth.without(|joint| of_right_arm(joint) || joint == Hand(Right));
    let again = one_thread.install(|| together(&model, naked, &[&worn[0], &worn[1]]));
    assert!(again.0 == all && again.1 == after, "the same bits");
}

#[test]
fn a_scan_of_someone_else_spoils_no_shape() {
    let model = embedded_model().unwrap();
    let truth = invented(&model, 32, &[]);
    let stranger = invented_in(&model, 35, &[], 0.01);
    let (_, alone) = together(&model, truth.scan.clone(), &[]);
    let (_, both) = together(&model, truth.scan.clone(), &[&stranger]);
    assert!(both.report.residual_mean < alone.report.residual_mean + 2.5e-4, "{:?}", both.report);
    let expected = ["is not used for the shape", "contradict", "no other scan", "one shape from"];
    assert!(
        both.report.log.iter().any(|line| expected.iter().any(|words| line.contains(words))),
        "{:?}",
        both.report.log
    );
}

/// How much hair is over each vertex of the model, 0 to 1: on the scalp, and if it is long, down the back.
fn hair_of(model: &BodyModel, truth: &Invented, is_long: bool) -> Vec<f64> {
    let (points, normals) = (model.template.points(), model.template.vertex_normals());
    let of_head = |v: &VertexId| truth.moved_by[v.index()] == HumanJoint::Head;
    let head = Aabb::around(points.enumerate().filter(|(v, _)| of_head(v)).map(|(_, p)| p)).unwrap();
    let smooth = |x: f64| {
        let t = x.clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    points
        .enumerate()
        .map(|(v, p)| {
            let at = (p - head.center()).component_div(&(head.extent() * 0.5));
            let on_scalp = if of_head(&v) { smooth((0.8 * at.y - 0.55 * at.z - 0.1) / 0.35) } else { 0.0 };
            let hangs =
                is_long && [HumanJoint::Head, HumanJoint::Neck, UpperChest].contains(&truth.moved_by[v.index()]);
            let below = smooth((p.y - (head.min.y - 0.25)) / 0.05) * smooth((-0.2 - normals[v].z) / 0.3);
            if hangs && p.y < head.center().y { on_scalp.max(below) } else { on_scalp }
        })
        .collect()
}

#[test]
fn hair_is_left_out_and_the_head_below_it_keeps_its_size() {
    let model = embedded_model().unwrap();
    for (seed, thickness, is_long) in [(91, 0.020, false), (92, 0.045, true)] {
        let truth = invented(&model, seed, &[]);
        let hair = hair_of(&model, &truth, is_long);
        let normals = smoothed_normals(&truth.scan, &Adjacency::prepare(&truth.scan), 4);
        let grown = truth.scan.points().enumerate().map(|(v, p)| p + normals[v] * (thickness * hair[v.index()]));
        let scan = Scan::from_clean_mesh(truth.scan.with_points(grown.collect::<PerVertex<Point>>()), None);
        let fitted = |params: NakedParams| {
            let fitted = fit_naked(&scan, &model, &params, &mut |_| {}).unwrap_or_else(|e| panic!("{seed}: {e}"));
            let body = register(&scan, &model, &fitted, &RegisterParams::default(), &mut |_| {}).unwrap();
            let posed = model.posed(body.surface.points(), &body.skeleton, &body.pose);
            (fitted, SurfaceIndex::prepare(&body.surface.with_points(posed)))
        };
        let (kept, with_hair) = fitted(NakedParams { hair: HairTreatment::Keep, ..NakedParams::default() });
        let (dropped, bald) = fitted(NakedParams { hair: HairTreatment::Drop, ..NakedParams::default() });
        assert!(kept.hair.is_none());
        let found = dropped.hair.as_ref().unwrap_or_else(|| panic!("{seed}: no hair found"));

        let off = |surface: &SurfaceIndex, counts: &dyn Fn(VertexId) -> bool| {
            let of: Vec<f64> = (truth.scan.points().enumerate())
                .filter(|(v, _)| counts(*v))
                .map(|(_, p)| 1e3 * surface.closest(p).distance)
                .collect();
            of.iter().sum::<f64>() / of.len() as f64
        };
        let of_scalp = |v: VertexId| hair[v.index()] > 0.8;
        let of_face = |v: VertexId| {
            truth.moved_by[v.index()] == HumanJoint::Head
                && hair[v.index()] == 0.0
                && model.template.vertex_normals()[v].z > 0.3
        };
        let scalp = [&with_hair, &bald].map(|surface| off(surface, &of_scalp));
        let face = off(&bald, &of_face);
        assert!(scalp[0] > 8.0 && scalp[1] < 6.0 && face < 3.0, "{seed}: scalp {scalp:.1?} mm, face {face:.1} mm");

        let right = scan.mesh.vertex_ids().filter(|&v| found.vertices[v] && hair[v.index()] > 0.5).count();
        let true_hair = hair.iter().filter(|share| **share > 0.5).count();
        let wrong = scan.mesh.vertex_ids().filter(|&v| found.vertices[v] && hair[v.index()] == 0.0).count();
        assert!(10 * right > 9 * true_hair && 3 * wrong < true_hair, "{seed}: {right} of {true_hair}, {wrong} wrong");
    }
}

#[test]
fn a_bald_head_has_no_hair() {
    let model = embedded_model().unwrap();
    for seed in [93, 94, 95] {
        let truth = invented(&model, seed, &[]);
        let params = NakedParams { hair: HairTreatment::Drop, samples: 2500, ..NakedParams::default() };
        let scan = Scan::from_clean_mesh(truth.scan.clone(), None);
        let fitted = fit_naked(&scan, &model, &params, &mut |_| {}).unwrap();
        assert_eq!(fitted.hair.map(|hair| hair.area), None, "{seed}");
    }
}
