//! The checks on invented surfaces: a ball for the body, its upper half for the garment.

use super::hems::most_ragged_hem;
use super::holes::{largest_hole, largest_unseen_part};
use super::*;
use crate::body::Stance;
use crate::cut::Garment;
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, VertexId, sphere};
use crate::scan::Scan;
use crate::segment::Inner;

const SKIN: [u8; 3] = [205, 160, 140];
const BLUE: [u8; 3] = [30, 50, 150];

fn ball() -> TriMesh {
    sphere(24, 48)
}

/// The ball with its upper half moved outward and painted.
fn dressed(stand_off: f64, color: [u8; 3]) -> (Scan, PerVertex<bool>) {
    let labels: PerVertex<bool> = ball().points().iter().map(|p| p.y > 0.0).collect();
    let mesh =
        ball().map_points(|p| if p.y > 0.0 { Point::from(p.coords * (1.0 + stand_off / p.coords.norm())) } else { *p });
    let colors = labels.iter().map(|&garment| if garment { color } else { SKIN }).collect();
    (Scan::from_clean_mesh(mesh, Some(colors)), labels)
}

/// The labelled faces, with their rim as the hem.
fn half(scan: &Scan, labels: &PerVertex<bool>) -> Garment {
    let kept = scan.mesh.faces().iter().map(|face| face.iter().all(|&v| labels[v])).collect();
    let (mesh, _) = scan.mesh.part(&kept);
    let hem_loops = Adjacency::prepare(&mesh).boundary_loops();
    Garment { mesh, colors: None, hem_loops, findings: Vec::new() }
}

fn doubts(scan: &Scan, labels: &PerVertex<bool>, inner: &[Inner]) -> Vec<Doubt> {
    check_garment(&GarmentResult { scan, garment: &half(scan, labels), labels, inner })
        .unwrap()
        .doubts("shirt", &["vest"])
}

fn skin() -> PerVertex<[u8; 3]> {
    PerVertex::filled(SKIN, ball().vertex_count())
}

#[test]
fn a_garment_of_another_colour_or_off_the_body_is_plausible() {
    let (body, colors) = (ball(), skin());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }];
    for (stand_off, color) in [(0.001, BLUE), (0.015, SKIN), (0.015, BLUE)] {
        let (scan, labels) = dressed(stand_off, color);
        assert_eq!(doubts(&scan, &labels, &inner), [], "{stand_off} {color:?}");
    }
}

#[test]
fn a_shirt_of_skin_is_reported_as_absent() {
    let (body, colors) = (ball(), skin());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }];
    let (scan, labels) = dressed(0.003, SKIN);
    let found = doubts(&scan, &labels, &inner);
    assert!(found.len() == 1 && found[0].what.starts_with("the scan seems to show no shirt: 100 %"), "{found:?}");
    // Without colours, a surface that nearly touches the body is only a possibility.
    let bare = Scan { colors: None, ..scan };
    let found = doubts(&bare, &labels, &inner);
    assert!(found.len() == 1 && found[0].what.starts_with("the scan may show no shirt"), "{found:?}");
}

#[test]
fn an_earlier_garment_that_is_gone_is_named() {
    let (body, colors) = (ball(), skin());
    let vest = ball().map_points(|p| Point::from(p.coords * 1.004));
    let blue = PerVertex::filled(BLUE, vest.vertex_count());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }, Inner { mesh: &vest, colors: Some(&blue) }];
    let (scan, labels) = dressed(0.02, [250, 250, 240]);
    let found = doubts(&scan, &labels, &inner);
    assert!(found.iter().any(|d| d.what.starts_with("the scan does not show the vest on 100 %")), "{found:?}");
    let with_vest = Scan { colors: Some(labels.iter().map(|&l| if l { SKIN } else { BLUE }).collect()), ..scan };
    let found = doubts(&with_vest, &labels, &inner);
    assert!(!found.iter().any(|d| d.what.contains("does not show the vest")), "{found:?}");
}

#[test]
fn a_body_that_leans_is_doubted_with_its_up_axis() {
    let body = |tilt_deg: f64| BodyPlausibility {
        tilt: Some(tilt_deg.to_radians()),
        posture: Posture { hip_bend: Some(0.2), knee_bend: Some(0.1) },
        unlike_hands_share: None,
        bent_p90: None,
        bent_median: None,
        fitted_p95: Some(0.005),
        deviation: 1.0,
        largest_unseen: None,
    };
    assert!(body(4.0).doubts().is_empty());
    let doubts = body(92.0).doubts();
    assert!(doubts.len() == 1 && doubts[0].what.contains("leans 92°"), "{doubts:?}");
    assert!(doubts[0].remedy.contains("--up"), "{doubts:?}");
}

#[test]
fn a_person_who_does_not_stand_is_doubted_and_one_who_stands_is_not() {
    let model = crate::body::embedded_model().unwrap();
    let (_, skeleton) = model.shaped(&model.mean_shape());
    let doubt = |stance: Stance| Posture::of(&skeleton, &stance.pose(&skeleton)).doubt().map(|d| d.what);
    for standing in
        [Stance::Bind, Stance::Upright, Stance::TPose, Stance::ArmsUp, Stance::ArmsForward, Stance::HeadTurned]
    {
        assert_eq!(doubt(standing), None, "{standing:?}");
    }
    assert!(doubt(Stance::Squat).is_some_and(|what| what.ends_with("the person seems to sit or squat")));
    assert!(doubt(Stance::ThighRaised).is_some());
    // The posture is that of the person, not of the frame.
    let mut turned = Stance::Squat.pose(&skeleton);
    let before = Posture::of(&skeleton, &turned);
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.4, 1.1, -0.7);
    turned.rotations[0] = turn * turned.rotations[0];
    let after = Posture::of(&skeleton, &turned);
    assert!((after.hip_bend.unwrap() - before.hip_bend.unwrap()).abs() < 1e-9);
    assert!((after.knee_bend.unwrap() - before.knee_bend.unwrap()).abs() < 1e-9);
}

#[test]
fn somebody_who_bends_forward_is_not_told_to_change_the_up_axis() {
    let bent = BodyPlausibility {
        tilt: Some(1.0),
        posture: Posture { hip_bend: Some(1.0), knee_bend: Some(0.1) },
        unlike_hands_share: None,
        bent_p90: None,
        bent_median: None,
        fitted_p95: None,
        deviation: 1.0,
        largest_unseen: None,
    };
    let doubts = bent.doubts();
    assert!(doubts.len() == 1 && doubts[0].what.contains("sit or to bend forward"), "{doubts:?}");
}

#[test]
fn surfaces_and_arrays_that_do_not_belong_together_are_refused() {
    let (scan, labels) = dressed(0.01, BLUE);
    let garment = half(&scan, &labels);
    let none = check_garment(&GarmentResult { scan: &scan, garment: &garment, labels: &labels, inner: &[] });
    assert_eq!(none, Err(CheckError::NoBody));
    let (body, few) = (ball(), PerVertex(vec![SKIN; 3]));
    let inner = [Inner { mesh: &body, colors: Some(&few) }];
    let wrong = check_garment(&GarmentResult { scan: &scan, garment: &garment, labels: &labels, inner: &inner });
    assert!(matches!(wrong, Err(CheckError::WrongLength { given: 3, .. })), "{wrong:?}");
}

#[test]
fn the_largest_hole_has_the_area_of_its_rim() {
    let mesh = ball();
    assert_eq!(largest_hole(&mesh, &[]), 0.0, "a closed surface has no hole");
    let kept = mesh.face_ids().map(|f| mesh.triangle(f).iter().any(|p| p.y < 0.5)).collect();
    let (open, _) = mesh.part(&kept);
    let radius_squared = 1.0 - 0.5 * 0.5;
    let circle = std::f64::consts::PI * radius_squared;
    let found = largest_hole(&open, &[]);
    assert!((found / circle - 1.0).abs() < 0.15, "{found} {circle}");
    let rim = Adjacency::prepare(&open).boundary_loops();
    assert_eq!(largest_hole(&open, &rim), 0.0, "a hem is no hole");
    let cap = 2.0 * std::f64::consts::PI * 0.5;
    let (unseen, _) = largest_unseen_part(&mesh, &SurfaceIndex::prepare(&open), |_| false).unwrap();
    assert!((unseen / cap - 1.0).abs() < 0.15, "{unseen} {cap}");
    assert_eq!(largest_unseen_part(&mesh, &SurfaceIndex::prepare(&open), |_| true), None);
}

/// A closed line around the Y axis at the height of a waist, `count` points of which every second one is moved by `depth`, down and
/// up in turn.
fn waistband(count: usize, depth: f64) -> (PerVertex<Point>, Vec<Vec<VertexId>>) {
    let point = |i: usize| {
        let around = std::f64::consts::TAU * i as f64 / count as f64;
        Point::new(0.15 * around.cos(), 1.0 + [depth, -depth][i % 2], 0.12 * around.sin())
    };
    ((0..count).map(point).collect(), vec![(0..count).map(VertexId::from_index).collect()])
}

fn ratio(hem: &(PerVertex<Point>, Vec<Vec<VertexId>>)) -> f64 {
    most_ragged_hem(&hem.0, &hem.1, 0.0).unwrap().length_per_smooth_length
}

#[test]
fn a_smooth_hem_is_as_long_as_its_smoothed_line_and_a_zigzag_is_not() {
    assert!((1.0..1.03).contains(&ratio(&waistband(200, 0.0))), "{}", ratio(&waistband(200, 0.0)));
    // Edges 4 mm along the line and 10 mm across: 2.5 times its length.
    let zigzag = ratio(&waistband(200, 0.005));
    assert!((2.0..3.0).contains(&zigzag), "{zigzag}");
    // The deeper the notches, the more ragged.
    let ratios: Vec<f64> = [0.0, 0.001, 0.002, 0.004].map(|depth| ratio(&waistband(200, depth))).to_vec();
    assert!(ratios.is_sorted_by(|a, b| a < b), "{ratios:?}");
    // A hem that only hangs lower on one side is smooth.
    let (points, hems) = waistband(200, 0.0);
    let slanted = points.iter().map(|p| Point::new(p.x, p.y + 0.5 * p.x, p.z)).collect();
    assert!(ratio(&(slanted, hems)) < 1.03);
}

#[test]
fn the_raggedness_of_a_hem_depends_on_neither_frame_nor_sampling() {
    for depth in [0.0, 0.005] {
        let (points, hems) = waistband(200, depth);
        let before = ratio(&(points.clone(), hems.clone()));
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.4, 1.1, -0.7);
        let moved = points.iter().map(|p| turn * p + nalgebra::Vector3::new(3.0, -2.0, 1.0)).collect();
        assert!((ratio(&(moved, hems.clone())) - before).abs() < 1e-9);
        // Three points per edge.
        let count = points.len();
        let fine = (0..3 * count).map(|i| {
            let ends = [i / 3, (i / 3 + 1) % count].map(|k| points[VertexId::from_index(k)]);
            ends[0] + (ends[1] - ends[0]) * ((i % 3) as f64 / 3.0)
        });
        let fine = (fine.collect(), vec![(0..3 * count).map(VertexId::from_index).collect()]);
        assert!((ratio(&fine) - before).abs() < 1e-9 * before, "{} {before}", ratio(&fine));
        // Another first vertex, and the other way round.
        let mut turned = hems[0].clone();
        turned.rotate_left(77);
        assert!((ratio(&(points.clone(), vec![turned.clone()])) - before).abs() < 2e-3 * before);
        turned.reverse();
        assert!((ratio(&(points, vec![turned])) - before).abs() < 2e-3 * before);
    }
}

#[test]
fn a_ragged_hem_is_reported_where_it_is_and_a_short_one_is_not() {
    let (body, colors) = (ball(), skin());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }];
    let (scan, labels) = dressed(0.01, BLUE);
    let mut garment = half(&scan, &labels);
    let found = |garment: &Garment| {
        let checked = check_garment(&GarmentResult { scan: &scan, garment, labels: &labels, inner: &inner }).unwrap();
        (checked.most_ragged_hem.unwrap(), checked.doubts("shirt", &[]))
    };
    assert_eq!(found(&garment).1, []);
    // A quarter of the rim is torn by 4 cm.
    let mut points = garment.mesh.points().clone();
    for (i, &v) in garment.hem_loops[0].iter().enumerate() {
        let p = points[v];
        points[v] = if p.x > 0.7 && i % 2 == 0 { Point::new(p.x, p.y + 0.3, p.z) } else { p };
    }
    garment.mesh = garment.mesh.with_points(points);
    let (hem, doubts) = found(&garment);
    assert!(hem.at.x > 0.5, "{hem:?}");
    assert!(
        doubts.len() == 1 && doubts[0].what.starts_with("a hem of the shirt is ragged, most of all 1."),
        "{doubts:?}"
    );
    assert!(doubts[0].remedy.contains("mask shirt"), "{doubts:?}");
    let cuff = garment.mesh.points().iter().map(|p| Point::from(p.coords * 0.05)).collect();
    assert_eq!(most_ragged_hem(&cuff, &garment.hem_loops, 0.0), None, "30 cm around");
}
