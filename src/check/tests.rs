//! The checks on invented surfaces: a ball for the body, its upper half for the garment.

use super::holes::{largest_hole, largest_unseen_part};
use super::*;
use crate::body::Stance;
use crate::cut::{Garment, most_ragged_hem};
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
    let is_seen = PerVertex::filled(true, mesh.vertex_count());
    Garment { mesh, colors: None, is_seen, hem_loops, findings: Vec::new() }
}

fn doubts(scan: &Scan, labels: &PerVertex<bool>, inner: &[Inner]) -> Vec<Doubt> {
    checked(scan, &half(scan, labels), labels, inner).unwrap().doubts("shirt", &["vest"])
}

/// Jersey over a body without inward offsets.
fn checked(
    scan: &Scan,
    garment: &Garment,
    labels: &PerVertex<bool>,
    inner: &[Inner],
) -> Result<GarmentPlausibility, CheckError> {
    let skin = ball();
    let none = PerVertex::filled(false, skin.vertex_count());
    let by_hand = &PerVertex::filled(false, labels.len());
    let (others, changing) = (None, &none);
    let result =
        GarmentResult { scan, garment, labels, by_hand, others, inner, skin: &skin, changing, thickness: 0.0006 };
    check_garment(&result)
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
}

#[test]
fn without_colours_a_garment_that_is_no_farther_off_than_noise_and_fabric_may_be_absent() {
    let body = ball();
    let inner = [Inner { mesh: &body, colors: None }];
    for (stand_off, thickness, is_doubted) in [
        (0.0, 0.0006, true),
        (0.0015, 0.0006, true),
        (0.0025, 0.0006, false),
        (0.0025, 0.002, true),
        (0.005, 0.002, false),
    ] {
        let (scan, labels) = dressed(stand_off, SKIN);
        let scan = Scan { colors: None, ..scan };
        // The body keeps a margin to the scan; that it does is no garment.
        let drawn_in = ball().map_points(|p| Point::from(p.coords * 0.996));
        let inner_of_fit = [Inner { mesh: &drawn_in, colors: None }];
        for inner in [&inner[..], &inner_of_fit[..]] {
            let garment = half(&scan, &labels);
            let result = GarmentResult {
                scan: &scan,
                garment: &garment,
                labels: &labels,
                by_hand: &PerVertex::filled(false, labels.len()),
                others: None,
                inner,
                skin: &body,
                changing: &PerVertex::filled(false, body.vertex_count()),
                thickness,
            };
            let found = check_garment(&result).unwrap().doubts("shirt", &[]);
            let absent = found.iter().any(|d| d.what.starts_with("the scan may show no shirt"));
            assert_eq!(absent, is_doubted, "{stand_off} {thickness}: {found:?}");
        }
    }
}

#[test]
fn a_garment_that_stands_off_on_part_of_its_area_is_there() {
    let body = ball();
    let inner = [Inner { mesh: &body, colors: None }];
    let (scan, labels) = dressed(0.001, SKIN);
    let mesh = scan.mesh.map_points(|p| if p.y > 0.6 { Point::from(p.coords * 1.02) } else { *p });
    let scan = Scan::from_clean_mesh(mesh, None);
    assert_eq!(doubts(&scan, &labels, &inner), []);
}

#[test]
fn a_hole_made_by_hand_is_to_be_undone_and_another_one_scanned_again() {
    let (body, colors) = (ball(), skin());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }];
    let (scan, covered) = dressed(0.015, BLUE);
    let cap: PerVertex<bool> = scan.mesh.points().iter().map(|p| p.y > 0.9).collect();
    let labels: PerVertex<bool> = scan.mesh.vertex_ids().map(|v| covered[v] && !cap[v]).collect();
    let mut garment = half(&scan, &labels);
    let Garment { mesh, hem_loops, .. } = &mut garment;
    hem_loops.retain(|hem| mesh.points()[hem[0]].y < 0.5);
    let below: PerVertex<bool> = scan.mesh.points().iter().map(|p| p.y < -0.5).collect();
    for (by_hand, remedy) in [(&cap, "undo the stroke"), (&below, "scan again without the hole")] {
        let result = GarmentResult {
            scan: &scan,
            garment: &garment,
            labels: &labels,
            by_hand,
            others: None,
            inner: &inner,
            skin: &body,
            changing: &PerVertex::filled(false, body.vertex_count()),
            thickness: 0.0006,
        };
        let found = check_garment(&result).unwrap().doubts("shirt", &[]);
        let hole = found.iter().find(|doubt| doubt.what.starts_with("a hole of")).unwrap();
        assert!(hole.remedy.starts_with(remedy), "{hole:?}");
    }
}

#[test]
fn another_person_is_told_by_skin_that_keeps_its_shape_and_not_by_the_margin_of_the_fit() {
    let (body, colors) = (ball(), skin());
    let drawn_in = ball().map_points(|p| Point::from(p.coords * 0.996));
    let is_another = |scan: &Scan, labels: &PerVertex<bool>, changing: &PerVertex<bool>| {
        let inner = [Inner { mesh: &drawn_in, colors: Some(&colors) }];
        let garment = half(scan, labels);
        let result = GarmentResult {
            scan,
            garment: &garment,
            labels,
            by_hand: &PerVertex::filled(false, labels.len()),
            others: None,
            inner: &inner,
            skin: &body,
            changing,
            thickness: 0.0006,
        };
        check_garment(&result).unwrap().doubts("shirt", &[]).iter().any(|d| d.what.contains("another person"))
    };
    let (scan, labels) = dressed(0.015, BLUE);
    let none = PerVertex::filled(false, body.vertex_count());
    assert!(!is_another(&scan, &labels, &none), "the offsets of 4 mm are the margin of the fit");
    // Bare skin below the equator is elsewhere by 4 mm.
    let moved = scan.mesh.map_points(|p| if p.y > 0.0 { *p } else { Point::from(p.coords * 1.004) });
    let scan = Scan { mesh: moved, ..scan };
    assert!(is_another(&scan, &labels, &none));
    let changing = body.points().iter().map(|p| p.y <= 0.1).collect();
    assert!(!is_another(&scan, &labels, &changing), "hands that open and close");
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
fn an_edge_that_is_mostly_unseen_is_doubted() {
    let (scan, labels) = dressed(0.01, BLUE);
    let garment = half(&scan, &labels);
    let (body, skin) = (ball(), PerVertex::filled(SKIN, ball().vertex_count()));
    let mut found = checked(&scan, &garment, &labels, &[Inner { mesh: &body, colors: Some(&skin) }]).unwrap();
    assert_eq!(found.unseen_edge_share, Some(0.0));
    let before = found.doubts("scarf", &[]).len();
    found.unseen_edge_share = Some(0.39);
    let doubts = found.doubts("scarf", &[]);
    assert_eq!(doubts.len(), before + 1);
    assert!(doubts[before].what.contains("39 % of the edge of the scarf cannot be seen"), "{doubts:?}");
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
        on_head: 0.0,
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
        on_head: 0.0,
    };
    let doubts = bent.doubts();
    assert!(doubts.len() == 1 && doubts[0].what.contains("sit or to bend forward"), "{doubts:?}");
}

#[test]
fn surfaces_and_arrays_that_do_not_belong_together_are_refused() {
    let (scan, labels) = dressed(0.01, BLUE);
    let garment = half(&scan, &labels);
    assert_eq!(checked(&scan, &garment, &labels, &[]), Err(CheckError::NoBody));
    let (body, few) = (ball(), PerVertex(vec![SKIN; 3]));
    let inner = [Inner { mesh: &body, colors: Some(&few) }];
    let wrong = checked(&scan, &garment, &labels, &inner);
    assert!(matches!(wrong, Err(CheckError::WrongLength { given: 3, .. })), "{wrong:?}");
}

#[test]
fn the_largest_hole_has_the_area_of_its_rim() {
    let mesh = ball();
    assert_eq!(largest_hole(&mesh, &[]), None, "a closed surface has no hole");
    let kept = mesh.face_ids().map(|f| mesh.triangle(f).iter().any(|p| p.y < 0.5)).collect();
    let (open, _) = mesh.part(&kept);
    let radius_squared = 1.0 - 0.5 * 0.5;
    let circle = std::f64::consts::PI * radius_squared;
    let found = largest_hole(&open, &[]).unwrap().0;
    assert!((found / circle - 1.0).abs() < 0.15, "{found} {circle}");
    let rim = Adjacency::prepare(&open).boundary_loops();
    assert_eq!(largest_hole(&open, &rim), None, "a hem is no hole");
    let cap = 2.0 * std::f64::consts::PI * 0.5;
    let (unseen, _) = largest_unseen_part(&mesh, &SurfaceIndex::prepare(&open), |_| false).unwrap();
    assert!((unseen / cap - 1.0).abs() < 0.15, "{unseen} {cap}");
    assert_eq!(largest_unseen_part(&mesh, &SurfaceIndex::prepare(&open), |_| true), None);
}

/// A band around the Y axis, 80 cm long and 20 cm high, of `count` columns. Every second point of its lower edge, the hem, is moved
/// down by `depth`, the others up. It lies in folds, as deep as `fold`: cloth that is bent and not stretched.
fn waistband(count: usize, depth: f64, fold: f64) -> (TriMesh, Vec<Vec<VertexId>>) {
    // Places around the axis whose distances along the line are equal.
    let place = |turn: f64| {
        let radius = 0.13 + fold * (12.0 * turn).cos();
        [radius * turn.cos(), radius * turn.sin()]
    };
    const STEPS: usize = 200_000;
    let line: Vec<[f64; 2]> = (0..=STEPS).map(|i| place(std::f64::consts::TAU * i as f64 / STEPS as f64)).collect();
    let gaps: Vec<f64> = line.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).collect();
    let total: f64 = gaps.iter().sum();
    let (mut places, mut passed) = (Vec::new(), 0.0);
    for (p, gap) in line.iter().zip(&gaps) {
        if passed >= places.len() as f64 * total / count as f64 && places.len() < count {
            places.push(*p);
        }
        passed += gap;
    }
    const ROWS: usize = 5;
    let height = |row: usize, i: usize| match row {
        0 => 1.0 + [depth, -depth][i % 2],
        _ => 1.0 + 0.2 * row as f64 / (ROWS - 1) as f64,
    };
    let scale = 0.8 / total;
    let points = (0..ROWS * count).map(|at| {
        let (row, i) = (at / count, at % count);
        Point::new(scale * places[i][0], height(row, i), scale * places[i][1])
    });
    let mut faces = Vec::new();
    for row in 0..ROWS - 1 {
        for i in 0..count {
            let [a, b] = [i, (i + 1) % count].map(|i| (row * count + i) as u32);
            faces.extend([[a, a + count as u32, b], [b, a + count as u32, b + count as u32]]);
        }
    }
    let mesh = TriMesh::try_from_indices(points.collect(), &faces).unwrap();
    (mesh, vec![(0..count).map(VertexId::from_index).collect()])
}

fn ratio((mesh, hems): &(TriMesh, Vec<Vec<VertexId>>)) -> f64 {
    most_ragged_hem(mesh, hems, 0.0).unwrap().length_per_smooth_length
}

#[test]
fn a_smooth_hem_is_as_long_as_its_smoothed_line_and_a_zigzag_is_not() {
    let smooth = ratio(&waistband(200, 0.0, 0.0));
    assert!((1.0 - 1e-9..1.001).contains(&smooth), "{smooth}");
    // Edges 4 mm along the line and 10 mm across: 2.7 times its length.
    let zigzag = ratio(&waistband(200, 0.005, 0.0));
    assert!((2.5..2.8).contains(&zigzag), "{zigzag}");
    // The deeper the notches, the more ragged.
    let ratios: Vec<f64> = [0.0, 0.001, 0.002, 0.004].map(|depth| ratio(&waistband(200, depth, 0.0))).to_vec();
    assert!(ratios.is_sorted_by(|a, b| a < b), "{ratios:?}");
    // A hem that only hangs lower on one side is smooth.
    let (mesh, hems) = waistband(200, 0.0, 0.0);
    let slanted = mesh.map_points(|p| Point::new(p.x, p.y + 0.5 * p.x, p.z));
    assert!(ratio(&(slanted, hems)) < 1.01);
}

#[test]
fn folds_of_cloth_do_not_make_its_hem_ragged() {
    for depth in [0.0, 0.002] {
        let [flat, folded] = [0.0, 0.03].map(|fold| waistband(400, depth, fold));
        let length_of = |(mesh, hems): &(TriMesh, Vec<Vec<VertexId>>)| most_ragged_hem(mesh, hems, 0.0).unwrap().length;
        assert!((length_of(&folded) / length_of(&flat) - 1.0).abs() < 0.01, "cloth is not stretched");
        let ratios = [ratio(&flat), ratio(&folded)];
        assert!((ratios[1] / ratios[0] - 1.0).abs() < 0.01, "{ratios:?}");
    }
}

#[test]
fn the_raggedness_of_a_hem_depends_on_neither_frame_nor_sampling() {
    for depth in [0.0, 0.005] {
        let (mesh, hems) = waistband(200, depth, 0.0);
        let before = ratio(&(mesh.clone(), hems.clone()));
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.4, 1.1, -0.7);
        let moved = mesh.map_points(|p| turn * p + nalgebra::Vector3::new(3.0, -2.0, 1.0));
        assert!((ratio(&(moved, hems.clone())) - before).abs() < 1e-9);
        // Another first vertex, and the other way round.
        let mut turned = hems[0].clone();
        turned.rotate_left(77);
        assert!((ratio(&(mesh.clone(), vec![turned.clone()])) - before).abs() < 2e-3 * before);
        turned.reverse();
        assert!((ratio(&(mesh.clone(), vec![turned])) - before).abs() < 2e-3 * before);
        // A vertex more on every edge of the hem.
        let (mut points, mut faces) = (mesh.points().0.clone(), Vec::new());
        let count = hems[0].len();
        for face in mesh.faces().iter() {
            let cut = (0..3).find(|&k| face[k].index() < count && face[(k + 1) % 3].index() < count);
            let Some(k) = cut else {
                faces.push(face.map(|v| v.0));
                continue;
            };
            let [a, b, c] = [face[k], face[(k + 1) % 3], face[(k + 2) % 3]];
            let middle = points.len() as u32;
            points.push(nalgebra::center(&points[a.index()], &points[b.index()]));
            faces.extend([[a.0, middle, c.0], [middle, b.0, c.0]]);
        }
        let fine = TriMesh::try_from_indices(points, &faces).unwrap();
        let around = Adjacency::prepare(&fine).boundary_loops();
        let hem = around.into_iter().find(|ring| ring.contains(&VertexId(0))).unwrap();
        assert_eq!(hem.len(), 2 * count);
        assert!((ratio(&(fine, vec![hem])) - before).abs() < 2e-3 * before);
    }
}

#[test]
fn a_ragged_hem_is_reported_where_it_is_and_a_short_one_is_not() {
    let (body, colors) = (ball(), skin());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }];
    let (scan, labels) = dressed(0.01, BLUE);
    let garment_of = |(mesh, hem_loops): (TriMesh, Vec<Vec<VertexId>>)| Garment {
        is_seen: PerVertex::filled(true, mesh.vertex_count()),
        mesh,
        colors: None,
        hem_loops,
        findings: Vec::new(),
    };
    let ragged = |garment: &Garment| {
        let checked = checked(&scan, garment, &labels, &inner).unwrap();
        let of_hems: Vec<Doubt> =
            checked.doubts("shirt", &[]).into_iter().filter(|doubt| doubt.what.contains("ragged")).collect();
        (checked.most_ragged_hem.unwrap(), of_hems)
    };
    let smooth = garment_of(waistband(200, 0.0, 0.0));
    assert_eq!(ragged(&smooth).1, []);
    // A part of the rim, in the middle of +x, is torn by 2 cm.
    let mut torn = smooth.clone();
    let mut points = torn.mesh.points().clone();
    for &v in torn.hem_loops[0].iter().filter(|v| v.index() % 2 == 0) {
        let p = points[v];
        points[v] = if p.x > 0.1 { Point::new(p.x, p.y + 0.02, p.z) } else { p };
    }
    torn.mesh = torn.mesh.with_points(points);
    let (hem, doubts) = ragged(&torn);
    assert!(hem.at.x > 0.05, "{hem:?}");
    assert!(doubts.len() == 1, "{doubts:?}");
    // The ball's lowest point is 1 m below its middle, the hem 1 m above that.
    assert!(doubts[0].what.starts_with("a hem of the shirt is ragged, most of all 2.0"), "{doubts:?}");
    assert!(doubts[0].remedy.contains("paint shirt"), "{doubts:?}");
    let cuff = torn.mesh.map_points(|p| Point::from(p.coords * 0.2));
    assert_eq!(most_ragged_hem(&cuff, &torn.hem_loops, 0.0), None, "16 cm around");
}

#[test]
fn a_hem_at_which_the_scan_ends_is_reported_with_its_height() {
    let (body, colors) = (ball(), skin());
    let inner = [Inner { mesh: &body, colors: Some(&colors) }];
    let (scan, labels) = dressed(0.01, BLUE);
    let garment = half(&scan, &labels);
    // Of the scan without the garment the part on one side of this plane is seen.
    let seen = |from: f64| {
        let stays = |face: &[VertexId; 3]| {
            face.iter().all(|&v| labels[v]) || face.iter().all(|&v| scan.mesh.points()[v].x > from)
        };
        let (mesh, was) = scan.mesh.part(&scan.mesh.faces().iter().map(stays).collect());
        let pick = |v: &VertexId| scan.colors.as_ref().unwrap()[*v];
        let part = Scan::from_clean_mesh(mesh, Some(was.iter().map(pick).collect()));
        let labels: PerVertex<bool> = was.iter().map(|&v| labels[v]).collect();
        checked(&part, &garment, &labels, &inner).unwrap()
    };
    assert!(seen(-9.0).cut_off_hems.is_empty(), "all is seen");
    assert!(seen(0.0).cut_off_hems.is_empty(), "half of the hem is seen");
    let nothing = seen(9.0);
    assert!(nothing.cut_off_hems.len() == 1 && nothing.cut_off_hems[0] < 0.1, "{:?}", nothing.cut_off_hems);
    let doubts = nothing.doubts("shirt", &[]);
    assert!(doubts.iter().any(|doubt| doubt.what.contains("is where the scan ends")), "{doubts:?}");
}
