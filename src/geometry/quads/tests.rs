//! Laws of re-meshed surfaces.

use super::*;
use crate::geometry::shapes_for_tests::{noise, sphere};
use crate::geometry::{Adjacency, FaceId, SurfaceIndex, Vec3};
use std::collections::BTreeMap;

/// A tube of cloth with waves, open at both ends, as long as a sleeve.
fn sleeve() -> TriMesh {
    let (around, along) = (60u32, 80u32);
    let point = |i: u32, j: u32| {
        let (angle, y) =
            (f64::from(i) / f64::from(around) * std::f64::consts::TAU, 0.5 * f64::from(j) / f64::from(along));
        let radius = 0.07 + 0.004 * (30.0 * y).sin() + 0.02 * y;
        Point::new(radius * angle.cos(), y, radius * angle.sin())
    };
    let points = (0..=along).flat_map(|j| (0..around).map(move |i| point(i, j))).collect();
    let at = |i: u32, j: u32| j * around + i % around;
    let faces: Vec<[u32; 3]> = (0..along)
        .flat_map(|j| (0..around).map(move |i| (i, j)))
        .flat_map(|(i, j)| [[at(i, j), at(i, j + 1), at(i + 1, j)], [at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]])
        .collect();
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// A flat sheet of 40 by 20 cm with a slit from one side.
fn sheet_with_slit() -> TriMesh {
    let (n, m) = (80u32, 40u32);
    let mut points: Vec<Point> = (0..=m)
        .flat_map(|j| (0..=n).map(move |i| Point::new(0.005 * f64::from(i), 0.005 * f64::from(j), 0.0)))
        .collect();
    let at = |i: u32, j: u32| j * (n + 1) + i;
    // Vertices of the slit, right of it, are doubled; its upper end is not.
    let first = points.len() as u32;
    (0..20).for_each(|j| points.push(points[at(40, j) as usize] + Vec3::x() * 0.001));
    let right = |i: u32, j: u32| if i == 40 && j < 20 { first + j } else { at(i, j) };
    let faces: Vec<[u32; 3]> = (0..m)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let corner = |x: u32, y: u32| if i >= 40 { right(x, y) } else { at(x, y) };
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh::try_from_indices(points, &faces).unwrap()
}

fn is_manifold(quads: &QuadMesh) -> bool {
    let mut sides: BTreeMap<[VertexId; 2], usize> = BTreeMap::new();
    for quad in &quads.quads {
        (0..4).for_each(|k| *sides.entry([quad[k], quad[(k + 1) % 4]]).or_insert(0) += 1);
    }
    sides.values().all(|&count| count == 1)
}

fn borders(mesh: &TriMesh) -> usize {
    Adjacency::prepare(mesh).boundary_loops().len()
}

/// The greatest distance of the border of one mesh from that of another, in mm.
fn border_distance_mm(from: &TriMesh, to: &TriMesh) -> f64 {
    let edges = Adjacency::prepare(to).boundary_edges().iter().map(|&[a, b]| [a, b, b]).collect::<Vec<_>>();
    let index = SurfaceIndex::prepare(&to.with_faces(edges));
    let ends =
        Adjacency::prepare(from).boundary_edges().iter().flatten().map(|&v| from.points()[v]).collect::<Vec<_>>();
    ends.iter().map(|p| 1e3 * index.closest(p).distance).fold(0.0, f64::max)
}

#[test]
fn cloth_gets_quads_near_it_with_its_borders_and_its_topology() {
    for (mesh, edge_length, hem_mm) in
        [(sleeve(), 0.008, 0.4), (sheet_with_slit(), 0.008, 0.5), (sphere(40, 60), 0.06, 0.0)]
    {
        let quads = quad_mesh(&mesh, edge_length).unwrap();
        let figures = quads.figures();
        let expected = mesh.area() / (edge_length * edge_length);
        assert!((0.8..1.25).contains(&(figures.quads as f64 / expected)), "{figures:?}");
        assert!(is_manifold(&quads) && figures.smallest_angle_deg > 20.0, "{figures:?}");
        assert!(figures.singular_vertices < figures.quads / 20, "{figures:?}");
        let fine = quads.triangles();
        assert_eq!(borders(&fine), borders(&mesh));
        let characteristic = |mesh: &TriMesh| {
            let edges = Adjacency::prepare(mesh).edges().len();
            mesh.vertex_count() as i64 - edges as i64 + mesh.face_count() as i64
        };
        assert_eq!(characteristic(&fine), characteristic(&mesh));
        let index = SurfaceIndex::prepare(&mesh);
        assert!(fine.points().iter().all(|p| index.closest(p).distance < 1e-9), "vertices lie on the surface");
        if borders(&mesh) > 0 {
            assert!(border_distance_mm(&fine, &mesh) < 1e-6, "border vertices lie on the border");
            assert!(border_distance_mm(&mesh, &fine) < hem_mm, "{}", border_distance_mm(&mesh, &fine));
        }
    }
}

#[test]
fn pairs_of_triangles_are_the_quads_again() {
    let quads = quad_mesh(&sleeve(), 0.01).unwrap();
    let again = quads_of_pairs(&quads.triangles());
    assert_eq!(again.len(), quads.quads.len());
    for (a, b) in again.iter().zip(&quads.quads) {
        let first = b.iter().position(|v| *v == a[0]).unwrap();
        assert!((0..4).all(|k| b[(first + k) % 4] == a[k]), "{a:?} {b:?}");
    }
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| quad_mesh(&sleeve(), 0.009).unwrap())
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn narrow_strips_handles_and_touching_fans_do_not_stop_it() {
    // A strip of 3 mm with edges of 10 mm, and two squares that touch in a corner.
    let points = (0..=100).flat_map(|i| [0.0, 0.003].map(|y| Point::new(0.004 * f64::from(i), y, 0.0))).collect();
    let faces: Vec<[u32; 3]> =
        (0..100u32).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]]).collect();
    let strip = quad_mesh(&TriMesh::try_from_indices(points, &faces).unwrap(), 0.01).unwrap();
    assert!(is_manifold(&strip) && strip.figures().smallest_angle_deg > 10.0, "{:?}", strip.figures());
    let p = |x: f64, y: f64| Point::new(0.1 * x, 0.1 * y, 0.0);
    let points = vec![p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0), p(2.0, 1.0), p(2.0, 2.0), p(1.0, 2.0)];
    let touching = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]]).unwrap();
    let quads = quad_mesh(&touching, 0.02).unwrap();
    assert!(is_manifold(&quads) && borders(&quads.triangles()) == 2);
}

#[test]
fn noise_and_faces_without_area_do_no_harm() {
    let mut next = noise(5);
    let round = sphere(30, 40).map_points(|p| p * 0.2);
    let shaken: Vec<Point> = round.points().iter().map(|p| p + Vec3::new(next(), next(), next()) * 0.001).collect();
    let mesh = round.with_points(shaken);
    // A corner moved onto its neighbour leaves two faces without area.
    let [a, b, _] = mesh.faces()[FaceId(600)];
    let mut points = mesh.points().clone();
    points[a] = points[b];
    let quads = quad_mesh(&mesh.with_points(points), 0.015).unwrap();
    assert!(is_manifold(&quads) && quads.figures().smallest_angle_deg > 10.0, "{:?}", quads.figures());
}

#[test]
fn what_cannot_be_re_meshed_gets_a_sentence() {
    let round = sphere(12, 24);
    let [a, b, _] = round.faces()[FaceId(100)];
    let mut faces = round.faces().clone().0;
    faces.push([a, b, VertexId(0)]);
    let said = |mesh: &TriMesh, edge: f64| quad_mesh(mesh, edge).unwrap_err().to_string();
    assert!(said(&round.with_faces(faces), 0.1).starts_with("1 of its edges belong to more than two faces"));
    let flat = round.map_points(|p| Point::new(p.x, 0.0, 0.0));
    assert_eq!(said(&flat, 0.1), "none of its 528 faces has an area");
    assert!(said(&TriMesh::empty(), 0.1).contains("has an area"));
    assert!(said(&round, 1e-5).contains("too short"));
}

/// Two half spheres with a pole at each end of x; the half at negative x is longer. And the vertex opposite to each.
fn egg() -> (TriMesh, PerVertex<VertexId>) {
    let (rings, around) = (24u32, 72u32);
    let half = 1 + (rings - 1) * around;
    let point = |ring: u32, k: u32, length: f64| {
        let (theta, phi) = (
            f64::from(ring) / f64::from(rings) * std::f64::consts::FRAC_PI_2,
            f64::from(k) / f64::from(around) * std::f64::consts::TAU,
        );
        Point::new(length * theta.cos(), 0.1 * theta.sin() * phi.cos(), 0.1 * theta.sin() * phi.sin())
    };
    let mut points = Vec::new();
    for length in [0.1, -0.16] {
        points.push(Point::new(length, 0.0, 0.0));
        (1..rings).for_each(|ring| points.extend((0..around).map(|k| point(ring, k, length))));
    }
    points.extend((0..around).map(|k| point(rings, k, 0.0)));
    let at = |side: u32, ring: u32, k: u32| match ring {
        0 => side * half,
        ring if ring == rings => 2 * half + k % around,
        ring => side * half + 1 + (ring - 1) * around + k % around,
    };
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for side in [0, 1] {
        for (ring, k) in (0..rings).flat_map(|ring| (0..around).map(move |k| (ring, k))) {
            let [a, b] = [at(side, ring, k), at(side, ring, k + 1)];
            let [c, d] = [at(side, ring + 1, k), at(side, ring + 1, k + 1)];
            let both = if ring == 0 { vec![[a, c, d]] } else { vec![[a, c, d], [a, d, b]] };
            faces.extend(both.into_iter().map(|[a, b, c]| if side == 0 { [a, b, c] } else { [a, c, b] }));
        }
    }
    let opposite = |v: u32| match v / half {
        0 => v + half,
        1 => v - half,
        _ => v,
    };
    let mirror = (0..points.len() as u32).map(|v| VertexId(opposite(v))).collect();
    (TriMesh::try_from_indices(points, &faces).unwrap(), mirror)
}

#[test]
fn halves_that_correspond_get_corresponding_quads() {
    let (mesh, mirror) = egg();
    assert!(mesh.signed_volume() > 0.0 && borders(&mesh) == 0);
    let quads = mirrored_quad_mesh(&mesh, &mirror, 0.01).unwrap().expect("its faces are symmetric");
    assert!(is_manifold(&quads) && borders(&quads.triangles()) == 0);
    assert!(quads.triangles().signed_volume() > 0.9 * mesh.signed_volume());
    let half = quads.quads.len() / 2;
    let index = SurfaceIndex::prepare(&mesh);
    let mut in_the_middle = 0;
    for (ours, theirs) in quads.quads[..half].iter().zip(&quads.quads[half..]) {
        let [a, d, c, b] = theirs.map(|v| quads.points[v]);
        for (p, q) in ours.map(|v| quads.points[v]).iter().zip([a, b, c, d]) {
            assert!(p.x >= -1e-9 && q.x <= 1e-9 && (p.y - q.y).abs() < 1e-9 && (p.z - q.z).abs() < 1e-9);
            assert!((p.x * 1.6 + q.x).abs() < 1e-9 && index.closest(&q).distance < 1e-9);
            in_the_middle += usize::from(p.x.abs() < 1e-9);
        }
    }
    assert!(in_the_middle > 40, "edges run along the middle: {in_the_middle}");
    // A face that no face is opposite to.
    let faces: Vec<[VertexId; 3]> = mesh.faces().iter().skip(1).copied().collect();
    let torn = mesh.with_faces(faces);
    assert_eq!(mirrored_quad_mesh(&torn, &mirror, 0.01), Ok(None));
}
