//! Cloth that settles: all layers at once, each pressing on the others.

use super::fabric::Fabric;
use super::solid::Solid;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, intersecting_pairs};
use rayon::prelude::*;

/// A garment as sewn: lengths at rest, and what is held.
pub(super) struct Cloth {
    /// Lengths at rest are those of this mesh.
    pub(super) rest: TriMesh,
    /// Held where it starts, as by an elastic waistband.
    pub(super) held: PerVertex<bool>,
    pub(super) fabric: Fabric,
}

/// Seconds a frame: contacts are looked up once in each; what falls freely for a second moves 30 cm in it, what settles
/// a millimetre.
const FRAME_SECS: f64 = 1.0 / 30.0;
/// Steps a frame; small steps converge better than many iterations (Macklin 2019).
const SUBSTEPS: usize = 20;
/// Share of velocity lost a step: cloth is watched settling, not swinging.
const DAMPING: f64 = 0.02;
/// Share of sliding that contact takes away a step.
const FRICTION: f64 = 0.4;
/// Cloth farther away than this meets nothing within a frame, metres.
const CONTACT_REACH: f64 = 0.03;
/// An outer layer is felt from farther, metres: a shirt to be tucked in starts outside of the trousers.
const INSIDE_REACH: f64 = 0.05;
/// Beyond a hem cloth is free: contact where the way to the surface is steeper to its normal than this cosine is none.
const BESIDE: f64 = 0.5;
/// Share of the way apart that a layer is pushed a step by another layer, the heavier the less: see [`yields`].
const LAYER_PUSH: f64 = 0.6;
/// Metres of air between skin and cloth, and between cloth and cloth, beside the thickness.
const AIR: [f64; 2] = [1.5e-3, 0.8e-3];
/// Gravity, m/s².
const GRAVITY: f64 = 9.81;

/// A distance that two vertices keep.
struct Spring {
    ends: [u32; 2],
    length: f64,
    /// Compliance over the square of the step, 1/kg.
    softness: f64,
}

/// A plane that a vertex stays on the outer side of.
#[derive(Clone, Copy)]
struct Contact {
    point: Point,
    normal: Vec3,
    gap: f64,
    /// Share of the depth that is mended a step.
    push: f64,
}

/// One layer while it settles.
struct Sheet<'a> {
    cloth: &'a Cloth,
    springs: Vec<Spring>,
    /// 1/kg; 0 where it is held.
    lightness: Vec<f64>,
    at: Vec<Point>,
    velocity: Vec<Vec3>,
}

/// Where layers are after `secs` of settling from `starts`, the innermost first, on a body that does not give.
///
/// The outermost observed surface is what the last layer becomes: it presses those below, and rests on them.
///
/// **Source** distances as compliant constraints, one iteration a small step (XPBD; Macklin 2016, 2019).
///
/// **Guarantees** the same with any number of threads; no layer is left inside the body or an inner layer.
pub(super) fn settle(cloths: &[&Cloth], starts: &[PerVertex<Point>], body: &Solid, secs: f64) -> Vec<TriMesh> {
    let starts = put_on(cloths, starts);
    let mut sheets: Vec<Sheet<'_>> =
        cloths.iter().zip(&starts).map(|(cloth, start)| Sheet::new(cloth, start)).collect();
    let solid = |sheet: &Sheet<'_>| Solid::prepare(&sheet.mesh());
    let mut solids: Vec<Solid> = if sheets.len() > 1 { sheets.par_iter().map(solid).collect() } else { Vec::new() };
    for _ in 0..(secs / FRAME_SECS).round() as usize {
        let fabrics: Vec<Fabric> = cloths.iter().map(|c| c.fabric).collect();
        sheets.par_iter_mut().enumerate().for_each(|(k, sheet)| {
            let contacts = contacts_of(&sheet.at, k, body, &solids, &fabrics);
            sheet.step(&contacts);
        });
        solids = solids.par_iter().zip(&sheets).map(|(solid, sheet)| solid.moved(&sheet.at)).collect();
    }
    cleared(sheets.into_iter().map(|s| (s.cloth, s.at)).collect(), body)
}

/// Each layer outside of those below it before anything moves: what is put on over a flared skirt starts beyond contact's
/// reach inside it, and would stay there. What is held at the waist goes the other way: the shirt is tucked in.
fn put_on(cloths: &[&Cloth], starts: &[PerVertex<Point>]) -> Vec<PerVertex<Point>> {
    /// Metres: a jacket's hem inside a skirt.
    const REACH: f64 = 0.09;
    let mut worn: Vec<PerVertex<Point>> = Vec::new();
    for (cloth, start) in cloths.iter().zip(starts) {
        let mut at = start.clone();
        if !cloth.held.0.contains(&true) {
            for (below, points) in cloths.iter().zip(&worn) {
                let solid = Solid::prepare(&below.rest.with_points(points.clone()));
                let gap = AIR[1] + cloth.fabric.thickness;
                let outside = at.0.par_iter().map(|p| match contact(p, &solid, REACH, false, gap, 1.0) {
                    Some(c) => p + c.normal * (c.gap - (p - c.point).dot(&c.normal)).max(0.0),
                    None => *p,
                });
                at = outside.collect::<Vec<_>>().into();
            }
        }
        worn.push(at);
    }
    worn
}

impl<'a> Sheet<'a> {
    fn new(cloth: &'a Cloth, start: &PerVertex<Point>) -> Self {
        let areas = cloth.rest.vertex_areas();
        let mass = |v: usize| (areas.0[v] * cloth.fabric.density).max(1e-6);
        let lightness = (0..start.len()).map(|v| if cloth.held.0[v] { 0.0 } else { 1.0 / mass(v) }).collect();
        Self {
            cloth,
            springs: springs_of(cloth),
            lightness,
            at: start.0.clone(),
            velocity: vec![Vec3::zeros(); start.len()],
        }
    }

    fn mesh(&self) -> TriMesh {
        self.cloth.rest.with_points(self.at.clone())
    }

    /// One frame.
    fn step(&mut self, contacts: &[Vec<Contact>]) {
        let h = FRAME_SECS / SUBSTEPS as f64;
        for _ in 0..SUBSTEPS {
            let before = self.at.clone();
            for (v, p) in self.at.iter_mut().enumerate() {
                if self.lightness[v] > 0.0 {
                    self.velocity[v].y -= GRAVITY * h;
                    *p += self.velocity[v] * h;
                }
            }
            for spring in &self.springs {
                pull(&mut self.at, spring, &self.lightness);
            }
            for (v, p) in self.at.iter_mut().enumerate() {
                if self.lightness[v] > 0.0 {
                    contacts[v].iter().for_each(|c| push_out(p, &before[v], c));
                }
            }
            for (v, p) in self.at.iter().enumerate() {
                self.velocity[v] = (p - before[v]) / h * (1.0 - DAMPING);
            }
        }
    }
}

fn springs_of(cloth: &Cloth) -> Vec<Spring> {
    /// Distance springs across an edge resist bending by their lever; with equal triangles of side `l` the spring of
    /// rigidity `B` has `12 B / l²`.
    const LEVER: f64 = 12.0;
    let adjacency = Adjacency::prepare(&cloth.rest);
    let points = cloth.rest.points();
    let h = FRAME_SECS / SUBSTEPS as f64;
    let side = cloth.rest.mean_edge_length().max(1e-4);
    let spring = |a: VertexId, b: VertexId, stiffness: f64| Spring {
        ends: [a.0, b.0],
        length: (points[a] - points[b]).norm(),
        softness: 1.0 / (stiffness * h * h),
    };
    let bending = LEVER * cloth.fabric.bending / (side * side);
    let along = adjacency.edges().iter().map(|&([a, b], _)| spring(a, b, cloth.fabric.stretch));
    let across = adjacency.edges().iter().filter_map(|&(edge, faces)| {
        let [Some(f), Some(g)] = faces else { return None };
        let opposite = |f| cloth.rest.faces()[f].into_iter().find(|v| !edge.contains(v));
        Some(spring(opposite(f)?, opposite(g)?, bending))
    });
    along.chain(across).collect()
}

fn pull(at: &mut [Point], spring: &Spring, lightness: &[f64]) {
    let [a, b] = spring.ends.map(|v| v as usize);
    let both = lightness[a] + lightness[b];
    let d = at[b] - at[a];
    let length = d.norm();
    if both == 0.0 || length < 1e-9 {
        return;
    }
    let correction = d * ((length - spring.length) / (length * (both + spring.softness)));
    at[a] += correction * lightness[a];
    at[b] -= correction * lightness[b];
}

fn push_out(p: &mut Point, before: &Point, contact: &Contact) {
    let depth = contact.gap - (*p - contact.point).dot(&contact.normal);
    if depth <= 0.0 {
        return;
    }
    *p += contact.normal * (depth * contact.push);
    let slid = *p - before;
    *p -= (slid - contact.normal * slid.dot(&contact.normal)) * FRICTION;
}

/// What layer `k` meets: the body, which is hard, the layers below and the layers above.
fn contacts_of(at: &[Point], k: usize, body: &Solid, solids: &[Solid], fabrics: &[Fabric]) -> Vec<Vec<Contact>> {
    at.par_iter()
        .enumerate()
        .map(|(v, p)| {
            let mut contacts = Vec::new();
            for (j, solid) in solids.iter().enumerate().filter(|(j, _)| *j != k) {
                let outer = j > k;
                let gap = AIR[1] + fabrics[j.max(k)].thickness;
                let reach = if outer { INSIDE_REACH } else { CONTACT_REACH };
                let found = contact(p, solid, reach, outer, gap, LAYER_PUSH * yields(&fabrics[k], &fabrics[j]));
                // What lies under another cloth faces the way that it does; the sleeve beside a vest does not.
                let own = solids[k].normal(VertexId(v as u32));
                contacts.extend(found.filter(|c| !outer || own.dot(&c.normal) < 0.0));
            }
            // The last word is the body's.
            contacts.extend(contact(p, body, CONTACT_REACH, false, AIR[0] + fabrics[k].thickness, 1.0));
            contacts
        })
        .collect()
}

/// How much a layer yields to another: 1 when both weigh the same, less for the heavier.
fn yields(own: &Fabric, other: &Fabric) -> f64 {
    (2.0 * other.density / (own.density + other.density)).min(1.0)
}

fn contact(p: &Point, surface: &Solid, reach: f64, inside: bool, gap: f64, push: f64) -> Option<Contact> {
    let (near, outward) = surface.closest(p, reach)?;
    let way = p - near.point;
    // Through an armhole the way is along the normal of its rim, and yet the sleeve is not under the vest.
    let beside = way.dot(&outward).abs() < BESIDE * near.distance || surface.ends_at(&near);
    if near.distance > 2.0 * gap && beside {
        return None;
    }
    let normal = if inside { -outward } else { outward };
    Some(Contact { point: near.point, normal, gap, push })
}

/// A point of cloth moved out of what lies below it.
pub(super) fn clear_of(p: &Point, below: &[&Solid], thickness: f64) -> Point {
    let mut q = *p;
    for solid in below {
        if let Some(c) = contact(&q, solid, CONTACT_REACH, false, AIR[0] + thickness, 1.0) {
            q += c.normal * (c.gap - (q - c.point).dot(&c.normal)).max(0.0);
        }
    }
    q
}

/// Each layer, from the inside, moved clear of the body and of those below it; what springs have pulled in since the
/// last look-up, and edges that cross though no vertex is inside.
fn cleared(layers: Vec<(&Cloth, Vec<Point>)>, body: &Solid) -> Vec<TriMesh> {
    /// Rounds of looking up and pushing.
    const ROUNDS: usize = 12;
    /// Metres that the corners of triangles which cross are pushed a round beyond contact.
    const NUDGE: f64 = 0.7e-3;
    let mut done: Vec<(Solid, Fabric)> = Vec::new();
    let mut meshes = Vec::new();
    for (cloth, mut at) in layers {
        for round in 0..ROUNDS {
            let moved: Vec<Point> = at
                .par_iter()
                .map(|p| {
                    let mut q = *p;
                    let inner = done.iter().map(|(solid, _)| (solid, AIR[1] + cloth.fabric.thickness));
                    for (solid, gap) in inner.chain([(body, AIR[0] + cloth.fabric.thickness)]) {
                        if let Some(c) = contact(&q, solid, CONTACT_REACH, false, gap, 1.0) {
                            let depth = c.gap - (q - c.point).dot(&c.normal);
                            q += c.normal * depth.max(0.0);
                        }
                    }
                    q
                })
                .collect();
            at = moved;
            if round < 2 {
                continue;
            }
            let mesh = cloth.rest.with_points(at.clone());
            let mut nudged = vec![false; at.len()];
            for solid in done.iter().map(|(solid, _)| solid).chain([body]) {
                for (face, _) in intersecting_pairs(&mesh, solid.mesh()) {
                    mesh.faces()[face].iter().for_each(|v| nudged[v.index()] = true);
                }
            }
            if !nudged.contains(&true) {
                break;
            }
            let normals = mesh.vertex_normals();
            for (v, p) in at.iter_mut().enumerate().filter(|(v, _)| nudged[*v]) {
                *p += normals.0[v] * NUDGE;
            }
        }
        let mesh = cloth.rest.with_points(at);
        done.push((Solid::prepare(&mesh), cloth.fabric));
        meshes.push(mesh);
    }
    meshes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studio::kind::GarmentKind;
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
    fn ball() -> Solid {
        let mut volume = Volume::covering(
            &crate::geometry::Aabb { min: Point::new(-0.15, -0.15, -0.15), max: Point::new(0.15, 0.15, 0.15) },
            0.03,
            0.02,
        );
        volume.fill(|p| (p.coords.norm() - 0.15) as f32);
        Solid::prepare(&volume.zero_surface())
    }

    fn cloth(kind: GarmentKind, y: f64) -> Cloth {
        let rest = square(24, y);
        Cloth { held: PerVertex::filled(false, rest.vertex_count()), fabric: kind.fabric(), rest }
    }

    #[test]
    fn a_cloth_over_a_ball_hangs_down_keeps_its_lengths_and_stays_outside() {
        let (shirt, ball) = (cloth(GarmentKind::Shirt, 0.16), ball());
        let drop = || settle(&[&shirt], &[shirt.rest.points().clone()], &ball, 0.7).remove(0);
        let fallen = drop();
        assert!(fallen.points().iter().all(|p| p.coords.norm() > 0.148), "outside");
        assert!(fallen.points().0[0].y < 0.05, "corners hang");
        assert!(fallen.points().iter().any(|p| p.y > 0.14), "and the middle lies on top");
        let stretch = fallen.mean_edge_length() / shirt.rest.mean_edge_length();
        assert!((0.93..1.04).contains(&stretch), "{stretch}");
        assert_eq!(fallen, drop(), "twice the same");
    }

    #[test]
    fn what_is_held_stays() {
        let mut shirt = cloth(GarmentKind::Shirt, 0.0);
        (0..24).for_each(|v| shirt.held.0[v] = true);
        let far_away = Solid::prepare(&square(2, -9.0));
        let hung = settle(&[&shirt], &[shirt.rest.points().clone()], &far_away, 0.5).remove(0);
        assert_eq!(hung.points().0[..24], shirt.rest.points().0[..24]);
        assert!(hung.points().0[24 * 23 + 5].y < -0.1);
    }

    #[test]
    fn of_two_layers_the_outer_lies_outside_and_neither_cuts_the_other() {
        let (inner, outer, ball) = (cloth(GarmentKind::Pullover, 0.17), cloth(GarmentKind::Coat, 0.18), ball());
        let starts = [inner.rest.points().clone(), outer.rest.points().clone()];
        let both = settle(&[&inner, &outer], &starts, &ball, 0.6);
        assert_eq!(intersecting_pairs(&both[1], &both[0]).len(), 0);
        let (above, below) = (Solid::prepare(&both[0]), both[1].points().iter());
        let inside =
            below.filter(|p| above.closest(p, 0.02).is_some_and(|(near, n)| (*p - near.point).dot(&n) < -1e-3));
        assert_eq!(inside.count(), 0);
    }
}
