//! Holes of a scan.

use crate::geometry::{Adjacency, TriMesh, Vec3};

/// The area of the largest hole, in m²: half the length of the sum of the cross products along its rim, which is the area of
/// a flat hole, and less than that of a curved one.
pub(super) fn largest_hole(mesh: &TriMesh) -> f64 {
    let rims = Adjacency::prepare(mesh).boundary_loops();
    let area = |rim: &Vec<crate::geometry::VertexId>| {
        let points: Vec<_> = rim.iter().map(|&v| mesh.points()[v]).collect();
        let Some(&first) = points.first() else { return 0.0 };
        0.5 * points.windows(2).map(|w| (w[0] - first).cross(&(w[1] - first))).sum::<Vec3>().norm()
    };
    rims.iter().map(area).fold(0.0, f64::max)
}
