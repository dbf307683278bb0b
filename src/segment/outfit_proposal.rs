//! Labels of an outfit before any brush, kept with their costs so that a brush stroke costs only the work near it.

use super::brush::Marks;
use super::error::{SegmentError, check_length};
use super::expansion::{Label, LabelCosts};
use super::fold_over::without_fold_overs;
use super::proposal::{Proposal, REACH, Segmentation};
use super::specks::without_specks_of_labels;
use super::transfer::Labels;
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId, geodesic_distances};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The label of the figure that no garment of the outfit covers.
pub(super) const REST: Label = 0;
/// What an impossible label costs: more than all evidence of a vertex.
const BARRED: i64 = 1 << 40;

/// Labels of an outfit without any brush, and their costs. Transferred labels have no costs.
///
/// Label 0 is the rest of the figure, 1 to G are the garments, innermost first, then comes the hair if it is known, and last what none
/// of them explains.
///
/// **Shapes** `cut`, `labels` and `below_hair`: one entry per vertex; `of_label`: one list per label with one cost per vertex, or
/// empty; `boundaries`: one per edge, or empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutfitProposal {
    garments: usize,
    /// What each label costs at each vertex.
    of_label: Vec<Vec<i64>>,
    /// What a boundary across each edge costs, in the order of [`Adjacency::edges`].
    boundaries: Vec<i64>,
    /// The cheapest labels found.
    cut: PerVertex<Label>,
    /// Those without specks and fold-overs.
    labels: PerVertex<Label>,
    /// If the hair is known: the labels that would be seen without it.
    below_hair: Option<PerVertex<Label>>,
}

/// Labels of all garments of an outfit, and where the user overrode the proposal.
///
/// **Guarantees** each vertex belongs to one garment at most.
#[derive(Clone, Debug, PartialEq)]
pub struct OutfitLabels {
    garments: usize,
    labels: PerVertex<Label>,
    proposed: PerVertex<Label>,
    marked: PerVertex<bool>,
    below_hair: Option<PerVertex<Label>>,
}

impl OutfitLabels {
    /// The labels of garment `k`, counted from 0, innermost first, and where hair hides it.
    pub fn of_garment(&self, k: usize) -> Segmentation {
        let is = |label: Label| usize::from(label) == k + 1;
        let changed = |v: VertexId| self.marked[v] && is(self.labels[v]) != is(self.proposed[v]);
        let by_hand = (0..self.labels.len()).map(VertexId::from_index).map(changed).collect();
        // What is unexplained may be a bag, which the garment does not go under.
        let is_over = |label: Label| (k + 2..=self.garments).contains(&usize::from(label));
        let where_true = |of: &dyn Fn(Label) -> bool| self.labels.iter().map(|&label| of(label)).collect();
        let below_hair = self.below_hair.as_ref().map(|below| {
            let hides = |v: VertexId| self.is_hair(self.labels[v]) && is(below[v]);
            (0..self.labels.len()).map(VertexId::from_index).map(hides).collect()
        });
        Segmentation { labels: Labels(where_true(&is)), by_hand, under: where_true(&is_over), below_hair }
    }

    fn is_hair(&self, label: Label) -> bool {
        self.below_hair.is_some() && usize::from(label) == self.garments + 1
    }

    /// Which vertices are hair; none if the hair is not known.
    ///
    /// **Shapes** one entry per vertex.
    pub fn hair(&self) -> PerVertex<bool> {
        self.labels.iter().map(|&label| self.is_hair(label)).collect()
    }

    /// Which vertices belong to another garment than `k`, or to nothing that is listed.
    ///
    /// **Shapes** one entry per vertex.
    pub fn of_others(&self, k: usize) -> PerVertex<bool> {
        self.labels.iter().map(|&label| label != REST && usize::from(label) != k + 1).collect()
    }

    /// Which vertices neither the figure nor a garment nor known hair explains: a garment that is not listed.
    ///
    /// **Shapes** one entry per vertex.
    pub fn unexplained(&self) -> PerVertex<bool> {
        self.labels.iter().map(|&label| usize::from(label) > self.garments && !self.is_hair(label)).collect()
    }
}

/// What the user said about a vertex.
#[derive(Clone, Copy, Default)]
struct Said {
    /// The garment whose mark covers it.
    is: Option<Label>,
    /// The garments that it is not, one bit per label.
    barred: u64,
    /// Whether some mark is not exact.
    is_brushed: bool,
}

impl Said {
    fn anything(self) -> bool {
        self.is.is_some() || self.barred != 0
    }

    fn allows(self, label: Label) -> bool {
        self.is.map_or(self.barred >> label & 1 == 0, |is| is == label)
    }
}

impl OutfitProposal {
    /// From a cut and its costs; `edges` are those of `adjacency`, in its order.
    pub(super) fn new(
        garments: usize,
        mesh: &TriMesh,
        adjacency: &Adjacency,
        of_label: Vec<Vec<i64>>,
        edges: &[(u32, u32, i64)],
        cut: PerVertex<Label>,
    ) -> Self {
        let labels = settled(mesh, adjacency, cut.clone(), garments, &Marks::none(mesh.vertex_count()));
        let boundaries = edges.iter().map(|e| e.2).collect();
        Self { garments, of_label, boundaries, cut, labels, below_hair: None }
    }

    /// Finds what the hair hides: the cheapest labels of its vertices with the other labels given.
    ///
    /// **Requires** that the label after the garments is that of the hair.
    ///
    /// **Shapes** `of_label`: what the rest and the garments that hair may hide cost at each vertex, without what the scan shows
    /// there; `edges`: what a boundary across each edge costs.
    pub(super) fn with_labels_below_hair(self, of_label: &[Vec<i64>], edges: &[(u32, u32, i64)]) -> Self {
        let is_hair = |v: usize| usize::from(self.labels.0[v]) == self.garments + 1;
        // Around the hair every label holds that was found, whatever it costs; those that hair cannot hide are like the rest.
        let known = |label: Label| if usize::from(label) < of_label.len() { label } else { REST };
        let mut below: Vec<Label> = (0..self.labels.len()).map(|v| known(self.labels.0[v])).collect();
        (0..below.len()).filter(|&v| is_hair(v)).for_each(|v| below[v] = REST);
        LabelCosts { of_label, edges }.expand(&mut below, &|v| !is_hair(v));
        Self { below_hair: Some(below.into()), ..self }
    }

    /// The proposal of a garment that is the only one.
    pub(super) fn of_one(only: Proposal) -> Self {
        let (unary, boundaries, cut, labels) = only.into_parts();
        let label = |labels: Labels| labels.0.iter().map(|&own| Label::from(own)).collect();
        let of_label =
            if unary.is_empty() { Vec::new() } else { vec![vec![0; unary.len()], unary.iter().map(|u| -u).collect()] };
        Self { garments: 1, of_label, boundaries, cut: label(cut), labels: label(labels), below_hair: None }
    }

    /// Labels that are final except for marks.
    pub(super) fn transferred(garments: usize, labels: PerVertex<Label>) -> Self {
        Self { garments, of_label: Vec::new(), boundaries: Vec::new(), cut: labels.clone(), labels, below_hair: None }
    }

    /// The labels with the marks of all garments over them. A mark that adds to one garment takes from the others; a vertex
    /// that is erased from one takes the next best label; where two garments are marked, it is the outer one's. Else as
    /// [`Proposal::corrected`]: only near marks that contradict the proposal boundaries are found again.
    ///
    /// **Shapes** `marks`: one per garment, innermost first, each with one entry per vertex of the mesh.
    ///
    /// **Requires** the mesh of the proposal, and its adjacency.
    ///
    /// **Errors** if proposal, mesh, adjacency and marks differ in size.
    pub fn corrected(
        &self,
        mesh: &TriMesh,
        adjacency: &Adjacency,
        marks: &[&Marks],
    ) -> Result<OutfitLabels, SegmentError> {
        let count = mesh.vertex_count();
        check_length("labels of the proposal", self.labels.len(), count)?;
        check_length("marked garments", marks.len(), self.garments)?;
        for of_one in marks {
            check_length("marks", of_one.labels.len(), count)?;
        }
        if !self.of_label.is_empty() {
            check_length("edges of the proposal", self.boundaries.len(), adjacency.edges().len())?;
        }
        let said: PerVertex<Said> = mesh.vertex_ids().map(|v| said_of(marks, v)).collect();
        let is_contradicted = |v: VertexId| said[v].is_brushed && !said[v].allows(self.cut[v]);
        let sources: Vec<(VertexId, f64)> =
            mesh.vertex_ids().filter(|&v| is_contradicted(v)).map(|v| (v, 0.0)).collect();
        let has_exact = mesh.vertex_ids().any(|v| said[v].anything() && !said[v].is_brushed);
        let over = |labels: &PerVertex<Label>| -> PerVertex<Label> {
            mesh.vertex_ids().map(|v| self.nearest_allowed(v, labels[v], said[v])).collect()
        };
        let labels = if !said.iter().any(|s| s.anything()) {
            self.labels.clone()
        } else if self.of_label.is_empty() || (has_exact && sources.is_empty()) {
            over(&self.labels)
        } else {
            let near = geodesic_distances(mesh, adjacency, &sources, REACH);
            let cut = self.cut_again(adjacency, over(&self.cut), &said, |v| near[v].is_finite());
            let any_mark: Marks = said.iter().map(|s| s.anything().then_some(true)).collect();
            let labels = settled(mesh, adjacency, cut, self.garments, &any_mark);
            match has_exact {
                false => labels,
                // Where no boundary was found again, only marks change labels.
                true => {
                    let far = over(&self.labels);
                    mesh.vertex_ids().map(|v| if near[v].is_finite() { labels[v] } else { far[v] }).collect()
                }
            }
        };
        let marked = said.iter().map(|s| s.anything()).collect();
        let (proposed, below_hair) = (self.labels.clone(), self.below_hair.clone());
        Ok(OutfitLabels { garments: self.garments, labels, proposed, marked, below_hair })
    }

    /// The label itself if the marks allow it, otherwise the cheapest that they allow.
    fn nearest_allowed(&self, v: VertexId, label: Label, said: Said) -> Label {
        if said.allows(label) {
            return label;
        }
        let cost = |label: Label| self.of_label.get(usize::from(label)).map_or(0, |costs| costs[v.index()]);
        let known = self.of_label.len().max(self.garments + 1) as Label;
        // Without costs the erased part is the rest of the figure.
        let allowed = (0..known).filter(|&label| said.allows(label));
        allowed.min_by_key(|&label| cost(label)).unwrap_or(REST)
    }

    /// The cheapest labels over the vertices that are `near` and not given; all others keep those of `labels`.
    fn cut_again(
        &self,
        adjacency: &Adjacency,
        labels: PerVertex<Label>,
        said: &PerVertex<Said>,
        near: impl Fn(VertexId) -> bool,
    ) -> PerVertex<Label> {
        let mut of_label = self.of_label.clone();
        for (label, costs) in of_label.iter_mut().enumerate() {
            for (cost, said) in costs.iter_mut().zip(said.iter()) {
                *cost += if said.allows(label as Label) { 0 } else { BARRED };
            }
        }
        let edges: Vec<(u32, u32, i64)> =
            adjacency.edges().iter().zip(&self.boundaries).map(|(([i, j], _), &cost)| (i.0, j.0, cost)).collect();
        let mut cut = labels.0;
        let held = |i: usize| said.0[i].is.is_some() || !near(VertexId::from_index(i));
        LabelCosts { of_label: &of_label, edges: &edges }.expand(&mut cut, &held);
        cut.into()
    }
}

fn said_of(marks: &[&Marks], v: VertexId) -> Said {
    let mut said = Said::default();
    for (label, marks) in (1..).zip(marks) {
        match marks.labels[v] {
            Some(true) => said.is = Some(label),
            Some(false) => said.barred |= 1 << label,
            None => continue,
        }
        said.is_brushed |= !marks.is_exact(v);
    }
    said
}

/// Labels without specks and without the fold-overs of hems. Vertices with a mark keep their labels.
fn settled(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    labels: PerVertex<Label>,
    garments: usize,
    marks: &Marks,
) -> PerVertex<Label> {
    let labels = without_specks_of_labels(mesh, adjacency, labels, marks);
    let folded = |labels: &PerVertex<Label>, garment: Label| -> PerVertex<bool> {
        let own = Labels(labels.iter().map(|&label| label == garment).collect());
        let kept = without_fold_overs(mesh, adjacency, own.clone(), marks);
        own.0.iter().zip(kept.0.iter()).map(|(own, kept)| *own && !kept).collect()
    };
    let mut given = labels.clone();
    let mut is_given = PerVertex::filled(false, labels.len());
    for garment in 1..=garments as Label {
        let folded = folded(&labels, garment);
        give_to_neighbours(adjacency, &folded, garment, &mut given);
        is_given.0.iter_mut().zip(folded.iter()).for_each(|(given, folded)| *given |= folded);
    }
    // Between two garments a fold-over of one is often one of the other too, and then belongs to neither.
    let mut settled = given.clone();
    for garment in 1..=garments as Label {
        let folded = folded(&given, garment);
        for v in mesh.vertex_ids().filter(|&v| folded[v] && is_given[v]) {
            settled[v] = REST;
        }
    }
    settled
}

/// Gives the vertices of a fold-over of `garment` the labels beyond it.
fn give_to_neighbours(adjacency: &Adjacency, folded: &PerVertex<bool>, garment: Label, labels: &mut PerVertex<Label>) {
    let mut open = folded.clone();
    let beyond = |v: VertexId, open: &PerVertex<bool>, labels: &PerVertex<Label>| {
        let mut around = adjacency.neighbours_of(v).iter();
        around.find(|&&w| !open[w] && labels[w] != garment).map(|&w| labels[w])
    };
    let ids = || (0..folded.len()).map(VertexId::from_index);
    let mut queue: VecDeque<VertexId> = ids().filter(|&v| open[v] && beyond(v, &open, labels).is_some()).collect();
    while let Some(v) = queue.pop_front() {
        if !open[v] {
            continue;
        }
        if let Some(label) = beyond(v, &open, labels) {
            (labels[v], open[v]) = (label, false);
            queue.extend(adjacency.neighbours_of(v).iter().filter(|&&w| open[w]));
        }
    }
    // A fold-over always begins at a boundary; what is cut off from it by another garment's is the rest.
    for v in ids().filter(|&v| open[v]) {
        labels[v] = REST;
    }
}
