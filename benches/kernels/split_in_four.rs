//! A finer mesh, for kernels and for tables of times.

use overcoat::geometry::{Point, TriMesh};
use std::collections::BTreeMap;

/// Each triangle split in four, at the middles of its sides.
pub fn split_in_four(coarse: &TriMesh) -> TriMesh {
    let mut points: Vec<Point> = coarse.points().iter().copied().collect();
    let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut faces = Vec::new();
    for face in coarse.faces().iter() {
        let [a, b, c] = face.map(|v| v.0);
        let mut middle = |i: u32, j: u32| {
            *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                points.push(nalgebra::center(&points[i as usize], &points[j as usize]));
                points.len() as u32 - 1
            })
        };
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    let Ok(mesh) = TriMesh::try_from_indices(points, &faces) else { unreachable!("all corners are points") };
    mesh
}
