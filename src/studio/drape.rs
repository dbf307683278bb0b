//! Cloth that settles: springs, gravity, contact.

use super::solid::Solid;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// A garment as sewn: lengths at rest, and what is held.
pub(super) struct Cloth {
    /// Lengths at rest are those of this mesh.
    pub(super) rest: TriMesh,
    /// Held where it starts, as by an elastic waistband.
    pub(super) held: PerVertex<bool>,
    /// How much bending springs back, 0–1 of an edge's stiffness: 0.02 silk, 0.1 jersey, 0.4 denim.
    pub(super) bending: f64,
}

/// What the cloth may not enter.
pub(super) struct Obstacle<'a> {
    pub(super) surface: &'a Solid,
    /// Metres that the cloth keeps from it.
    pub(super) gap: f64,
    /// Stay inside it instead of outside.
    pub(super) inside: bool,
}

/// Seconds a frame: contacts are looked up once in each.
const FRAME_SECS: f64 = 1.0 / 60.0;
/// Steps a frame; small steps converge better than many iterations (Macklin 2019).
const SUBSTEPS: usize = 10;
/// Share of velocity lost a step: cloth is watched settling, not swinging.
const DAMPING: f64 = 0.02;
/// Share of sliding that contact takes away a step.
const FRICTION: f64 = 0.4;
/// Cloth farther away than this meets nothing within a frame, metres.
const CONTACT_REACH: f64 = 0.03;
/// Obstacles that cloth must stay inside of are felt from farther, metres: it starts outside.
const INSIDE_REACH: f64 = 0.05;
/// Gravity, m/s².
const GRAVITY: f64 = 9.81;

/// A spring between two vertices.
struct Spring {
    ends: [u32; 2],
    length: f64,
    /// Share of the error mended in one step.
    stiffness: f64,
}

/// A plane that a vertex stays on the outer side of.
#[derive(Clone, Copy)]
struct Contact {
    point: Point,
    normal: Vec3,
    gap: f64,
}

/// Where the cloth comes to rest after `frames`, from `start`.
pub(super) fn drape(cloth: &Cloth, start: &PerVertex<Point>, obstacles: &[Obstacle], frames: usize) -> TriMesh {
    let springs = springs_of(cloth);
    let mut at = start.0.clone();
    let mut velocity = vec![Vec3::zeros(); at.len()];
    let h = FRAME_SECS / SUBSTEPS as f64;
    for _ in 0..frames {
        let contacts = find_contacts(&at, obstacles);
        for _ in 0..SUBSTEPS {
            let before = at.clone();
            for (v, p) in at.iter_mut().enumerate() {
                if !cloth.held.0[v] {
                    velocity[v].y -= GRAVITY * h;
                    *p += velocity[v] * h;
                }
            }
            for spring in &springs {
                pull(&mut at, spring, &cloth.held);
            }
            for (v, p) in at.iter_mut().enumerate() {
                if !cloth.held.0[v] {
                    contacts[v].iter().for_each(|c| push_out(p, &before[v], c));
                }
            }
            for (v, p) in at.iter().enumerate() {
                velocity[v] = (p - before[v]) / h * (1.0 - DAMPING);
            }
        }
    }
    // What springs have pulled back in since the last look-up.
    for _ in 0..3 {
        let contacts = find_contacts(&at, obstacles);
        for (v, p) in at.iter_mut().enumerate() {
            let before = *p;
            contacts[v].iter().for_each(|c| push_out(p, &before, c));
        }
    }
    cloth.rest.with_points(at)
}

fn springs_of(cloth: &Cloth) -> Vec<Spring> {
    let adjacency = Adjacency::prepare(&cloth.rest);
    let points = cloth.rest.points();
    let spring = |a: VertexId, b: VertexId, stiffness: f64| Spring {
        ends: [a.0, b.0],
        length: (points[a] - points[b]).norm(),
        stiffness,
    };
    let along = adjacency.edges().iter().map(|&([a, b], _)| spring(a, b, 0.9));
    let across = adjacency.edges().iter().filter_map(|&(edge, faces)| {
        let [Some(f), Some(g)] = faces else { return None };
        let opposite = |f| cloth.rest.faces()[f].into_iter().find(|v| !edge.contains(v));
        Some(spring(opposite(f)?, opposite(g)?, cloth.bending))
    });
    along.chain(across).collect()
}

fn pull(at: &mut [Point], spring: &Spring, held: &PerVertex<bool>) {
    let [a, b] = spring.ends.map(|v| v as usize);
    let (mobile_a, mobile_b) = (f64::from(u8::from(!held.0[a])), f64::from(u8::from(!held.0[b])));
    let mobile = mobile_a + mobile_b;
    let d = at[b] - at[a];
    let length = d.norm();
    if mobile == 0.0 || length < 1e-9 {
        return;
    }
    let correction = d * (spring.stiffness * (length - spring.length) / (length * mobile));
    at[a] += correction * mobile_a;
    at[b] -= correction * mobile_b;
}

fn push_out(p: &mut Point, before: &Point, contact: &Contact) {
    let depth = contact.gap - (*p - contact.point).dot(&contact.normal);
    if depth <= 0.0 {
        return;
    }
    *p += contact.normal * depth;
    let slid = *p - before;
    *p -= (slid - contact.normal * slid.dot(&contact.normal)) * FRICTION;
}

fn find_contacts(at: &[Point], obstacles: &[Obstacle]) -> Vec<Vec<Contact>> {
    at.par_iter()
        .map(|p| {
            obstacles
                .iter()
                .filter_map(|o| {
                    let reach = if o.inside { INSIDE_REACH } else { CONTACT_REACH };
                    let (near, outward) = o.surface.closest(p, reach)?;
                    let normal = if o.inside { -outward } else { outward };
                    Some(Contact { point: near.point, normal, gap: o.gap })
                })
                .collect()
        })
        .collect()
}
