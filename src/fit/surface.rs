//! The scan as a fit sees it, and correspondences with it.

use super::articulated::Residual;
use crate::geometry::{Adjacency, FaceId, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};
use crate::scan::Scan;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Residual scale: about the noise of a depth camera at 2 m, and what a 15-component model leaves. Metres.
const SIGMA: f64 = 0.005;
/// Area that counts as one observation. Square metres.
const AREA_PER_OBSERVATION: f64 = 4e-4;

/// A scan prepared for queries.
pub(crate) struct ScanSurface {
    pub(crate) index: SurfaceIndex,
    pub(crate) normals: PerVertex<Vec3>,
    pub(crate) areas: PerVertex<f64>,
    /// How much each vertex counts as data, 0 to 1: how well a fusion saw it; 1 where nothing says so.
    trust: PerVertex<f64>,
    on_boundary: PerVertex<bool>,
}

/// For each place that is asked for again and again the face that was nearest the last time.
pub(crate) struct LastFaces(Vec<AtomicU32>);

impl LastFaces {
    pub(crate) fn none(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU32::new(u32::MAX)).collect())
    }

    fn of(&self, k: usize) -> Option<FaceId> {
        let face = self.0[k].load(Relaxed);
        (face != u32::MAX).then_some(FaceId(face))
    }

    // Each place is asked for by one task at a time, so that the order of tasks does not matter.
    fn remember(&self, k: usize, face: FaceId) {
        self.0[k].store(face.0, Relaxed);
    }
}

/// A place on the scan with its smooth normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanHit {
    pub(crate) point: Point,
    pub(crate) normal: Vec3,
    pub(crate) distance: f64,
    /// Whether the nearest place is the rim of a hole: nothing is known beyond it.
    pub(crate) at_rim: bool,
    /// How much the place counts as data, 0 to 1.
    pub(crate) trust: f64,
}

impl ScanSurface {
    pub(crate) fn prepare(scan: &Scan) -> Self {
        /// What was seen least still counts a little: it may be all that there is of a hand.
        const LEAST_TRUST: f64 = 0.05;
        let mesh = &scan.mesh;
        let trust = match &scan.confidence {
            Some(confidence) => confidence.iter().map(|c| f64::from(*c).clamp(LEAST_TRUST, 1.0)).collect(),
            None => PerVertex::filled(1.0, mesh.vertex_count()),
        };
        let small =
            || (mesh.vertex_normals_by_area(), mesh.vertex_areas(), Adjacency::prepare(mesh).boundary_vertices());
        let (index, (normals, areas, on_boundary)) = rayon::join(|| SurfaceIndex::prepare(mesh), small);
        Self { index, normals, areas, trust, on_boundary }
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        self.index.mesh()
    }

    /// Length of the rims of holes within `radius` of a place; each of their vertices stands for the root of its area.
    pub(crate) fn rim_near(&self, place: &Point, radius: f64) -> f64 {
        let is_near = |v: VertexId| self.on_boundary[v] && (self.mesh().points()[v] - place).norm() < radius;
        self.mesh().vertex_ids().filter(|&v| is_near(v)).map(|v| self.areas[v].sqrt()).sum()
    }

    /// The nearest place within `max_distance`.
    pub(crate) fn nearest(&self, p: &Point, max_distance: f64) -> Option<ScanHit> {
        self.index.closest_within(p, max_distance).map(|s| self.hit(&s))
    }

    /// The same, from the face that was nearest to place `k` the last time.
    pub(crate) fn nearest_from(&self, p: &Point, max_distance: f64, last: &LastFaces, k: usize) -> Option<ScanHit> {
        let found = self.index.closest_within_from(p, max_distance, last.of(k))?;
        last.remember(k, found.face);
        Some(self.hit(&found))
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
        let (mut rim, mut trust) = (0.0, 0.0);
        for (&v, &b) in corners.iter().zip(&s.barycentric) {
            normal += self.normals[v] * b;
            trust += self.trust[v] * b;
            if self.on_boundary[v] {
                rim += b;
            }
        }
        ScanHit {
            point: s.point,
            normal: normal.try_normalize(1e-9).unwrap_or_else(|| self.mesh().face_normal(s.face)),
            distance: s.distance,
            at_rim: rim > 0.5,
            trust,
        }
    }

    /// About `count` vertices spread evenly over the area, with the area that each stands for.
    pub(crate) fn samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        spread(&self.areas, count)
    }

    /// The same as data: what was seen badly stands for less.
    pub(crate) fn trusted_samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        self.samples(count).into_iter().map(|(v, area)| (v, area * self.trust[v])).collect()
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

/// Area over the area of one observation, over σ², under a Geman–McClure kernel that ends near `reach`.
pub(crate) fn robust(area: f64, distance: f64, reach: f64) -> f64 {
    let scale = 0.4 * reach;
    let kernel = 1.0 / (1.0 + (distance / scale).powi(2)).powi(2);
    area / AREA_PER_OBSERVATION / (SIGMA * SIGMA) * kernel
}

/// Mean of the gaps, each as it weighs.
pub(crate) fn mean_gap(residuals: &[Residual]) -> f64 {
    let (sum, total) =
        residuals.iter().fold((0.0, 0.0), |(sum, total), r| (sum + r.weight * r.gap.abs(), total + r.weight));
    sum / f64::max(total, 1e-12)
}

/// Point-to-plane residuals of places of the scan against the nearest place of a posed mesh with these normals, where
/// `takes` accepts that place's corners.
pub(crate) fn scan_to_mesh(
    surface: &ScanSurface,
    posed: &SurfaceIndex,
    normals: &PerVertex<Vec3>,
    samples: &[(VertexId, f64)],
    reach: f64,
    least_cosine: f64,
    takes: impl Fn(&[VertexId; 3]) -> bool + Sync,
) -> Vec<Residual> {
    let anew = LastFaces::none(samples.len());
    scan_to_mesh_from(surface, posed, normals, (samples, &anew), reach, least_cosine, takes)
}

/// The same, each from the face that was nearest the last time.
pub(crate) fn scan_to_mesh_from(
    surface: &ScanSurface,
    posed: &SurfaceIndex,
    normals: &PerVertex<Vec3>,
    (samples, last): (&[(VertexId, f64)], &LastFaces),
    reach: f64,
    least_cosine: f64,
    takes: impl Fn(&[VertexId; 3]) -> bool + Sync,
) -> Vec<Residual> {
    samples
        .par_iter()
        .enumerate()
        .filter_map(|(k, &(v, area))| {
            let q = surface.mesh().points()[v];
            let normal = surface.normals[v];
            let s = posed.closest_within_from(&q, reach, last.of(k))?;
            last.remember(k, s.face);
            let corners = posed.mesh().faces()[s.face];
            let on_mesh: Vec3 = (0..3).map(|k| normals[corners[k]] * s.barycentric[k]).sum();
            if !takes(&corners) || on_mesh.dot(&normal) < least_cosine {
                return None;
            }
            let at = std::array::from_fn(|k| (corners[k], s.barycentric[k]));
            let gap = normal.dot(&(q - s.point));
            Some(Residual { at, normal, gap, weight: robust(area, s.distance, reach) })
        })
        .collect()
}

/// Mean distance from a mesh, by area, each no more than `truncate`.
pub(crate) fn mean_truncated(to: &SurfaceIndex, from: &TriMesh, areas: &PerVertex<f64>, truncate: f64) -> f64 {
    /// Enough for a mean to 1.5 %.
    const SAMPLES: usize = 1000;
    let samples = spread(areas, SAMPLES);
    let distances: Vec<(f64, f64)> = samples
        .iter()
        .map(|&(v, a)| (a, to.closest_within(&from.points()[v], truncate).map_or(truncate, |s| s.distance)))
        .collect();
    let total: f64 = distances.iter().map(|d| d.0).sum();
    distances.iter().map(|d| d.0 * d.1).sum::<f64>() / total.max(1e-12)
}

/// The mean place of points, each weighed by its area.
pub(crate) fn area_centroid<'p>(places: impl Iterator<Item = (&'p Point, &'p f64)>) -> Vec3 {
    let (sum, total) = places.fold((Vec3::zeros(), 0.0), |(sum, total), (p, a)| (sum + p.coords * *a, total + a));
    sum / f64::max(total, 1e-12)
}

/// The least height.
pub(crate) fn lowest<'p>(points: impl Iterator<Item = &'p Point>) -> f64 {
    points.map(|p| p.y).fold(f64::INFINITY, f64::min)
}
