//! Small shapes with known answers, for tests.

use super::{Point, TriMesh};

/// Reproducible numbers in −1..1 (xorshift64*).
pub(crate) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// The unit cube, outward.
pub(super) fn cube() -> TriMesh {
    let points = (0..8).map(|i| Point::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64)).collect();
    let faces = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
    ];
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// The unit sphere by rings of latitude, outward, poles on the Y axis.
pub(crate) fn sphere(rings: usize, sectors: usize) -> TriMesh {
    let mut points = vec![Point::new(0.0, 1.0, 0.0)];
    for i in 1..rings {
        let polar = std::f64::consts::PI * i as f64 / rings as f64;
        for j in 0..sectors {
            let around = std::f64::consts::TAU * j as f64 / sectors as f64;
            points.push(Point::new(polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin()));
        }
    }
    points.push(Point::new(0.0, -1.0, 0.0));
    let id = |ring: usize, j: usize| (1 + (ring - 1) * sectors + j % sectors) as u32;
    let last = (points.len() - 1) as u32;
    let mut faces = Vec::new();
    for j in 0..sectors {
        faces.push([0, id(1, j + 1), id(1, j)]);
        for i in 1..rings - 1 {
            faces.push([id(i, j), id(i, j + 1), id(i + 1, j + 1)]);
            faces.push([id(i, j), id(i + 1, j + 1), id(i + 1, j)]);
        }
        faces.push([last, id(rings - 1, j), id(rings - 1, j + 1)]);
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

#[test]
fn the_shapes_are_outward() {
    assert!((cube().signed_volume() - 1.0).abs() < 1e-12);
    assert!(sphere(20, 30).signed_volume() > 4.0);
}
