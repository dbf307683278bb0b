//! What colours say about the edge of cloth, kept from one cut of a scan to the next.

use crate::geometry::{NearestVertex, PerVertex, Point, VertexId};
use crate::segment::{Lab, color_difference, lab_of};
use rayon::prelude::*;

/// Vertices from this distance on are the model of the colours on their side, in metres: outside the blur of fusion.
const MODEL_FROM: f64 = 0.008;
/// Radius within which colours are compared, in metres.
pub(super) const MODEL_RADIUS: f64 = 0.045;
/// Greatest number of colours that one is compared with.
const COLORS_ASKED: usize = 96;
/// Fewer colours on one side are no model.
const LEAST_COLORS: usize = 5;
/// Greatest evidence of one vertex's colour, in nats: one of ten must not decide.
const GREATEST_COLOR: f64 = 2.0;
/// Density of a colour that neither side has, relative to the density at a colour of the model.
const UNKNOWN: f64 = 0.02;

/// Where a vertex is in relation to a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// Too far away to be compared.
    Far,
    /// Clearly on the garment.
    Inside,
    /// Too near to show the colours of one side.
    Between,
    /// Clearly beside the garment.
    Outside,
}

/// The evidence of colours around a cut, which depends on the scan and on nothing but the sides of the vertices near.
#[derive(Clone, Debug)]
pub(super) struct ColorEvidence {
    sides: PerVertex<Side>,
    /// In nats; `None` where it was not asked for.
    nats: PerVertex<Option<f64>>,
}

/// A vertex at the radius is taken as within it: the search that this saves rounds otherwise.
const ROUNDING: f64 = 1.0 + 1e-9;

impl ColorEvidence {
    /// The evidence at the vertices `asked`, of which `find` finds that of the one at an index. Where no vertex within `radius` has
    /// changed sides, the evidence is that of `before`.
    ///
    /// **Shapes** `sides` and `points`: one per vertex.
    fn find(
        before: Option<&Self>,
        sides: PerVertex<Side>,
        points: &PerVertex<Point>,
        radius: f64,
        asked: &[VertexId],
        find: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        let changed = |before: &Self| -> Vec<Point> {
            sides.enumerate().filter(|(v, side)| before.sides[*v] != **side).map(|(v, _)| points[v]).collect()
        };
        let before = before.map(|before| (before, NearestVertex::prepare(&changed(before))));
        let kept = |v: VertexId| {
            let (before, changed) = before.as_ref()?;
            let is_near = changed.nearest(&points[v]).is_some_and(|(_, distance)| distance <= ROUNDING * radius);
            before.nats[v].filter(|_| !is_near)
        };
        let found: Vec<f64> = asked.par_iter().enumerate().map(|(i, &v)| kept(v).unwrap_or_else(|| find(i))).collect();
        let mut nats = PerVertex::filled(None, sides.len());
        for (&v, value) in asked.iter().zip(found) {
            nats[v] = Some(value);
        }
        Self { sides, nats }
    }

    /// That of a vertex; 0 where it was not asked for.
    pub(super) fn at(&self, v: VertexId) -> f64 {
        self.nats[v].unwrap_or(0.0)
    }
}

/// What colours say, in nats for cloth: whether a vertex has those of the cloth near it, or those beside it. It is asked up to `reach`
/// from the cut.
///
/// **Shapes** `distance`: of each of `vertices` from the cut, in metres, negative on the garment.
pub(super) fn color_evidence(
    points: &PerVertex<Point>,
    colors: &PerVertex<[u8; 3]>,
    vertices: &[VertexId],
    distance: &[f64],
    reach: f64,
    before: Option<&ColorEvidence>,
) -> ColorEvidence {
    let mut sides = PerVertex::filled(Side::Far, points.len());
    for (&v, &from_cut) in vertices.iter().zip(distance) {
        sides[v] = match from_cut {
            d if d < -MODEL_FROM => Side::Inside,
            d if d > MODEL_FROM => Side::Outside,
            _ => Side::Between,
        };
    }
    let labs: Vec<Lab> = vertices.iter().map(|&v| lab_of(colors[v])).collect();
    let of_band: Vec<Point> = vertices.iter().map(|&v| points[v]).collect();
    let index = NearestVertex::prepare(&of_band);
    let asked: Vec<usize> = (0..labs.len()).filter(|&k| distance[k].abs() <= reach).collect();
    let asked_vertices: Vec<VertexId> = asked.iter().map(|&k| vertices[k]).collect();
    let of_side = sides.clone();
    ColorEvidence::find(before, sides, points, MODEL_RADIUS, &asked_vertices, |i| {
        let k = asked[i];
        let near = index.within(&of_band[k], MODEL_RADIUS);
        let (mut inside, mut outside) = (Mean::default(), Mean::default());
        for j in near.iter().step_by(near.len().div_ceil(COLORS_ASKED).max(1)).map(|near| near.index()) {
            let side = match of_side[vertices[j]] {
                Side::Inside => &mut inside,
                Side::Outside => &mut outside,
                Side::Between | Side::Far => continue,
            };
            side.add((-0.5 * color_difference(&labs[k], &labs[j]).powi(2)).exp());
        }
        let ratio = |(inside, outside): (f64, f64)| ((inside + UNKNOWN) / (outside + UNKNOWN)).ln();
        inside.get().zip(outside.get()).map_or(0.0, ratio).clamp(-GREATEST_COLOR, GREATEST_COLOR)
    })
}

/// A running mean.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    /// `None` of too few values for a model.
    fn get(&self) -> Option<f64> {
        (self.count >= LEAST_COLORS).then(|| self.sum / self.count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn only_what_is_near_a_change_of_sides_is_found_again() {
        let points: PerVertex<Point> = (0..100).map(|i| Point::new(0.01 * f64::from(i), 0.0, 0.0)).collect();
        let asked: Vec<VertexId> = (0..100).map(VertexId::from_index).collect();
        let found = |before: Option<&ColorEvidence>, sides: &PerVertex<Side>, value: f64| {
            let count = AtomicUsize::new(0);
            let find = |_| {
                count.fetch_add(1, Ordering::Relaxed);
                value
            };
            (ColorEvidence::find(before, sides.clone(), &points, 0.045, &asked, find), count.into_inner())
        };
        let mut sides = PerVertex::filled(Side::Inside, 100);
        let (first, count) = found(None, &sides, 1.0);
        assert_eq!(count, 100);
        assert_eq!(found(Some(&first), &sides, 2.0).1, 0);
        sides[asked[50]] = Side::Outside;
        let (second, count) = found(Some(&first), &sides, 2.0);
        assert_eq!(count, 9);
        assert_eq!([45, 46, 54, 55].map(|i| second.at(asked[i])), [1.0, 2.0, 2.0, 1.0]);
    }
}
