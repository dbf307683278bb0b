//! Separates layers that cross after they were re-meshed: a quad cuts off the top of a fold, and the layer over it another.

use crate::geometry::{Adjacency, FaceId, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use std::collections::BTreeMap;

/// Faces are moved apart by the depth of a crossing plus this, in metres; it grows each round.
const MARGIN: f64 = 1e-4;

/// The greatest move in one round, in metres.
const GREATEST_MOVE: f64 = 2e-3;

/// No vertex goes farther than this in all, in metres: what is still folded then is folded in the scan, too.
const FARTHEST: f64 = 12e-3;

/// From this round on the vertices around a fold move, too.
const WIDER_FROM: usize = 6;

/// Rounds of moves: most crossings end within three.
const ROUNDS: usize = 30;

/// Where two faces cross.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// The middle of the smaller face.
    pub at: Point,
    /// How far that one reaches from there, in metres.
    pub radius: f64,
}

/// Moves the vertices of re-meshed layers until no face of theirs crosses any other, on coordinates rounded to `f32` as in
/// a file: the outer of two layers outwards, the inner inwards if the outer is not re-meshed; a fold of one layer becomes smoother.
///
/// **Shapes** `layers` innermost first, the body is the first; `may_move` one entry per layer. The result has the layers'
/// points, rounded, and per layer the crossings that are left, each listed for the layers that may move.
pub(super) fn uncrossed(layers: &[TriMesh], may_move: &[bool]) -> (Vec<TriMesh>, Vec<Vec<Crossing>>) {
    let mut sheets = Sheets::join(layers, may_move);
    let mut pairs: Vec<[FaceId; 2]> = Vec::new();
    let mut moved: Vec<FaceId> = sheets.index.mesh().face_ids().collect();
    for round in 0..=ROUNDS {
        pairs.retain(|pair| !pair.iter().any(|f| moved.binary_search(f).is_ok()));
        pairs.extend(sheets.crossings(&moved));
        pairs.sort_unstable();
        pairs.dedup();
        if pairs.is_empty() || round == ROUNDS {
            break;
        }
        let moves = sheets.moves_apart(&pairs, round);
        moved = sheets.moved_by(&moves);
    }
    let mut left = vec![Vec::new(); layers.len()];
    for [f, g] in pairs {
        let [i, j] = [f, g].map(|f| sheets.layer_of(f));
        let crossing = sheets.crossing([f, g]);
        if may_move[i] {
            left[i].push(crossing);
        }
        if may_move[j] && i != j {
            left[j].push(crossing);
        }
    }
    let points = sheets.index.mesh().points();
    let apart =
        |(k, layer): (usize, &TriMesh)| layer.with_points(points.0[sheets.starts[k]..sheets.starts[k + 1]].to_vec());
    (layers.iter().enumerate().map(apart).collect(), left)
}

/// All layers in one mesh.
struct Sheets<'a> {
    index: SurfaceIndex,
    /// Per layer its first vertex; then the number of all vertices.
    starts: Vec<usize>,
    may_move: &'a [bool],
    normals: PerVertex<Vec3>,
    adjacency: Adjacency,
    is_border: PerVertex<bool>,
    points_before: PerVertex<Point>,
}

impl<'a> Sheets<'a> {
    fn join(layers: &[TriMesh], may_move: &'a [bool]) -> Self {
        let mut starts = vec![0];
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for layer in layers {
            let first = points.len();
            points.extend(layer.points().iter().map(rounded));
            faces.extend(layer.faces().iter().map(|f| f.map(|v| v.0 + first as u32)));
            starts.push(points.len());
        }
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap_or_else(|_| TriMesh::empty());
        let adjacency = Adjacency::prepare(&mesh);
        Self {
            index: SurfaceIndex::prepare(&mesh),
            starts,
            may_move,
            normals: mesh.vertex_normals(),
            is_border: adjacency.boundary_vertices(),
            adjacency,
            points_before: mesh.points().clone(),
        }
    }

    fn layer_of_vertex(&self, v: VertexId) -> usize {
        self.starts.partition_point(|&start| start <= v.index()) - 1
    }

    fn layer_of(&self, f: FaceId) -> usize {
        self.layer_of_vertex(self.index.mesh().faces()[f][0])
    }

    fn crossing(&self, pair: [FaceId; 2]) -> Crossing {
        let mesh = self.index.mesh();
        let of_face = |f: FaceId| {
            let corners = mesh.triangle(f);
            let at = Point::from(corners.iter().map(|p| p.coords / 3.0).sum::<Vec3>());
            Crossing { at, radius: corners.iter().map(|p| (p - at).norm()).fold(0.0, f64::max) }
        };
        let [a, b] = pair.map(of_face);
        if a.radius <= b.radius { a } else { b }
    }

    /// The pairs of which one face is in `faces` and one may move, the inner first.
    fn crossings(&self, faces: &[FaceId]) -> Vec<[FaceId; 2]> {
        let pairs = self.index.piercings(faces).into_iter().map(|x| [x.from.min(x.face), x.from.max(x.face)]);
        pairs.filter(|pair| pair.iter().any(|&f| self.may_move[self.layer_of(f)])).collect()
    }

    /// The longest move of each vertex of a crossing face.
    fn moves_apart(&self, pairs: &[[FaceId; 2]], round: usize) -> BTreeMap<VertexId, Vec3> {
        let mesh = self.index.mesh();
        let margin = MARGIN * (1 + round) as f64;
        let mut moves: BTreeMap<VertexId, Vec3> = BTreeMap::new();
        let mut require = |v: VertexId, by: Vec3| {
            let own = moves.entry(v).or_insert_with(Vec3::zeros);
            if by.norm_squared() > own.norm_squared() {
                *own = by;
            }
        };
        for &[f, g] in pairs {
            let (normal, of_outer) = (mesh.face_normal(f), mesh.face_normal(g));
            let [t, u] = [f, g].map(|f| mesh.triangle(f));
            let depth = |points: &[Point; 3], plane: &Point, n: &Vec3| {
                points.iter().map(|p| n.dot(&(p - plane))).fold(0.0, f64::max)
            };
            let [i, j] = [f, g].map(|f| self.layer_of(f));
            if i == j {
                let mut folded: Vec<VertexId> = mesh.faces()[f].into_iter().chain(mesh.faces()[g]).collect();
                if round >= WIDER_FROM {
                    let around: Vec<&[VertexId]> = folded.iter().map(|&v| self.adjacency.neighbours_of(v)).collect();
                    folded.extend(around.concat());
                }
                for v in folded.into_iter().filter(|&v| !self.is_border[v]) {
                    let around = self.adjacency.neighbours_of(v);
                    let mean = around.iter().map(|&w| mesh.points()[w].coords).sum::<Vec3>() / around.len() as f64;
                    let by = 0.5 * (mean - mesh.points()[v].coords);
                    require(v, by.cap_magnitude(GREATEST_MOVE));
                }
                continue;
            }
            let out: Vec3 = mesh.faces()[f].iter().map(|&v| self.normals[v]).sum();
            let out = out.try_normalize(1e-9).unwrap_or(normal);
            let below = depth(&u, &t[0], &-normal);
            let above = depth(&t, &u[0], &of_outer);
            let height = (below.min(above) + margin).min(GREATEST_MOVE);
            let (face, by) = if self.may_move[j] { (g, out * height) } else { (f, -out * height) };
            mesh.faces()[face].into_iter().for_each(|v| require(v, by));
        }
        moves
    }

    /// Moves vertices; the faces that moved, ascending.
    fn moved_by(&mut self, moves: &BTreeMap<VertexId, Vec3>) -> Vec<FaceId> {
        let mesh = self.index.mesh();
        let mut points = mesh.points().clone();
        for (&v, by) in moves {
            let whole = points[v] + by - self.points_before[v];
            points[v] = rounded(&(self.points_before[v] + whole.cap_magnitude(FARTHEST)));
        }
        let has_moved = |corners: &[VertexId; 3]| corners.iter().any(|v| moves.contains_key(v));
        let moved = mesh.faces().enumerate().filter(|(_, corners)| has_moved(corners)).map(|(f, _)| f).collect();
        let mesh = mesh.with_points(points);
        self.index.follow(&mesh);
        moved
    }
}

fn rounded(p: &Point) -> Point {
    Point::from(p.coords.map(|c| f64::from(c as f32)))
}
