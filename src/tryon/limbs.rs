//! The curve skeleton of a sleeve or leg: centres of level sets of the geodesic distance from its rim.
//!
//! **Source** Shi 2020, §§4.1 and 5.1: the discrete Reeb graph of a geodesic function; along one tube its level sets are single
//! loops, and where it meets the trunk they grow at once. Source of the function is the limb's own rim, not a single vertex, so
//! level sets are cross-sections.

use super::rims::Rim;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, geodesic_distances};

/// Level sets from the rim to the trunk.
const LEVELS: usize = 60;
/// Growth of a cross-section per length along the limb at which it has reached the trunk. A hole in a sheet has 2π, a trunk around an
/// arm hole about 4; sleeves that widen from a narrow cuff have up to 1.7, flared legs 1.
const GROWTH: f64 = 2.5;
/// Levels over which growth counts: less is a fold.
const WINDOW: usize = 2;

/// A sleeve's or leg's skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Limb {
    /// Centres of its cross-sections, from the trunk to the rim.
    pub nodes: Vec<Point>,
    /// Length of the cross-section at each node.
    pub girths: Vec<f64>,
    /// Geodesic distance from its rim up to which vertices belong to it.
    pub reach: f64,
    /// Geodesic distance from its rim.
    pub distance: PerVertex<f64>,
}

impl Limb {
    /// Follows a limb from its rim to the trunk. `reach` is the farthest that a limb may go, in units of the mesh.
    pub fn of(mesh: &TriMesh, adjacency: &Adjacency, rim: &Rim, reach: f64) -> Self {
        let sources: Vec<(VertexId, f64)> = rim.ring.iter().map(|&v| (v, 0.0)).collect();
        let distance = geodesic_distances(mesh, adjacency, &sources, f64::INFINITY);
        let step = reach / LEVELS as f64;
        let (mut nodes, mut girths) = (vec![rim.center], vec![rim.length]);
        let mut last = 0.0;
        for k in 1..=LEVELS {
            let level = step * k as f64;
            let Some((center, girth)) = level_set(mesh, &distance, level) else { break };
            let before = girths.len().checked_sub(WINDOW).map(|k| girths[k]);
            if before.is_some_and(|before| girth - before > GROWTH * step * WINDOW as f64) {
                // The levels before have grown as fast.
                let own = nodes.len().saturating_sub(WINDOW - 1).max(1);
                nodes.truncate(own);
                girths.truncate(own);
                last = step * (own - 1) as f64;
                break;
            }
            (last, _) = (level, nodes.push(center));
            girths.push(girth);
        }
        nodes.reverse();
        girths.reverse();
        Self { nodes, girths, reach: last, distance }
    }

    /// The direction from the trunk to the rim; `None` for a rim without a limb.
    pub fn direction(&self) -> Option<Vec3> {
        (self.nodes.last()? - self.nodes.first()?).try_normalize(1e-9)
    }

    /// Its length along the nodes.
    pub fn length(&self) -> f64 {
        self.nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }

    /// The point at a length from the trunk, and beyond the rim straight on.
    pub fn at(&self, length: f64) -> Point {
        point_along(&self.nodes, length)
    }
}

/// The point of a polyline at a length from its begin; beyond its end straight on, from begin to end.
pub fn point_along(way: &[Point], length: f64) -> Point {
    let mut rest = length;
    for pair in way.windows(2) {
        let part = (pair[1] - pair[0]).norm();
        if rest <= part && part > 0.0 {
            return pair[0] + (pair[1] - pair[0]) * (rest / part);
        }
        rest -= part;
    }
    match way {
        [first, .., last] => last + (last - first).try_normalize(1e-9).unwrap_or_else(Vec3::zeros) * rest,
        _ => way.first().copied().unwrap_or_else(Point::origin),
    }
}

/// Centre and length of the curve where a function over the vertices has a value; `None` where it has it nowhere.
fn level_set(mesh: &TriMesh, values: &PerVertex<f64>, level: f64) -> Option<(Point, f64)> {
    let (mut sum, mut length) = (Vec3::zeros(), 0.0);
    for face in mesh.faces().iter() {
        let mut ends: Vec<Point> = Vec::new();
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let (x, y) = (values[a], values[b]);
            if (x < level) != (y < level) && x.is_finite() && y.is_finite() {
                ends.push(mesh.points()[a] + (mesh.points()[b] - mesh.points()[a]) * ((level - x) / (y - x)));
            }
        }
        if let [p, q] = ends[..] {
            let part = (q - p).norm();
            sum += (p.coords + q.coords) * (0.5 * part);
            length += part;
        }
    }
    (length > 0.0).then(|| (Point::from(sum / length), length))
}
