//! Coarser and coarser graphs of a surface, so that the fields become smooth everywhere and not only nearby.
//!
//! **Source** Jakob et al. 2015, §3.3: vertices are joined in pairs, those of like normals and areas first.

use super::surface::{Lists, Surface};
use crate::geometry::{Point, Vec3};

/// A graph with the data that the fields need.
pub(super) struct Level {
    pub points: Vec<Point>,
    pub normals: Vec<Vec3>,
    pub areas: Vec<f64>,
    /// Between the points of the lattice, in metres.
    pub spacings: Vec<f64>,
    pub neighbours: Lists,
    /// A point and the direction of the border, where the field is bound to one.
    pub bound: Vec<Option<(Point, Vec3)>>,
    /// The vertex of the next coarser level that each belongs to; empty on the coarsest.
    pub coarser: Vec<u32>,
}

/// The finest level first.
pub(super) fn hierarchy(surface: &Surface, spacings: &[f64]) -> Vec<Level> {
    let edges = surface.edges();
    let bound = (surface.borders.of_vertex.iter())
        .map(|place| place.filter(|p| !p.is_corner).map(|p| (surface.borders.point(&p), surface.borders.tangent(&p))))
        .collect();
    let mut levels = vec![Level {
        points: surface.points.clone(),
        normals: surface.normals.clone(),
        areas: surface.areas.clone(),
        spacings: spacings.to_vec(),
        neighbours: Lists::of(surface.points.len(), &edges),
        bound,
        coarser: Vec::new(),
    }];
    let mut edges = edges;
    loop {
        let finest = levels.last_mut().expect("at least the first level");
        let (coarser, count) = pairs(finest, &edges);
        if count as f64 > 0.95 * finest.points.len() as f64 {
            return levels;
        }
        edges =
            (edges.iter().map(|&(a, b)| (coarser[a as usize], coarser[b as usize])).filter(|(a, b)| a != b)).collect();
        edges.sort_unstable();
        edges.dedup();
        let next = merged(finest, &coarser, count, &edges);
        finest.coarser = coarser;
        levels.push(next);
    }
}

/// The pair that each vertex belongs to, and the number of pairs (and of vertices that stay alone).
fn pairs(level: &Level, edges: &[(u32, u32)]) -> (Vec<u32>, usize) {
    let likeness = |a: usize, b: usize| {
        let (x, y) = (level.areas[a], level.areas[b]);
        level.normals[a].dot(&level.normals[b]) * (x / y).max(y / x)
    };
    let mut order: Vec<(f64, u32, u32)> =
        edges.iter().filter(|(a, b)| a < b).map(|&(a, b)| (likeness(a as usize, b as usize), a, b)).collect();
    order.sort_unstable_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut partner: Vec<u32> = (0..level.points.len() as u32).collect();
    for (_, a, b) in order {
        if partner[a as usize] == a && partner[b as usize] == b {
            (partner[a as usize], partner[b as usize]) = (b, a);
        }
    }
    let mut pair = vec![u32::MAX; partner.len()];
    let mut count = 0;
    for v in 0..partner.len() {
        if pair[v] == u32::MAX {
            pair[v] = count as u32;
            pair[partner[v] as usize] = count as u32;
            count += 1;
        }
    }
    (pair, count)
}

fn merged(level: &Level, pair: &[u32], count: usize, edges: &[(u32, u32)]) -> Level {
    let mut sums = vec![(Vec3::zeros(), Vec3::zeros(), 0.0, 0.0); count];
    let mut bound: Vec<Option<(Point, Vec3)>> = vec![None; count];
    for (v, &to) in pair.iter().enumerate() {
        let (point, normal, area, spacing) = &mut sums[to as usize];
        *point += level.points[v].coords * level.areas[v];
        *normal += level.normals[v] * level.areas[v];
        *area += level.areas[v];
        *spacing += level.spacings[v] * level.areas[v];
        if let Some((p, along)) = level.bound[v] {
            bound[to as usize] = Some(match bound[to as usize] {
                None => (p, along),
                Some((q, other)) => {
                    let sum = other + along * if other.dot(&along) < 0.0 { -1.0 } else { 1.0 };
                    (nalgebra::center(&p, &q), sum.try_normalize(1e-9).unwrap_or(other))
                }
            });
        }
    }
    Level {
        points: sums.iter().map(|(p, _, area, _)| Point::from(p / *area)).collect(),
        normals: sums.iter().map(|(_, n, ..)| n.try_normalize(1e-300).unwrap_or_else(Vec3::y)).collect(),
        areas: sums.iter().map(|s| s.2).collect(),
        spacings: sums.iter().map(|s| s.3 / s.2).collect(),
        neighbours: Lists::of(count, edges),
        bound,
        coarser: Vec::new(),
    }
}
