//! Steps of mass–spring cloth on a figure, resting on planes of what is near: the paper's solver, without our guarantee.

use super::net::{MassSpring, runge_kutta};
use crate::cloth::contact::collider::Collider;
use crate::cloth::contact::planes::{ContactPlane, contacts_of};
use crate::cloth::fabric::Fabric;
use crate::cloth::skin_step::{GRAVITY, SkinStep};
use crate::geometry::{Point, TriMesh, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Longest Runge–Kutta step, seconds: a hundred per frame. Springs are softened to what it bears; at slivers, as scanned
/// garments have them, nothing is left of them.
const LONGEST_STEP: f64 = 1.0 / 3000.0;
/// Share of its fabric's stiffness that the median spring of a layer must keep. Even triangles of 15 mm keep nearly all; on the
/// demo, where half of the edges are shorter than 7 mm, arms came through sleeves.
const LEAST_MEDIAN: f64 = 0.5;
/// Angular frequency of contact times the length of a Runge–Kutta step: critically damped, so that it throws nothing off.
const CONTACT: f64 = 0.5;
/// Share of its sliding that cloth in contact loses, relative to the damping of contact.
const FRICTION: f64 = 0.1;

/// The layers of cloth of a figure as springs, and what they touch.
pub(in crate::cloth) struct MassSpringLayers {
    nets: Vec<MassSpring>,
    fabrics: Vec<Fabric>,
    body: Collider,
    layers: Vec<Collider>,
}

/// What moves, and what pulls it; one entry per vertex of the figure.
pub(in crate::cloth) struct Moving<'a> {
    pub at: &'a mut [Point],
    pub velocity: &'a mut [Vec3],
    /// Angular frequency of the pull to the skinned place, 1/s.
    pub frequency: &'a [f64],
    /// Share of its velocity relative to the skin that cloth loses, 1/s.
    pub damping: f64,
}

impl MassSpringLayers {
    /// **Requires** the body.
    ///
    /// **Shapes** `meshes` one per layer, the body first; `fabrics` one per layer but the body; `inverse_mass` one entry per
    /// vertex of all layers.
    pub fn prepare(meshes: &[TriMesh], fabrics: Vec<Fabric>, vertices: &[Range<usize>], inverse_mass: &[f64]) -> Self {
        let (body, cloth) = (&meshes[0], &meshes[1..]);
        let nets = cloth.iter().zip(&fabrics).zip(&vertices[1..]);
        let nets = nets
            .map(|((mesh, fabric), range)| MassSpring::of(mesh, fabric, &inverse_mass[range.clone()], LONGEST_STEP));
        let layers = cloth.iter().map(Collider::prepare).collect();
        Self { nets: nets.collect(), fabrics, body: Collider::prepare(body), layers }
    }

    /// The first layer of cloth whose triangles are too small for the steps, and what its median spring keeps of its fabric's
    /// stiffness.
    pub fn too_fine(&self) -> Option<(usize, f64)> {
        self.nets.iter().map(|net| net.median_share).enumerate().find(|(_, share)| *share < LEAST_MEDIAN)
    }

    /// Least share of its fabric's stiffness that a spring has.
    pub fn least_stiffness(&self) -> f64 {
        self.nets.iter().map(|net| net.least_share).fold(1.0, f64::min)
    }

    /// Moves on by one step of the skin.
    ///
    /// Cloth rests on planes of the surfaces that are near at the start of the step; they move as its skinned place does.
    pub fn step(&mut self, moving: Moving<'_>, vertices: &[Range<usize>], skin: &SkinStep<'_>) {
        let body = vertices[0].end;
        moving.at[..body].copy_from_slice(&skin.places[..body]);
        let contacts = self.contacts(moving.at, vertices);
        let (mut at, mut velocity) = (&mut moving.at[body..], &mut moving.velocity[body..]);
        let mut tasks = Vec::new();
        for ((net, range), contacts) in self.nets.iter().zip(&vertices[1..]).zip(&contacts) {
            let (own, after) = at.split_at_mut(range.len());
            let (own_velocity, velocity_after) = velocity.split_at_mut(range.len());
            tasks.push((net, range.clone(), contacts, own, own_velocity));
            (at, velocity) = (after, velocity_after);
        }
        let steps = (skin.secs / LONGEST_STEP).ceil().max(1.0);
        let secs = skin.secs / steps;
        let (frequency, damping) = (moving.frequency, moving.damping);
        let skinned = |v: usize| skin.places[v] - skin.before[v];
        tasks.into_par_iter().for_each(|(net, range, contacts, at, velocity)| {
            for step in 0..steps as usize {
                runge_kutta(at, velocity, secs, |at, velocity, time, out| {
                    let share = (step as f64 * secs + time) / skin.secs;
                    net.add_accelerations(at, velocity, out);
                    for (k, v) in range.clone().enumerate() {
                        // Above one per step the pull would be unstable.
                        let frequency = frequency[v].min(1.0 / secs);
                        let relative = velocity[k] - skinned(v) / skin.secs;
                        let place = skin.before[v] + skinned(v) * share;
                        out[k] += Vec3::new(0.0, -GRAVITY, 0.0) - skin.carried[v]
                            + (place - at[k]) * (frequency * frequency)
                            - relative * (damping + frequency);
                        let seen_from_skin = at[k] - skinned(v) * share;
                        out[k] += contacts[k]
                            .iter()
                            .map(|plane| support(plane, &seen_from_skin, &relative, secs))
                            .sum::<Vec3>();
                    }
                });
            }
            for (k, v) in range.enumerate() {
                // Nothing that overflows is carried on.
                let sound = at[k].iter().chain(velocity[k].iter()).all(|x| x.is_finite() && x.abs() < 1e3);
                if !sound {
                    (at[k], velocity[k]) = (skin.places[v], skinned(v) / skin.secs);
                }
            }
        });
        self.body = self.body.moved(&skin.places[..body]);
    }

    /// What each vertex of each layer rests on.
    fn contacts(&mut self, at: &[Point], vertices: &[Range<usize>]) -> Vec<Vec<Vec<ContactPlane>>> {
        let moved = self.layers.par_iter().zip(&vertices[1..]).map(|(layer, range)| layer.moved(&at[range.clone()]));
        self.layers = moved.collect();
        let of_layer = |(k, range): (usize, &Range<usize>)| {
            contacts_of(&at[range.clone()], k, &self.body, &self.layers, &self.fabrics)
        };
        vertices[1..].iter().enumerate().map(of_layer).collect()
    }
}

/// The acceleration by which a plane holds up what is too near, and slows it.
fn support(plane: &ContactPlane, at: &Point, velocity: &Vec3, secs: f64) -> Vec3 {
    let depth = plane.depth(at);
    if depth <= 0.0 {
        return Vec3::zeros();
    }
    let (frequency, normal) = (CONTACT / secs, plane.normal);
    let approach = normal * normal.dot(velocity);
    let sliding = velocity - approach;
    normal * (frequency * frequency * depth) - (approach + sliding * FRICTION) * (2.0 * frequency)
}
