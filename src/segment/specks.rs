//! Removes specks: small patches of one label within the other.

use super::brush::Marks;
use super::transfer::Labels;
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};
use std::collections::BTreeMap;

/// Area below which a patch is a speck, in m². 6 cm²: a button and its shadow.
const SPECK: f64 = 6e-4;

/// Gives specks without a mark the label around them.
///
/// **Shapes** labels and marks: one entry per vertex.
pub(super) fn without_specks(mesh: &TriMesh, adjacency: &Adjacency, labels: Labels, marks: &Marks) -> Labels {
    Labels(without_specks_of_labels(mesh, adjacency, labels.0, marks))
}

/// Gives specks without a mark the label that most of the edges at their border have beyond it.
///
/// **Shapes** labels and marks: one entry per vertex.
pub(super) fn without_specks_of_labels<L: Copy + Ord>(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    mut labels: PerVertex<L>,
    marks: &Marks,
) -> PerVertex<L> {
    let areas = mesh.vertex_areas();
    let mut visited = PerVertex::filled(false, mesh.vertex_count());
    for seed in mesh.vertex_ids() {
        if visited[seed] {
            continue;
        }
        visited[seed] = true;
        let (mut patch, mut at): (Vec<VertexId>, usize) = (vec![seed], 0);
        let mut beyond: BTreeMap<L, usize> = BTreeMap::new();
        while at < patch.len() {
            for &w in adjacency.neighbours_of(patch[at]) {
                if labels[w] != labels[seed] {
                    *beyond.entry(labels[w]).or_default() += 1;
                } else if !visited[w] {
                    visited[w] = true;
                    patch.push(w);
                }
            }
            at += 1;
        }
        let area: f64 = patch.iter().map(|&v| areas[v]).sum();
        let most = beyond.iter().max_by_key(|(label, edges)| (**edges, std::cmp::Reverse(**label)));
        if let Some((&other, _)) = most
            && area < SPECK
            && patch.iter().all(|&v| marks.labels[v].is_none())
        {
            for v in patch {
                labels[v] = other;
            }
        }
    }
    labels
}
