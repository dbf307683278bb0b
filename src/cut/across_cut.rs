//! What is across a cut: the rest of the person, or a patch that the user erased within the cloth.

use super::holes::fill_holes::FilledScan;
use super::slice::Slice;
use crate::geometry::{Adjacency, PerVertex, VertexId};

/// Least share of marked vertices in a patch that the user erased. Half: the boundary is found again beside a mark, so a
/// patch is a little larger or smaller than the mark; across a hem is the whole person.
const BY_HAND_SHARE: f64 = 0.5;

/// Per vertex of a slice the patch across the cut, and per patch whether the user erased it.
pub(super) struct AcrossCut {
    patch_of: Vec<Option<u32>>,
    by_hand: Vec<bool>,
}

impl AcrossCut {
    /// For a slice of `whole`, whose adjacency is `around`.
    pub(super) fn of(slice: &Slice, whole: &FilledScan, around: &Adjacency) -> Self {
        let (patch, by_hand) = patches(whole, around);
        let beside = |v: VertexId| patch[v].or_else(|| around.neighbours_of(v).iter().find_map(|&w| patch[w]));
        let patch_of = slice
            .origins
            .iter()
            .zip(&slice.on_cut)
            .map(|(origin, &on_cut)| origin.iter().filter(|_| on_cut).find_map(|&(v, _)| beside(v)));
        Self { patch_of: patch_of.collect(), by_hand }
    }

    /// The patch within a ring, if the user erased it: the one across most of its vertices.
    pub(super) fn erased_within(&self, ring: &[VertexId]) -> Option<u32> {
        let mut votes: Vec<u32> = ring.iter().filter_map(|v| self.patch_of.get(v.index()).copied().flatten()).collect();
        votes.sort_unstable();
        let most = votes.chunk_by(|a, b| a == b).max_by_key(|group| (group.len(), std::cmp::Reverse(group[0])))?;
        self.by_hand[most[0] as usize].then_some(most[0])
    }
}

/// The connected patches of unlabelled surface, and which of them the user erased: those that do not reach the border of
/// the scan and are marked on most of their vertices.
fn patches(whole: &FilledScan, around: &Adjacency) -> (PerVertex<Option<u32>>, Vec<bool>) {
    let at_end = around.boundary_vertices();
    let mut patch: PerVertex<Option<u32>> = PerVertex::filled(None, whole.surface.mesh.vertex_count());
    let mut by_hand = Vec::new();
    for seed in whole.surface.mesh.vertex_ids() {
        if whole.labels.0[seed] || patch[seed].is_some() {
            continue;
        }
        let id = by_hand.len() as u32;
        patch[seed] = Some(id);
        let (mut members, mut at) = (vec![seed], 0);
        while at < members.len() {
            for &w in around.neighbours_of(members[at]) {
                if !whole.labels.0[w] && patch[w].is_none() {
                    patch[w] = Some(id);
                    members.push(w);
                }
            }
            at += 1;
        }
        let marked = members.iter().filter(|&&v| whole.by_hand[v]).count();
        let ends = members.iter().any(|&v| at_end[v]);
        by_hand.push(!ends && marked as f64 >= BY_HAND_SHARE * members.len() as f64);
    }
    (patch, by_hand)
}
