//! Removes specks: small patches of one label within the other.

use super::brush::Marks;
use super::transfer::Labels;
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};

/// Area below which a patch is a speck, in m². 6 cm²: a button and its shadow.
const SPECK: f64 = 6e-4;

/// Gives specks without a mark the label around them.
///
/// **Shapes** labels and marks: one entry per vertex.
pub(super) fn without_specks(mesh: &TriMesh, adjacency: &Adjacency, labels: Labels, marks: &Marks) -> Labels {
    let areas = mesh.vertex_areas();
    let mut labels = labels;
    let mut visited = PerVertex::filled(false, mesh.vertex_count());
    for seed in mesh.vertex_ids() {
        if visited[seed] {
            continue;
        }
        visited[seed] = true;
        let (mut patch, mut at): (Vec<VertexId>, usize) = (vec![seed], 0);
        let mut meets_other = false;
        while at < patch.len() {
            for &w in adjacency.neighbours_of(patch[at]) {
                if labels.0[w] != labels.0[seed] {
                    meets_other = true;
                } else if !visited[w] {
                    visited[w] = true;
                    patch.push(w);
                }
            }
            at += 1;
        }
        let area: f64 = patch.iter().map(|&v| areas[v]).sum();
        if meets_other && area < SPECK && patch.iter().all(|&v| marks.labels[v].is_none()) {
            let other = !labels.0[seed];
            for v in patch {
                labels.0[v] = other;
            }
        }
    }
    labels
}
