//! Fills holes of the scan that a level camera leaves at crown, shoulders and soles: cloth is believed to follow the body.

use super::patch::Patch;
use crate::cut::body_below::BodyBelow;
use crate::geometry::{NearestVertex, PerVertex, Point, SurfaceIndex, Vec3};

/// Greatest distance of the cloth at the border of a hole from the body, on average, in metres: a cap's, over hair.
const GREATEST_OFFSET: f64 = 0.04;
/// Least mean cosine between the normals of filling and body. Below a skirt and at the end of a sleeve the filling would lie
/// across the limbs, with 0; crowns, soles and shoulders have 0.9.
const LEAST_AGREEMENT: f64 = 0.6;
/// Least distance of the filling from the body, in metres: it is cloth, not skin.
const LEAST_OFFSET: f64 = 1e-3;
/// What is farther than this from the part of the body that the template covers is not covered, in metres: the soles below
/// trousers are farther. The straps of tank tops are, too, at 3 and at 5 cm (seeds 2003, 2007): what leads across is cloth nevertheless.
const TEMPLATE_ERROR: f64 = 0.05;
/// Rounds of smoothing after the filling was laid on the body: they soften the step at its border, and flatten a crown by 1 mm.
const SMOOTHING_ROUNDS: usize = 3;

/// A body, prepared for queries.
pub(in crate::cut) struct BodyIndex {
    surface: SurfaceIndex,
    is_covered: PerVertex<bool>,
    covered: NearestVertex,
    floor: f64,
    goes_between_legs: bool,
}

impl BodyIndex {
    pub(in crate::cut) fn prepare(body: &BodyBelow) -> Self {
        let points = body.mesh.points().iter().zip(body.covered.iter());
        let covered: Vec<Point> = points.filter(|(_, covered)| **covered).map(|(p, _)| *p).collect();
        let (surface, is_covered) = (SurfaceIndex::prepare(body.mesh), body.covered.clone());
        let floor = body.mesh.bounds().map_or(0.0, |bounds| bounds.min.y);
        let covered = NearestVertex::prepare(&covered);
        Self { surface, is_covered, covered, floor, goes_between_legs: body.goes_between_legs }
    }

    /// Whether it is that of this body.
    pub(in crate::cut) fn is_of(&self, body: &BodyBelow) -> bool {
        let Self { surface, is_covered, goes_between_legs, .. } = self;
        is_covered == body.covered && *goes_between_legs == body.goes_between_legs && surface.mesh() == body.mesh
    }

    /// The body's surface.
    pub(in crate::cut) fn surface(&self) -> &SurfaceIndex {
        &self.surface
    }

    /// Whether a strap may lead across a hole there: over a shoulder, or between the legs if the garment goes there, but not under a
    /// foot, at which trousers end on both sides.
    pub(in crate::cut) fn may_have_strap(&self, p: &Point) -> bool {
        /// Height above the lowest point of the body, in metres.
        const ABOVE_FEET: f64 = 0.12;
        /// Least height of the unit normal at the top of a shoulder.
        const FACES_UP: f64 = 0.3;
        let faces_up = || self.surface.pseudonormal(&self.surface.closest(p)).y > FACES_UP;
        p.y > self.floor + ABOVE_FEET && (self.goes_between_legs || faces_up())
    }

    /// Whether the template may cover the body there.
    pub(in crate::cut) fn may_be_covered(&self, p: &Point) -> bool {
        self.covered.nearest(&self.surface.closest(p).point).is_some_and(|(_, distance)| distance < TEMPLATE_ERROR)
    }
}

/// The new points of a filling laid along the body, as far from it as the cloth at the border is; `None` if the body does
/// not continue below the hole.
///
/// **Shapes** `inner`: the fair points of the patch that are not on the ring, which has `patch.points.len() - inner.len()`.
pub(in crate::cut) fn laid_along_body(patch: &Patch, inner: &[Point], body: &BodyIndex) -> Option<Vec<Point>> {
    let body = &body.surface;
    let ring = &patch.points[..patch.points.len() - inner.len()];
    let offsets: Vec<f64> = ring.iter().map(|p| body.signed_distance(p)).collect();
    let mean = offsets.iter().sum::<f64>() / offsets.len().max(1) as f64;
    if inner.is_empty() || !(-GREATEST_OFFSET..=GREATEST_OFFSET).contains(&mean) {
        return None;
    }
    let fair: Vec<Point> = ring.iter().chain(inner).copied().collect();
    let (mut agreement, mut area) = (0.0, 0.0);
    for face in &patch.faces {
        let [a, b, c] = face.map(|i| fair[i]);
        let normal = (b - a).cross(&(c - a));
        let middle = Point::from((a.coords + b.coords + c.coords) / 3.0);
        agreement += normal.dot(&body.pseudonormal(&body.closest(&middle)));
        area += normal.norm();
    }
    if agreement < LEAST_AGREEMENT * area {
        return None;
    }
    let laid = |p: &Point| {
        let at = body.closest(p);
        let (mut sum, mut total) = (0.0, 0.0);
        for (q, offset) in ring.iter().zip(&offsets) {
            let weight = 1.0 / (p - q).norm_squared().max(1e-10);
            sum += weight * offset;
            total += weight;
        }
        at.point + body.pseudonormal(&at) * (sum / total).max(LEAST_OFFSET)
    };
    let mut points = fair;
    points[ring.len()..].iter_mut().for_each(|p| *p = laid(p));
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for face in &patch.faces {
        for k in 0..3 {
            around[face[k]].push(face[(k + 1) % 3]);
            around[face[k]].push(face[(k + 2) % 3]);
        }
    }
    for _ in 0..SMOOTHING_ROUNDS {
        let smoothed: Vec<Point> = (ring.len()..points.len())
            .map(|i| {
                let sum: Vec3 = around[i].iter().map(|&j| points[j].coords).sum();
                nalgebra::center(&points[i], &Point::from(sum / around[i].len().max(1) as f64))
            })
            .collect();
        points[ring.len()..].copy_from_slice(&smoothed);
    }
    Some(points.split_off(ring.len()))
}
