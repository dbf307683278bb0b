//! The scan's surface, prepared for closest points and rays.

use super::sampling::spread;
use crate::geometry::{Adjacency, FaceId, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};
use crate::scan::Scan;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A scan prepared for queries.
pub(crate) struct ScanSurface {
    pub(crate) index: SurfaceIndex,
    pub(crate) normals: PerVertex<Vec3>,
    pub(crate) areas: PerVertex<f64>,
    /// Confidence of each vertex, 0 to 1: how well a fusion observed it; 1 for scans without confidence.
    confidence: PerVertex<f64>,
    on_boundary: PerVertex<bool>,
}

/// For each point of a repeated query: the face that was closest last time.
pub(crate) struct LastFaces(Vec<AtomicU32>);

impl LastFaces {
    pub(crate) fn none(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU32::new(u32::MAX)).collect())
    }

    pub(crate) fn of(&self, k: usize) -> Option<FaceId> {
        let face = self.0[k].load(Relaxed);
        (face != u32::MAX).then_some(FaceId(face))
    }

    // One task at a time queries a point, so that the order of tasks does not matter.
    pub(crate) fn remember(&self, k: usize, face: FaceId) {
        self.0[k].store(face.0, Relaxed);
    }
}

/// A point of the scan with its smooth normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanHit {
    pub(crate) point: Point,
    pub(crate) normal: Vec3,
    pub(crate) distance: f64,
    /// Whether the point is on the rim of a hole, beyond which nothing is known.
    pub(crate) at_rim: bool,
    /// Confidence of the scan at the point, 0 to 1.
    pub(crate) confidence: f64,
}

impl ScanSurface {
    pub(crate) fn prepare(scan: &Scan) -> Self {
        /// The least confident vertices still count a little: they may be all that the scan has of a hand.
        const LEAST_CONFIDENCE: f64 = 0.05;
        let mesh = &scan.mesh;
        let confidence = match &scan.confidence {
            Some(confidence) => confidence.iter().map(|c| f64::from(*c).clamp(LEAST_CONFIDENCE, 1.0)).collect(),
            None => PerVertex::filled(1.0, mesh.vertex_count()),
        };
        let small =
            || (mesh.vertex_normals_by_area(), mesh.vertex_areas(), Adjacency::prepare(mesh).boundary_vertices());
        let (index, (normals, areas, on_boundary)) = rayon::join(|| SurfaceIndex::prepare(mesh), small);
        Self { index, normals, areas, confidence, on_boundary }
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        self.index.mesh()
    }

    /// Length of the rims of holes within `radius` of a point; each rim vertex counts the root of its area.
    pub(crate) fn rim_near(&self, place: &Point, radius: f64) -> f64 {
        let is_near = |v: VertexId| self.on_boundary[v] && (self.mesh().points()[v] - place).norm() < radius;
        self.mesh().vertex_ids().filter(|&v| is_near(v)).map(|v| self.areas[v].sqrt()).sum()
    }

    /// The closest point within `max_distance`.
    pub(crate) fn nearest(&self, p: &Point, max_distance: f64) -> Option<ScanHit> {
        self.index.closest_within(p, max_distance).map(|s| self.hit(&s))
    }

    /// [`nearest`](Self::nearest), with a search that starts from the face that was closest to point `k` last time.
    pub(crate) fn nearest_from(&self, p: &Point, max_distance: f64, last: &LastFaces, k: usize) -> Option<ScanHit> {
        let found = self.index.closest_within_from(p, max_distance, last.of(k))?;
        last.remember(k, found.face);
        Some(self.hit(&found))
    }

    /// The first point along a ray.
    pub(crate) fn along(&self, origin: &Point, direction: &Vec3, max: f64) -> Option<ScanHit> {
        let hit = self.index.cast_ray(origin, direction, max)?;
        let point = origin + direction * hit.distance;
        Some(self.hit(&SurfacePoint { face: hit.face, barycentric: hit.barycentric, point, distance: hit.distance }))
    }

    fn hit(&self, s: &SurfacePoint) -> ScanHit {
        let corners = self.mesh().faces()[s.face];
        let mut normal = Vec3::zeros();
        let (mut rim, mut confidence) = (0.0, 0.0);
        for (&v, &b) in corners.iter().zip(&s.barycentric) {
            normal += self.normals[v] * b;
            confidence += self.confidence[v] * b;
            if self.on_boundary[v] {
                rim += b;
            }
        }
        ScanHit {
            point: s.point,
            normal: normal.try_normalize(1e-9).unwrap_or_else(|| self.mesh().face_normal(s.face)),
            distance: s.distance,
            at_rim: rim > 0.5,
            confidence,
        }
    }

    /// About `count` vertices spread evenly over the area, each with the area that it represents.
    pub(crate) fn samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        spread(&self.areas, count)
    }

    /// [`samples`](Self::samples) with areas multiplied by the confidence of the vertices.
    pub(crate) fn confidence_weighted_samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        self.samples(count).into_iter().map(|(v, area)| (v, area * self.confidence[v])).collect()
    }
}
