//! Laws of the cut, on a tube with a ragged label boundary.

use super::{BodyBelow, CutError, CutParams, EarlierCuts, Garment, cut_again};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::{Labels, Segmentation};

fn cut(scan: &Scan, segmentation: &Segmentation) -> Result<Garment, CutError> {
    let covered = PerVertex::filled(true, scan.mesh.vertex_count());
    let body = BodyBelow { mesh: &scan.mesh, covered: &covered, goes_between_legs: false };
    super::cut(scan, &Adjacency::prepare(&scan.mesh), segmentation, &body, 1..=1, &CutParams::default())
}

const SECTORS: u32 = 120;
const RINGS: u32 = 100;

/// A tube 20 cm across and 50 cm high, its lower end open, its upper end closed by a cone, coloured by height.
fn tube() -> Scan {
    let mut points = Vec::new();
    for i in 0..=RINGS {
        let height = 0.5 * f64::from(i) / f64::from(RINGS);
        for j in 0..SECTORS {
            let turn = std::f64::consts::TAU * f64::from(j) / f64::from(SECTORS);
            points.push(Point::new(0.1 * turn.cos(), height, -0.1 * turn.sin()));
        }
    }
    points.push(Point::new(0.0, 0.55, 0.0));
    let mut faces = Vec::new();
    for i in 0..RINGS {
        for j in 0..SECTORS {
            let [a, b] = [i * SECTORS + j, i * SECTORS + (j + 1) % SECTORS];
            faces.extend([[a, b, b + SECTORS], [a, b + SECTORS, a + SECTORS]]);
        }
    }
    let (top, apex) = (RINGS * SECTORS, (RINGS + 1) * SECTORS);
    faces.extend((0..SECTORS).map(|j| [top + j, top + (j + 1) % SECTORS, apex]));
    let colors = points.iter().map(|p: &Point| [(p.y * 400.0) as u8, 0, 9]).collect();
    Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), Some(colors))
}

/// Everything above 20 cm, but for ±5 mm of noise from vertex to vertex.
fn ragged(scan: &Scan) -> Labels {
    let mut state = 3u64;
    let labels = scan.mesh.points().iter().map(|p| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        p.y > 0.2 + 0.01 * ((state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5)
    });
    Labels(labels.collect())
}

fn degrees_per_cm(mesh: &TriMesh, ring: &[VertexId]) -> f64 {
    let at = |i: usize| mesh.points()[ring[i % ring.len()]];
    let (mut turn, mut length) = (0.0, 0.0);
    for i in 0..ring.len() {
        let (u, v) = (at(i + 1) - at(i), at(i + 2) - at(i + 1));
        turn += u.angle(&v).to_degrees();
        length += u.norm();
    }
    turn / (100.0 * length)
}

#[test]
fn a_ragged_boundary_becomes_one_fair_hem_in_the_right_place() {
    let scan = tube();
    let garment = cut(&scan, &ragged(&scan).into()).unwrap();
    assert_eq!(garment.hem_loops.len(), 1, "{:?}", garment.findings);
    let ring = &garment.hem_loops[0];
    for &v in ring {
        assert!((garment.mesh.points()[v].y - 0.2).abs() < 0.006, "{}", garment.mesh.points()[v]);
    }
    // A circle of this size turns by 5.7° a centimetre.
    let roughness = degrees_per_cm(&garment.mesh, ring);
    assert!(roughness < 9.0, "{roughness}° a centimetre");
    assert_eq!(garment.colors.as_ref().unwrap().len(), garment.mesh.vertex_count());
    for (p, c) in garment.mesh.points().iter().zip(garment.colors.as_ref().unwrap().iter()) {
        assert!((f64::from(c[0]) - (p.y * 400.0).min(220.0)).abs() < 4.0 || p.y > 0.49, "{p} {c:?}");
    }
}

#[test]
fn a_hem_on_crumpled_cloth_is_not_ragged_and_the_cloth_keeps_its_girth() {
    // Fusion noise of 8 mm from vertex to vertex in the 4 cm around the hem.
    let smooth = tube();
    let mut state = 7u64;
    let points = smooth.mesh.points().iter().map(|p| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let noise = 0.016 * ((state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5);
        let share = if (p.y - 0.2).abs() < 0.02 { 1.0 } else { 0.0 };
        Point::new(p.x * (1.0 + 10.0 * share * noise), p.y, p.z * (1.0 + 10.0 * share * noise))
    });
    let mesh = smooth.mesh.with_points(points.collect::<Vec<_>>());
    let scan = Scan::from_clean_mesh(mesh, smooth.colors);
    let garment = cut(&scan, &ragged(&scan).into()).unwrap();
    let ratio = super::most_ragged_hem(&garment.mesh, &garment.hem_loops, 0.0).unwrap().length_per_smooth_length;
    assert!(ratio <= super::hems::hem::MOST_RAGGED, "{ratio}");
    let girth = garment.hem_loops[0].iter().map(|&v| garment.mesh.points()[v]).map(|p| p.x.hypot(p.z));
    let mean = girth.sum::<f64>() / garment.hem_loops[0].len() as f64;
    assert!((mean - 0.1).abs() < 0.002, "{mean}");
}

#[test]
fn the_garment_is_manifold_oriented_and_the_same_each_time() {
    let scan = tube();
    let labels = ragged(&scan);
    let garment = cut(&scan, &labels.clone().into()).unwrap();
    let mut directed: Vec<(u32, u32)> =
        garment.mesh.faces().iter().flat_map(|f| (0..3).map(|k| (f[k].0, f[(k + 1) % 3].0))).collect();
    let count = directed.len();
    directed.sort_unstable();
    directed.dedup();
    assert_eq!(directed.len(), count, "no edge is run twice in the same sense");
    for f in garment.mesh.face_ids().filter(|&f| garment.mesh.triangle(f).iter().all(|p| p.y < 0.49)) {
        let [a, b, c] = garment.mesh.triangle(f).map(|p| p.coords);
        let middle = (a + b + c) / 3.0;
        assert!(garment.mesh.area_vector(f).dot(&crate::geometry::Vec3::new(middle.x, 0.0, middle.z)) > 0.0);
    }
    assert_eq!(Adjacency::prepare(&garment.mesh).face_components().1, 1);
    assert_eq!(cut(&scan, &labels.clone().into()).unwrap(), garment);
}

#[test]
fn islands_go_and_are_told_pinholes_close() {
    let scan = tube();
    let mut labels = Labels(scan.mesh.points().iter().map(|p| p.y > 0.2).collect());
    let spot = |center: Point, radius: f64, value: bool, labels: &mut Labels| {
        for (v, p) in scan.mesh.points().enumerate() {
            if (p - center).norm() < radius {
                labels.0[v] = value;
            }
        }
    };
    spot(Point::new(0.1, 0.08, 0.0), 0.02, true, &mut labels);
    spot(Point::new(0.1, 0.4, 0.0), 0.006, false, &mut labels);
    let garment = cut(&scan, &labels.clone().into()).unwrap();
    assert_eq!(garment.hem_loops.len(), 1);
    assert_eq!(Adjacency::prepare(&garment.mesh).boundary_loops().len(), 1);
    assert!(garment.findings.iter().any(|f| f.contains("1 island")), "{:?}", garment.findings);
}

#[test]
fn a_spot_erased_by_hand_stays_open_and_one_added_stays() {
    let scan = tube();
    let spot = |center: Point, radius: f64| -> PerVertex<bool> {
        scan.mesh.points().iter().map(|p| (p - center).norm() < radius).collect()
    };
    let plain = Labels(scan.mesh.points().iter().map(|p| p.y > 0.2).collect());
    // 1.1 cm²: less than a pinhole, and than the least pore.
    let (erased, added) = (spot(Point::new(0.1, 0.4, 0.0), 0.006), spot(Point::new(0.1, 0.08, 0.0), 0.012));
    let by_hand: PerVertex<bool> = erased.iter().zip(added.iter()).map(|(&e, &a)| e || a).collect();
    let labels = Labels(plain.0.enumerate().map(|(v, &l)| (l && !erased[v]) || added[v]).collect());
    let marked = Segmentation { by_hand, ..labels.clone().into() };
    let garment = cut(&scan, &marked).unwrap();
    let adjacency = Adjacency::prepare(&garment.mesh);
    assert_eq!((adjacency.boundary_loops().len(), adjacency.face_components().1), (3, 2), "{:?}", garment.findings);
    let index = crate::geometry::SurfaceIndex::prepare(&garment.mesh);
    for (v, p) in scan.mesh.points().enumerate().filter(|&(v, _)| marked.by_hand[v]) {
        let gap = index.closest(p).distance;
        assert!((gap < 1e-3) == added[v], "{p} is {gap} m from the garment");
    }
    let unmarked = cut(&scan, &labels.into()).unwrap();
    assert_eq!(Adjacency::prepare(&unmarked.mesh).boundary_loops().len(), 1);
}

/// The tube from 20 cm up, with what `erased` says taken off by hand.
fn erased_by_hand(scan: &Scan, erased: impl Fn(&Point) -> bool) -> Segmentation {
    let cloth = |p: &Point| p.y > 0.2;
    let by_hand = scan.mesh.points().iter().map(|p| cloth(p) && erased(p)).collect();
    let labels = Labels(scan.mesh.points().iter().map(|p| cloth(p) && !erased(p)).collect());
    Segmentation { by_hand, ..labels.into() }
}

#[test]
fn cuts_of_a_scan_one_after_another_equal_first_cuts() {
    let scan = tube();
    let (around, covered) = (Adjacency::prepare(&scan.mesh), PerVertex::filled(true, scan.mesh.vertex_count()));
    let body = BodyBelow { mesh: &scan.mesh, covered: &covered, goes_between_legs: false };
    let earlier = EarlierCuts::default();
    // Strokes in the middle, at the hem, and at the hem elsewhere; then the second one is undone.
    for spots in [&[0.35][..], &[0.35, 0.21], &[0.35, 0.21, 0.19], &[0.35, 0.19], &[]] {
        let is_erased = |p: &Point| {
            spots.iter().any(|&y| (p - Point::new(0.1 * f64::cos(40.0 * y), y, 0.1 * f64::sin(40.0 * y))).norm() < 0.03)
        };
        let segmentation = erased_by_hand(&scan, is_erased);
        let again = cut_again(&scan, &around, &segmentation, &body, 1..=1, &CutParams::default(), &earlier);
        assert_eq!(again.unwrap(), cut(&scan, &segmentation).unwrap(), "{spots:?}");
    }
}

#[test]
fn a_hole_made_by_hand_is_no_hem_and_one_at_a_hem_or_all_round_is() {
    let scan = tube();
    let near = |center: Point, radius: f64| move |p: &Point| (p - center).norm() < radius;
    let cut = |erased: &dyn Fn(&Point) -> bool| cut(&scan, &erased_by_hand(&scan, erased)).unwrap();
    let hole = cut(&near(Point::new(0.1, 0.4, 0.0), 0.03));
    assert_eq!((hole.hem_loops.len(), Adjacency::prepare(&hole.mesh).boundary_loops().len()), (1, 2));
    // 28 cm² were painted; the cut runs within an edge outside of it.
    assert!(hole.findings.iter().any(|f| f.starts_with("1 hole made by hand, 3")), "{:?}", hole.findings);
    assert!(!hole.findings.iter().any(|f| f.contains("hem")), "{:?}", hole.findings);
    // A notch in the hem makes it longer; it is still the one.
    let notch = cut(&near(Point::new(0.1, 0.2, 0.0), 0.03));
    assert_eq!((notch.hem_loops.len(), Adjacency::prepare(&notch.mesh).boundary_loops().len()), (1, 1));
    assert!(!notch.findings.iter().any(|f| f.contains("hand")), "{:?}", notch.findings);
    // A band all round leaves two parts: three hems.
    let band = cut(&|p: &Point| (0.3..0.34).contains(&p.y));
    assert_eq!(band.hem_loops.len(), 3, "{:?}", band.findings);
}

#[test]
fn a_hole_made_by_hand_where_a_hem_is_missing_is_that_hem() {
    let scan = tube();
    // The whole tube down to its open end, which is the scan's; its second hem is made at the side.
    let center = Point::new(0.1, 0.3, 0.0);
    let erased = |p: &Point| (p - center).norm() < 0.07;
    let by_hand: PerVertex<bool> = scan.mesh.points().iter().map(erased).collect();
    let labels = Labels(by_hand.iter().map(|&e| !e).collect());
    let around = Adjacency::prepare(&scan.mesh);
    let covered = PerVertex::filled(true, scan.mesh.vertex_count());
    let body = BodyBelow { mesh: &scan.mesh, covered: &covered, goes_between_legs: false };
    let garment =
        super::cut(&scan, &around, &Segmentation { by_hand, ..labels.into() }, &body, 2..=2, &CutParams::default())
            .unwrap();
    assert_eq!(garment.hem_loops.len(), 2, "{:?}", garment.findings);
    assert!(!garment.findings.iter().any(|f| f.contains("hole")), "{:?}", garment.findings);
}

#[test]
fn an_unexpected_number_of_hems_is_reported() {
    let scan = tube();
    let labels = Labels(scan.mesh.points().iter().map(|p| (0.2..0.4).contains(&p.y)).collect());
    let garment = cut(&scan, &labels.clone().into()).unwrap();
    assert_eq!(garment.hem_loops.len(), 2);
    assert!(garment.findings.iter().any(|f| f.contains("2 hems found, 1 expected")), "{:?}", garment.findings);
}

#[test]
fn a_place_within_the_garment_is_closed_if_its_kind_has_no_hem_there() {
    let scan = tube();
    let without_spot = |radius: f64| -> Segmentation {
        let spot = Point::new(0.1, 0.35, 0.0);
        Labels(scan.mesh.points().iter().map(|p| p.y > 0.2 && (p - spot).norm() > radius).collect()).into()
    };
    let closed = cut(&scan, &without_spot(0.03)).unwrap();
    assert_eq!(closed.hem_loops.len(), 1);
    assert_eq!(Adjacency::prepare(&closed.mesh).boundary_loops().len(), 1);
    assert!(closed.findings.iter().any(|f| f.starts_with("closed 1 place within")), "{:?}", closed.findings);
    assert_eq!(cut(&scan, &without_spot(0.07)).unwrap().hem_loops.len(), 2, "150 cm²");
    let covered = PerVertex::filled(true, scan.mesh.vertex_count());
    let (body, around) =
        (BodyBelow { mesh: &scan.mesh, covered: &covered, goes_between_legs: false }, Adjacency::prepare(&scan.mesh));
    let two_hems = super::cut(&scan, &around, &without_spot(0.03), &body, 2..=2, &CutParams::default()).unwrap();
    assert_eq!(two_hems.hem_loops.len(), 2, "{:?}", two_hems.findings);
}

#[test]
fn labels_for_another_scan_and_none_at_all_are_refused() {
    let scan = tube();
    let few = Labels(PerVertex::filled(true, 7));
    assert!(matches!(cut(&scan, &few.clone().into()), Err(CutError::LabelCount { labels: 7, .. })));
    let none = Labels(PerVertex::filled(false, scan.mesh.vertex_count()));
    let error = cut(&scan, &none.clone().into()).unwrap_err();
    assert!(matches!(error, CutError::NothingLabelled { labelled: 0, .. }) && error.hint().is_some());
}

#[test]
fn arguments_that_do_not_belong_together_are_refused() {
    let scan = tube();
    let all: Segmentation = Labels(PerVertex::filled(true, scan.mesh.vertex_count())).into();
    let around = Adjacency::prepare(&scan.mesh);
    let params = CutParams::default();
    let covered = PerVertex::filled(true, scan.mesh.vertex_count());
    let body = BodyBelow { mesh: &scan.mesh, covered: &covered, goes_between_legs: false };
    let given = |scan: &Scan, around: &Adjacency, params: &CutParams| {
        super::cut(scan, around, &all, &body, 0..=4, params).unwrap_err()
    };
    let half = scan.mesh.part(&scan.mesh.face_ids().map(|f| f.index() % 2 == 0).collect()).0;
    let other = given(&scan, &Adjacency::prepare(&half), &params);
    assert!(matches!(other, CutError::WrongLength { .. }), "{other}");
    let colors = Scan { colors: Some(PerVertex::filled([0; 3], 3)), ..scan.clone() };
    let few = given(&colors, &around, &params);
    assert!(matches!(few, CutError::WrongLength { what: "colours", given: 3, .. }), "{few}");
    let unknown = given(&scan, &around, &CutParams { smoothing_radius: f64::NAN, ..params });
    assert!(matches!(unknown, CutError::Parameter(_)), "{unknown}");
    let reversed = std::ops::RangeInclusive::new(3, 2);
    let loops = super::cut(&scan, &around, &all, &body, reversed, &params).unwrap_err();
    assert!(matches!(loops, CutError::BadLoopRange { least: 3, most: 2 }), "{loops}");
}

#[test]
fn no_two_faces_span_the_same_vertices() {
    let scan = tube();
    // A fin: a third face on an edge of the tube. It is its own rim, whose filling would be its back.
    let mut points = scan.mesh.points().0.clone();
    let row = 70 * SECTORS;
    points.push(Point::new(0.103, 0.352, 0.0));
    let mut faces: Vec<[u32; 3]> = scan.mesh.faces().iter().map(|f| f.map(|v| v.0)).collect();
    faces.push([row, row + 1, points.len() as u32 - 1]);
    let finned = Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), None);
    let labels = Labels(finned.mesh.points().iter().map(|p| p.y > 0.2).collect());
    let garment = cut(&finned, &labels.into()).unwrap();
    let mut spans: Vec<[VertexId; 3]> = garment.mesh.faces().0.clone();
    spans.iter_mut().for_each(|face| face.sort());
    spans.sort();
    let count = spans.len();
    spans.dedup();
    assert_eq!(spans.len(), count);
}

/// A tube of radius 9 cm on which the tube of the scan is worn, open at both ends.
fn body_in_tube() -> TriMesh {
    let scan = tube().mesh;
    let points: Vec<Point> = scan.points().iter().map(|p| Point::new(0.9 * p.x, p.y * 2.0 - 0.3, 0.9 * p.z)).collect();
    scan.with_points(points)
}

/// The garment below 20 cm, where the scan shows another garment from `from` to 40 cm, seen from the angles of `shows`.
fn below_another(from: f64, shows: impl Fn(&Point) -> bool) -> (Scan, Garment) {
    let scan = tube();
    let labels = Labels(scan.mesh.points().iter().map(|p| p.y < 0.2).collect());
    let under = scan.mesh.points().iter().map(|p| p.y >= from && p.y < 0.4 && shows(p)).collect();
    let segmentation = Segmentation { under, ..labels.into() };
    let body = body_in_tube();
    let covered = PerVertex::filled(true, body.vertex_count());
    let below = BodyBelow { mesh: &body, covered: &covered, goes_between_legs: false };
    let around = Adjacency::prepare(&scan.mesh);
    let garment = super::cut(&scan, &around, &segmentation, &below, 2..=2, &CutParams::default()).unwrap();
    (scan, garment)
}

#[test]
fn a_garment_continues_two_centimetres_under_the_one_over_it() {
    let (_, garment) = below_another(0.2, |_| true);
    let heights = |seen: bool| -> Vec<f64> {
        let vertices = garment.mesh.vertex_ids().filter(|&v| garment.is_seen[v] == seen);
        vertices.map(|v| garment.mesh.points()[v].y).collect()
    };
    assert!(heights(true).iter().all(|y| *y < 0.203));
    let unseen = heights(false);
    let top = unseen.iter().copied().fold(0.0, f64::max);
    assert!(!unseen.is_empty() && (top - 0.22).abs() < 0.003, "{top}");
    for v in garment.mesh.vertex_ids().filter(|&v| !garment.is_seen[v]) {
        let p = garment.mesh.points()[v];
        let radius = p.x.hypot(p.z);
        // Between the body at 9 cm and the cloth over it at 10, less its thickness.
        assert!((0.0905..0.0982).contains(&radius), "{p}: {radius}");
    }
    // One sheet, oriented as the rest; the hem is the end of the underlap.
    assert_eq!(Adjacency::prepare(&garment.mesh).face_components().1, 1);
    assert_eq!(Adjacency::prepare(&garment.mesh).boundary_loops().len(), 2);
    for f in garment.mesh.face_ids() {
        let [a, b, c] = garment.mesh.triangle(f).map(|p| p.coords);
        let middle = (a + b + c) / 3.0;
        assert!(garment.mesh.area_vector(f).dot(&crate::geometry::Vec3::new(middle.x, 0.0, middle.z)) > 0.0);
    }
    let upper = garment.hem_loops.iter().find(|ring| garment.mesh.points()[ring[0]].y > 0.1).unwrap();
    assert!(upper.iter().all(|&v| !garment.is_seen[v] && garment.mesh.points()[v].y > 0.217));
    assert!(garment.findings.iter().any(|f| f.contains("under the garment over it")), "{:?}", garment.findings);
    assert_eq!(garment.colors.unwrap().len(), garment.mesh.vertex_count());
}

#[test]
fn a_garment_ends_where_nothing_is_worn_over_it() {
    let (_, garment) = below_another(0.2, |_| false);
    assert!(garment.is_seen.iter().all(|&is| is));
    assert!(garment.mesh.points().iter().all(|p| p.y < 0.205));
    // A jacket that hangs open: the underlap is at one side, and narrows towards the front.
    let (_, half) = below_another(0.2, |p| p.x < 0.0);
    for v in half.mesh.vertex_ids().filter(|&v| !half.is_seen[v]) {
        assert!(half.mesh.points()[v].x < 0.012, "{}", half.mesh.points()[v]);
    }
    assert!(half.is_seen.iter().any(|is| !is));
    assert_eq!(Adjacency::prepare(&half.mesh).boundary_loops().len(), 2);
}

#[test]
fn what_is_filled_is_not_seen() {
    let scan = tube();
    let hole = Point::new(0.1, 0.4, 0.0);
    let keep = scan.mesh.faces().iter().map(|f| f.iter().all(|&v| (scan.mesh.points()[v] - hole).norm() > 0.015));
    let (mesh, _) = scan.mesh.part(&keep.collect());
    let open = Scan::from_clean_mesh(mesh, None);
    let labels = Labels(open.mesh.points().iter().map(|p| p.y > 0.2).collect());
    let garment = cut(&open, &labels.into()).unwrap();
    for v in garment.mesh.vertex_ids() {
        let distance = (garment.mesh.points()[v] - hole).norm();
        assert!(distance > 0.014 || !garment.is_seen[v], "{}", garment.mesh.points()[v]);
        assert!(distance < 0.02 || garment.is_seen[v], "{}", garment.mesh.points()[v]);
    }
    assert!(garment.is_seen.iter().any(|is| !is));
}

#[test]
fn a_garment_continues_below_hair_along_the_body() {
    let cloth = tube();
    let body = cloth.mesh.map_points(|p| Point::new(0.96 * p.x, p.y, 0.96 * p.z));
    let is_hair = |p: &Point| p.x > 0.05 && (0.2..0.42).contains(&p.y);
    // A strand 2 cm thick, rough, and of another colour.
    let mut scan = cloth.clone();
    let rough = |v: usize| 1.2 + 0.03 * ((v * 7919 % 13) as f64 / 12.0 - 0.5);
    scan.mesh = cloth.mesh.with_points(
        (cloth.mesh.points().enumerate())
            .map(|(v, p)| if is_hair(p) { Point::new(rough(v.index()) * p.x, p.y, rough(v.index()) * p.z) } else { *p })
            .collect::<PerVertex<Point>>(),
    );
    let hair: PerVertex<bool> = cloth.mesh.points().iter().map(is_hair).collect();
    if let Some(colors) = &mut scan.colors {
        hair.enumerate().filter(|(_, hair)| **hair).for_each(|(v, _)| colors[v] = [0, 250, 0]);
    }
    let shown: PerVertex<bool> = cloth.mesh.points().iter().map(|p| p.y > 0.1 && !is_hair(p)).collect();
    let segmentation = |below_hair| Segmentation { below_hair, ..Labels(shown.clone()).into() };
    let covered = PerVertex::filled(true, body.vertex_count());
    let below = BodyBelow { mesh: &body, covered: &covered, goes_between_legs: false };
    let around = Adjacency::prepare(&scan.mesh);
    let cut = |labels: &Segmentation| super::cut(&scan, &around, labels, &below, 1..=1, &CutParams::default()).unwrap();
    let whole = cut(&segmentation(Some(hair)));
    assert!(whole.findings[0].starts_with("continued below hair along the body"), "{:?}", whole.findings);
    assert_eq!(Adjacency::prepare(&whole.mesh).boundary_loops().len(), 1, "no hole where the hair was");
    for (v, p) in whole.mesh.points().enumerate().filter(|(_, p)| p.y < 0.48) {
        assert!((p.x.hypot(p.z) - 0.1).abs() < 1.5e-3, "{p}: as far from the body as the cloth around");
        assert!(whole.colors.as_ref().unwrap()[v][1] < 10, "the colour of the cloth");
        let is_hidden = p.x > 0.055 && (0.21..0.41).contains(&p.y);
        assert!(!is_hidden || !whole.is_seen[v], "{p}");
        assert!(p.x > 0.04 || whole.is_seen[v], "{p}");
    }
    let open = cut(&segmentation(None));
    assert!(Adjacency::prepare(&open.mesh).boundary_loops().len() > 1);
}
