//! Whether the edge of a garment can be seen in its scan.

use crate::geometry::{Adjacency, PerVertex, VertexId};
use crate::scan::Scan;
use crate::segment::{Lab, color_difference, lab_of};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// How far on either side of the edge colour and height are averaged, in metres: half the width of a cuff.
const BAND: f64 = 0.015;
/// Colours this near are those of one cloth, in spreads.
const SAME_COLOR: f64 = 1.0;
/// A smaller step is none, in metres: noise of a depth camera, and the thickness of most cloth.
const SAME_HEIGHT: f64 = 0.003;

/// The share of a garment's edge in the scan at which it has the colour and the height of what is beside it, so that only its
/// kind says where it ends; `None` without colours or edge. Edges by hand do not count, nor those beside specks and narrow strips at the
/// border of the scan, which have less than half as much surface on their other side.
///
/// **Shapes** `labels` and `by_hand`: one flag per vertex of the scan; `heights`: the distance of each from the figure without
/// the garment, in metres.
pub(super) fn unseen_edge_share(
    scan: &Scan,
    labels: &PerVertex<bool>,
    by_hand: &PerVertex<bool>,
    heights: impl Fn(VertexId) -> f64 + Sync,
) -> Option<f64> {
    let (colors, adjacency) = (scan.colors.as_ref()?, Adjacency::prepare(&scan.mesh));
    let of_band = |band: &[VertexId]| -> (Lab, f64) {
        let mean = |value: &dyn Fn(VertexId) -> f64| band.iter().map(|&v| value(v)).sum::<f64>() / band.len() as f64;
        ([0, 1, 2].map(|k| mean(&|v| lab_of(colors[v])[k])), mean(&heights))
    };
    let ends_unseen = |v: VertexId| -> Option<bool> {
        let beside = |w: &VertexId| !labels[*w];
        let outer: Vec<VertexId> = adjacency.neighbours_of(v).iter().copied().filter(beside).collect();
        let is_by_hand = by_hand[v] || outer.iter().any(|&w| by_hand[w]);
        if !labels[v] || outer.is_empty() || is_by_hand {
            return None;
        }
        let (inner, outer) = (band(scan, labels, &adjacency, v, vec![v]), band(scan, labels, &adjacency, v, outer));
        if 2 * outer.len() <= inner.len() {
            return None;
        }
        let ((color, height), (color_beside, height_beside)) = (of_band(&inner), of_band(&outer));
        let has_same_color = color_difference(&color, &color_beside) < SAME_COLOR;
        Some(has_same_color && (height - height_beside).abs() < SAME_HEIGHT)
    };
    let vertices: Vec<VertexId> = scan.mesh.vertex_ids().collect();
    let edge: Vec<bool> = vertices.into_par_iter().filter_map(ends_unseen).collect();
    (!edge.is_empty()).then(|| edge.iter().filter(|unseen| **unseen).count() as f64 / edge.len() as f64)
}

/// The vertices within `BAND` of `center` that are connected with the first ones and labelled as they are.
fn band(
    scan: &Scan,
    labels: &PerVertex<bool>,
    adjacency: &Adjacency,
    center: VertexId,
    first: Vec<VertexId>,
) -> Vec<VertexId> {
    let points = scan.mesh.points();
    let mut found: BTreeSet<VertexId> = first.iter().copied().collect();
    let mut front = first;
    while let Some(v) = front.pop() {
        for &w in adjacency.neighbours_of(v) {
            let is_near = (points[w] - points[center]).norm() < BAND;
            if labels[w] == labels[v] && is_near && found.insert(w) {
                front.push(w);
            }
        }
    }
    found.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, TriMesh};

    /// A strip of 8 by 40 cm in steps of 5 mm: of it the garment is what is farther than 20 cm.
    fn strip(color: [u8; 3], height: f64) -> (Scan, PerVertex<bool>, PerVertex<f64>) {
        let (across, along) = (17_u32, 81_u32);
        let is_garment = |i: u32| i > 40;
        let points: Vec<Point> = (0..along)
            .flat_map(|i| (0..across).map(move |j| (i, j)))
            .map(|(i, j)| {
                let z = if is_garment(i) { height } else { 0.0 };
                Point::new(0.005 * f64::from(j), 0.005 * f64::from(i), z)
            })
            .collect();
        let mut faces = Vec::new();
        for i in 0..along - 1 {
            for j in 0..across - 1 {
                let k = i * across + j;
                faces.extend([[k, k + 1, k + across], [k + 1, k + across + 1, k + across]]);
            }
        }
        let labels: PerVertex<bool> = (0..along).flat_map(|i| (0..across).map(move |_| i)).map(is_garment).collect();
        let colors = labels.iter().map(|&l| if l { color } else { [120, 60, 50] }).collect();
        let heights = labels.iter().map(|&l| if l { height } else { 0.0 }).collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        (Scan::from_clean_mesh(mesh, Some(colors)), labels, heights)
    }

    #[test]
    fn an_edge_is_unseen_only_without_another_colour_and_without_a_step() {
        let share = |color, height| {
            let (scan, labels, heights) = strip(color, height);
            let none = PerVertex::filled(false, labels.len());
            unseen_edge_share(&scan, &labels, &none, |v| heights[v])
        };
        assert_eq!(share([120, 60, 50], 0.0), Some(1.0));
        assert_eq!(share([60, 80, 160], 0.0), Some(0.0));
        assert_eq!(share([120, 60, 50], 0.006), Some(0.0));
    }

    #[test]
    fn specks_and_strips_at_the_border_of_the_scan_are_no_edges() {
        let (scan, labels, _) = strip([120, 60, 50], 0.0);
        let none = PerVertex::filled(false, labels.len());
        let ring: PerVertex<bool> = scan.mesh.points().iter().map(|p| p.y > 0.002).collect();
        assert_eq!(unseen_edge_share(&scan, &ring, &none, |_| 0.0), None);
        let speck: PerVertex<bool> = scan.mesh.vertex_ids().map(|v| v.index() != 700).collect();
        assert_eq!(unseen_edge_share(&scan, &speck, &none, |_| 0.0), None);
    }

    #[test]
    fn what_was_painted_and_what_has_no_edge_or_no_colour_is_not_judged() {
        let (scan, labels, _) = strip([120, 60, 50], 0.0);
        let (all, none) = (PerVertex::filled(true, labels.len()), PerVertex::filled(false, labels.len()));
        assert_eq!(unseen_edge_share(&scan, &labels, &all, |_| 0.0), None);
        assert_eq!(unseen_edge_share(&scan, &all, &none, |_| 0.0), None);
        assert_eq!(unseen_edge_share(&Scan { colors: None, ..scan }, &labels, &none, |_| 0.0), None);
    }
}
