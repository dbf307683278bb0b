//! How near a pair may come, and which pairs need another test after some vertices have moved.

use super::near_pairs::NearPair;
use crate::geometry::Vec3;
use rayon::prelude::*;

/// No pair comes nearer than this, metres: thirty times the rounding of a metre to the `f32` of files.
const LEAST_DISTANCE: f64 = 3e-6;
/// Nor nearer than this share of its distance at the start of the step, so that there is always room for the next.
const LEAST_SHARE: f64 = 0.1;
/// Pairs that are already nearer, in a jam, stop approaching each other here, metres: five times the rounding of their positions
/// in files.
const JAMMED_DISTANCE: f64 = 1e-6;
/// Levels of ways: 0, then from 1 µm on, each twice as far as the one before; the last is 16 mm.
const LEVELS: u8 = 16;

/// What is left of the distance of a pair, beyond the least, by the motion of its sides along its normal, metres.
pub(super) fn room(pair: &NearPair, by: &[Vec3]) -> f64 {
    let split = usize::from(pair.split);
    let along = pair.vertices.map(|v| pair.normal.dot(&by[v as usize]));
    let closing = greatest(&along[..split]) + greatest(&along.map(|a| -a)[split..]);
    (pair.distance - least_distance(pair)) - closing
}

pub(super) fn greatest(values: &[f64]) -> f64 {
    values.iter().fold(f64::MIN, |a, &b| a.max(b))
}

/// The distance below which a pair is too near.
pub(super) fn least_distance(pair: &NearPair) -> f64 {
    let usual = (LEAST_SHARE * pair.distance).max(LEAST_DISTANCE);
    let jammed = (0.9 * pair.distance).max(JAMMED_DISTANCE).min(0.999 * pair.distance);
    usual.min(jammed)
}

/// The pairs that displacements can have brought too near since they were last tested.
///
/// A pair is cold while no vertex of it has moved by half of the room that the plane between its sides leaves: it cannot be
/// too near. In a jam a vertex has a thousand pairs, of which its small moves concern a few.
pub(super) struct Watch<'a> {
    pairs: &'a [NearPair],
    /// The displacements at the start.
    start: Vec<Vec3>,
    /// Per pair, the level of the way that each of its vertices may move while the pair stays cold.
    levels: Vec<u8>,
    /// The pairs of each vertex, one vertex after another, those with the least room first.
    list: Vec<u32>,
    /// Where the part of each vertex begins in the list, and one end.
    first: Vec<u32>,
    /// The first pair of each vertex's part that is not yet known to be hot.
    next: Vec<u32>,
    /// Whether a pair is no longer cold; one entry per pair.
    is_hot: Vec<bool>,
    /// The hot pairs of each vertex.
    hot: Vec<Vec<u32>>,
    /// Whether a pair is in the list that is made; one entry per pair.
    is_listed: Vec<bool>,
}

/// The least way of a level, in metres.
fn way_of(level: u8) -> f64 {
    if level == 0 { 0.0 } else { 1e-6 * f64::from(1_u32 << (level - 1)) }
}

impl<'a> Watch<'a> {
    pub fn prepare(pairs: &'a [NearPair], by: &[Vec3]) -> Self {
        let levels: Vec<u8> = pairs
            .par_iter()
            .with_min_len(1024)
            .map(|pair| {
                let way = 0.5 * room(pair, by) - 1e-12;
                (1..LEVELS).take_while(|&level| way_of(level) <= way).last().unwrap_or(0)
            })
            .collect();
        let mut first = vec![0; by.len() + 1];
        pairs.iter().flat_map(|p| p.vertices).for_each(|v| first[v as usize + 1] += 1);
        for v in 0..by.len() {
            first[v + 1] += first[v];
        }
        let mut of_level: Vec<Vec<u32>> = vec![Vec::new(); usize::from(LEVELS)];
        levels.iter().enumerate().for_each(|(p, &level)| of_level[usize::from(level)].push(p as u32));
        let (mut end, mut list) = (first.clone(), vec![0; 4 * pairs.len()]);
        for &p in of_level.iter().flatten() {
            for v in pairs[p as usize].vertices {
                list[end[v as usize] as usize] = p;
                end[v as usize] += 1;
            }
        }
        Self {
            pairs,
            start: by.to_vec(),
            levels,
            next: first[..by.len()].to_vec(),
            first,
            list,
            is_hot: vec![false; pairs.len()],
            hot: vec![Vec::new(); by.len()],
            is_listed: vec![false; pairs.len()],
        }
    }

    /// The pairs of the vertices, which have moved, that are not cold, each once, in ascending order.
    pub fn of(&mut self, moved: &[u32], by: &[Vec3]) -> Vec<u32> {
        for &v in moved {
            let v = v as usize;
            let way = (by[v] - self.start[v]).norm();
            while self.next[v] < self.first[v + 1] {
                let p = self.list[self.next[v] as usize] as usize;
                if way_of(self.levels[p]) > way {
                    break;
                }
                if !std::mem::replace(&mut self.is_hot[p], true) {
                    self.pairs[p].vertices.iter().for_each(|&of| self.hot[of as usize].push(p as u32));
                }
                self.next[v] += 1;
            }
        }
        let mut listed = Vec::new();
        for &v in moved {
            for &p in &self.hot[v as usize] {
                if !std::mem::replace(&mut self.is_listed[p as usize], true) {
                    listed.push(p);
                }
            }
        }
        listed.iter().for_each(|&p| self.is_listed[p as usize] = false);
        listed.sort_unstable();
        listed
    }
}
