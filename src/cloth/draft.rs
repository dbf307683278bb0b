//! Cloth that is fast enough to watch while a figure moves. Each vertex keeps to its side of the nearest face of the surfaces
//! beneath and above it, which are followed from frame to frame instead of searched: layers may cross.

use super::constraint_solver::ConstraintSolver;
use super::crossing_free::surfaces::Surfaces;
use super::shortened::shortened;
use super::skin_step::SkinStep;
use super::springs::{Spring, satisfy_all};
use crate::geometry::{Point, SurfaceIndex, TriMesh, Vec3, closest_on_triangle};
use rayon::prelude::*;
use std::ops::Range;

/// What is farther from a vertex in the bind pose begins without contact, metres.
const REACH: f64 = 0.1;
/// The gap that contact keeps where layers were farther apart in the bind pose, metres.
const GAP: f64 = 2e-3;
/// A gap that became too narrow is widened by at most this much per step, metres: contact must not throw cloth off.
const FASTEST_PUSH: f64 = 2e-3;
/// A vertex that is farther beside its face, as beyond a hem, is free, metres.
const BESIDE: f64 = 6e-3;
/// Faces by which a contact moves on per frame.
const HOPS: usize = 6;
/// Rounds of all constraints per step.
const ITERATIONS: usize = 4;

/// What the layers of cloth touch, and what holds them together.
pub(super) struct Draft {
    /// Of each layer of cloth; indices within the layer.
    springs: Vec<Vec<Spring>>,
    /// For each layer of cloth, what its vertices rest on: one per vertex.
    beneath: Vec<Vec<Contact>>,
    /// For each layer of cloth, the vertices of other layers whose nearest surface above is this one.
    covered: Vec<Vec<Contact>>,
    /// The face beyond each side of each face; its own where there is none.
    beyond: Vec<[u32; 3]>,
}

/// A vertex and the nearest face on one side of it.
#[derive(Clone, Copy)]
struct Contact {
    vertex: u32,
    face: u32,
    /// Of the corners in its closest point.
    weights: [f64; 3],
    /// The distance to keep, metres; infinitely below where there is no contact.
    gap: f64,
}

/// A plane that separates a vertex from its face within a step.
#[derive(Clone, Copy)]
struct Plane {
    /// Outward.
    normal: Vec3,
    /// Of the other side and the gap, along the normal, metres.
    height: f64,
    /// How far the other side moves.
    by: Vec3,
}

impl Draft {
    /// **Shapes** `meshes`: one per layer in the bind pose, the body first, as in `surfaces`.
    pub fn prepare(meshes: &[TriMesh], surfaces: &Surfaces, springs: Vec<Vec<Spring>>) -> Self {
        let mut faces_of_side = vec![[None; 2]; surfaces.edges.len()];
        for (f, sides) in surfaces.sides.iter().enumerate() {
            for &side in sides {
                let faces = &mut faces_of_side[side as usize];
                faces[usize::from(faces[0].is_some())] = Some(f as u32);
            }
        }
        let beyond = |(f, sides): (usize, &[u32; 3])| {
            sides.map(|side| {
                let mut faces = faces_of_side[side as usize].into_iter().flatten();
                faces.find(|&g| g != f as u32).unwrap_or(f as u32)
            })
        };
        let mut first_face = 0;
        let indices: Vec<(SurfaceIndex, u32)> = meshes
            .iter()
            .map(|mesh| {
                first_face += mesh.face_count() as u32;
                (SurfaceIndex::prepare(mesh), first_face - mesh.face_count() as u32)
            })
            .collect();
        let contacts_of = |range: &Range<usize>, others: &[(SurfaceIndex, u32)], outward: f64| -> Vec<Contact> {
            range.clone().into_par_iter().map(|v| Contact::nearest(v, &surfaces.rest[v], others, outward)).collect()
        };
        let (mut beneath, mut covered) = (Vec::new(), vec![Vec::new(); meshes.len()]);
        for (k, range) in surfaces.vertices.iter().enumerate() {
            if k > 0 {
                beneath.push(contacts_of(range, &indices[..k], 1.0));
            }
            for contact in contacts_of(range, &indices[k + 1..], -1.0).into_iter().filter(|contact| contact.gap > 0.0) {
                let above = indices.partition_point(|(_, first)| *first <= contact.face) - 1;
                covered[above].push(contact);
            }
        }
        covered.remove(0);
        Self { springs, beneath, covered, beyond: surfaces.sides.iter().enumerate().map(beyond).collect() }
    }

    /// Follows the nearest faces: once per frame.
    pub fn follow(&mut self, solver: &ConstraintSolver) {
        let Self { beneath, covered, beyond, .. } = self;
        let contacts = beneath.par_iter_mut().chain(covered.par_iter_mut()).flat_map(|layer| layer.par_iter_mut());
        contacts.filter(|contact| contact.gap.is_finite()).for_each(|contact| contact.follow(solver, beyond));
    }

    /// Prepares for steps of another length, in seconds.
    pub fn set_step(&mut self, secs: f64) {
        self.springs.iter_mut().flatten().for_each(|spring| spring.set_step(secs));
    }

    /// Moves on by one step.
    pub fn step(&self, solver: &mut ConstraintSolver, skin: &SkinStep<'_>) {
        let body = solver.surfaces.body_vertices();
        let free = |v: usize| match v < body {
            true => skin.places[v],
            false => {
                let by = skin.places[v] - skin.before[v];
                solver.at[v] + solver.free_motion(v, &by, &skin.places[v], &skin.carried[v], skin.secs)
            }
        };
        let free: Vec<Point> = (0..solver.at.len()).into_par_iter().map(free).collect();
        let mut to = free.clone();
        let mut layers = Vec::new();
        let mut rest = &mut to[body..];
        for (k, range) in solver.surfaces.cloth().iter().enumerate() {
            let (own, after) = rest.split_at_mut(range.len());
            layers.push((own, range.clone(), k));
            rest = after;
        }
        layers.into_par_iter().for_each(|(to, range, k)| self.settle(solver, &free, (to, range), k));
        solver.move_to(&to, skin);
    }

    /// Moves a layer to satisfy its springs and contacts; all others are where they move without neighbours.
    fn settle(&self, solver: &ConstraintSolver, free: &[Point], (to, range): (&mut [Point], Range<usize>), k: usize) {
        let plane = |contact: &Contact, outward: f64| contact.plane(solver, free, outward);
        let beneath: Vec<Option<Plane>> = self.beneath[k].iter().map(|contact| plane(contact, 1.0)).collect();
        let covered: Vec<(&Contact, Plane)> =
            self.covered[k].iter().filter_map(|contact| Some((contact, plane(contact, -1.0)?))).collect();
        let (at, inverse_mass) = (&solver.at[range.clone()], &solver.inverse_mass[range.clone()]);
        for round in 0..ITERATIONS {
            satisfy_all(&self.springs[k], to, inverse_mass, round % 2 == 1);
            for (contact, plane) in &covered {
                let corners = solver.surfaces.faces[contact.face as usize].map(|v| v as usize - range.start);
                let each = || corners.into_iter().zip(contact.weights);
                let depth = plane.height - each().map(|(v, w)| w * plane.normal.dot(&to[v].coords)).sum::<f64>();
                if depth > 0.0 {
                    let share = depth / contact.weights.iter().map(|w| w * w).sum::<f64>();
                    each().for_each(|(v, w)| to[v] += plane.normal * (w * share));
                }
            }
            for ((to, at), plane) in to.iter_mut().zip(at).zip(&beneath) {
                let Some(plane) = plane else { continue };
                let depth = plane.height - plane.normal.dot(&to.coords);
                if depth > 0.0 {
                    let slid = *to - at - plane.by;
                    let slid = slid - plane.normal * plane.normal.dot(&slid);
                    *to += plane.normal * depth - shortened(slid, solver.friction * depth);
                }
            }
        }
    }
}

impl Contact {
    /// The nearest of the layers' faces, each layer with its first; those beneath with `outward` 1, those above with −1.
    fn nearest(vertex: usize, p: &Point, layers: &[(SurfaceIndex, u32)], outward: f64) -> Self {
        let near = layers.iter().filter_map(|(index, first)| Some((index.closest_within(p, REACH)?, index, first)));
        let vertex = vertex as u32;
        match near.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance)) {
            None => Self { vertex, face: 0, weights: [0.0; 3], gap: f64::NEG_INFINITY },
            Some((near, index, first)) => {
                let height = outward * index.mesh().face_normal(near.face).dot(&(p - near.point));
                Self { vertex, face: near.face.index() as u32 + first, weights: near.barycentric, gap: height.min(GAP) }
            }
        }
    }

    fn follow(&mut self, solver: &ConstraintSolver, beyond: &[[u32; 3]]) {
        let p = solver.at[self.vertex as usize];
        let to = |face: u32| {
            let corners = solver.surfaces.faces[face as usize].map(|v| solver.at[v as usize]);
            let (weights, point) = closest_on_triangle(&p, &corners);
            ((p - point).norm_squared(), face, weights)
        };
        let mut best = to(self.face);
        for _ in 0..HOPS {
            // Only beyond the sides on which the closest point lies can it be nearer.
            let sides = (0..3).filter(|side| best.2[(side + 2) % 3] == 0.0);
            let next = sides.map(|side| beyond[best.1 as usize][side]).filter(|&f| f != best.1).map(to);
            match next.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|next| next.0 < best.0) {
                Some(next) => best = next,
                None => break,
            }
        }
        (_, self.face, self.weights) = best;
    }

    /// What the vertex stays above, or, with `outward` −1, what the face stays above.
    fn plane(&self, solver: &ConstraintSolver, free: &[Point], outward: f64) -> Option<Plane> {
        if !self.gap.is_finite() {
            return None;
        }
        let corners = solver.surfaces.faces[self.face as usize].map(|v| v as usize);
        let [a, b, c] = corners.map(|v| free[v]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        let mixed =
            |of: &dyn Fn(usize) -> Vec3| corners.iter().zip(self.weights).map(|(&v, w)| of(v) * w).sum::<Vec3>();
        let (point, vertex) = (mixed(&|v| free[v].coords), free[self.vertex as usize].coords);
        let across = (vertex - point) * outward;
        let height = normal.dot(&across);
        if (across - normal * height).norm() > BESIDE {
            return None;
        }
        let (other, by) = match outward > 0.0 {
            true => (point, mixed(&|v| free[v] - solver.at[v])),
            false => (vertex, free[self.vertex as usize] - solver.at[self.vertex as usize]),
        };
        Some(Plane { normal, height: normal.dot(&other) + self.gap.min(height + FASTEST_PUSH), by })
    }
}
