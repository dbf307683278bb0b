use super::placing::place;
use super::thin::ThinFigure;
use super::*;
use crate::body::{Figure, Pose, embedded_model};
use crate::formats::RawMesh;
use crate::geometry::{Point, Vec3, intersecting_pairs};
use nalgebra::{Rotation3, Unit};

fn average() -> Figure {
    let model = embedded_model().unwrap();
    Figure::mean(&model)
}

/// A skirt of rings, 0.35 m long, wider at the hem and wider than deep, in metres.
fn skirt() -> RawMesh {
    const AROUND: u32 = 36;
    const RINGS: u32 = 12;
    let mut raw = RawMesh::default();
    for ring in 0..RINGS {
        for k in 0..AROUND {
            let (share, turn) = (f64::from(ring) / f64::from(RINGS - 1), std::f64::consts::TAU * f64::from(k) / 36.0);
            let lean = 0.01 * turn.sin() * (1.0 - share);
            raw.points.push([
                (0.15 + 0.07 * share) * turn.cos(),
                1.0 - 0.35 * share - lean,
                (0.11 + 0.07 * share) * turn.sin(),
            ]);
        }
    }
    for ring in 0..RINGS - 1 {
        for k in 0..AROUND {
            let [a, b] = [ring * AROUND + k, ring * AROUND + (k + 1) % AROUND];
            raw.faces.extend([[a, b, a + AROUND], [b, b + AROUND, a + AROUND]]);
        }
    }
    raw
}

fn moved(raw: &RawMesh, turn: &Rotation3<f64>, scale: f64) -> RawMesh {
    let place = |p: &[f64; 3]| {
        let q = turn * Point::from(*p) * scale + Vec3::new(70.0, -3.0, 12.0);
        [q.x, q.y, q.z]
    };
    RawMesh { points: raw.points.iter().map(place).collect(), ..raw.clone() }
}

#[test]
fn unit_frame_and_orientation_of_the_faces_do_not_matter() {
    let average = average();
    let plain = UprightGarment::read(&skirt(), None, &average).unwrap();
    assert_eq!(plain.kind, "skirt");
    for (k, (unit, scale)) in [("cm", 100.0), ("mm", 1000.0), ("in", 1.0 / 0.0254)].into_iter().enumerate() {
        let axis = Unit::new_normalize(Vec3::new(0.3, 0.5 - k as f64, 0.8));
        let mut raw = moved(&skirt(), &Rotation3::from_axis_angle(&axis, 2.1 + k as f64), scale);
        raw.faces.iter_mut().step_by(3).for_each(|face| face.swap(1, 2));
        let read = UprightGarment::read(&raw, None, &average).unwrap();
        assert!(read.notes[0].ends_with(unit), "{:?}", read.notes);
        for (p, q) in plain.mesh.points().iter().zip(read.mesh.points().iter()) {
            assert!((p - q).norm() < 1e-3, "{p} {q}");
        }
    }
}

#[test]
fn a_figure_stands_in_the_skirt_and_the_skirt_rests_outside_of_it() {
    let figure = average();
    let garment = UprightGarment::read(&skirt(), None, &figure).unwrap();
    let placed = place(&garment.mesh, &figure).unwrap();
    let bind = Pose::bind(figure.skeleton.len());
    assert!((placed.pose.translation - bind.translation).norm() < 0.2, "a garment is read where an adult wears it");
    let Worn { mesh, thickness, fell, .. } = at_rest(&garment.mesh, &figure, "cotton").unwrap();
    assert_eq!(mesh.faces(), garment.mesh.faces());
    assert!(thickness.is_some() && fell.abs() < 0.1, "{thickness:?} {fell}");
    assert!(edge_length_p95(&garment.mesh, &mesh) < 1.15);
    assert_eq!(intersecting_pairs(&mesh, &figure.body().mesh).len(), 0, "nothing crosses at any time");
}

#[test]
fn a_thin_figure_is_the_figure_at_its_full_thickness() {
    let figure = average();
    let mut pose = Pose::bind(figure.skeleton.len());
    for (joint, turn) in pose.rotations.iter_mut().enumerate() {
        *turn = nalgebra::UnitQuaternion::from_euler_angles(0.1, 0.02 * joint as f64, -0.1);
    }
    let thin = ThinFigure::near(&figure, &figure.body().mesh, 0.1);
    let whole = figure.body().posed(&figure.skeleton, &pose);
    for (p, q) in thin.posed(&pose, 1.0)[0].points().iter().zip(whole.points().iter()) {
        assert!((p - q).norm() < 1e-9);
    }
    let bind = Pose::bind(figure.skeleton.len());
    let volume = |thickness: f64| thin.posed(&bind, thickness)[0].signed_volume();
    assert!(volume(0.5) < 0.4 * volume(1.0) && volume(0.5) > 0.1 * volume(1.0));
}

#[test]
fn the_inside_of_thick_cloth_is_left_out() {
    let thin = skirt();
    let count = thin.points.len() as u32;
    let mut thick = thin.clone();
    // The inner sheet, 6 mm inside and closed with the outer one at both rims.
    thick.points.extend(thin.points.iter().map(|p| {
        let r = p[0].hypot(p[2]);
        [p[0] * (1.0 - 0.006 / r), p[1], p[2] * (1.0 - 0.006 / r)]
    }));
    thick.faces.extend(thin.faces.iter().map(|[a, b, c]| [a + count, c + count, b + count]));
    for first in [0, count - 36] {
        for k in 0..36 {
            let [a, b] = [first + k, first + (k + 1) % 36];
            thick.faces.extend([[a, a + count, b], [b, a + count, b + count]]);
        }
    }
    let read = UprightGarment::read(&thick, None, &average()).unwrap();
    assert_eq!(read.kind, "skirt");
    assert!(read.notes.iter().any(|note| note.contains("thick cloth")), "{:?}", read.notes);
    let share = read.mesh.face_count() as f64 / thin.faces.len() as f64;
    assert!((0.9..1.3).contains(&share), "{share}");
}

#[test]
fn other_meshes_are_refused() {
    let average = average();
    let read = |raw: &RawMesh| UprightGarment::read(raw, None, &average).map(|garment| garment.kind);
    assert!(matches!(read(&RawMesh::default()), Err(TryOnError::Empty)));
    let tetrahedron = RawMesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        ..RawMesh::default()
    };
    assert!(matches!(read(&tetrahedron), Err(TryOnError::Closed)));
    let doll = moved(&skirt(), &Rotation3::identity(), 0.2);
    let refused = UprightGarment::read(&doll, Some(1.0), &average);
    assert!(matches!(refused, Err(TryOnError::NotForAdults { .. })));
    let mut patch = skirt();
    patch.faces.truncate(20);
    assert!(matches!(read(&patch), Err(TryOnError::OtherRims { rims: 1 })));
}
