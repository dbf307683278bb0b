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

/// Where the cloth is after `secs` of settling, from `start`.
///
/// **Source** springs as position constraints, small steps (Müller 2007; Macklin 2019).
pub(super) fn drape(cloth: &Cloth, start: &PerVertex<Point>, obstacles: &[Obstacle], secs: f64) -> TriMesh {
    let frames = (secs / FRAME_SECS).round() as usize;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studio::volume::Volume;

    /// A square cloth of `n × n` vertices, 2 cm apart, at height `y`.
    fn square(n: usize, y: f64) -> TriMesh {
        let at = |i: usize| 0.02 * (i as f64 - 0.5 * (n - 1) as f64);
        let points = (0..n * n).map(|i| Point::new(at(i % n), y, at(i / n))).collect();
        let mut faces = Vec::new();
        for j in 0..n - 1 {
            for i in 0..n - 1 {
                let [a, b, c, d] = [i + n * j, i + 1 + n * j, i + n * (j + 1), i + 1 + n * (j + 1)].map(|k| k as u32);
                faces.extend([[a, c, b], [b, c, d]]);
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    /// A ball of radius 0.15 m.
    fn ball() -> TriMesh {
        let mut volume = Volume::covering(
            &crate::geometry::Aabb { min: Point::new(-0.15, -0.15, -0.15), max: Point::new(0.15, 0.15, 0.15) },
            0.03,
            0.02,
        );
        volume.fill(|p| (p.coords.norm() - 0.15) as f32);
        volume.zero_surface()
    }

    #[test]
    fn a_cloth_over_a_ball_hangs_down_keeps_its_lengths_and_stays_outside() {
        let rest = square(24, 0.16);
        let cloth = Cloth { held: PerVertex::filled(false, rest.vertex_count()), bending: 0.1, rest };
        let solid = Solid::prepare(&ball());
        let obstacles = [Obstacle { surface: &solid, gap: 0.003, inside: false }];
        let fallen = drape(&cloth, cloth.rest.points(), &obstacles, 0.7);
        assert!(fallen.points().iter().all(|p| p.coords.norm() > 0.148), "outside");
        assert!(fallen.points().0[0].y < 0.05, "corners hang");
        assert!(fallen.points().iter().any(|p| p.y > 0.14), "and the middle lies on top");
        let stretch = fallen.mean_edge_length() / cloth.rest.mean_edge_length();
        assert!((0.93..1.04).contains(&stretch), "{stretch}");
        assert_eq!(fallen, drape(&cloth, cloth.rest.points(), &obstacles, 0.7), "twice the same");
        let free = drape(&cloth, cloth.rest.points(), &[], 0.7);
        assert!(free.points().iter().all(|p| p.y < -0.2), "without the ball it falls");
    }

    #[test]
    fn what_is_held_stays_and_what_is_pressed_stays_inside() {
        let rest = square(10, 0.0);
        let held: PerVertex<bool> = (0..rest.vertex_count()).map(|v| v < 10).collect();
        let cloth = Cloth { held, bending: 0.1, rest };
        let hung = drape(&cloth, cloth.rest.points(), &[], 0.5);
        assert_eq!(hung.points().0[..10], cloth.rest.points().0[..10]);
        assert!(hung.points().0[95].y < -0.1);
        let ceiling = Solid::prepare(&square(20, 0.01).flipped());
        let below = [Obstacle { surface: &ceiling, gap: 0.002, inside: false }];
        let raised = cloth.rest.map_points(|p| p + Vec3::new(0.0, 0.015, 0.0));
        let pressed = drape(&cloth, raised.points(), &below, 0.1);
        assert!(pressed.points().0[10..].iter().all(|p| p.y < 0.0085));
    }
}
