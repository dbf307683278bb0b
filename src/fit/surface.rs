//! The scan as a fit sees it, and correspondences with it.

use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};

/// A scan prepared for queries.
pub(crate) struct ScanSurface {
    pub(crate) index: SurfaceIndex,
    pub(crate) normals: PerVertex<Vec3>,
    pub(crate) areas: PerVertex<f64>,
    on_boundary: PerVertex<bool>,
}

/// A place on the scan with its smooth normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanHit {
    pub(crate) point: Point,
    pub(crate) normal: Vec3,
    pub(crate) distance: f64,
    /// Whether the nearest place is the rim of a hole: nothing is known beyond it.
    pub(crate) at_rim: bool,
}

impl ScanSurface {
    pub(crate) fn prepare(mesh: &TriMesh) -> Self {
        Self {
            index: SurfaceIndex::prepare(mesh),
            normals: mesh.vertex_normals(),
            areas: mesh.vertex_areas(),
            on_boundary: Adjacency::prepare(mesh).boundary_vertices(),
        }
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        self.index.mesh()
    }

    /// The nearest place within `max_distance`.
    pub(crate) fn nearest(&self, p: &Point, max_distance: f64) -> Option<ScanHit> {
        self.index.closest_within(p, max_distance).map(|s| self.hit(&s))
    }

    /// The first place met along a ray.
    pub(crate) fn along(&self, origin: &Point, direction: &Vec3, max: f64) -> Option<ScanHit> {
        let hit = self.index.cast_ray(origin, direction, max)?;
        let point = origin + direction * hit.distance;
        Some(self.hit(&SurfacePoint { face: hit.face, barycentric: hit.barycentric, point, distance: hit.distance }))
    }

    fn hit(&self, s: &SurfacePoint) -> ScanHit {
        let corners = self.mesh().faces()[s.face];
        let mut normal = Vec3::zeros();
        let mut rim = 0.0;
        for (&v, &b) in corners.iter().zip(&s.barycentric) {
            normal += self.normals[v] * b;
            if self.on_boundary[v] {
                rim += b;
            }
        }
        ScanHit {
            point: s.point,
            normal: normal.try_normalize(1e-9).unwrap_or_else(|| self.mesh().face_normal(s.face)),
            distance: s.distance,
            at_rim: rim > 0.5,
        }
    }

    /// About `count` vertices spread evenly over the area, with the area that each stands for.
    pub(crate) fn samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        spread(&self.areas, count)
    }
}

/// About `count` vertices spread evenly over `areas`, in index order, each with the area that it stands for.
///
/// Error diffusion over the index order: no random numbers, so the same mesh gives the same samples.
pub(crate) fn spread(areas: &PerVertex<f64>, count: usize) -> Vec<(VertexId, f64)> {
    let total: f64 = areas.iter().sum();
    if count == 0 || total <= 0.0 {
        return Vec::new();
    }
    let step = total / count as f64;
    let mut owed = step * 0.5;
    let mut out = Vec::with_capacity(count + 1);
    for (v, &a) in areas.enumerate() {
        owed += a;
        if owed >= step {
            out.push((v, owed.min(4.0 * step)));
            owed = 0.0;
        }
    }
    out
}
