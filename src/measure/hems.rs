//! Metrics of the hems of a garment.

use super::sample::mean;
use crate::geometry::{Adjacency, NearestVertex, PerVertex, Point, TriMesh, VertexId};

/// Hems are resampled in steps of this length, metres: half of a scan's edge, so that teeth of one triangle count, while
/// the slivers that a cut through triangles leaves do not count as corners.
const HEM_STEP: f64 = 2e-3;

/// The number of boundary loops of a garment: its hems, and the holes that are left in it.
pub fn hem_loops(garment: &TriMesh) -> usize {
    boundary_loops(garment).len()
}

/// The boundary loops of a garment, the one with most vertices first.
pub(super) fn boundary_loops(garment: &TriMesh) -> Vec<Vec<VertexId>> {
    Adjacency::prepare(garment).boundary_loops()
}

/// Mean turning angle along all hems, in degrees per centimetre. A smooth round hem of girth G cm has 360 / G.
pub fn hem_roughness(garment: &TriMesh) -> f64 {
    let (mut turned_deg, mut length_cm) = (0.0, 0.0);
    for ring in boundary_loops(garment) {
        let walked = resampled(garment, &ring);
        let n = walked.len();
        for i in 0..n {
            let (before, at, after) = (walked[(i + n - 1) % n], walked[i], walked[(i + 1) % n]);
            turned_deg += (at - before).angle(&(after - at)).to_degrees();
            length_cm += 100.0 * (after - at).norm();
        }
    }
    if length_cm > 0.0 { turned_deg / length_cm } else { 0.0 }
}

/// Mean distance from the given hems of a garment to the nearest hem of the true garment, in millimetres; both are resampled
/// in steps of 2 mm. `None` if either has no hem.
///
/// It is taken in one direction: a hem that was not found does not enlarge it, but is missing in the number of hems.
pub fn hem_to_truth_mm(garment: &TriMesh, hems: &[Vec<VertexId>], true_garment: &TriMesh) -> Option<f64> {
    let true_hems = boundary_loops(true_garment);
    let truth: PerVertex<Point> = true_hems.iter().flat_map(|ring| resampled(true_garment, ring)).collect();
    let nearest = NearestVertex::prepare(truth.as_slice());
    let walked: Vec<Point> = hems.iter().flat_map(|ring| resampled(garment, ring)).collect();
    let distances: Vec<f64> = walked.iter().filter_map(|p| nearest.nearest(p).map(|(_, distance)| distance)).collect();
    (!distances.is_empty()).then(|| 1e3 * mean(&distances))
}

/// The boundary loop in equal steps of about [`HEM_STEP`].
fn resampled(mesh: &TriMesh, ring: &[VertexId]) -> Vec<Point> {
    let points: Vec<Point> = ring.iter().chain(ring.first()).map(|&v| mesh.points()[v]).collect();
    let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let count = (length / HEM_STEP).round() as usize;
    if count < 3 {
        return Vec::new();
    }
    let step = length / count as f64;
    let mut walked = Vec::with_capacity(count);
    let mut passed = 0.0;
    for w in points.windows(2) {
        let edge = (w[1] - w[0]).norm();
        while walked.len() < count && walked.len() as f64 * step < passed + edge {
            walked.push(w[0] + (w[1] - w[0]) * ((walked.len() as f64 * step - passed) / edge));
        }
        passed += edge;
    }
    walked
}
