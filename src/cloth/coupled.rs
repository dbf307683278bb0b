//! The state of a simulation on a moving figure, and its step by constraints: physics and skinning blended within one solver,
//! so that the blend cannot make layers cross.

use super::cloth_params::ClothParams;
use super::crossing_free::near_pairs::{NearPair, Search};
use super::crossing_free::safe_motion::Step;
use super::crossing_free::surfaces::Surfaces;
use super::crossing_free::swept_tree::SweptTree;
use super::error::ClothError;
use super::known_fabric::fabric_named;
use super::layer::ClothLayer;
use super::mass_spring::step::{MassSpringLayers, Moving};
use super::mode::{ClothMode, ClothSolver};
use super::skin_step::{GRAVITY, SkinStep};
use super::springs::{Spring, springs_of};
use crate::body::{Figure, Layer, Pose, Skinning};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use nalgebra::Matrix3;
use rayon::prelude::*;

/// Greatest rotation of a joint per step, degrees: triangles of the demo are 1 to 2 cm wide and 1 mm apart.
const STEP_DEG: f64 = 3.0;
/// Steps per frame at 30 frames per second; the greatest number is reached at 36° per frame, faster than people move.
const STEPS: std::ops::RangeInclusive<f64> = 3.0..=12.0;
/// Iterations of the constraints per step.
const ITERATIONS: usize = 8;
/// Distance in metres from which contact acts, and the gap that it keeps where layers were farther apart at rest.
const REACH: f64 = 0.8e-3;
const GAP: f64 = 0.6e-3;
/// How far a displacement may differ from the expected one before its neighbourhood is searched again, metres, and the same
/// per metre that it moves relative to the skin.
const SLACK: f64 = 0.5e-3;
const SLACK_PER_METRE: f64 = 0.05;
/// Most that skinning pulls cloth and skin back to their places in a step, metres: where they cannot get there, as in an
/// armpit, they do not press harder and harder. At 90 steps per second cloth still comes back by 9 cm per second, skin by 36.
const PULL: f64 = 1e-3;
const BODY_PULL: f64 = 4e-3;
/// Pull of cloth that had to be corrected is halved, down to this share, and recovers by this factor per step.
const LEAST_EASE: f64 = 0.02;
const RECOVERY: f64 = 1.1;
/// A correction that counts as one, metres.
const CORRECTION: f64 = 2e-5;
/// Greatest correction by constraints within a step, metres: more is an error of the constraints.
const FARTHEST: f64 = 1e-2;
/// Greatest correction that is expected again in the next step, metres.
const EXPECTED: f64 = 3e-3;
/// Coefficient of friction. Cloth that is squeezed between arm and trunk by skinning would be dragged along by more.
const FRICTION: f64 = 0.1;
/// Inverse mass of a vertex of the body, relative to the typical one of cloth: it gives way only where cloth cannot.
const BODY_SHARE: f64 = 0.02;
/// Physics weights are taken as at least this, so that the frequency is finite.
const LEAST_WEIGHT: f64 = 0.01;
/// Physics without skinning holds cloth where its physics weight is below this, and at least this share of a layer's vertices.
const GRIPPED: f64 = 0.1;
const LEAST_GRIPPED: f64 = 0.05;
/// The fabric of layers that do not say theirs.
const UNKNOWN_FABRIC: &str = "cotton";

/// The simulation: positions, velocities, constraints.
pub(super) struct Simulation<'a> {
    figure: &'a Figure,
    skinning: Skinning,
    params: ClothParams,
    pub surfaces: Surfaces,
    pub tree: SweptTree,
    /// Springs of each layer of cloth; indices within the layer.
    springs: Vec<Vec<Spring>>,
    /// Instead of constraints.
    mass_spring: Option<MassSpringLayers>,
    /// 1/kg.
    inverse_mass: Vec<f64>,
    /// Angular frequency of the pull to the skinned place, 1/s.
    frequency: Vec<f64>,
    pub at: Vec<Point>,
    velocity: Vec<Vec3>,
    /// Share of the pull that is used.
    ease: Vec<f64>,
    /// What the constraints added to the displacement in the last step.
    correction: Vec<Vec3>,
    pub stopped_steps: usize,
}

impl<'a> Simulation<'a> {
    /// The figure in the bind pose.
    ///
    /// **Errors** an unknown fabric.
    pub fn prepare(
        figure: &'a Figure,
        skinning: Skinning,
        params: &ClothParams,
        (mode, solver): (ClothMode, ClothSolver),
    ) -> Result<Self, ClothError> {
        // What is exported is `f32`: the simulation starts from the same positions.
        let rounded = |mesh: &TriMesh| mesh.map_points(|p| p.map(|x| f64::from(x as f32)));
        let meshes: Vec<TriMesh> = figure.layers.iter().map(|layer| rounded(&layer.mesh)).collect();
        let surfaces = Surfaces::of(&meshes.iter().collect::<Vec<_>>());
        let body = surfaces.body_vertices();
        let (mut springs, mut fabrics, mut inverse_mass) = (Vec::new(), Vec::new(), vec![0.0; surfaces.rest.len()]);
        for (k, (layer, mesh)) in figure.layers.iter().zip(&meshes).enumerate().skip(1) {
            let fabric = fabric_named(layer.fabric.as_deref().unwrap_or(UNKNOWN_FABRIC))?;
            let areas = mesh.vertex_areas();
            for (v, area) in surfaces.vertices[k].clone().zip(areas.iter()) {
                inverse_mass[v] = 1.0 / (area * fabric.density).max(1e-6);
            }
            let pinned = PerVertex::filled(false, mesh.vertex_count());
            springs.push(springs_of(&ClothLayer { rest: mesh.clone(), pinned, fabric }, 1.0));
            fabrics.push(fabric);
        }
        let mass_spring = match solver {
            ClothSolver::Constraints => None,
            ClothSolver::MassSpring => MassSpringLayers::prepare(&meshes, fabrics, &surfaces.vertices, &inverse_mass),
        };
        let mut masses = inverse_mass[body..].to_vec();
        masses.sort_by(f64::total_cmp);
        let typical = masses.get(masses.len() / 2).copied().unwrap_or(1.0);
        inverse_mass[..body].fill(typical * BODY_SHARE);
        let frequency = figure.layers.iter().flat_map(|layer| frequencies(layer, params, mode)).collect();
        let center =
            |f: &[u32; 3]| Point::from(f.iter().map(|&v| surfaces.rest[v as usize].coords).sum::<Vec3>() / 3.0);
        let centers: Vec<Point> = surfaces.faces.iter().map(center).collect();
        let count = surfaces.rest.len();
        Ok(Self {
            figure,
            skinning,
            params: params.clone(),
            tree: SweptTree::prepare(&centers),
            springs,
            mass_spring,
            inverse_mass,
            frequency,
            at: surfaces.rest.clone(),
            velocity: vec![Vec3::zeros(); count],
            ease: vec![1.0; count],
            correction: vec![Vec3::zeros(); count],
            stopped_steps: 0,
            surfaces,
        })
    }

    /// The skinned place of every vertex, and gravity as its skin would carry it along: turned by the skin from the bind
    /// pose.
    pub fn places(&self, pose: &Pose) -> (Vec<Point>, Vec<Vec3>) {
        let skeleton = &self.figure.skeleton;
        let turns: Vec<Matrix3<f64>> = skeleton
            .world_from_bind(pose)
            .iter()
            .map(|world_from_bind| world_from_bind.rotation.to_rotation_matrix().into_inner())
            .collect();
        let down = Vec3::new(0.0, -GRAVITY, 0.0);
        let (mut places, mut carried) = (Vec::new(), Vec::new());
        for layer in &self.figure.layers {
            places.extend(self.skinning.skin(layer.mesh.points(), &layer.weights, skeleton, pose).0);
            let turned = |row: &crate::body::SkinRow| row.iter().map(|&(j, w)| turns[j.index()] * down * w).sum();
            carried.extend(layer.weights.rows().iter().map(turned).collect::<Vec<Vec3>>());
        }
        (places, carried)
    }

    /// Least share of its fabric's stiffness that a spring has.
    pub fn least_stiffness(&self) -> f64 {
        self.mass_spring.as_ref().map_or(1.0, MassSpringLayers::least_stiffness)
    }

    /// Moves on by one frame.
    pub fn frame(&mut self, from: &Pose, to: &Pose, fps: f64) {
        let rotations = from.rotations.iter().zip(&to.rotations);
        let turned = rotations.map(|(a, b)| a.angle_to(b).to_degrees()).fold(0.0, f64::max);
        let steps = (turned / STEP_DEG).ceil().max((STEPS.start() * 30.0 / fps).ceil()).clamp(1.0, *STEPS.end());
        let step_secs = 1.0 / (fps * steps);
        self.springs.iter_mut().flatten().for_each(|spring| spring.set_step(step_secs));
        let mut before = self.places(from).0;
        for step in 1..=steps as usize {
            let (places, carried) = self.places(&from.toward(to, step as f64 / steps));
            let skin = SkinStep { before: &before, places: &places, carried: &carried, secs: step_secs };
            match &mut self.mass_spring {
                None => self.step(&skin),
                Some(layers) => {
                    let (at, velocity, frequency) = (&mut self.at, &mut self.velocity, &self.frequency);
                    let moving = Moving { at, velocity, frequency, damping: self.params.damping };
                    layers.step(moving, &self.surfaces.vertices, &skin);
                }
            }
            before = places;
        }
    }

    /// Moves on by one step, by constraints.
    fn step(&mut self, skin: &SkinStep<'_>) {
        let (count, SkinStep { before, places, carried, secs: step_secs }) = (self.at.len(), *skin);
        let free: Vec<Vec3> = (0..count)
            .into_par_iter()
            .map(|v| self.free_motion(v, &(places[v] - before[v]), &places[v], &carried[v], step_secs))
            .collect();
        let mut expected: Vec<Vec3> = free.iter().zip(&self.correction).map(|(free, added)| free + added).collect();
        let relative = |v: usize| (expected[v] - (places[v] - before[v])).norm();
        let mut slack: Vec<f64> = (0..count).map(|v| SLACK + SLACK_PER_METRE * relative(v)).collect();
        let search = Search {
            surfaces: &self.surfaces,
            tree: &self.tree,
            at: &self.at,
            by: &expected,
            slack: &slack,
            reach: REACH,
            gap: GAP,
        };
        let mut pairs = search.all();
        let mut by = self.solved(&free, &pairs);
        let solved = by.clone();
        let step = Step { surfaces: &self.surfaces, tree: &self.tree, at: &self.at, gap: GAP };
        let corrections = step.make_safe(&mut pairs, &mut by, &mut expected, &mut slack);
        self.stopped_steps += usize::from(corrections.stopped);
        for v in 0..count {
            let corrected = (by[v] - solved[v]).norm() > CORRECTION;
            self.ease[v] =
                if corrected { (0.5 * self.ease[v]).max(LEAST_EASE) } else { (RECOVERY * self.ease[v]).min(1.0) };
            self.correction[v] = shortened(by[v] - free[v], EXPECTED);
            self.velocity[v] = by[v] / step_secs;
            self.at[v] += by[v];
        }
    }

    /// The displacement of a vertex without its neighbours: skin follows its place; cloth keeps its velocity, falls, and is
    /// pulled to its place.
    fn free_motion(&self, v: usize, skinned: &Vec3, place: &Point, carried: &Vec3, step_secs: f64) -> Vec3 {
        let offset = place - (self.at[v] + skinned);
        if v < self.surfaces.body_vertices() {
            return skinned + shortened(offset, BODY_PULL);
        }
        let squared = (self.frequency[v] * step_secs).powi(2);
        // An implicit step of the pull also damps the motion relative to the skin.
        let relative =
            (self.velocity[v] * step_secs - skinned) * ((-self.params.damping * step_secs).exp() / (1.0 + squared));
        let pull = shortened((offset - relative) * (squared / (1.0 + squared)), PULL * self.ease[v]);
        let weight = (Vec3::new(0.0, -GRAVITY, 0.0) - carried) * (step_secs * step_secs / (1.0 + squared));
        skinned + relative + pull + weight
    }

    /// The displacements after stretch, bending and contact.
    fn solved(&self, free: &[Vec3], pairs: &[NearPair]) -> Vec<Vec3> {
        let body = self.surfaces.body_vertices();
        let mut to: Vec<Point> = self.at.iter().zip(free).map(|(at, by)| at + by).collect();
        // Skin alone needs no contact: where it folds, the correction of displacements keeps it apart.
        let of_cloth = |pair: &&NearPair| pair.vertices.iter().any(|&v| v as usize >= body);
        let contacts: Vec<&NearPair> = pairs.iter().filter(of_cloth).collect();
        for round in 0..ITERATIONS {
            self.satisfy_springs(&mut to, round % 2 == 1);
            contacts.iter().for_each(|contact| self.push_apart(contact, &mut to));
            contacts.iter().rev().for_each(|contact| self.push_apart(contact, &mut to));
        }
        let moved = |v: usize| {
            let added = to[v] - self.at[v] - free[v];
            let sound = added.iter().all(|x| x.is_finite());
            free[v] + if sound { shortened(added, FARTHEST) } else { Vec3::zeros() }
        };
        (0..to.len()).map(moved).collect()
    }

    /// One round of the springs, the layers at once.
    fn satisfy_springs(&self, to: &mut [Point], backwards: bool) {
        let mut layers = Vec::new();
        let mut rest = &mut to[self.surfaces.body_vertices()..];
        for (range, springs) in self.surfaces.vertices[1..].iter().zip(&self.springs) {
            let (own, after) = rest.split_at_mut(range.len());
            layers.push((own, &self.inverse_mass[range.clone()], springs));
            rest = after;
        }
        layers.into_par_iter().for_each(|(at, inverse_mass, springs)| {
            let satisfy = |spring: &Spring, at: &mut [Point]| spring.satisfy(at, inverse_mass);
            if backwards {
                springs.iter().rev().for_each(|spring| satisfy(spring, at));
            } else {
                springs.iter().for_each(|spring| satisfy(spring, at));
            }
        });
    }

    /// Moves the vertices of a pair apart to its gap, the lighter by more, and slows their sliding.
    fn push_apart(&self, pair: &NearPair, to: &mut [Point]) {
        let vertices = pair.vertices.map(|v| v as usize);
        let weights = pair.weights.map(f64::from);
        let each = || vertices.iter().copied().zip(weights);
        let distance: f64 = each().map(|(v, w)| w * pair.normal.dot(&to[v].coords)).sum();
        let depth = f64::from(pair.gap) - distance;
        if depth <= 0.0 {
            return;
        }
        let denominator: f64 = each().map(|(v, w)| w * w * self.inverse_mass[v]).sum();
        if denominator <= 0.0 {
            return;
        }
        let slid: Vec3 = each().map(|(v, w)| (to[v] - self.at[v]) * w).sum();
        let slid = shortened(slid - pair.normal * pair.normal.dot(&slid), FRICTION * depth);
        for (v, w) in each() {
            to[v] += (pair.normal * depth - slid) * (w * self.inverse_mass[v] / denominator);
        }
    }
}

/// Angular frequency of the pull of each vertex of a layer to its skinned place, 1/s.
fn frequencies(layer: &Layer, params: &ClothParams, mode: ClothMode) -> Vec<f64> {
    let weight = |v: usize| layer.physics.as_ref().map_or(0.0, |physics| physics.0[v]);
    let grip = |weight: f64| {
        let weight = weight.clamp(LEAST_WEIGHT, 0.5);
        params.grip_hz * (0.5 - weight) / weight
    };
    let weights: Vec<f64> = (0..layer.mesh.vertex_count()).map(weight).collect();
    let in_hz: Vec<f64> = match mode {
        ClothMode::Skinned | ClothMode::Coupled => weights.iter().map(|&w| params.swing_hz + grip(w)).collect(),
        // The grip fades out where the weight reaches the bound, so that cloth has no crease there.
        ClothMode::Physics | ClothMode::Blended => {
            let mut sorted = weights.clone();
            sorted.sort_by(f64::total_cmp);
            let few = sorted.get((LEAST_GRIPPED * sorted.len() as f64) as usize).copied().unwrap_or_default();
            let bound = grip(few.max(GRIPPED));
            weights.iter().map(|&w| (grip(w) - bound).max(0.0)).collect()
        }
    };
    in_hz.into_iter().map(|hz| std::f64::consts::TAU * hz).collect()
}

/// `v`, or shorter in the same direction.
pub(super) fn shortened(v: Vec3, most: f64) -> Vec3 {
    let length = v.norm();
    if length > most { v * (most / length) } else { v }
}
