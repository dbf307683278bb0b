//! Cloth over a sphere, with known answers.

use crate::cloth::{ClothError, ClothLayer, Collider, Fabric, drape, fabric_named};
use crate::geometry::{PerVertex, Point, TriMesh, intersecting_pairs, sphere};

/// A square cloth of `n × n` vertices, 2 cm apart, at height `y`.
fn square(n: usize, y: f64) -> TriMesh {
    let at = |i: usize| 0.02 * (i as f64 - 0.5 * (n - 1) as f64);
    let points = (0..n * n).map(|i| Point::new(at(i % n), y, at(i / n))).collect();
    let mut faces = Vec::new();
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let [a, b, c, d] = [i + n * j, i + 1 + n * j, i + n * (j + 1), i + 1 + n * (j + 1)].map(|k| k as u32);
            faces.extend([[a, c, b], [b, c, d]]);
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// A sphere of radius 0.15 m.
fn ball() -> Collider {
    Collider::prepare(&sphere(24, 48).map_points(|p| p * 0.15))
}

fn layer(fabric: &str, y: f64) -> ClothLayer {
    let (rest, fabric) = (square(24, y), fabric_named(fabric).unwrap());
    ClothLayer { pinned: PerVertex::filled(false, rest.vertex_count()), fabric, rest }
}

#[test]
fn a_cloth_over_a_ball_hangs_down_keeps_its_lengths_and_stays_outside() {
    let (shirt, ball) = (layer("cotton", 0.16), ball());
    let drop = || drape(&[&shirt], &[shirt.rest.points().clone()], &ball, 0.7).unwrap().remove(0);
    let fallen = drop();
    assert!(fallen.points().iter().all(|p| p.coords.norm() > 0.148), "outside");
    assert!(fallen.points().0[0].y < 0.05, "corners hang");
    assert!(fallen.points().iter().any(|p| p.y > 0.14), "and the middle lies on top");
    let stretch = fallen.mean_edge_length() / shirt.rest.mean_edge_length();
    assert!((0.93..1.04).contains(&stretch), "{stretch}");
    assert_eq!(fallen, drop(), "twice the same");
}

#[test]
fn pinned_vertices_stay() {
    let mut shirt = layer("cotton", 0.0);
    (0..24).for_each(|v| shirt.pinned.0[v] = true);
    let far_away = Collider::prepare(&square(2, -9.0));
    let hung = drape(&[&shirt], &[shirt.rest.points().clone()], &far_away, 0.5).unwrap().remove(0);
    assert_eq!(hung.points().0[..24], shirt.rest.points().0[..24]);
    assert!(hung.points().0[24 * 23 + 5].y < -0.1);
}

#[test]
fn of_two_layers_the_outer_lies_outside_and_neither_cuts_the_other() {
    let (inner, outer, ball) = (layer("knit", 0.17), layer("coating", 0.18), ball());
    let starts = [inner.rest.points().clone(), outer.rest.points().clone()];
    let both = drape(&[&inner, &outer], &starts, &ball, 0.6).unwrap();
    assert_eq!(intersecting_pairs(&both[1], &both[0]).len(), 0);
    let (above, below) = (Collider::prepare(&both[0]), both[1].points().iter());
    let inside = below.filter(|p| above.closest(p, 0.02).is_some_and(|(near, n)| (*p - near.point).dot(&n) < -1e-3));
    assert_eq!(inside.count(), 0);
}

#[test]
fn arrays_that_do_not_belong_together_and_impossible_values_are_refused() {
    let (shirt, ball) = (layer("cotton", 0.2), ball());
    let start = shirt.rest.points().clone();
    let drape = |layer: &ClothLayer, initial: &[PerVertex<Point>], secs: f64| drape(&[layer], initial, &ball, secs);
    let refused = |result: Result<Vec<TriMesh>, ClothError>| result.unwrap_err();
    assert!(matches!(refused(drape(&shirt, &[], 0.1)), ClothError::CountMismatch { found: 0, expected: 1, .. }));
    let short: PerVertex<Point> = start.0[1..].to_vec().into();
    assert!(matches!(refused(drape(&shirt, &[short], 0.1)), ClothError::CountMismatch { .. }));
    let unpinned = ClothLayer { pinned: PerVertex::filled(false, 3), ..shirt.clone() };
    assert!(matches!(
        refused(drape(&unpinned, std::slice::from_ref(&start), 0.1)),
        ClothError::CountMismatch { found: 3, .. }
    ));
    let weightless = ClothLayer { fabric: Fabric { density: 0.0, ..fabric_named("silk").unwrap() }, ..shirt.clone() };
    assert!(matches!(
        refused(drape(&weightless, std::slice::from_ref(&start), 0.1)),
        ClothError::BadFabric { layer: 0, .. }
    ));
    for secs in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(drape(&shirt, std::slice::from_ref(&start), secs)), ClothError::BadDuration { .. }));
    }
    assert_eq!(drape(&shirt, std::slice::from_ref(&start), 0.0).unwrap()[0].vertex_count(), start.len());
}
