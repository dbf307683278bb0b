//! Removal of interpenetration: the garment is pushed out of the person, smoothly.
//!
//! **Source** Shi 2020, §6.2, Eqs. 18–21, corrected:
//! - Eq. 20 as printed is a sum of signed gaps, which has no minimum. The gap is squared, as in Guan et al. 2012, from whom the
//!   paper has the term.
//! - Eq. 18 measures along the normal of the nearest *vertex*, which misses by up to an edge. Here it is the signed distance to
//!   the nearest face. Where that face looks the other way than the cloth does, cloth is deep inside, and the nearest way out
//!   is through the wrong side: then the gap is measured along the cloth's own normal.
//! - Vertices outside do not keep coarse cloth outside: the middles of long edges are matched too.
//! - ω is written as a sum over the person's mesh; it is one over the garment.
//! - Nothing holds a garment that touches nowhere: each round's move is damped.
//! - The nearest points change as the garment moves, so match and solve are repeated, with a greater λ_1 each time.
//! - The paper gives no weights. λ_1 is 1 per vertex; λ_2 grows with the fourth power of the smoothed length over the edge length,
//!   since ω is the square of a second difference: a finer mesh of the same garment moves the same way.

use super::push::{KAPPA, Match, Push, Smoothness};
use crate::geometry::{Adjacency, FaceId, PerVertex, SurfaceIndex, TriMesh, Vec3, VertexId, smoothed_normals};
use rayon::prelude::*;

/// What was pushed out stays matched up to this many κ, so that it neither sinks back nor is drawn in.
const RELEASED: f64 = 1.5;
/// A push fades over this length along the cloth, in metres: between the widths of a finger and a hand.
const SMOOTH_LENGTH: f64 = 0.035;
/// The least and greatest λ_2: below, single vertices spike; above, conjugate gradients need hundreds of steps.
const LAMBDA_2: [f64; 2] = [2.0, 200.0];
/// λ_1 grows by this factor per round, to this greatest value.
const GROWTH: [f64; 2] = [2.0, 256.0];
/// Most rounds of matching and solving, and how many may pass without a better result.
const MOST_ROUNDS: [usize; 2] = [14, 4];
/// Edges longer than this are matched in their middle too, in metres: over 2 cm, skin with the radius of an arm rises by 1 mm.
const LONG_EDGE: f64 = 0.02;
/// Cloth farther than this from the skin is matched again only when it has moved that far, in metres.
const FAR: f64 = 0.04;
/// Cloth deeper than this, in metres, that looks away from the nearest skin was brought in from the other side.
const DEEP: f64 = 0.03;
/// Rounds of smoothing of the cloth's normals: lapels, pockets and hems that are folded over look inward.
const SMOOTHED: usize = 12;
/// Cosine between cloth and skin below which they look away from each other.
const LOOKS_AWAY: f64 = -0.3;
/// The way out along the cloth's own normal may be this many times as long as that through the nearest skin.
const WAY_OUT_PER_DEPTH: f64 = 2.5;
/// The longest such way, in metres: half of a deep trunk. Cloth for which it is longer, as in the fold between the belly and the
/// thigh of a squatting person, has no way out; it stays where its neighbours lead it.
const WAY_OUT: f64 = 0.14;

/// A garment clear of the person, as far as its vertices and long edges tell.
#[derive(Clone, Debug, PartialEq)]
pub struct Cleared {
    /// The garment. Vertices and faces keep their order.
    pub mesh: TriMesh,
    /// Rounds of matching and solving.
    pub rounds: usize,
    /// Vertices inside the person before and after.
    pub inside: [usize; 2],
    /// The deepest vertex before and after, in metres; 0 if none is inside.
    pub depth: [f64; 2],
}

/// Pushes a garment out of a body. `is_other` tells for a vertex and a face of the skin that they belong to different limbs, so
/// that a way out through the vertex's own side does not lead past that face.
///
/// **Frame and units** garment and body in one place, in metres; the body closed and oriented.
///
/// **Guarantees** vertices and their order stay; equal bytes with any number of threads.
pub fn cleared(
    garment: &TriMesh,
    adjacency: &Adjacency,
    body: &SurfaceIndex,
    is_other: &(dyn Fn(VertexId, FaceId) -> bool + Sync),
) -> Cleared {
    let smoothness = Smoothness::of(garment, adjacency);
    let edge = garment.mean_edge_length().max(f64::MIN_POSITIVE);
    let lambda_2 = (SMOOTH_LENGTH / edge).powi(4).clamp(LAMBDA_2[0], LAMBDA_2[1]);
    let normals = smoothed_normals(garment, adjacency, SMOOTHED);
    let matcher = Matcher { body, is_other, normals: &normals };
    let mut mesh = garment.clone();
    let mut matches = matcher.first(garment, adjacency);
    matcher.update(&mut matches, &mesh);
    let before = state(&matches);
    let mut best = (before, mesh.clone());
    let (mut lambda_1, mut rounds, mut since_best) = (1.0, 0, 0);
    while rounds < MOST_ROUNDS[0] && since_best < MOST_ROUNDS[1] && best.0.samples > 0 {
        for m in &mut matches {
            m.is_held = !m.is_trapped && (m.distance < 0.0 || m.is_held && m.distance < RELEASED * KAPPA);
        }
        let so_far: Vec<Vec3> = mesh.points().iter().zip(garment.points().iter()).map(|(p, q)| p - q).collect();
        let step = Push { smoothness: &smoothness, matches: &matches, lambda_1, lambda_2 }.solve(&so_far);
        mesh = mesh.with_points(mesh.points().iter().zip(&step).map(|(p, s)| p + s).collect::<Vec<_>>());
        matcher.update(&mut matches, &mesh);
        let now = state(&matches);
        if (now.inside, now.samples) < (best.0.inside, best.0.samples) {
            best = (now, mesh.clone());
            since_best = 0;
        } else {
            since_best += 1;
        }
        lambda_1 = (lambda_1 * GROWTH[0]).min(GROWTH[1]);
        rounds += 1;
    }
    let (after, mesh) = best;
    Cleared { mesh, rounds, inside: [before.inside, after.inside], depth: [before.depth, after.depth] }
}

/// How much of a garment is inside.
#[derive(Clone, Copy)]
struct Inside {
    /// Vertices.
    inside: usize,
    /// Vertices and middles of edges.
    samples: usize,
    /// The deepest vertex, in metres.
    depth: f64,
}

fn state(matches: &[Match]) -> Inside {
    let inside = |m: &&Match| m.distance < 0.0;
    let vertices = || matches.iter().filter(|m| m.ends[0] == m.ends[1]).filter(inside);
    Inside {
        inside: vertices().count(),
        samples: matches.iter().filter(inside).count(),
        depth: vertices().map(|m| -m.distance).fold(0.0, f64::max),
    }
}

/// 𝒯: finds the skin next to the garment.
struct Matcher<'a> {
    body: &'a SurfaceIndex,
    is_other: &'a (dyn Fn(VertexId, FaceId) -> bool + Sync),
    /// Of the cloth before the first round.
    normals: &'a PerVertex<Vec3>,
}

impl Matcher<'_> {
    /// All vertices in order, then the long edges, not yet matched.
    fn first(&self, garment: &TriMesh, adjacency: &Adjacency) -> Vec<Match> {
        let length = |[a, b]: [VertexId; 2]| (garment.points()[a] - garment.points()[b]).norm();
        let edges = adjacency.edges().iter().map(|(edge, _)| *edge).filter(|&edge| length(edge) > LONG_EDGE);
        garment
            .vertex_ids()
            .map(|v| [v, v])
            .chain(edges)
            .map(|ends| Match {
                ends,
                face: FaceId(0),
                distance: f64::NEG_INFINITY,
                outward: Vec3::zeros(),
                at: nalgebra::center(&garment.points()[ends[0]], &garment.points()[ends[1]]),
                is_trapped: false,
                is_held: false,
            })
            .collect()
    }

    fn update(&self, matches: &mut [Match], garment: &TriMesh) {
        let points = garment.points();
        matches.par_iter_mut().with_min_len(64).for_each(|m| {
            let [a, b] = m.ends;
            let p = nalgebra::center(&points[a], &points[b]);
            if m.distance - (p - m.at).norm() > FAR {
                return;
            }
            // On the first round there is no face to begin from, and any will do.
            if let Some(at) = self.body.closest_within_from(&p, f64::INFINITY, Some(m.face)) {
                let normal = self.body.pseudonormal(&at);
                let off = p - at.point;
                let side = if off.dot(&normal) < 0.0 { -1.0 } else { 1.0 };
                // On the skin itself, the way out is the skin's normal.
                m.outward = if at.distance > 1e-6 { off * (side / at.distance) } else { normal };
                (m.face, m.distance, m.at, m.is_trapped) = (at.face, side * at.distance, p, false);
                self.lead_out(m, &(self.normals[a] + self.normals[b]));
            }
        });
    }

    /// Measures along the cloth's normal where the nearest skin looks the other way.
    fn lead_out(&self, m: &mut Match, normal: &Vec3) {
        let Some(normal) = normal.try_normalize(1e-12) else { return };
        if m.distance > -DEEP || m.outward.dot(&normal) > LOOKS_AWAY || (self.is_other)(m.ends[0], m.face) {
            return;
        }
        if let Some(hit) = self.body.cast_ray(&m.at, &normal, WAY_OUT_PER_DEPTH * -m.distance)
            && !(self.is_other)(m.ends[0], hit.face)
        {
            m.is_trapped = hit.distance > WAY_OUT;
            (m.distance, m.outward) = (-hit.distance, normal);
        }
    }
}
