//! Mean curvature flow with edge collapses: a closed surface that contracts to a curve.
//!
//! **Source** Tagliasacchi et al. 2012, whose constants these are. Where their least squares hold `‖L x‖²`, we solve the implicit
//! step `(w_L L + w_H + w_M) x = w_H x₀ + w_M pole`, whose matrix has the pattern of the mesh: the flow is the same, its rounds
//! are a few times faster.

use crate::geometry::{Adjacency, NearestVertex, Point, TriMesh, Vec3, VertexId, cotangent_laplacian};
use crate::numerics::{NumericsError, SparseCholesky};

/// w_L: weight of the Laplacian.
const W_L: f64 = 1.0;
/// w_H: weight of the place before, which sets the speed of the flow.
const W_H: f64 = 0.1;
/// w_M: weight of the medial pole, which keeps the curve in the middle.
const W_M: f64 = 0.2;
/// Shorter edges are collapsed, relative to the diagonal of the bounding box: 1 cm of a sleeve. Tagliasacchi's 0.002 leaves more
/// nodes than the rotations along a skeleton need.
const SHORTEST_PER_DIAGONAL: f64 = 0.015;
/// The flow ends when this share of the area is left.
const AREA_LEFT: f64 = 2e-3;
/// The flow ends after this many rounds; sleeves and trouser legs take 4 to 8.
const MOST_ROUNDS: usize = 25;
/// Steps of a shrinking ball; nearly all are done after five.
const BALL_STEPS: usize = 12;
/// Balls smaller than this share of the mean are in folds, and pull nothing.
const LEAST_BALL: f64 = 0.35;

/// A surface on its way to its curve skeleton.
pub(super) struct Contraction {
    points: Vec<Vec3>,
    poles: Vec<Option<Vec3>>,
    /// Vertices that were merged into each one. Empty: merged into another.
    members: Vec<Vec<VertexId>>,
    faces: Vec<[u32; 3]>,
    /// Edges, also those that no longer have faces. Sorted.
    links: Vec<[u32; 2]>,
    shortest: f64,
}

impl Contraction {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let diagonal = mesh.bounds().map_or(0.0, |bounds| bounds.extent().norm());
        Self {
            points: mesh.points().iter().map(|p| p.coords).collect(),
            poles: poles(mesh, diagonal),
            members: mesh.vertex_ids().map(|v| vec![v]).collect(),
            faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
            links: Adjacency::prepare(mesh).edges().iter().map(|(edge, _)| edge.map(|v| v.0)).collect(),
            shortest: SHORTEST_PER_DIAGONAL * diagonal,
        }
    }

    /// Flows until nearly no area is left. Returns the number of rounds.
    pub(super) fn run(&mut self) -> Result<usize, NumericsError> {
        let area = self.area();
        for round in 0..MOST_ROUNDS {
            if self.faces.is_empty() || self.area() <= AREA_LEFT * area {
                return Ok(round);
            }
            self.flow()?;
            self.collapse_short();
        }
        Ok(MOST_ROUNDS)
    }

    fn area(&self) -> f64 {
        let area = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| self.points[v as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        self.faces.iter().map(area).sum()
    }

    /// One implicit step of the vertices that still have faces.
    fn flow(&mut self) -> Result<(), NumericsError> {
        let mut own: Vec<u32> = self.faces.iter().flatten().copied().collect();
        own.sort_unstable();
        own.dedup();
        let mut index = vec![u32::MAX; self.points.len()];
        own.iter().enumerate().for_each(|(k, &v)| index[v as usize] = k as u32);
        let points = own.iter().map(|&v| Point::from(self.points[v as usize])).collect();
        let faces: Vec<[u32; 3]> = self.faces.iter().map(|f| f.map(|v| index[v as usize])).collect();
        let Ok(mesh) = TriMesh::try_from_indices(points, &faces) else {
            return Err(NumericsError::NotFinite { what: "points of a part in its flow", index: 0 });
        };
        let mut triplets = cotangent_laplacian(&mesh).triplets;
        triplets.iter_mut().for_each(|triplet| triplet.2 *= W_L);
        let mut right = Vec::with_capacity(own.len());
        for (k, &v) in own.iter().enumerate() {
            let at = self.points[v as usize];
            let (weight, sum) = match self.poles[v as usize] {
                Some(pole) => (W_H + W_M, at * W_H + pole * W_M),
                None => (W_H, at * W_H),
            };
            triplets.push((k, k, weight));
            right.push(sum);
        }
        let moved = SparseCholesky::prepare(own.len(), &triplets)?.solve_vectors(&right);
        own.iter().zip(moved).for_each(|(&v, p)| self.points[v as usize] = p);
        Ok(())
    }

    /// Collapses all edges that are too short, the shortest first.
    fn collapse_short(&mut self) {
        let length = |points: &[Vec3], a: u32, b: u32| (points[a as usize] - points[b as usize]).norm();
        let mut short: Vec<(f64, u32, u32)> = self
            .links
            .iter()
            .map(|&[a, b]| (length(&self.points, a, b), a, b))
            .filter(|(length, ..)| *length < self.shortest)
            .collect();
        short.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut into: Vec<u32> = (0..self.points.len() as u32).collect();
        for (_, a, b) in short {
            let (a, b) = (root(&mut into, a), root(&mut into, b));
            if a != b && length(&self.points, a, b) < self.shortest {
                self.merge(a, b);
                into[b as usize] = a;
            }
        }
        self.rename(&mut into);
    }

    /// Collapses the shortest edges that have faces, until no face is left.
    pub(super) fn collapse_to_curve(&mut self) {
        while !self.faces.is_empty() {
            let length = |&(a, b): &(u32, u32)| (self.points[a as usize] - self.points[b as usize]).norm_squared();
            let edges = self.faces.iter().flat_map(|f| (0..3).map(|k| (f[k], f[(k + 1) % 3])));
            let edges = edges.map(|(a, b)| (a.min(b), a.max(b)));
            let Some((a, b)) = edges.min_by(|x, y| length(x).total_cmp(&length(y)).then(x.cmp(y))) else { return };
            self.merge(a, b);
            let mut into: Vec<u32> = (0..self.points.len() as u32).collect();
            into[b as usize] = a;
            self.rename(&mut into);
        }
    }

    /// Merges `b` into `a`, in the middle of both by their numbers of vertices.
    fn merge(&mut self, a: u32, b: u32) {
        let (a, b) = (a as usize, b as usize);
        let (m, n) = (self.members[a].len() as f64, self.members[b].len() as f64);
        let middle = |x: Vec3, y: Vec3| (x * m + y * n) / (m + n).max(1.0);
        self.points[a] = middle(self.points[a], self.points[b]);
        self.poles[a] = match (self.poles[a], self.poles[b]) {
            (Some(x), Some(y)) => Some(middle(x, y)),
            (one, other) => one.or(other),
        };
        let moved = std::mem::take(&mut self.members[b]);
        self.members[a].extend(moved);
    }

    fn rename(&mut self, into: &mut [u32]) {
        for face in &mut self.faces {
            *face = face.map(|v| root(into, v));
        }
        self.faces.retain(|[a, b, c]| a != b && b != c && c != a);
        for link in &mut self.links {
            let [a, b] = link.map(|v| root(into, v));
            *link = [a.min(b), a.max(b)];
        }
        self.links.retain(|[a, b]| a != b);
        self.links.sort_unstable();
        self.links.dedup();
    }

    /// The nodes from the one with most of `from` to the one with most of `to`, along links; all other nodes' vertices go to the
    /// nearest node of that path along links.
    pub(super) fn path(&self, from: &[VertexId], to: &[VertexId]) -> Vec<(Point, Vec<VertexId>)> {
        let count = self.points.len();
        let mut node_of = vec![0usize; count];
        for (node, members) in self.members.iter().enumerate() {
            members.iter().for_each(|v| node_of[v.index()] = node);
        }
        let most = |ring: &[VertexId]| {
            let mut counts = vec![0usize; count];
            ring.iter().for_each(|v| counts[node_of[v.index()]] += 1);
            (0..count).max_by_key(|&k| (counts[k], std::cmp::Reverse(k))).unwrap_or(0)
        };
        let mut around: Vec<Vec<usize>> = vec![Vec::new(); count];
        for &[a, b] in &self.links {
            around[a as usize].push(b as usize);
            around[b as usize].push(a as usize);
        }
        let (start, end) = (most(from), most(to));
        let before = self.nearest_of(&around, &[start]);
        let mut path = vec![end];
        while let Some(&at) = path.last()
            && at != start
            && before[at] != usize::MAX
        {
            path.push(before[at]);
        }
        path.reverse();
        // Along links from the path, each node knows the one before it; those lead back to the path.
        let before = self.nearest_of(&around, &path);
        let mut nodes: Vec<(Point, Vec<VertexId>)> =
            path.iter().map(|&k| (Point::from(self.points[k]), Vec::new())).collect();
        let mut rank = vec![usize::MAX; count];
        path.iter().enumerate().for_each(|(r, &k)| rank[k] = r);
        for (k, members) in self.members.iter().enumerate().filter(|(_, members)| !members.is_empty()) {
            let mut at = k;
            while rank[at] == usize::MAX && before[at] != usize::MAX {
                at = before[at];
            }
            let r = if rank[at] == usize::MAX { 0 } else { rank[at] };
            nodes[r].1.extend(members);
        }
        nodes.iter_mut().for_each(|(_, members)| members.sort_unstable());
        nodes
    }

    /// Dijkstra over links: for each node the one before it on the shortest way from a source.
    fn nearest_of(&self, around: &[Vec<usize>], sources: &[usize]) -> Vec<usize> {
        let count = self.points.len();
        let (mut far, mut before) = (vec![f64::INFINITY; count], vec![usize::MAX; count]);
        let mut open: Vec<usize> = sources.to_vec();
        sources.iter().for_each(|&k| far[k] = 0.0);
        // Some ten nodes: no heap is needed.
        while let Some(next) = (0..open.len()).min_by(|&a, &b| far[open[a]].total_cmp(&far[open[b]])) {
            let k = open.swap_remove(next);
            for &next in &around[k] {
                let way = far[k] + (self.points[k] - self.points[next]).norm();
                if way < far[next] {
                    (far[next], before[next]) = (way, k);
                    open.push(next);
                }
            }
        }
        before
    }
}

fn root(into: &mut [u32], v: u32) -> u32 {
    let mut at = v;
    while into[at as usize] != at {
        into[at as usize] = into[into[at as usize] as usize];
        at = into[at as usize];
    }
    at
}

/// The centre of the largest ball inside the surface that touches it at each vertex.
fn poles(mesh: &TriMesh, diagonal: f64) -> Vec<Option<Vec3>> {
    let normals = mesh.vertex_normals();
    let tree = NearestVertex::prepare(mesh.points().as_slice());
    let ball = |v: VertexId| -> Option<(Vec3, f64)> {
        let (p, inward) = (mesh.points()[v], -normals[v]);
        if inward.norm_squared() < 0.5 {
            return None;
        }
        let mut radius = 0.5 * diagonal;
        for _ in 0..BALL_STEPS {
            let (nearest, _) = tree.nearest(&(p + inward * radius))?;
            let to = mesh.points()[nearest] - p;
            let along = to.dot(&inward);
            if nearest == v || along <= 0.0 {
                break;
            }
            let smaller = to.norm_squared() / (2.0 * along);
            if smaller > 0.995 * radius {
                break;
            }
            radius = smaller;
        }
        Some(((p + inward * radius).coords, radius))
    };
    use rayon::prelude::*;
    let ids: Vec<VertexId> = mesh.vertex_ids().collect();
    let balls: Vec<Option<(Vec3, f64)>> = ids.par_iter().map(|&v| ball(v)).collect();
    let known = balls.iter().flatten().count().max(1) as f64;
    let mean = balls.iter().flatten().map(|(_, radius)| radius).sum::<f64>() / known;
    balls.into_iter().map(|ball| ball.filter(|(_, radius)| *radius >= LEAST_BALL * mean).map(|(c, _)| c)).collect()
}
