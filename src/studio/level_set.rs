//! A dense grid of signed distances, and its zero surface.

use crate::geometry::{Aabb, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// Signed distances to a surface at the nodes of a grid, metres, positive outside; `NaN` where the distance is unknown.
///
/// **Shapes** `distance` has `size[0] * size[1] * size[2]` entries; x runs fastest.
pub(super) struct LevelSet {
    origin: Point,
    /// Metres between nodes.
    pub(super) spacing: f64,
    /// Nodes along x, y, z.
    pub(super) size: [usize; 3],
    pub(super) distance: Vec<f32>,
}

impl LevelSet {
    /// A grid that covers `bounds` and `around` metres more on every side, all distances unknown.
    pub(super) fn covering(bounds: &Aabb, around: f64, spacing: f64) -> Self {
        let origin = bounds.min - Vec3::repeat(around);
        let extent = bounds.extent() + Vec3::repeat(2.0 * around);
        let size = [extent.x, extent.y, extent.z].map(|e| (e / spacing).ceil() as usize + 1);
        Self { origin, spacing, size, distance: vec![f32::NAN; size[0] * size[1] * size[2]] }
    }

    /// The position of a node.
    pub(super) fn node(&self, x: usize, y: usize, z: usize) -> Point {
        self.origin + Vec3::new(x as f64, y as f64, z as f64) * self.spacing
    }

    /// Evaluates `distance` at every node. Each slab of constant z is one parallel task.
    pub(super) fn fill(&mut self, distance: impl Fn(&Point) -> f32 + Sync) {
        let (origin, spacing, [nx, ny, _]) = (self.origin, self.spacing, self.size);
        self.distance.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slab)| {
            for (i, value) in slab.iter_mut().enumerate() {
                *value = distance(&(origin + Vec3::new((i % nx) as f64, (i / nx) as f64, z as f64) * spacing));
            }
        });
    }

    /// One pass of the binomial kernel (¼, ½, ¼) along each axis: removes features narrower than about two nodes.
    pub(super) fn smooth(&mut self) {
        let [nx, ny, nz] = self.size;
        for (stride, count) in [(1, nx), (nx, ny), (nx * ny, nz)] {
            let old = self.distance.clone();
            self.distance.par_iter_mut().enumerate().for_each(|(i, value)| {
                let at = (i / stride) % count;
                if at > 0 && at + 1 < count {
                    *value = 0.25 * (old[i - stride] + old[i + stride]) + 0.5 * old[i];
                }
            });
        }
    }

    /// The zero surface, oriented outward: one vertex in each cell that it crosses, one quad (two triangles) around each
    /// grid edge that it crosses. Edges with an unknown end become holes.
    ///
    /// **Source** naive surface nets (Gibson 1998).
    pub(super) fn zero_surface(&self) -> TriMesh {
        let [nx, ny, nz] = self.size;
        let mut vertex_of_cell = vec![u32::MAX; self.distance.len()];
        let mut points = Vec::new();
        for z in 0..nz - 1 {
            for y in 0..ny - 1 {
                for x in 0..nx - 1 {
                    if let Some(p) = self.cell_vertex(x, y, z) {
                        vertex_of_cell[x + nx * (y + ny * z)] = points.len() as u32;
                        points.push(p);
                    }
                }
            }
        }
        let strides = [1, nx, nx * ny];
        let mut faces = Vec::new();
        for z in 1..nz - 1 {
            for y in 1..ny - 1 {
                for x in 1..nx - 1 {
                    let at = x + nx * (y + ny * z);
                    for axis in 0..3 {
                        let (here, there) = (self.distance[at], self.distance[at + strides[axis]]);
                        if here.is_nan() || there.is_nan() || (here < 0.0) == (there < 0.0) {
                            continue;
                        }
                        let (u, v) = (strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
                        let quad = [at - u - v, at - v, at, at - u].map(|cell| vertex_of_cell[cell]);
                        if quad.contains(&u32::MAX) {
                            continue;
                        }
                        let [a, b, c, d] = if here < 0.0 { quad } else { [quad[3], quad[2], quad[1], quad[0]] };
                        faces.extend(shorter_diagonal(&points, [a, b, c, d]));
                    }
                }
            }
        }
        TriMesh::try_from_indices(points, &faces).expect("cells lie in the grid and their vertices are finite")
    }

    /// The mean of the points at which the surface crosses the cell's edges.
    fn cell_vertex(&self, x: usize, y: usize, z: usize) -> Option<Point> {
        let [nx, ny, _] = self.size;
        let mut corners = [0.0f32; 8];
        for (k, value) in corners.iter_mut().enumerate() {
            *value = self.distance[x + (k & 1) + nx * (y + (k >> 1 & 1) + ny * (z + (k >> 2)))];
        }
        let (mut sum, mut count) = (Vec3::zeros(), 0);
        for a in 0..8usize {
            for axis in 0..3 {
                let b = a | 1 << axis;
                let (da, db) = (f64::from(corners[a]), f64::from(corners[b]));
                if b == a || da.is_nan() || db.is_nan() || (da < 0.0) == (db < 0.0) {
                    continue;
                }
                let mut at = Vec3::new((a & 1) as f64, (a >> 1 & 1) as f64, (a >> 2) as f64);
                at[axis] = da / (da - db);
                sum += at;
                count += 1;
            }
        }
        (count > 0).then(|| self.node(x, y, z) + sum * (self.spacing / f64::from(count)))
    }
}

fn shorter_diagonal(points: &[Point], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let length = |i: u32, j: u32| (points[i as usize] - points[j as usize]).norm_squared();
    if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Adjacency;

    #[test]
    fn a_ball_comes_back_round_closed_and_outward() {
        let mut field =
            LevelSet::covering(&Aabb { min: Point::new(-1.0, -1.0, -1.0), max: Point::new(1.0, 1.0, 1.0) }, 0.3, 0.1);
        field.fill(|p| (p.coords.norm() - 1.0) as f32);
        let ball = field.zero_surface();
        assert!((ball.signed_volume() - 4.19).abs() < 0.1, "{}", ball.signed_volume());
        assert!(ball.points().iter().all(|p| (p.coords.norm() - 1.0).abs() < 0.02));
        assert!(Adjacency::prepare(&ball).boundary_loops().is_empty());
        field.fill(|p| if p.y > 0.6 { f32::NAN } else { (p.coords.norm() - 1.0) as f32 });
        assert_eq!(Adjacency::prepare(&field.zero_surface()).boundary_loops().len(), 1, "the unknown cap is a hole");
        field.fill(|p| (p.coords.norm() - 1.0) as f32);
        field.smooth();
        assert!(field.zero_surface().signed_volume() < ball.signed_volume());
    }
}
