//! The ring of a garment around a part of the body, where a tape goes around the body.

use crate::body::TapeLine;
use crate::geometry::{PerVertex, Point, TriMesh, VertexId};
use crate::numerics::DisjointSets;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Openings of a ring, as of a jacket or at armholes, as a share of its length: with wider ones it does not go around the body.
const WIDEST_OPENING: f64 = 0.35;
/// Shorter pieces of a section are no part of a ring, as a share of the longest.
const LEAST_PIECE: f64 = 0.05;

/// A piece of a garment's section, or several with the straight ways between them.
#[derive(Clone, Default)]
pub(super) struct TapeRing {
    /// Length as worn, with its folds, metres.
    pub worn: f64,
    /// Its length without stretch, metres.
    pub own: f64,
    /// Integral of the distance from the skin along it, m².
    air: f64,
    /// Signed angle that it turns about the tape's origin.
    turn: f64,
    /// Length of what is not cloth, metres.
    opening: f64,
    /// First and last place; equal indices of a closed ring.
    ends: Option<[Point; 2]>,
}

/// Where the plane cuts an edge.
#[derive(Clone, Copy)]
struct Cut {
    worn: Point,
    own: Point,
    gap: f64,
}

impl TapeRing {
    /// The garment's ring around a tape line; an opening is bridged. `own`: the garment without stretch.
    ///
    /// **Shapes** `gap`, `is_wanted`: one entry per vertex.
    pub fn around(
        line: &TapeLine,
        [worn, own]: [&TriMesh; 2],
        is_wanted: &PerVertex<bool>,
        gap: &PerVertex<f64>,
    ) -> Option<Self> {
        let pieces = pieces(line, [worn, own], is_wanted, gap);
        let single = pieces.iter().map(|piece| chained(line, std::slice::from_ref(piece)));
        let shortest = single.filter(Self::goes_around).min_by(|a, b| a.worn.total_cmp(&b.worn));
        shortest.or_else(|| {
            let longest = pieces.iter().map(|piece| piece.worn).fold(0.0, f64::max);
            let open = |piece: &&Self| piece.ends.is_some() && piece.worn > LEAST_PIECE * longest;
            let open: Vec<Self> = pieces.iter().filter(open).cloned().collect();
            Some(chained(line, &open)).filter(Self::goes_around)
        })
    }

    /// Mean distance from the skin, metres.
    pub fn gap(&self) -> f64 {
        self.air / (self.worn - self.opening).max(1e-9)
    }

    fn goes_around(&self) -> bool {
        self.turn.abs() > PI && self.opening <= WIDEST_OPENING * self.worn
    }
}

/// The connected pieces of the section, each in the direction in which what is above lies on the same side.
fn pieces(
    line: &TapeLine,
    [worn, own]: [&TriMesh; 2],
    is_wanted: &PerVertex<bool>,
    gap: &PerVertex<f64>,
) -> Vec<TapeRing> {
    let normal = line.axes[0].cross(&line.axes[1]);
    let height: Vec<f64> = worn.points().iter().map(|p| (p - line.origin).dot(&normal)).collect();
    let is_above = |v: VertexId| height[v.index()] > 0.0;
    let (mut index, mut cuts, mut segments) = (BTreeMap::new(), Vec::new(), Vec::new());
    let mut cut = |a: VertexId, b: VertexId| -> usize {
        *index.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            let t = height[a.index()] / (height[a.index()] - height[b.index()]);
            let at = |mesh: &TriMesh| mesh.points()[a] + (mesh.points()[b] - mesh.points()[a]) * t;
            cuts.push(Cut { worn: at(worn), own: at(own), gap: gap[a] + (gap[b] - gap[a]) * t });
            cuts.len() - 1
        })
    };
    for face in worn.faces().iter().filter(|face| face.iter().all(|v| is_wanted[*v])) {
        let sides = || (0..3).map(|k| [face[k], face[(k + 1) % 3]]);
        let up = sides().find(|[a, b]| !is_above(*a) && is_above(*b));
        let down = sides().find(|[a, b]| is_above(*a) && !is_above(*b));
        if let (Some([a, b]), Some([c, d])) = (up, down) {
            segments.push([cut(a, b), cut(c, d)]);
        }
    }
    let mut sets = DisjointSets::of_single(cuts.len());
    let (mut begins, mut ends) = (vec![true; cuts.len()], vec![true; cuts.len()]);
    for &[a, b] in &segments {
        sets.join(a, b);
        (ends[a], begins[b]) = (false, false);
    }
    let mut pieces: BTreeMap<usize, TapeRing> = BTreeMap::new();
    for &[a, b] in &segments {
        let (piece, [a, b]) = (pieces.entry(sets.root(a)).or_default(), [cuts[a], cuts[b]]);
        let long = (b.worn - a.worn).norm();
        piece.worn += long;
        piece.own += (b.own - a.own).norm();
        piece.air += 0.5 * long * (a.gap + b.gap);
        piece.turn += turned(line, &a.worn, &b.worn);
    }
    for (root, piece) in &mut pieces {
        let own = |at: &[bool], sets: &mut DisjointSets| (0..cuts.len()).find(|&v| at[v] && sets.root(v) == *root);
        let (first, last) = (own(&begins, &mut sets), own(&ends, &mut sets));
        piece.ends = first.zip(last).map(|(first, last)| [cuts[first].worn, cuts[last].worn]);
    }
    pieces.into_values().collect()
}

/// Pieces in a row, from the end of each to the nearest beginning of another, and back to the first.
fn chained(line: &TapeLine, pieces: &[TapeRing]) -> TapeRing {
    let Some((first, others)) = pieces.split_first() else { return TapeRing::default() };
    let (mut ring, mut left) = (first.clone(), others.to_vec());
    let Some([begin, mut end]) = first.ends else { return ring };
    let bridge = |ring: &mut TapeRing, from: &Point, to: &Point| {
        let long = (to - from).norm();
        (ring.worn, ring.own, ring.opening) = (ring.worn + long, ring.own + long, ring.opening + long);
        ring.turn += turned(line, from, to);
    };
    while !left.is_empty() {
        let far = |piece: &TapeRing| piece.ends.map_or(f64::MAX, |[begin, _]| (begin - end).norm());
        let nearest = (0..left.len()).min_by(|&a, &b| far(&left[a]).total_cmp(&far(&left[b]))).unwrap_or(0);
        let next = left.swap_remove(nearest);
        let Some([next_begin, next_end]) = next.ends else { continue };
        bridge(&mut ring, &end, &next_begin);
        ring.worn += next.worn;
        ring.own += next.own;
        ring.air += next.air;
        ring.turn += next.turn;
        end = next_end;
    }
    bridge(&mut ring, &end, &begin);
    ring
}

/// Signed angle from one place to another, seen from the tape's origin.
fn turned(line: &TapeLine, from: &Point, to: &Point) -> f64 {
    let [a, b] = [from, to].map(|p| line.axes.map(|axis| (p - line.origin).dot(&axis)));
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
}
