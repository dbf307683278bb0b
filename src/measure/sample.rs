//! Area-weighted samples of a surface, and statistics of their distances.

use crate::geometry::{FaceId, Point, SurfaceIndex, TriMesh, Vec3};
use crate::numerics::Rng;
use rayon::prelude::*;

/// Samples per surface: 20 000 are one per cm² of a person and make the mean of a distance repeatable to 1 %.
pub(super) const SAMPLE_COUNT: usize = 20_000;

/// All metrics use this stream, so that two runs agree to the last digit.
const SEED: u64 = 20_170;

/// A point of a surface with the outward normal of its face.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceSample {
    pub(super) point: Point,
    pub(super) normal: Vec3,
    pub(super) face: FaceId,
}

/// `count` points, each for an equal area (systematic sampling with a random position in the face).
pub(super) fn area_weighted(mesh: &TriMesh, count: usize) -> Vec<SurfaceSample> {
    let total = mesh.area();
    if total <= 0.0 || count == 0 {
        return Vec::new();
    }
    let mut rng = Rng::new(SEED);
    let step = total / count as f64;
    let mut next_at = step * rng.unit();
    let mut passed = 0.0;
    let mut samples = Vec::with_capacity(count);
    for face in mesh.face_ids() {
        passed += mesh.face_area(face);
        while next_at < passed && samples.len() < count {
            samples.push(somewhere_in(mesh, face, &mut rng));
            next_at += step;
        }
    }
    samples
}

fn somewhere_in(mesh: &TriMesh, face: FaceId, rng: &mut Rng) -> SurfaceSample {
    let (mut s, mut t) = (rng.unit(), rng.unit());
    if s + t > 1.0 {
        (s, t) = (1.0 - s, 1.0 - t);
    }
    let [a, b, c] = mesh.triangle(face);
    SurfaceSample { point: a + (b - a) * s + (c - a) * t, normal: mesh.face_normal(face), face }
}

/// Distances from samples of `from` to the nearest point of `to`, in metres, in sample order.
pub(super) fn distances(from: &TriMesh, to: &SurfaceIndex) -> Vec<f64> {
    area_weighted(from, SAMPLE_COUNT).par_iter().map(|s| to.closest(&s.point).distance).collect()
}

/// The mean; 0 of no values.
pub(super) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// The quantile `share` (nearest rank); 0 of no values.
pub(super) fn percentile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied().unwrap_or(0.0)
}
