//! The curve skeleton of a part: what is left of its closed surface after mean curvature flow.
//!
//! **Source** Shi 2020, §5.1 and Eq. 12, after Tagliasacchi et al. 2012, mean curvature skeletons. The paper gives no weights:
//! - w_L, w_H and w_M are those of Tagliasacchi; cotangents have no unit, so only the shortest edge scales with the bounding box.
//! - The poles that w_M pulls to are centres of shrinking balls (Ma et al. 2012) instead of Voronoi poles, which agree on tubes.
//! - Edges are collapsed, not split: a garment's triangles are small relative to its limbs.
//! - The flow also shortens a tube by about its radius at each end. The centres of the end rings are therefore nodes too, and
//!   nodes closer to an end than half of its radius are dropped.

use super::contraction::Contraction;
use super::fill::ClosedPart;
use crate::geometry::{Point, VertexId};
use crate::numerics::NumericsError;
use crate::tryon::rims::ring_center;
use std::collections::BTreeSet;

/// Nodes nearer to an end ring's centre than this share of its radius belong to the ring's own node.
const NEAR_END_PER_RADIUS: f64 = 0.5;
/// Rounds of smoothing of the inner nodes: directions come from their differences.
const SMOOTHED: usize = 4;

/// The curve skeleton of a tube, with its correspondence.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveSkeleton {
    /// Nodes in order, from the torso to the rim; of a torso from the upper rim to the lower one. In metres.
    pub nodes: Vec<Point>,
    /// Mean distance of each node's vertices from it, in metres.
    pub radii: Vec<f64>,
    /// ℳ(l_i): the garment's vertices of each node. Disjoint (Eq. 12).
    pub vertices: Vec<Vec<VertexId>>,
    /// How many rounds the flow took.
    pub rounds: usize,
}

impl CurveSkeleton {
    /// Length from the first node to each, in metres (Eq. 8).
    pub fn arc_lengths(&self) -> Vec<f64> {
        arc_lengths(&self.nodes)
    }
}

/// f_seg of Eq. 8 from the first node to each.
pub fn arc_lengths(nodes: &[Point]) -> Vec<f64> {
    let mut sum = 0.0;
    let rest = nodes.windows(2).map(|pair| {
        sum += (pair[1] - pair[0]).norm();
        sum
    });
    std::iter::once(0.0).take(nodes.len()).chain(rest.collect::<Vec<_>>()).collect()
}

/// Contracts a closed part to a curve from one of its rings to another.
///
/// **Requires** `from` and `to`: vertices of the part's mesh, as in its rings.
///
/// **Errors** if the flow's system cannot be solved.
pub fn curve_skeleton(part: &ClosedPart, from: &[VertexId], to: &[VertexId]) -> Result<CurveSkeleton, NumericsError> {
    let mut flow = Contraction::of(&part.mesh);
    let rounds = flow.run()?;
    flow.collapse_to_curve();
    let path = flow.path(from, to);
    let own = part.garment_vertex.len();
    let points = |ring: &[VertexId]| -> Vec<Point> { ring.iter().map(|&v| part.mesh.points()[v]).collect() };
    let ends = [points(from), points(to)].map(|ring| {
        let center = ring_center(&ring);
        let radius = ring.iter().map(|p| (p - center).norm()).sum::<f64>() / ring.len().max(1) as f64;
        (center, radius)
    });
    let mut nodes = vec![ends[0].0];
    let mut groups: Vec<Vec<VertexId>> = vec![Vec::new()];
    let at_ring: [BTreeSet<VertexId>; 2] = [from, to].map(|ring| ring.iter().copied().collect());
    let mut last = Vec::new();
    for (node, members) in path {
        let mut inner: Vec<VertexId> = Vec::new();
        for v in members.into_iter().filter(|v| v.index() < own) {
            match at_ring.each_ref().map(|ring| ring.contains(&v)) {
                [true, _] => groups[0].push(v),
                [_, true] => last.push(v),
                _ => inner.push(v),
            }
        }
        let near = ends.map(|(center, radius)| (node - center).norm() < NEAR_END_PER_RADIUS * radius);
        match near {
            [_, true] => last.extend(inner),
            [true, _] if nodes.len() == 1 => groups[0].extend(inner),
            _ => {
                nodes.push(node);
                groups.push(inner);
            }
        }
    }
    nodes.push(ends[1].0);
    groups.push(last);
    for _ in 0..SMOOTHED {
        let before = nodes.clone();
        for k in 1..nodes.len() - 1 {
            nodes[k] = Point::from((before[k - 1].coords + before[k].coords * 2.0 + before[k + 1].coords) / 4.0);
        }
    }
    let radii = nodes
        .iter()
        .zip(&groups)
        .enumerate()
        .map(|(k, (node, group))| {
            let end = if k == 0 { ends[0].1 } else { ends[1].1 };
            let sum: f64 = group.iter().map(|&v| (part.mesh.points()[v] - node).norm()).sum();
            if group.is_empty() { end } else { sum / group.len() as f64 }
        })
        .collect();
    let vertices = groups.into_iter().map(|group| group.into_iter().map(|v| part.garment_vertex[v]).collect());
    Ok(CurveSkeleton { nodes, radii, vertices: vertices.collect(), rounds })
}
