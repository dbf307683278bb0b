//! How ragged the hems of a garment are.

use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use serde::{Deserialize, Serialize};

/// The most ragged hem of a garment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RaggedHem {
    /// Its length relative to that of its smoothed line; 1 is smooth.
    pub length_per_smooth_length: f64,
    /// Its length in metres.
    pub length: f64,
    /// Where it is most ragged.
    pub at: Point,
    /// Height of that place above the lowest point of the scan, in metres.
    pub height: f64,
}

/// Shorter loops tell nothing, in metres: smoothing draws in a small circle, too. Sleeves and legs are cut across a tube and are
/// never as ragged as the collar or the front of a coat.
const LEAST_LENGTH: f64 = 0.6;
/// Standard deviation of the Gaussian along the hem, in metres: longer than a triangle, shorter than the corner of a coat.
const DEVIATION: f64 = 0.02;
/// Distance of the samples along a hem, in metres: a tenth of the deviation, so that the sum is the integral.
const SPACING: f64 = 0.002;
/// The Gaussian ends here, in deviations.
const REACH: f64 = 3.0;
/// Length of the piece of which the most ragged is named, in metres: longer than one corner.
const PIECE: f64 = 0.2;

/// The hem that is longest in relation to its smoothed line; `None` if all are short. `floor` is the height of the scan's lowest
/// point.
///
/// **Shapes** `hems`: the vertices of each hem, in order, closed.
pub(super) fn most_ragged_hem(points: &PerVertex<Point>, hems: &[Vec<VertexId>], floor: f64) -> Option<RaggedHem> {
    let of_hem = |hem: &Vec<VertexId>| raggedness(&hem.iter().map(|&v| points[v]).collect::<Vec<_>>(), floor);
    let ragged = hems.iter().filter_map(of_hem);
    ragged.max_by(|a, b| a.length_per_smooth_length.total_cmp(&b.length_per_smooth_length))
}

fn raggedness(ring: &[Point], floor: f64) -> Option<RaggedHem> {
    let length: f64 = (0..ring.len()).map(|i| (ring[(i + 1) % ring.len()] - ring[i]).norm()).sum();
    if !length.is_finite() || length < LEAST_LENGTH {
        return None;
    }
    let samples = resampled(ring, (length / SPACING).round() as usize);
    let count = samples.len();
    let smooth = smoothed(&samples, length / count as f64);
    let steps: Vec<f64> = (0..count).map(|i| (smooth[(i + 1) % count] - smooth[i]).norm()).collect();
    let piece = ((PIECE / length * count as f64) as usize).clamp(1, count);
    let of_piece = |start: usize| (start..start + piece).map(|i| steps[i % count]).sum::<f64>();
    let shortest = (0..count).map(|i| (i, of_piece(i))).min_by(|a, b| a.1.total_cmp(&b.1))?.0;
    let smooth_length: f64 = steps.iter().sum();
    let at = smooth[(shortest + piece / 2) % count];
    Some(RaggedHem {
        length_per_smooth_length: length / smooth_length.max(f64::MIN_POSITIVE),
        length,
        at,
        height: at.y - floor,
    })
}

/// Points of a closed line at equal distances along it.
fn resampled(ring: &[Point], count: usize) -> Vec<Point> {
    let ends = |i: usize| (ring[i], ring[(i + 1) % ring.len()]);
    let length: f64 = (0..ring.len()).map(ends).map(|(a, b)| (b - a).norm()).sum();
    let (mut samples, mut passed) = (Vec::with_capacity(count), 0.0);
    for (a, b) in (0..ring.len()).map(ends) {
        let edge = (b - a).norm();
        while samples.len() < count && samples.len() as f64 * length / count as f64 <= passed + edge {
            let along = samples.len() as f64 * length / count as f64 - passed;
            samples.push(a + (b - a) * (along / edge.max(f64::MIN_POSITIVE)));
        }
        passed += edge;
    }
    samples
}

/// Each point of a closed line as the weighted mean of its neighbours along the line.
fn smoothed(samples: &[Point], spacing: f64) -> Vec<Point> {
    let (count, reach) = (samples.len() as isize, (REACH * DEVIATION / spacing).ceil() as isize);
    let weight = |k: isize| (-0.5 * (k as f64 * spacing / DEVIATION).powi(2)).exp();
    let total: f64 = (-reach..=reach).map(weight).sum();
    let at = |i: isize| {
        let sum: Vec3 = (-reach..=reach).map(|k| samples[(i + k).rem_euclid(count) as usize].coords * weight(k)).sum();
        Point::from(sum / total)
    };
    (0..count).map(at).collect()
}
