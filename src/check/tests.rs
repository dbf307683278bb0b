//! The checks on invented surfaces: a ball for the body, its upper half for the garment.

use super::holes::{largest_hole, largest_unseen_part};
use super::*;
use crate::cut::Garment;
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, sphere};
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
