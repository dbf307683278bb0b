//! Geometry: queries are invariant under rigid motion, operators have the right null spaces.

use nalgebra::{Isometry3, UnitQuaternion};
use overcoat::geometry::{
    NearestVertex, Point, SurfaceIndex, TriMesh, Vec3, WindingField, cotangent_laplacian, intersecting_pairs,
    mean_value_coordinates,
};
use proptest::prelude::*;

/// A lumpy closed surface: a sphere of latitude and longitude with a seeded swell.
pub fn lump(seed: u32, rings: usize, spokes: usize) -> TriMesh {
    let phase = f64::from(seed) * 0.37;
    let mut points = vec![Point::new(0.0, 1.0, 0.0)];
    for r in 1..rings {
        let theta = std::f64::consts::PI * r as f64 / rings as f64;
        for s in 0..spokes {
            let phi = std::f64::consts::TAU * s as f64 / spokes as f64;
            let radius = 1.0 + 0.2 * (3.0 * phi + phase).sin() * theta.sin() + 0.1 * (2.0 * theta + phase).cos();
            let (st, ct) = theta.sin_cos();
            points.push(Point::new(radius * st * phi.sin(), radius * ct, radius * st * phi.cos()));
        }
    }
    points.push(Point::new(0.0, -1.0, 0.0));
    let (last, at) = ((points.len() - 1) as u32, |r: usize, s: usize| (1 + (r - 1) * spokes + s % spokes) as u32);
    let mut faces = Vec::new();
    for s in 0..spokes {
        faces.push([0, at(1, s), at(1, s + 1)]);
        faces.push([last, at(rings - 1, s + 1), at(rings - 1, s)]);
        for r in 1..rings - 1 {
            faces.push([at(r, s), at(r + 1, s), at(r, s + 1)]);
            faces.push([at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)]);
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

fn motion() -> impl Strategy<Value = Isometry3<f64>> {
    (prop::array::uniform3(-3.0..3.0f64), prop::array::uniform3(-5.0..5.0f64)).prop_map(|(turn, shift)| {
        Isometry3::from_parts(Vec3::from(shift).into(), UnitQuaternion::from_scaled_axis(Vec3::from(turn)))
    })
}

fn place() -> impl Strategy<Value = Point> {
    prop::array::uniform3(-1.5..1.5f64).prop_map(Point::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn closest_points_and_winding_numbers_move_with_the_mesh(seed in 0u32..50, m in motion(), p in place()) {
        let mesh = lump(seed, 10, 16);
        let moved = mesh.map_points(|q| m * q);
        let (here, there) = (SurfaceIndex::prepare(&mesh), SurfaceIndex::prepare(&moved));
        // Two faces that are equally far to seven digits are a tie, which the rotated boxes may decide otherwise.
        prop_assert!((here.closest(&p).distance - there.closest(&(m * p)).distance).abs() < 1e-6);
        let (w, v) = (WindingField::prepare(&mesh).winding(&p), WindingField::prepare(&moved).winding(&(m * p)));
        prop_assert!((w - v).abs() < 0.02, "{w} against {v}");
        prop_assert!(w.min((w - 1.0).abs()) < 0.1 || here.closest(&p).distance < 0.05);
    }

    #[test]
    fn the_index_agrees_with_a_search_over_all_faces(seed in 0u32..50, p in place()) {
        let mesh = lump(seed, 8, 12);
        let found = SurfaceIndex::prepare(&mesh).closest(&p).distance;
        // No sample of any face is closer, and some sample is nearly as close.
        let mut least = f64::INFINITY;
        for f in mesh.face_ids() {
            let [a, b, c] = mesh.triangle(f);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    least = least.min((a + (b - a) * u + (c - a) * v - p).norm());
                }
            }
        }
        prop_assert!(found <= least * (1.0 + 1e-7) && least - found < 0.03, "{found} against {least}");
        let (_, nearest) = NearestVertex::prepare(mesh.points().as_slice()).nearest(&p).unwrap();
        let naive = mesh.points().iter().map(|q| (q - p).norm()).fold(f64::INFINITY, f64::min);
        prop_assert!((nearest - naive).abs() < 1e-9);
    }

    #[test]
    fn mean_value_coordinates_reproduce_the_point(seed in 0u32..50, p in prop::array::uniform3(-0.4..0.4f64)) {
        let mesh = lump(seed, 10, 16);
        let p = Point::from(p);
        let m = mean_value_coordinates(&mesh, &p);
        let sum: f64 = m.iter().sum();
        let back: Vec3 = m.iter().zip(mesh.points().iter()).map(|(w, q)| q.coords * *w).sum();
        prop_assert!((sum - 1.0).abs() < 1e-9 && (back - p.coords).norm() < 1e-9);
    }

    #[test]
    fn the_laplacian_annihilates_constants_and_is_positive_semidefinite(seed in 0u32..50, k in 1.0..9.0f64) {
        let mesh = lump(seed, 10, 16);
        let laplacian = cotangent_laplacian(&mesh);
        let flat = laplacian.apply(&vec![k; mesh.vertex_count()]);
        prop_assert!(flat.iter().all(|x| x.abs() < 1e-9));
        let wave: Vec<f64> = mesh.points().iter().map(|p| (k * p.x).sin() + p.y * p.z).collect();
        let energy: f64 = laplacian.apply(&wave).iter().zip(&wave).map(|(a, b)| a * b).sum();
        prop_assert!(energy > 0.0);
    }

    #[test]
    fn triangle_intersection_does_not_depend_on_order_or_place(seed in 0u32..50, m in motion(), shift in -0.6..0.6f64) {
        let a = lump(seed, 6, 9);
        let b = lump(seed + 7, 6, 9).map_points(|p| p + Vec3::new(0.9, shift, 0.1));
        let mut pairs = intersecting_pairs(&a, &b);
        let mut swapped: Vec<_> = intersecting_pairs(&b, &a).into_iter().map(|(x, y)| (y, x)).collect();
        let mut moved = intersecting_pairs(&a.map_points(|p| m * p), &b.map_points(|p| m * p));
        pairs.sort_unstable();
        swapped.sort_unstable();
        moved.sort_unstable();
        prop_assert!(!pairs.is_empty());
        prop_assert_eq!(&pairs, &swapped);
        prop_assert!(pairs.len().abs_diff(moved.len()) <= 1 + pairs.len() / 50, "rounding at touching edges only");
    }
}

#[test]
fn distant_triangles_do_not_intersect() {
    let a = lump(1, 6, 9);
    assert!(intersecting_pairs(&a, &a.map_points(|p| p + Vec3::new(5.0, 0.0, 0.0))).is_empty());
}
