//! Labels of a scan before any brush, kept with their graph so that a brush stroke costs only the work near it.

use super::brush::Marks;
use super::error::{SegmentError, check_length};
use super::fold_over::without_fold_overs;
use super::max_flow::min_cut;
use super::specks::without_specks;
use super::transfer::Labels;
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId, geodesic_distances};
use serde::{Deserialize, Serialize};

/// Distance along the surface within which a brush that contradicts the proposal lets the boundary move, in metres: that
/// within which a hem is searched for. Farther away the labels stay as proposed.
pub(super) const REACH: f64 = 0.1;

/// Labels without any brush, and the graph whose minimum cut they are. Transferred labels have no graph.
///
/// **Shapes** `cut` and `labels`: one entry per vertex; `unary`: one per vertex, or empty without a graph; `costs`: one
/// per edge, or empty without a graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proposal {
    /// What it costs to leave each vertex to the rest (positive) or to the garment (negative).
    unary: Vec<i64>,
    /// What a boundary across each edge costs, in the order of [`Adjacency::edges`].
    costs: Vec<i64>,
    /// The minimum cut.
    cut: Labels,
    /// The cut without specks and fold-overs.
    labels: Labels,
}

/// Labels, and where the user overrode the proposal.
///
/// **Shapes** one entry per vertex of the scan each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segmentation {
    /// Which vertices are the garment.
    pub labels: Labels,
    /// Vertices whose label a mark changed; later steps keep these labels.
    pub by_hand: PerVertex<bool>,
    /// Vertices that show another garment of the same scan, worn over this one.
    pub under: PerVertex<bool>,
    /// Vertices that show hair which hides the garment; `None` if the hair is not known.
    pub below_hair: Option<PerVertex<bool>>,
}

impl From<Labels> for Segmentation {
    fn from(labels: Labels) -> Self {
        let none = PerVertex::filled(false, labels.0.len());
        Self { by_hand: none.clone(), under: none, labels, below_hair: None }
    }
}

impl Proposal {
    /// From a cut and its graph; `edges` are those of `adjacency`, in its order.
    pub(super) fn new(
        mesh: &TriMesh,
        adjacency: &Adjacency,
        unary: Vec<i64>,
        edges: &[(u32, u32, i64)],
        cut: Labels,
    ) -> Self {
        let none = Marks::none(mesh.vertex_count());
        let labels = without_specks(mesh, adjacency, cut.clone(), &none);
        let labels = without_fold_overs(mesh, adjacency, labels, &none);
        Self { unary, costs: edges.iter().map(|e| e.2).collect(), cut, labels }
    }

    /// No garment at all.
    pub fn of_nothing(mesh: &TriMesh) -> Self {
        let (vertex_count, edge_count) = (mesh.vertex_count(), Adjacency::prepare(mesh).edges().len());
        let none = Labels(PerVertex::filled(false, vertex_count));
        Self { unary: vec![0; vertex_count], costs: vec![0; edge_count], cut: none.clone(), labels: none }
    }

    /// Labels that are final except for marks: no specks are removed, and no boundary is found again beside a mark.
    pub(super) fn of_labels(labels: Labels) -> Self {
        Self { unary: Vec::new(), costs: Vec::new(), cut: labels.clone(), labels }
    }

    /// What each vertex and each boundary costs, the cut, and the labels; see the fields.
    pub(super) fn into_parts(self) -> (Vec<i64>, Vec<i64>, Labels, Labels) {
        (self.unary, self.costs, self.cut, self.labels)
    }

    /// The labels as proposed.
    pub fn labels(&self) -> &Labels {
        &self.labels
    }

    /// The labels with marks over them. Marked vertices take the label of their mark. Around labels painted exactly nothing
    /// else changes. Near other marks that contradict the
    /// proposal the boundary is found again, unless the labels were transferred: those change only where they are marked,
    /// as with the painting interface of Hu 2017, §6.2.
    ///
    /// **Shapes** `marks`: one entry per vertex of the mesh.
    ///
    /// **Requires** the mesh of the proposal, and its adjacency.
    ///
    /// **Errors** if proposal, mesh, adjacency and marks differ in size.
    pub fn corrected(
        &self,
        mesh: &TriMesh,
        adjacency: &Adjacency,
        marks: &Marks,
    ) -> Result<Segmentation, SegmentError> {
        let count = mesh.vertex_count();
        check_length("labels of the proposal", self.labels.0.len(), count)?;
        check_length("marks", marks.labels.len(), count)?;
        if !self.unary.is_empty() {
            check_length("edges of the proposal", self.costs.len(), adjacency.edges().len())?;
        }
        let contradicts = |v: VertexId| !marks.is_exact(v) && marks.labels[v].is_some_and(|mark| mark != self.cut.0[v]);
        let sources: Vec<(VertexId, f64)> = mesh.vertex_ids().filter(|&v| contradicts(v)).map(|v| (v, 0.0)).collect();
        let overlaid = || -> PerVertex<bool> {
            marks.labels.iter().zip(self.labels.0.iter()).map(|(mark, &label)| mark.unwrap_or(label)).collect()
        };
        let has_exact = mesh.vertex_ids().any(|v| marks.is_exact(v));
        let labels = if marks.labels.iter().all(Option::is_none) {
            self.labels.clone()
        } else if self.unary.is_empty() || (has_exact && sources.is_empty()) {
            Labels(overlaid())
        } else {
            let near = geodesic_distances(mesh, adjacency, &sources, REACH);
            let cut = self.cut_again(adjacency, marks, |v| near[v].is_finite());
            let labels = without_specks(mesh, adjacency, cut, marks);
            let labels = without_fold_overs(mesh, adjacency, labels, marks);
            if has_exact {
                // Where no boundary was found again, only marks change labels.
                let far = overlaid();
                let label = |v: VertexId| if near[v].is_finite() { labels.0[v] } else { far[v] };
                Labels(mesh.vertex_ids().map(label).collect())
            } else {
                labels
            }
        };
        let changed = |v: VertexId| marks.labels[v].is_some_and(|mark| mark != self.labels.0[v]);
        let by_hand = mesh.vertex_ids().map(changed).collect();
        Ok(Segmentation { by_hand, under: PerVertex::filled(false, mesh.vertex_count()), labels, below_hair: None })
    }

    /// The minimum cut over the vertices that are `near` and not marked; all others keep their mark or label.
    fn cut_again(&self, adjacency: &Adjacency, marks: &Marks, near: impl Fn(VertexId) -> bool) -> Labels {
        let mut labels: PerVertex<bool> =
            marks.labels.iter().zip(self.cut.0.iter()).map(|(mark, &old)| mark.unwrap_or(old)).collect();
        const FIXED: u32 = u32::MAX;
        let mut node = PerVertex::filled(FIXED, labels.len());
        let mut free: Vec<VertexId> = Vec::new();
        for (v, _) in marks.labels.enumerate().filter(|&(v, mark)| mark.is_none() && near(v)) {
            node[v] = free.len() as u32;
            free.push(v);
        }
        let mut unary: Vec<i64> = free.iter().map(|v| self.unary[v.index()]).collect();
        let mut edges: Vec<(u32, u32, i64)> = Vec::new();
        for (([i, j], _), &cost) in adjacency.edges().iter().zip(&self.costs) {
            match (node[*i], node[*j]) {
                (FIXED, FIXED) => {}
                (FIXED, at) => unary[at as usize] += if labels[*i] { cost } else { -cost },
                (at, FIXED) => unary[at as usize] += if labels[*j] { cost } else { -cost },
                (a, b) => edges.push((a, b, cost)),
            }
        }
        for (v, side) in free.into_iter().zip(min_cut(&unary, &edges)) {
            labels[v] = side;
        }
        Labels(labels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// A sheet of 41 × 41 vertices, 40 cm wide, whose left half is the garment for sure; boundaries are free at x = 0.3.
    fn sheet() -> (TriMesh, Adjacency, Proposal) {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for i in 0..41u32 {
            for j in 0..41u32 {
                points.push(Point::new(f64::from(i) / 100.0, f64::from(j) / 100.0, 0.0));
                if i < 40 && j < 40 {
                    let [a, b, c, d] = [0, 41, 42, 1].map(|k| i * 41 + j + k);
                    faces.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let adjacency = Adjacency::prepare(&mesh);
        let unary: Vec<i64> = mesh.points().iter().map(|p| if p.x < 0.195 { 100 } else { -100 }).collect();
        let free = |v: VertexId| (mesh.points()[v].x - 0.3).abs() < 0.006;
        let cost = |i: VertexId, j: VertexId| if free(i) != free(j) { 1 } else { 2000 };
        let edges: Vec<(u32, u32, i64)> = adjacency.edges().iter().map(|&([i, j], _)| (i.0, j.0, cost(i, j))).collect();
        let labels = Labels(min_cut(&unary, &edges).into());
        let proposal = Proposal::new(&mesh, &adjacency, unary, &edges, labels);
        (mesh, adjacency, proposal)
    }

    #[test]
    fn without_a_mark_nothing_changes_and_far_from_one_neither() {
        let (mesh, adjacency, proposal) = sheet();
        let mut marks = Marks::none(mesh.vertex_count());
        let plain = proposal.corrected(&mesh, &adjacency, &marks).unwrap();
        assert_eq!(&plain.labels, proposal.labels());
        assert!(!plain.by_hand.iter().any(|&h| h));
        for (v, p) in mesh.points().enumerate() {
            if (p - Point::new(0.0, 0.0, 0.0)).norm() < 0.06 {
                marks.labels[v] = Some(false);
            }
        }
        let marked = proposal.corrected(&mesh, &adjacency, &marks).unwrap();
        for (v, p) in mesh.points().enumerate() {
            assert!(marks.labels[v].is_none_or(|m| m == marked.labels.0[v]));
            let corner = (p - Point::origin()).norm();
            assert!(corner < 0.17 || marked.labels.0[v] == plain.labels.0[v], "{p}");
        }
        assert_eq!(marked.by_hand.iter().filter(|&&h| h).count(), marks.labels.iter().flatten().count());
    }

    #[test]
    fn a_label_file_of_the_proposed_labels_changes_nothing() {
        let (mesh, adjacency, proposal) = sheet();
        let marks: Marks = proposal.labels().0.iter().map(|&l| Some(l)).collect();
        let again = proposal.corrected(&mesh, &adjacency, &marks).unwrap();
        assert_eq!(again, Segmentation::from(proposal.labels().clone()));
    }

    #[test]
    fn labels_painted_exactly_change_nothing_beside_them_with_and_without_a_stroke_elsewhere() {
        let (mesh, adjacency, proposal) = sheet();
        let before: PerVertex<Option<bool>> = proposal.labels().0.iter().map(|&l| Some(l)).collect();
        let spot = |p: &Point, x: f64, y: f64| (p - Point::new(x, y, 0.0)).norm() < 0.03;
        // Half of the spot is the garment already; it was not painted over.
        let painted: Marks = mesh
            .points()
            .enumerate()
            .map(|(v, p): (VertexId, &Point)| Some(spot(p, 0.3, 0.2) || before[v] == Some(true)))
            .collect();
        let painted = painted.painted_over(&before);
        let count = painted.labels.iter().flatten().count();
        assert!((5..40).contains(&count), "{count}");
        let segmentation = proposal.corrected(&mesh, &adjacency, &painted).unwrap();
        for v in mesh.vertex_ids() {
            let expected = spot(&mesh.points()[v], 0.3, 0.2) || before[v] == Some(true);
            assert_eq!(segmentation.labels.0[v], expected);
            assert_eq!(segmentation.by_hand[v], Some(expected) != before[v]);
        }
        let erased = |p: &Point| spot(p, 0.0, 0.0).then_some(false);
        let stroke: Marks = mesh.points().iter().map(erased).collect();
        let both = proposal.corrected(&mesh, &adjacency, &painted.clone().then(&stroke)).unwrap();
        let alone = proposal.corrected(&mesh, &adjacency, &stroke).unwrap();
        for (v, p) in mesh.points().enumerate() {
            let expected = if spot(p, 0.3, 0.2) { true } else { alone.labels.0[v] };
            assert_eq!(both.labels.0[v], expected, "{p}");
        }
    }
}
