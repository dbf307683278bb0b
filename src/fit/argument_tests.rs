//! Public functions check their arguments; registrations and the paper's methods on the model's own surface.

use super::*;
use crate::body::{BodyModel, Figure, Pose, embedded_model};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use crate::scan::Scan;

fn fitted(model: &BodyModel) -> FittedBody {
    let (surface, skeleton) = model.shaped(&model.mean_shape());
    FittedBody {
        deviation: None,
        shape: model.mean_shape(),
        pose: Pose::bind(skeleton.len()),
        surface,
        skeleton,
        unseen: Vec::new(),
        poses_in_others: Vec::new(),
        hair: None,
        report: NakedReport::default(),
    }
}

/// The model's own surface, moved.
fn scan(model: &BodyModel, by: Vec3) -> Scan {
    Scan::from_clean_mesh(model.template.map_points(|p| p + by), None)
}

fn no_scan() -> Scan {
    let empty = crate::geometry::TriMesh::try_new(Vec::<Point>::new(), Vec::new()).unwrap();
    Scan::from_clean_mesh(empty, None)
}

#[test]
fn a_fit_inside_checks_its_arguments() {
    let model = embedded_model().unwrap();
    let body = fitted(&model);
    let figure = body.figure(&model);
    let scan = scan(&model, Vec3::zeros());
    let vertices = model.template.vertex_count();
    let fit = |figure: &Figure, start: &Pose, cover: usize, limits: usize, params: InsideParams| {
        let cover = PerVertex::filled(Cover::Bare, cover);
        fit_inside(&scan, figure, start, &cover, &model.limits[..limits], &params, &mut |_| {}).unwrap_err()
    };
    let joints = model.skeleton.len();
    let defaults = InsideParams::default;
    let short = fit(&figure, &body.pose, vertices - 1, joints, defaults());
    let WrongLengthOf(given, expected) = wrong_length(&short);
    assert_eq!((given, expected), (vertices - 1, vertices), "{short}");
    assert!(short.hint().is_some());
    let pose = fit(&figure, &Pose::bind(joints + 1), vertices, joints, defaults());
    assert_eq!(wrong_length(&pose).0, joints + 1, "{pose}");
    let limits = fit(&figure, &body.pose, vertices, 1, defaults());
    assert_eq!(wrong_length(&limits).0, 1, "{limits}");
    for bad in [
        InsideParams { samples: 0, ..defaults() },
        InsideParams { iterations: 0, ..defaults() },
        InsideParams { margin: f64::NAN, ..defaults() },
        InsideParams { greatest_offset: -0.001, ..defaults() },
        InsideParams { least_explained: 1.5, ..defaults() },
    ] {
        let error = fit(&figure, &body.pose, vertices, joints, bad.clone());
        assert!(matches!(error, FitError::OutOfRange { .. }), "{bad:?}: {error}");
    }
    let cover = PerVertex::filled(Cover::Bare, vertices);
    let error = fit_inside(&no_scan(), &figure, &body.pose, &cover, &model.limits, &defaults(), &mut |_| {});
    assert_eq!(error.unwrap_err(), FitError::EmptyScan);
}

struct WrongLengthOf(usize, usize);

fn wrong_length(error: &FitError) -> WrongLengthOf {
    match error {
        FitError::WrongLength { given, expected, .. } => WrongLengthOf(*given, *expected),
        other => panic!("{other}"),
    }
}

#[test]
fn a_naked_fit_and_a_shape_from_all_scans_check_their_arguments() {
    let model = embedded_model().unwrap();
    let scan = scan(&model, Vec3::zeros());
    for bad in [
        NakedParams { samples: 0, ..NakedParams::default() },
        NakedParams { shape_prior: -1.0, ..NakedParams::default() },
        NakedParams { least_explained: f64::NAN, ..NakedParams::default() },
    ] {
        let error = fit_naked(&scan, &model, &bad, &mut |_| {}).unwrap_err();
        assert!(matches!(error, FitError::OutOfRange { .. }), "{bad:?}: {error}");
    }
    assert_eq!(fit_naked(&no_scan(), &model, &NakedParams::default(), &mut |_| {}).unwrap_err(), FitError::EmptyScan);

    let body = fitted(&model);
    let other = |cover: usize| OtherScan {
        name: "shirt",
        scan: &scan,
        cover: PerVertex::filled(Cover::Bare, cover),
        params: InsideParams::default(),
    };
    let params = NakedParams::default();
    let short = fit_together(&scan, &body, &[other(3)], &model, &params, &mut |_| {}).unwrap_err();
    assert_eq!(wrong_length(&short).0, 3, "{short}");
    let paper = NakedParams { method: NakedMethod::Paper, ..params };
    let others = [other(model.template.vertex_count())];
    let error = fit_together(&scan, &body, &others, &model, &paper, &mut |_| {}).unwrap_err();
    assert!(matches!(error, FitError::Contradiction { .. }), "{error}");
}

#[test]
fn a_registration_checks_its_arguments() {
    let model = embedded_model().unwrap();
    let (body, scan) = (fitted(&model), scan(&model, Vec3::zeros()));
    let params = RegisterParams::default();
    let landmarks = [(VertexId::from_index(model.template.vertex_count()), Point::origin())];
    let hints = RegisterHints { landmarks: &landmarks, ..RegisterHints::default() };
    let error = register_with_hints(&scan, &model, &body, &hints, &params, &mut |_| {}).unwrap_err();
    assert!(matches!(error, FitError::OutOfRange { .. }), "{error}");
    for bad in [
        RegisterParams { smoothing_lengths: Vec::new(), ..params.clone() },
        RegisterParams { smoothing_lengths: vec![0.0], ..params.clone() },
        RegisterParams { iterations: 0, ..params.clone() },
        RegisterParams { reach: f64::NAN, ..params.clone() },
    ] {
        let error = register(&scan, &model, &body, &bad, &mut |_| {}).unwrap_err();
        assert!(matches!(error, FitError::OutOfRange { .. }), "{bad:?}: {error}");
    }
    let mut foreign = body.clone();
    foreign.pose = Pose::bind(3);
    let error = register(&scan, &model, &foreign, &params, &mut |_| {}).unwrap_err();
    assert_eq!(wrong_length(&error).0, 3, "{error}");
}

#[test]
fn a_registration_converges_only_if_its_last_iteration_moves_little() {
    let model = embedded_model().unwrap();
    let body = fitted(&model);
    let on_itself = register(&scan(&model, Vec3::zeros()), &model, &body, &RegisterParams::default(), &mut |_| {});
    let report = on_itself.unwrap().report;
    assert!(report.converged && report.last_move < 1e-4, "{report:?}");
    // One iteration toward a scan that is 10 mm away moves the surface by millimetres.
    let once = RegisterParams { smoothing_lengths: vec![0.06], iterations: 1, ..RegisterParams::default() };
    let report = register(&scan(&model, Vec3::z() * 0.01), &model, &body, &once, &mut |_| {}).unwrap().report;
    assert!(!report.converged && report.last_move > 1e-3, "{report:?}");
    assert!(report.log.iter().any(|line| line.contains("did not converge")), "{:?}", report.log);
}

#[test]
fn eq_4_finds_the_models_own_surface_and_refuses_nothing() {
    let model = embedded_model().unwrap();
    let paper = NakedParams { method: NakedMethod::Paper, iterations: 10, ..NakedParams::default() };
    let moved = scan(&model, Vec3::new(0.3, 0.1, -0.2));
    let found = fit_naked(&moved, &model, &paper, &mut |_| {}).unwrap();
    assert!(found.report.residual_mean < 1e-3, "{:?}", found.report);
    // A scan that the robust fit refuses.
    let small = Scan::from_clean_mesh(model.template.map_points(|p| Point::from(p.coords * 0.4)), None);
    let strict = NakedParams { iterations: 2, ..paper };
    assert!(fit_naked(&small, &model, &strict, &mut |_| {}).is_ok());
}

#[test]
fn eqs_5_and_6_have_no_offset_and_refuse_nothing() {
    let model = embedded_model().unwrap();
    let body = fitted(&model);
    let figure = body.figure(&model);
    let cover = PerVertex::filled(Cover::Tight, model.template.vertex_count());
    let params = InsideParams { method: InsideMethod::Paper, iterations: 3, ..InsideParams::default() };
    let small = Scan::from_clean_mesh(model.template.map_points(|p| Point::from(p.coords * 0.9)), None);
    let found = fit_inside(&small, &figure, &body.pose, &cover, &model.limits, &params, &mut |_| {}).unwrap();
    assert!(found.offsets.iter().all(|offset| *offset == 0.0));
    assert!(found.report.outside_share > 0.1 && !found.report.is_confident(), "{:?}", found.report);
}
