//! A ball as body, and bands of noisy cloth around it.

use super::untangle::untangle;
use super::*;
use crate::body::{HumanJoint, JointId, Layer, Side, Skeleton, SkinWeights};
use crate::geometry::{SurfaceIndex, Vec3, noise};
use crate::rig::RigReport;

/// Part of a sphere between two latitudes (degrees from the pole), outward; closed with 0 and 180.
fn band(radius: f64, from_deg: f64, to_deg: f64, rings: usize, sectors: usize) -> TriMesh {
    let mut points = Vec::new();
    let mut faces = Vec::new();
    let cap = |deg: f64| deg <= 0.0 || deg >= 180.0;
    let mut starts: Vec<(u32, bool)> = Vec::new();
    for i in 0..=rings {
        let deg = from_deg + (to_deg - from_deg) * i as f64 / rings as f64;
        starts.push((points.len() as u32, cap(deg)));
        for s in 0..if cap(deg) { 1 } else { sectors } {
            let (polar, around) = (deg.to_radians(), std::f64::consts::TAU * s as f64 / sectors as f64);
            points.push(Point::new(polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos()) * radius);
        }
    }
    for pair in starts.windows(2) {
        for s in 0..sectors as u32 {
            let at = |ring: usize, s: u32| pair[ring].0 + if pair[ring].1 { 0 } else { s % sectors as u32 };
            if !pair[1].1 {
                faces.push([at(0, s), at(1, s), at(1, s + 1)]);
            }
            if !pair[0].1 {
                faces.push([at(0, s), at(1, s + 1), at(0, s + 1)]);
            }
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

fn shaken(mesh: &TriMesh, amplitude: f64, seed: u64) -> TriMesh {
    let mut next = noise(seed);
    let moved: Vec<Point> = mesh.points().iter().map(|p| p + Vec3::new(next(), next(), next()) * amplitude).collect();
    mesh.with_points(moved)
}

fn layer(name: &str, mesh: TriMesh, joint: u16) -> Layer {
    let weights = SkinWeights::from_rows(mesh.vertex_ids().map(|_| vec![(JointId(joint), 1.0)]));
    Layer::plain(name, mesh, weights)
}

fn figure(layers: Vec<Layer>) -> Figure {
    let skeleton = Skeleton {
        names: [HumanJoint::Hips, HumanJoint::UpperArm(Side::Left)].map(|joint| joint.name().to_string()).to_vec(),
        parents: vec![None, Some(JointId(0))],
        joints_in_bind: vec![Point::origin(), Point::new(0.1, 0.0, 0.0)],
    };
    Figure { skeleton, layers }
}

/// The new garment after stacking, and the report.
fn outermost(garment: &RiggedGarment, figure: &Figure, params: &StackParams) -> (TriMesh, StackReport) {
    let Stacked { mut garments, report } = stack(garment, None, figure, params).unwrap();
    assert_eq!(garments.len(), figure.layers.len(), "the inner garments and the new one");
    (garments.pop().unwrap(), report)
}

fn ball() -> Layer {
    layer("body", band(0.15, 0.0, 180.0, 40, 60), 0)
}

fn garment(mesh: TriMesh, joint: u16) -> RiggedGarment {
    let layer = layer("", mesh, joint);
    RiggedGarment { mesh: layer.mesh, weights: layer.weights, colors: None, report: RigReport::default() }
}

#[test]
fn noisy_cloth_on_the_skin_comes_clear_without_spikes() {
    // 4 mm inside at the back, 6 mm clear in front.
    let cloth = shaken(&band(0.151, 40.0, 130.0, 36, 110), 0.0015, 5).map_points(|p| p + Vec3::z() * 0.005);
    let (stacked, report) = outermost(&garment(cloth.clone(), 0), &figure(vec![ball()]), &StackParams::default());
    let [body] = report.layers.as_slice() else { panic!("{report:?}") };
    assert!(body.inside_before > 200 && body.intersecting_pairs_before > 500, "{body:?}");
    assert_eq!((body.inside_after, body.intersecting_pairs_after), (0, 0));
    assert!(report.mean_move_of_clear < 5e-4 && report.max_move < 8e-3, "{report:?}");
    let roughness = |mesh: &TriMesh| {
        let normals = mesh.vertex_normals();
        mesh.face_ids()
            .map(|f| mesh.faces()[f].iter().map(|&v| 1.0 - normals[v].dot(&mesh.face_normal(f))).sum::<f64>())
            .sum::<f64>()
    };
    assert!(roughness(&stacked) < roughness(&cloth), "smoother than it came");
}

#[test]
fn a_second_layer_comes_clear_of_the_first_and_of_the_body() {
    let shirt = layer("shirt", shaken(&band(0.156, 30.0, 120.0, 30, 90), 0.0005, 3), 0);
    // Flattened at one side, so that it cuts into shirt and ball; and longer than the shirt.
    let flattened = band(0.17, 30.0, 140.0, 40, 120).map_points(|p| Point::new(p.x, p.y, p.z.min(0.145)));
    let (stacked, report) =
        outermost(&garment(flattened.clone(), 0), &figure(vec![ball(), shirt]), &StackParams::default());
    assert!(report.layers.iter().all(|l| l.inside_before > 50 && l.intersecting_pairs_before > 50), "{report:?}");
    assert_eq!((report.inside, report.crossing_pairs), (0, 0), "{report:?}");
    for (p, q) in flattened.points().iter().zip(stacked.points().iter()) {
        assert!(p.z > -0.05 || (p - q).norm() < 1e-3, "the far side stays");
    }
}

#[test]
fn the_paper_method_is_equation_7_along_the_vertex_normal() {
    // Lopsided, so that the normals of the cloth do not point to the closest point of the ball.
    let cloth = band(0.149, 50.0, 130.0, 20, 60).map_points(|p| Point::new(p.x, p.y * 0.8, p.z) + Vec3::x() * 0.003);
    let params = StackParams { method: StackMethod::Paper, clearance: 0.003, ..StackParams::default() };
    let (stacked, report) = outermost(&garment(cloth.clone(), 0), &figure(vec![ball()]), &params);
    let body = SurfaceIndex::prepare(&ball().mesh);
    let normals = cloth.vertex_normals();
    let mut tilted = 0;
    for (v, p) in cloth.points().enumerate() {
        let signed = body.signed_distance(p);
        let expected = if signed < 0.0 { p + normals[v] * (0.003 - signed) } else { *p };
        assert!((stacked.points()[v] - expected).norm() < 1e-12);
        tilted += usize::from(signed < 0.0 && normals[v].dot(&p.coords.normalize()) < 0.98);
    }
    assert!(report.layers[0].inside_before > 100 && report.layers[0].inside_before < cloth.vertex_count());
    assert!(tilted > 20, "only {tilted} normals differ from the direction to the surface");
}

#[test]
fn pushing_moves_each_vertex_to_the_clearance() {
    let cloth = band(0.146, 50.0, 130.0, 20, 60);
    let params = StackParams { method: StackMethod::Push, clearance: 0.003, ..StackParams::default() };
    let (stacked, report) = outermost(&garment(cloth.clone(), 0), &figure(vec![ball()]), &params);
    assert_eq!(report.layers[0].inside_before, cloth.vertex_count());
    assert_eq!(report.layers[0].inside_after, 0);
    let ball = ball();
    let body = obstacle::Obstacle::prepare(&ball.mesh, &ball.weights, &[Limb::Trunk, Limb::Arm(Side::Left)], &params);
    for (p, q) in cloth.points().iter().zip(stacked.points().iter()) {
        assert!((body.index.signed_distance(q) - 0.003).abs() < 1e-6, "k above the surface");
        assert!((q - p).cross(&p.coords).norm() < 1e-4, "towards the closest surface point");
    }
}

#[test]
fn a_limb_that_only_happens_to_be_near_is_not_pushed_around_the_other() {
    // A sleeve that dips 4 mm into the ball: as part of the trunk it is pushed round it, as an arm's it is only separated.
    let sleeve = band(0.04, 40.0, 140.0, 12, 24).map_points(|p| p + Vec3::new(0.186, 0.0, 0.0));
    let params = StackParams { method: StackMethod::Push, ..StackParams::default() };
    let (own, report) = outermost(&garment(sleeve.clone(), 0), &figure(vec![ball()]), &params);
    assert!(own != sleeve && report.layers[0].inside_after == 0, "{report:?}");
    let (stacked, report) = outermost(&garment(sleeve.clone(), 1), &figure(vec![ball()]), &params);
    assert_eq!(stacked, sleeve);
    assert!(report.inside > 0 && report.crossing_pairs > 0, "what stays inside is said: {report:?}");
    let (separated, report) = outermost(&garment(sleeve, 1), &figure(vec![ball()]), &StackParams::default());
    assert!(separated.face_count() > 0 && (report.inside, report.crossing_pairs) == (0, 0), "{report:?}");
}

#[test]
fn one_thread_and_many_give_the_same_bytes() {
    let cloth = garment(shaken(&band(0.151, 60.0, 120.0, 20, 80), 0.0015, 9), 0);
    let run = || stack(&cloth, None, &figure(vec![ball()]), &StackParams::default()).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run);
    let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap().install(run);
    assert_eq!(one, three);
}

#[test]
fn what_cannot_be_stacked_is_said() {
    let empty = garment(TriMesh::try_from_indices(vec![Point::origin()], &[]).unwrap(), 0);
    let params = StackParams::default();
    let error = stack(&empty, None, &figure(vec![ball()]), &params).unwrap_err();
    assert!(matches!(error, StackError::EmptyGarment) && error.hint().is_some());
    let cloth = garment(band(0.16, 60.0, 120.0, 4, 12), 0);
    let bare = RiggedGarment { weights: SkinWeights::from_rows([]), ..cloth };
    assert!(matches!(
        stack(&bare, None, &figure(vec![ball()]), &params),
        Err(StackError::WrongLength { weights: 0, .. })
    ));
}

#[test]
fn layers_and_parameters_that_do_not_fit_are_refused() {
    let cloth = garment(band(0.16, 60.0, 120.0, 4, 12), 0);
    let params = StackParams::default();
    let mut naked = figure(vec![ball()]);
    naked.layers[0].weights = SkinWeights::from_rows([]);
    let error = stack(&cloth, None, &naked, &params).unwrap_err();
    assert!(matches!(error, StackError::WrongLength { weights: 0, .. }), "{error}");
    let stranger = garment(cloth.mesh.clone(), 40_000);
    let error = stack(&stranger, None, &figure(vec![ball()]), &params).unwrap_err();
    assert!(matches!(error, StackError::NoSuchJoint { joint: 40_000, .. }), "{error}");
    let error = stack(&cloth, None, &figure(vec![ball()]), &StackParams { clearance: f64::NAN, ..params }).unwrap_err();
    assert!(matches!(error, StackError::Parameter(_)), "{error}");
    let surfaces = [ball().mesh];
    let dressed = figure(vec![ball(), layer("shirt", cloth.mesh.clone(), 0)]);
    let error = press(&dressed, &surfaces, &PressParams::default()).unwrap_err();
    assert!(matches!(error, StackError::SurfaceCount { surfaces: 1, layers: 2 }), "{error}");
}

#[test]
fn a_shirt_under_a_jacket_is_pressed_between_it_and_the_body() {
    let loose = shaken(&band(0.163, 30.0, 150.0, 40, 120), 0.001, 3);
    let jacket = shaken(&band(0.157, 50.0, 120.0, 24, 110), 0.0005, 8);
    let figure = figure(vec![ball(), layer("shirt", loose.clone(), 0), layer("jacket", jacket.clone(), 0)]);
    let surfaces: Vec<TriMesh> = figure.layers.iter().map(|l| l.mesh.clone()).collect();
    let (pressed_meshes, reports) = press(&figure, &surfaces, &PressParams::default()).unwrap();
    assert!(reports[0].outside_before > 1000 && reports[0].outside_after == 0, "{reports:?}");
    assert!(reports[1].max_move < 2e-4, "there is room, so what was observed stays: {reports:?}");
    let jacket = SurfaceIndex::prepare(&jacket);
    let body = SurfaceIndex::prepare(&surfaces[0]);
    for (p, pressed) in loose.points().iter().zip(pressed_meshes[0].points().iter()) {
        assert!(body.signed_distance(pressed) > 0.0);
        let polar_deg = (p.y / p.coords.norm()).acos().to_degrees();
        if (55.0..115.0).contains(&polar_deg) {
            assert!(jacket.signed_distance(pressed) < 0.0, "under the jacket at {polar_deg}°");
        }
        if !(28.0..142.0).contains(&polar_deg) {
            assert!((pressed - p).norm() < 1e-4, "what the jacket leaves free keeps its shape");
        }
    }
}

#[test]
fn a_shirt_that_hung_loose_is_pressed_below_the_trousers_it_is_tucked_into() {
    let trousers = garment(shaken(&band(0.155, 90.0, 150.0, 30, 110), 0.0005, 8), 0);
    let worn = |radius: f64| {
        let shirt = shaken(&band(radius, 30.0, 120.0, 40, 120), 0.0005, 3);
        let figure = figure(vec![ball(), layer("shirt", shirt.clone(), 0)]);
        (stack(&trousers, None, &figure, &StackParams::default()).unwrap(), shirt)
    };
    let polar_deg = |p: &Point| (p.y / p.coords.norm()).acos().to_degrees();
    let moved = |stacked: &Stacked, shirt: &TriMesh, degrees: std::ops::Range<f64>| {
        let moves = shirt.points().iter().zip(stacked.garments[0].points().iter());
        let within: Vec<f64> =
            moves.filter(|(p, _)| degrees.contains(&polar_deg(p))).map(|(p, q)| (p - q).norm()).collect();
        within.iter().sum::<f64>() / within.len() as f64
    };
    let (tucked, shirt) = worn(0.19);
    assert_eq!((tucked.report.inside, tucked.report.crossing_pairs), (0, 0), "{:?}", tucked.report);
    assert!(tucked.report.mean_move < 0.002, "the trousers stay where they were scanned: {:?}", tucked.report);
    assert!(moved(&tucked, &shirt, 95.0..120.0) > 0.03);
    assert!(moved(&tucked, &shirt, 30.0..75.0) < 1e-4, "above the trousers the shirt keeps its shape");
    let (over, shirt) = worn(0.165);
    assert!(
        moved(&over, &shirt, 30.0..120.0) < 0.002,
        "a shirt a centimetre out is not pressed: the trousers go over it"
    );
    assert!(over.report.mean_move > 2.0 * tucked.report.mean_move);
}

#[test]
fn where_there_is_no_room_the_body_wins_and_the_outermost_yields() {
    let shirt = band(0.156, 40.0, 140.0, 30, 100);
    let belt = band(0.1503, 70.0, 110.0, 16, 100);
    let figure = figure(vec![ball(), layer("shirt", shirt, 0), layer("belt", belt, 0)]);
    let surfaces: Vec<TriMesh> = figure.layers.iter().map(|l| l.mesh.clone()).collect();
    let (pressed_meshes, reports) = press(&figure, &surfaces, &PressParams::default()).unwrap();
    let body = SurfaceIndex::prepare(&surfaces[0]);
    assert!(pressed_meshes.iter().all(|mesh| mesh.points().iter().all(|p| body.signed_distance(p) > 0.0)));
    assert!(reports[0].max_move > 0.003, "the shirt gives way as far as it can: {reports:?}");
    assert!((0.0005..0.004).contains(&reports[1].max_move), "0.3 mm hold no shirt: {reports:?}");
    assert!(
        pressed_meshes[1].points().iter().all(|p| p.coords.norm() < 0.155),
        "not carried out to where the shirt was"
    );
}

/// A tube around the y axis of `place`.
fn tube(place: Vec3, radius: f64) -> TriMesh {
    let (rings, sectors) = (24, 40);
    let mut points = Vec::new();
    let mut faces = Vec::new();
    for i in 0..=rings {
        for s in 0..sectors {
            let around = std::f64::consts::TAU * f64::from(s) / f64::from(sectors);
            let y = 0.3 * f64::from(i) / f64::from(rings) - 0.15;
            points.push(Point::from(place + Vec3::new(radius * around.sin(), y, radius * around.cos())));
            if i < rings {
                let (a, b) = (i * sectors + s, i * sectors + (s + 1) % sectors);
                faces.push([a, b, a + sectors].map(|v| v as u32));
                faces.push([b, b + sectors, a + sectors].map(|v| v as u32));
            }
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

fn joined(a: &TriMesh, b: &TriMesh) -> TriMesh {
    let points = a.points().iter().chain(b.points().iter()).copied().collect();
    let shifted = b.faces().iter().map(|f| f.map(|v| v.0 + a.vertex_count() as u32));
    let faces: Vec<[u32; 3]> = a.faces().iter().map(|f| f.map(|v| v.0)).chain(shifted).collect();
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// Crossing pairs of all layers, with the body and with themselves.
fn crossings(layers: &[TriMesh]) -> usize {
    pairs_of(&sheets::Sheets::join(layers).unwrap().piercings()).len()
}

#[test]
fn a_garment_that_crosses_itself_is_separated_and_the_rest_of_it_stays() {
    // Two sleeves side by side, 3 mm into each other, as a sleeve and the side at an armpit.
    let body = joined(&tube(Vec3::x() * -0.05, 0.045), &tube(Vec3::x() * 0.05, 0.045));
    let cloth = joined(&tube(Vec3::x() * -0.05, 0.0515), &tube(Vec3::x() * 0.05, 0.0515));
    let before = crossings(&[body.clone(), cloth.clone()]);
    assert!(before > 20, "{before}");
    let untangled = untangle(&[body.clone(), cloth.clone()], 60, 0.05).unwrap();
    assert!(untangled.left.is_empty(), "{} of {before} left", untangled.left.len());
    assert_eq!(crossings(&[body, untangled.garments[0].clone()]), 0);
    for (p, q) in cloth.points().iter().zip(untangled.garments[0].points().iter()) {
        assert!((p - q).norm() < 4e-3, "a small move: {}", (p - q).norm());
        assert!(p.x.abs() < 0.02 || (p - q).norm() < 1e-6, "what is clear stays");
    }
}

#[test]
fn a_fold_over_in_the_cloth_is_smoothed_away() {
    let mut cloth = tube(Vec3::zeros(), 0.06);
    let tip = cloth.vertex_ids().nth(12 * 40 + 5).unwrap();
    let mut points = cloth.points().clone();
    let inwards = points[tip].coords.normalize() * -0.002;
    points[tip] += inwards + Vec3::y() * 0.03;
    // The cloth above the fold dips below it.
    let above = cloth.vertex_ids().nth(14 * 40 + 5).unwrap();
    points[above] += inwards * 3.0;
    cloth = cloth.with_points(points);
    let body = tube(Vec3::zeros(), 0.05);
    let before = crossings(&[body.clone(), cloth.clone()]);
    assert!(before > 0);
    let untangled = untangle(&[body, cloth], 60, 0.05).unwrap();
    assert!(untangled.left.is_empty(), "{} of {before} left", untangled.left.len());
}

#[test]
fn the_result_is_of_f32_coordinates() {
    let cloth = shaken(&band(0.151, 60.0, 120.0, 20, 80), 0.0015, 9);
    let (stacked, _) = outermost(&garment(cloth, 0), &figure(vec![ball()]), &StackParams::default());
    let is_f32 = |p: &Point| p.coords.iter().all(|&c| f64::from(c as f32) == c);
    assert!(stacked.points().iter().all(is_f32));
}
