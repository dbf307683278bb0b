//! Separates everything that still crosses, all layers at once: layers from each other and garments from themselves.

use super::insiders::{Insider, insiders};
use super::required_moves::RequiredMoves;
use super::resurfaced::resurfaced;
use super::sheets::Sheets;
use crate::geometry::{
    Adjacency, FaceId, MeshError, PerVertex, Piercing, Point, SurfaceIndex, TriMesh, Vec3, VertexId,
};
use rayon::prelude::*;

/// A crossing is separated by its depth plus this margin, in metres; the margin grows each round.
const MARGIN: f64 = 5e-5;
/// Rounds in which the margin grows.
const MOST_MARGINS: usize = 9;
/// Greatest number of rings around a fold that are smoothed.
const MOST_RINGS: usize = 6;
/// Greatest move of a vertex in one round, in metres.
const GREATEST_MOVE: f64 = 2e-3;
/// Share of a separation that the inner layer takes where it is cloth.
const INNER_SHARE: f64 = 0.5;
/// Cosine between the normals of two sheets of one garment below which they face each other, as a sleeve faces the side.
const OPPOSED_COSINE: f64 = -0.3;
/// Rounds after which the inner layers that smoothing keeps clear of are brought up to date.
const ROUNDS_PER_FLOOR: usize = 5;
/// Height above inner layers that smoothing keeps, in metres.
const FLOOR_HEIGHT: f64 = 2e-4;
/// How far inside a layer smoothing may have drawn a vertex, in metres.
const FLOOR_REACH: f64 = 5e-3;
/// Rings around a fold, as they have grown, within which the border of the cloth is drawn back.
const FLAP_RINGS: u16 = 2;
/// How far behind cloth the body is at most, in metres: within the folds of a wide skirt.
const FARTHEST_BODY: f64 = 0.2;
/// Rings around what stays tangled that are replaced, from attempt to attempt.
const RINGS_REPLACED: [usize; 5] = [1, 2, 3, 4, 6];
/// Rounds without progress after which untangling ends.
const STALLED: usize = 10;
/// Steps of smoothing per round, and the share of the way to the middle of the neighbours per step.
const SMOOTHING_STEPS: usize = 3;
const SMOOTHING: f64 = 0.6;
/// Rounds of spreading moves to the neighbours.
const SPREAD: usize = 3;
/// How often a vertex is pushed out before it moves to the middle of its neighbours instead: a tip of long hair that reached into a
/// flat fold of the jacket of the foreign person c crossed it each time it was pushed out.
const PUSHES: u16 = 1;
/// Rounds after which the neighbourhood that is smoothed grows by a ring.
const ROUNDS_PER_RING: usize = 3;

/// What untangling did.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Untangled {
    /// The garments, innermost first.
    pub garments: Vec<TriMesh>,
    /// Rounds that it took.
    pub rounds: usize,
    /// What crosses after it.
    pub left: Vec<Piercing>,
}

/// The state with the fewest conflicts so far.
struct Best {
    /// Piercings; vertices inside, which are counted only where nothing crosses: before, it says little.
    score: (usize, usize),
    points: PerVertex<Point>,
    left: Vec<Piercing>,
    round: usize,
}

/// Separates the layers; the first is the body, which does not move.
pub(super) fn untangle(layers: &[TriMesh], rounds: usize, greatest_depth: f64) -> Result<Untangled, MeshError> {
    let mut tangle = Tangle::of(layers)?;
    let mut piercings = tangle.sheets.piercings();
    let mut best: Option<Best> = None;
    for round in 0..=rounds {
        let inside = match piercings.is_empty() {
            true => insiders(&tangle.sheets.layers(layers), greatest_depth),
            false => Vec::new(),
        };
        let score = (piercings.len(), inside.len());
        if best.as_ref().is_none_or(|b| score < b.score) {
            let points = tangle.sheets.mesh().points().clone();
            best = Some(Best { score, points, left: piercings.clone(), round });
        }
        let has_stalled = best.as_ref().is_some_and(|b| round > b.round + STALLED);
        if score == (0, 0) || round == rounds || has_stalled {
            break;
        }
        if round > 0 && round % ROUNDS_PER_FLOOR == 0 {
            tangle.renew_floors(layers);
        }
        let moved = match piercings.is_empty() {
            true => tangle.pushed_out(&inside),
            false => tangle.separated(&piercings, round),
        };
        let faces = tangle.sheets.move_to(&moved);
        piercings.retain(|x| [x.from, x.face].iter().all(|f| faces.binary_search(f).is_err()));
        piercings.extend(tangle.sheets.index.piercings(&faces));
        piercings.sort_unstable();
        piercings.dedup();
    }
    let mut sheets = tangle.sheets;
    let (rounds, left) = match best {
        Some(best) => {
            sheets.move_to(&best.points);
            (best.round, best.left)
        }
        None => (0, piercings),
    };
    let garments = (1..sheets.layer_count()).map(|k| sheets.layer(k, &layers[k])).collect();
    Ok(Untangled { garments, rounds, left })
}

/// Separates the layers, and where a garment stays tangled replaces the tangled part, a larger one each time.
pub(super) fn untangle_or_resurface(
    layers: &[TriMesh],
    rounds: usize,
    greatest_depth: f64,
) -> Result<Untangled, MeshError> {
    let mut best = untangle(layers, rounds, greatest_depth)?;
    for rings in RINGS_REPLACED {
        if best.left.is_empty() {
            break;
        }
        let mut surfaces: Vec<TriMesh> = layers[..1].iter().chain(&best.garments).cloned().collect();
        let mut first = layers[0].face_count();
        for surface in surfaces.iter_mut().skip(1) {
            let own = first..first + surface.face_count();
            first = own.end;
            let mut bad: Vec<FaceId> = best
                .left
                .iter()
                .filter(|x| own.contains(&x.from.index()) || own.contains(&x.face.index()))
                .flat_map(|x| [x.from, x.face])
                .filter(|f| own.contains(&f.index()))
                .map(|f| FaceId::from_index(f.index() - own.start))
                .collect();
            bad.sort_unstable();
            bad.dedup();
            if !bad.is_empty()
                && let Some(replaced) = resurfaced(surface, &bad, rings)
            {
                *surface = replaced;
            }
        }
        let next = untangle(&surfaces, rounds / 2, greatest_depth)?;
        if next.left.len() < best.left.len() {
            best = Untangled { rounds: best.rounds + next.rounds, ..next };
        }
    }
    Ok(best)
}

/// All layers while they are separated.
struct Tangle {
    sheets: Sheets,
    /// All layers but the outermost; smoothing keeps clear of them.
    floors: Vec<SurfaceIndex>,
    adjacency: Adjacency,
    on_boundary: PerVertex<bool>,
    faces_out: PerVertex<bool>,
    /// In how many rounds each vertex was at a crossing.
    age: PerVertex<u16>,
    /// How often each vertex was pushed out of a layer.
    pushes: PerVertex<u16>,
}

impl Tangle {
    fn of(layers: &[TriMesh]) -> Result<Self, MeshError> {
        let sheets = Sheets::join(layers)?;
        let adjacency = Adjacency::prepare(sheets.mesh());
        Ok(Self {
            floors: layers[..layers.len().saturating_sub(1)].iter().map(SurfaceIndex::prepare).collect(),
            on_boundary: adjacency.boundary_vertices(),
            faces_out: faces_out(&sheets, layers),
            age: PerVertex::filled(0, sheets.mesh().vertex_count()),
            pushes: PerVertex::filled(0, sheets.mesh().vertex_count()),
            adjacency,
            sheets,
        })
    }

    /// Brings the inner garments that smoothing keeps clear of up to date.
    fn renew_floors(&mut self, layers: &[TriMesh]) {
        for (k, floor) in self.floors.iter_mut().enumerate().skip(1) {
            floor.follow(&self.sheets.layer(k, &layers[k]));
        }
    }

    /// The places of all vertices after those inside were pushed out, where nothing crosses.
    fn pushed_out(&mut self, inside: &[Insider]) -> PerVertex<Point> {
        let mesh = self.sheets.mesh();
        let mut required = RequiredMoves::none(mesh.vertex_count());
        for one in inside {
            let v = self.sheets.vertex(one.layer, one.vertex);
            let out = one.way_out.try_normalize(1e-12).unwrap_or_else(Vec3::zeros);
            let way = match self.pushes[v] < PUSHES {
                true => one.way_out + out * MARGIN,
                false => mean(self.adjacency.neighbours_of(v), |w| mesh.points()[w].coords) - mesh.points()[v].coords,
            };
            required.require(v, way);
            self.pushes[v] += 1;
        }
        let moves = spread(&self.sheets, &self.adjacency, &required);
        mesh.points().iter().zip(moves.iter()).map(|(p, u)| p + u).collect()
    }

    /// The places of all vertices after one round.
    fn separated(&mut self, piercings: &[Piercing], round: usize) -> PerVertex<Point> {
        let (sheets, mesh) = (&self.sheets, self.sheets.mesh());
        let normals = mesh.vertex_normals();
        let margin = MARGIN * (1 + round.min(MOST_MARGINS)) as f64;
        let mut required = RequiredMoves::none(mesh.vertex_count());
        let mut folded: Vec<VertexId> = Vec::new();
        let mut involved = PerVertex::filled(false, mesh.vertex_count());
        for piercing in piercings {
            for v in mesh.faces()[piercing.from].iter().chain(&mesh.faces()[piercing.face]) {
                involved[*v] = true;
            }
            let (a, b) = (sheets.layer_of_face(piercing.from), sheets.layer_of_face(piercing.face));
            if a == b {
                if !retreat(mesh, &normals, &self.faces_out, piercing, margin, &mut required) {
                    folded.extend(mesh.faces()[piercing.from].iter().chain(&mesh.faces()[piercing.face]));
                }
            } else {
                lift(sheets, &normals, piercing, margin, &mut required);
            }
        }
        for (v, is_involved) in involved.enumerate() {
            self.age[v] += u16::from(*is_involved);
        }
        let moves = spread(sheets, &self.adjacency, &required);
        let limited = |u: &Vec3| u * (GREATEST_MOVE / u.norm().max(GREATEST_MOVE));
        let mut points: PerVertex<Point> =
            mesh.points().iter().zip(moves.iter()).map(|(p, u)| p + limited(u)).collect();
        // What stays crossed for long is smoothed too, whatever crosses it.
        let is_stubborn = |v: VertexId| usize::from(self.age[v]) > 2 * ROUNDS_PER_RING;
        folded.extend(involved.enumerate().filter(|&(v, is)| *is && is_stubborn(v)).map(|(v, _)| v));
        folded.retain(|&v| sheets.layer_of(v) > 0);
        folded.sort_unstable();
        folded.dedup();
        self.smooth_around(&folded, &mut points);
        points
    }

    /// Moves the vertices around `folded` towards the middle of their neighbours. The longer a fold has stayed, the larger the
    /// neighbourhood.
    fn smooth_around(&self, folded: &[VertexId], points: &mut PerVertex<Point>) {
        let mut rings_left: PerVertex<u16> = PerVertex::filled(0, points.len());
        let mut region: Vec<VertexId> = Vec::new();
        let rings = |v: VertexId| 1 + (usize::from(self.age[v]) / ROUNDS_PER_RING).min(MOST_RINGS) as u16;
        let mut open: Vec<(VertexId, u16)> = folded.iter().map(|&v| (v, rings(v))).collect();
        while let Some((v, rings)) = open.pop() {
            if rings_left[v] >= rings {
                continue;
            }
            if rings_left[v] == 0 {
                region.push(v);
            }
            rings_left[v] = rings;
            let around = self.adjacency.neighbours_of(v).iter();
            open.extend(around.map(|&w| (w, rings - 1)).filter(|&(_, rings)| rings > 0));
        }
        region.sort_unstable();
        for _ in 0..if region.is_empty() { 0 } else { SMOOTHING_STEPS } {
            let smoothed = |&v: &VertexId| {
                // The border of a flap that stays folded is drawn back into the cloth, so that the flap shrinks.
                let keeps_border = self.on_boundary[v] && rings_left[v] < FLAP_RINGS;
                let around = self.adjacency.neighbours_of(v).iter().copied();
                let along: Vec<VertexId> = around.filter(|&w| !keeps_border || self.on_boundary[w]).collect();
                if along.is_empty() {
                    return points[v];
                }
                let middle = mean(&along, |w| points[w].coords);
                let floors = &self.floors[..self.sheets.layer_of(v)];
                above_floors(floors, Point::from(points[v].coords * (1.0 - SMOOTHING) + middle * SMOOTHING))
            };
            let new: Vec<Point> = region.par_iter().map(smoothed).collect();
            for (&v, p) in region.iter().zip(new) {
                points[v] = p;
            }
        }
    }
}

/// Whether the body is behind each vertex, as it is behind cloth that is not folded over. The closest body would not do: of
/// a sleeve at the armpit it is the trunk.
fn faces_out(sheets: &Sheets, layers: &[TriMesh]) -> PerVertex<bool> {
    let normals = sheets.mesh().vertex_normals();
    let body = SurfaceIndex::prepare(&layers[0]);
    let points = &sheets.mesh().points().0;
    let out: Vec<bool> = (points.par_iter().enumerate())
        .map(|(i, p)| {
            let v = VertexId::from_index(i);
            let has_body_behind = || {
                let hit = body.cast_ray(p, &-normals[v], FARTHEST_BODY)?;
                Some(body.mesh().face_normal(hit.face).dot(&normals[v]) > 0.0)
            };
            sheets.layer_of(v) == 0 || has_body_behind().unwrap_or(false)
        })
        .collect();
    PerVertex(out)
}

/// Requires the moves that take two layers apart: the outer one up, and inner cloth down.
fn lift(sheets: &Sheets, normals: &PerVertex<Vec3>, piercing: &Piercing, margin: f64, required: &mut RequiredMoves) {
    let mesh = sheets.mesh();
    let corners = mesh.faces()[piercing.face];
    let edge_is_outer = sheets.layer_of_face(piercing.from) > sheets.layer_of_face(piercing.face);
    let inner_vertices: &[VertexId] = if edge_is_outer { &corners } else { &piercing.edge };
    let Some(out) = inner_vertices.iter().map(|&v| normals[v]).sum::<Vec3>().try_normalize(1e-9) else { return };
    let plane_normal = mesh.face_normal(piercing.face);
    let plane_normal = if plane_normal.dot(&out) < 0.0 { -plane_normal } else { plane_normal };
    let height = |v: VertexId| plane_normal.dot(&(mesh.points()[v] - mesh.points()[corners[0]]));
    let [p, q] = piercing.edge;
    let (low, high) = if height(p) < height(q) { (p, q) } else { (q, p) };
    // The outer edge has one end too low, the inner edge one too high.
    let (end, depth) = if edge_is_outer { (low, -height(low)) } else { (high, height(high)) };
    let distance = depth.clamp(0.0, GREATEST_MOVE) + margin;
    let inner_is_body = sheets.layer_of(inner_vertices[0]) == 0;
    let inner_share = if inner_is_body { 0.0 } else { INNER_SHARE };
    let up = out * (distance * (1.0 - inner_share));
    let down = out * (-distance * inner_share);
    let (of_end, of_corners) = if edge_is_outer { (up, down) } else { (down, up) };
    if sheets.layer_of(end) > 0 {
        required.require(end, of_end);
    }
    if sheets.layer_of(corners[0]) > 0 {
        corners.iter().for_each(|&v| required.require(v, of_corners));
    }
}

/// Requires two sheets of one garment that face each other to retreat, each against its own normal; false if they do not
/// face each other.
fn retreat(
    mesh: &TriMesh,
    normals: &PerVertex<Vec3>,
    faces_out: &PerVertex<bool>,
    piercing: &Piercing,
    margin: f64,
    required: &mut RequiredMoves,
) -> bool {
    let corners = mesh.faces()[piercing.face];
    // A flap that fusion folded inwards has its back to the sheet that it crosses: to retreat would push it deeper.
    if !piercing.edge.iter().chain(&corners).all(|&v| faces_out[v]) {
        return false;
    }
    let of_edge = mesh.face_normal(piercing.from);
    let of_face = mesh.face_normal(piercing.face);
    if of_edge.dot(&of_face) > OPPOSED_COSINE {
        return false;
    }
    let height = |v: VertexId| of_face.dot(&(mesh.points()[v] - mesh.points()[corners[0]]));
    let [p, q] = piercing.edge;
    let (low, depth) = if height(p) < height(q) { (p, -height(p)) } else { (q, -height(q)) };
    let distance = 0.5 * depth.clamp(0.0, GREATEST_MOVE) + margin;
    required.require(low, -normals[low] * distance);
    corners.iter().for_each(|&v| required.require(v, -normals[v] * distance));
    true
}

/// The required moves, and for the vertices around them a share of their neighbours' moves.
fn spread(sheets: &Sheets, adjacency: &Adjacency, required: &RequiredMoves) -> PerVertex<Vec3> {
    let mut moves = required.moves().clone();
    let is_required: PerVertex<bool> = moves.iter().map(|u| *u != Vec3::zeros()).collect();
    let mut around: Vec<VertexId> = Vec::new();
    let mut front: Vec<VertexId> = is_required.enumerate().filter(|(_, is)| **is).map(|(v, _)| v).collect();
    let mut reached = is_required.clone();
    for _ in 0..SPREAD {
        let mut next = Vec::new();
        for &w in front.iter().flat_map(|&v| adjacency.neighbours_of(v)) {
            if !reached[w] && sheets.layer_of(w) > 0 {
                reached[w] = true;
                next.push(w);
            }
        }
        around.extend(&next);
        front = next;
    }
    for _ in 0..SPREAD {
        let new: Vec<Vec3> = around.iter().map(|&v| mean(adjacency.neighbours_of(v), |w| moves[w])).collect();
        for (&v, u) in around.iter().zip(new) {
            moves[v] = u;
        }
    }
    moves
}

/// A point that smoothing drew into an inner layer, moved back onto it.
fn above_floors(floors: &[SurfaceIndex], mut p: Point) -> Point {
    for floor in floors {
        let Some(at) = floor.closest_within(&p, FLOOR_REACH) else { continue };
        let out = floor.pseudonormal(&at);
        let height = if (p - at.point).dot(&out) < 0.0 { -at.distance } else { at.distance };
        if height < FLOOR_HEIGHT && !at.barycentric.contains(&0.0) {
            p += out * (FLOOR_HEIGHT - height);
        }
    }
    p
}

fn mean(of: &[VertexId], f: impl Fn(VertexId) -> Vec3) -> Vec3 {
    of.iter().map(|&v| f(v)).sum::<Vec3>() / of.len().max(1) as f64
}

/// Pairs of faces that cross, lower id first, in ascending order.
pub(super) fn pairs_of(piercings: &[Piercing]) -> Vec<(FaceId, FaceId)> {
    let mut pairs: Vec<_> = piercings.iter().map(|x| (x.from.min(x.face), x.from.max(x.face))).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
