//! Cleaning of a synthetic figure: round limbs joined into one closed surface, as a scanner would see it.

use super::{Scan, ScanError, ScanParams, Unit, Up, clean};
use crate::formats::RawMesh;
use crate::geometry::{Adjacency, Point, Vec3, WindingField};
use nalgebra::UnitQuaternion;

/// A cone with round ends: from, to, radius at each.
pub(super) type Limb = ([f64; 3], [f64; 3], f64, f64);

/// 1.7 m tall, facing +Z, in an A-pose.
pub(super) const BODY: [Limb; 11] = [
    ([0.0, 1.59, 0.0], [0.0, 1.61, 0.01], 0.09, 0.09),
    ([0.0, 1.4, 0.0], [0.0, 1.55, 0.0], 0.055, 0.055),
    ([-0.08, 1.2, 0.0], [-0.08, 0.95, 0.0], 0.12, 0.11),
    ([0.08, 1.2, 0.0], [0.08, 0.95, 0.0], 0.12, 0.11),
    ([-0.15, 1.38, 0.0], [0.15, 1.38, 0.0], 0.07, 0.07),
    ([0.17, 1.38, 0.0], [0.55, 0.9, 0.0], 0.055, 0.035),
    ([-0.17, 1.38, 0.0], [-0.55, 0.9, 0.0], 0.055, 0.035),
    ([0.1, 0.95, 0.0], [0.16, 0.08, 0.0], 0.09, 0.045),
    ([-0.1, 0.95, 0.0], [-0.16, 0.08, 0.0], 0.09, 0.045),
    ([0.16, 0.04, -0.04], [0.18, 0.04, 0.16], 0.04, 0.04),
    ([-0.16, 0.04, -0.04], [-0.18, 0.04, 0.16], 0.04, 0.04),
];
/// A gown that hides the feet, in place of legs.
const GOWN: Limb = ([0.0, 0.95, 0.0], [0.0, 0.3, 0.0], 0.15, 0.3);

fn moved(limbs: &[Limb], by: f64) -> Vec<Limb> {
    limbs.iter().map(|&(a, b, r, s)| ([a[0] + by, a[1], a[2]], [b[0] + by, b[1], b[2]], r, s)).collect()
}

/// The surface of joined limbs by naive surface nets on a grid of 2.5 cm.
pub(super) fn figure(limbs: &[Limb]) -> RawMesh {
    let distance = |p: Point| {
        let to_limb = |&(a, b, r, s): &Limb| {
            let (a, b) = (Point::from(a), Point::from(b));
            let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
            (p - (a + (b - a) * t)).norm() - (r + (s - r) * t)
        };
        limbs.iter().map(to_limb).fold(f64::INFINITY, f64::min)
    };
    let ends = || limbs.iter().flat_map(|l| [(l.0, l.2), (l.1, l.3)]);
    let low: [f64; 3] = std::array::from_fn(|i| ends().map(|(p, r)| p[i] - r - 0.05).fold(f64::INFINITY, f64::min));
    let high: [f64; 3] =
        std::array::from_fn(|i| ends().map(|(p, r)| p[i] + r + 0.05).fold(f64::NEG_INFINITY, f64::max));
    let cell = 0.025;
    let n: [usize; 3] = std::array::from_fn(|i| ((high[i] - low[i]) / cell) as usize + 1);
    let at = |x: usize, y: usize, z: usize| (z * n[1] + y) * n[0] + x;
    let place = |x: usize, y: usize, z: usize| {
        Point::new(low[0] + x as f64 * cell, low[1] + y as f64 * cell, low[2] + z as f64 * cell)
    };
    let mut value = Vec::with_capacity(n[0] * n[1] * n[2]);
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                value.push(distance(place(x, y, z)));
            }
        }
    }
    let mut vertex = vec![u32::MAX; value.len()];
    let mut raw = RawMesh::default();
    for z in 0..n[2] - 1 {
        for y in 0..n[1] - 1 {
            for x in 0..n[0] - 1 {
                let corners: [usize; 8] = std::array::from_fn(|c| at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1)));
                let (mut sum, mut count) = (Vec3::zeros(), 0.0);
                for c in 0..8 {
                    for bit in [1, 2, 4] {
                        let d = c | bit;
                        if d != c && (value[corners[c]] < 0.0) != (value[corners[d]] < 0.0) {
                            let t = value[corners[c]] / (value[corners[c]] - value[corners[d]]);
                            let corner = |c: usize| Vec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2 & 1) as f64);
                            sum += corner(c) * (1.0 - t) + corner(d) * t;
                            count += 1.0;
                        }
                    }
                }
                if count > 0.0 {
                    vertex[at(x, y, z)] = raw.points.len() as u32;
                    raw.points.push((place(x, y, z) + sum * (cell / count)).into());
                }
            }
        }
    }
    for z in 1..n[2] - 1 {
        for y in 1..n[1] - 1 {
            for x in 1..n[0] - 1 {
                let here = value[at(x, y, z)] < 0.0;
                let sides = [
                    (at(x + 1, y, z), [at(x, y - 1, z - 1), at(x, y, z - 1), at(x, y, z), at(x, y - 1, z)]),
                    (at(x, y + 1, z), [at(x - 1, y, z - 1), at(x - 1, y, z), at(x, y, z), at(x, y, z - 1)]),
                    (at(x, y, z + 1), [at(x - 1, y - 1, z), at(x, y - 1, z), at(x, y, z), at(x - 1, y, z)]),
                ];
                for (there, ring) in sides {
                    if here != (value[there] < 0.0) {
                        let [a, b, c, d] = ring.map(|i| vertex[i]);
                        raw.faces.extend(if here { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
                    }
                }
            }
        }
    }
    raw.colors = Some(raw.points.iter().map(|p| [(p[1] * 100.0) as u8, 0, (raw.faces.len() % 200) as u8]).collect());
    raw
}

pub(super) fn body() -> RawMesh {
    figure(&BODY)
}

fn gowned() -> RawMesh {
    figure(&[&BODY[..7], &[GOWN]].concat())
}

/// As wide as tall.
fn in_t_pose() -> RawMesh {
    let mut limbs = BODY;
    limbs[5].1 = [0.8, 1.38, 0.0];
    limbs[6].1 = [-0.8, 1.38, 0.0];
    figure(&limbs)
}

/// A mesh rotated and in another unit.
fn turned(raw: &RawMesh, rotation: &UnitQuaternion<f64>, scale: f64) -> RawMesh {
    let points = raw.points.iter().map(|&p| (rotation * Point::from(p) * scale).into()).collect();
    RawMesh { points, ..raw.clone() }
}

pub(super) fn cleaned(raw: &RawMesh) -> Result<Scan, ScanError> {
    clean(raw, &ScanParams::default(), &mut |_| {})
}

#[test]
fn any_unit_and_any_axis_is_found_and_undone_exactly() {
    for raw in [body(), gowned(), in_t_pose()] {
        for i in 0..8 {
            let (up, unit) = (Up::ALL[i % 6], Unit::ALL[(i + i / 4) % 4]);
            let heading = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), 0.7 * i as f64);
            let file_from_body = up.world_from_file().inverse() * heading;
            let file = turned(&raw, &file_from_body, 1.0 / unit.metres());
            let scan = clean(&file, &ScanParams { smoothing_passes: 0, ..Default::default() }, &mut |_| {}).unwrap();
            let found = scan.world_from_file;
            assert!((found.metres_per_unit / unit.metres() - 1.0).abs() < 1e-12, "{up} {unit} {:?}", scan.findings);
            let standing = found.direction_in_world(&up.direction());
            assert!((standing - Vec3::y()).norm() < 1e-9, "{up} {unit}: {:?}", scan.findings);
            for (v, p) in scan.mesh.points().enumerate().step_by(97) {
                let there = Point::from(file.points[scan.file_vertices[v] as usize]);
                assert!((found.file_from_world(p) - there).norm() < 1e-9 / unit.metres());
            }
        }
    }
}

#[test]
fn who_lies_askew_is_turned_upright() {
    let askew = UnitQuaternion::from_euler_angles(0.6, 0.2, 0.7);
    let scan = cleaned(&turned(&body(), &askew, 1.0)).unwrap();
    let up = scan.world_from_file.direction_in_world(&(askew * Vec3::y()));
    assert!(up.y > 0.99, "{up}");
}

#[test]
fn what_is_told_is_taken_and_doubted_aloud() {
    let given = ScanParams { unit: Some(Unit::Metre), up: Some(Up::MinusY), ..Default::default() };
    let scan = clean(&body(), &given, &mut |_| {}).unwrap();
    assert!((scan.world_from_file.direction_in_world(&Vec3::y()) + Vec3::y()).norm() < 1e-9);
    assert!(scan.findings.iter().any(|f| f.contains("the head seems to be at the other end")), "{:?}", scan.findings);
    let wrong = ScanParams { unit: Some(Unit::Millimetre), ..Default::default() };
    let error = clean(&body(), &wrong, &mut |_| {}).unwrap_err();
    assert!(matches!(error, ScanError::NotPersonSize { .. }) && error.to_string().contains("0.002 m in mm"), "{error}");
}

#[test]
fn what_is_no_person_is_refused_with_figures() {
    let giant = cleaned(&turned(&body(), &UnitQuaternion::identity(), 7.0)).unwrap_err();
    assert!(matches!(&giant, ScanError::NotPersonSize { .. }), "{giant}");
    assert!(giant.hint().unwrap().contains("--unit"));
    let cloud = RawMesh { faces: Vec::new(), ..body() };
    assert_eq!(cleaned(&cloud), Err(ScanError::NoFaces { points: cloud.points.len() }));
    assert_eq!(cleaned(&RawMesh::default()), Err(ScanError::Empty));
    let mut broken = body();
    broken.points[41][2] = f64::NAN;
    broken.points[77][0] = f64::INFINITY;
    assert_eq!(cleaned(&broken), Err(ScanError::NotFinite { vertex: 41, count: 2, of: broken.points.len() }));
    let mut bad_index = body();
    bad_index.faces[3][1] = 999_999_999;
    assert!(matches!(cleaned(&bad_index), Err(ScanError::Mesh(_))));
    let flat = RawMesh { points: vec![[1.0; 3]; 3], faces: vec![[0, 1, 2]], ..Default::default() };
    assert_eq!(cleaned(&flat), Err(ScanError::NoArea { faces: 1 }));
}

#[test]
fn two_people_are_refused_apart_and_hand_in_hand() {
    for distance in [2.5, 1.3, 1.02] {
        let pair = figure(&[BODY.to_vec(), moved(&BODY, distance)].concat());
        for heading in [0.0, 0.5, 1.3] {
            let file = turned(&pair, &UnitQuaternion::from_axis_angle(&Vec3::y_axis(), heading), 1.0);
            let result = cleaned(&file);
            assert!(
                matches!(result, Err(ScanError::TwoPeople { .. })),
                "{distance} {heading}: {:?}",
                result.map(|s| s.findings)
            );
        }
    }
}

#[test]
fn a_person_in_wide_trousers_is_not_two_people_upside_down() {
    // The head above the middle of the feet, and beside it.
    for aside in [0.0, 0.06] {
        let mut limbs = BODY;
        limbs[..2].copy_from_slice(&moved(&BODY[..2], aside));
        for (leg, side) in [(7, 1.0), (8, -1.0)] {
            limbs[leg] = ([side * 0.13, 0.95, 0.0], [side * 0.22, 0.12, 0.0], 0.11, 0.1);
        }
        let result = cleaned(&figure(&limbs));
        assert!(result.is_ok(), "{aside}: {:?}", result.map(|s| s.findings));
    }
}

#[test]
fn loose_pieces_go_and_a_severed_head_stays() {
    let crumbs = figure(&[&BODY[..], &[([0.9, 0.5, 0.3], [0.95, 0.5, 0.3], 0.05, 0.05)]].concat());
    let (scan, whole) = (cleaned(&crumbs).unwrap(), cleaned(&body()).unwrap());
    assert!(scan.findings.iter().any(|f| f.starts_with("removed 1 loose piece with")), "{:?}", scan.findings);
    assert!((scan.mesh.area() / whole.mesh.area() - 1.0).abs() < 0.01);
    let mut severed = body();
    let points = severed.points.clone();
    severed.faces.retain(|f| !f.iter().all(|&v| (1.47..1.52).contains(&points[v as usize][1])));
    let scan = cleaned(&severed).unwrap();
    assert!(scan.mesh.bounds().unwrap().max.y > 1.65, "{:?}", scan.findings);
    assert!(scan.findings.iter().any(|f| f.contains("2 separate pieces")), "{:?}", scan.findings);
}

#[test]
fn faces_turned_at_random_and_torn_apart_become_one_outward_surface() {
    let whole = cleaned(&body()).unwrap();
    let mut soup = RawMesh::default();
    let raw = body();
    for (i, face) in raw.faces.iter().enumerate() {
        let base = soup.points.len() as u32;
        soup.points.extend(face.map(|v| raw.points[v as usize]));
        soup.faces.push(if i % 3 == 0 { [base, base + 2, base + 1] } else { [base, base + 1, base + 2] });
    }
    let scan = cleaned(&soup).unwrap();
    assert_eq!(scan.mesh.face_count(), whole.mesh.face_count());
    assert_eq!(scan.mesh.vertex_count(), whole.mesh.vertex_count());
    assert!(scan.mesh.signed_volume() > 0.0);
    assert!(Adjacency::prepare(&scan.mesh).boundary_edges().is_empty());
    let field = WindingField::prepare(&scan.mesh);
    assert!((field.winding(&Point::new(0.0, 1.1, 0.0)) - 1.0).abs() < 0.01);
    let all_inward = RawMesh { faces: body().faces.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..body() };
    assert!(cleaned(&all_inward).unwrap().mesh.signed_volume() > 0.0);
}

#[test]
fn decimation_keeps_the_shape_the_colours_and_what_is_closed() {
    let raw = body();
    let plain = ScanParams { smoothing_passes: 0, ..Default::default() };
    let whole = clean(&raw, &plain, &mut |_| {}).unwrap();
    let mut steps = Vec::new();
    let fewer = clean(&raw, &ScanParams { faces: 4000, ..plain }, &mut |s| steps.push(s.name)).unwrap();
    assert_eq!(steps, ["checked", "stood upright", "turned outward", "smoothed", "decimated"]);
    assert!(fewer.mesh.face_count() <= 4000 && fewer.mesh.face_count() > 3900);
    assert!((fewer.mesh.signed_volume() / whole.mesh.signed_volume() - 1.0).abs() < 0.01);
    assert!(Adjacency::prepare(&fewer.mesh).boundary_edges().is_empty());
    let (colors, given) = (fewer.colors.unwrap(), raw.colors.unwrap());
    for (v, p) in fewer.mesh.points().enumerate() {
        let from = fewer.file_vertices[v] as usize;
        assert_eq!((colors[v], Point::from(raw.points[from])), (given[from], *p));
    }
}
