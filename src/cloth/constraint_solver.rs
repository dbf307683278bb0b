//! Constraints that move all surfaces by a step: springs, contact, and a pull to places, corrected until nothing crosses.

use super::crossing_free::near_pairs::{NearPair, Search};
use super::crossing_free::safe_motion::Step;
use super::crossing_free::surfaces::Surfaces;
use super::crossing_free::swept_tree::SweptTree;
use super::elastic::Elastic;
use super::shortened::shortened;
use super::skin_step::{GRAVITY, SkinStep};
use super::springs::{Spring, satisfy_all};
use crate::geometry::{Point, Vec3};
use crate::numerics::NumericsError;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Distance in metres from which contact acts, and the gap that it keeps where layers were farther apart at rest.
const REACH: f64 = 0.8e-3;
const GAP: f64 = 0.6e-3;
/// How far a displacement may differ from the expected one before its neighbourhood is searched again, metres, and the same
/// per metre that it moves relative to the skin.
const SLACK: f64 = 0.3e-3;
const SLACK_PER_METRE: f64 = 0.05;
/// Most that skinning pulls cloth and skin back to their places in a step, metres: where they cannot get there, as in an
/// armpit, they do not press harder and harder. At 90 steps per second cloth still comes back by 9 cm per second, skin by 36.
const PULL: f64 = 1e-3;
const BODY_PULL: f64 = 4e-3;
/// In longer steps skinning holds at least a little more than the weight of cloth, m/s².
const LEAST_PULL: f64 = 11.0;
/// Pull of cloth that had to be corrected is halved, down to this share, and recovers by this factor per step.
const LEAST_EASE: f64 = 0.02;
const RECOVERY: f64 = 1.1;
/// A correction that counts as one, metres.
const CORRECTION: f64 = 2e-5;
/// Greatest correction by constraints within a step, metres: more is an error of the constraints.
const FARTHEST: f64 = 1e-2;
/// Rounds of the balance of forces per step.
const BALANCE: usize = 3;
/// Pairs that are farther apart than their gap by this much at the start of a round have no contact in it, metres.
const CLEAR: f64 = 0.2e-3;
/// Shares of contact that a vertex has as a corner of what touches add up to at least this where it lies on something.
const LIES_ON: f64 = 0.2;
/// Cloth this far from its skin is an error of the constraints, metres.
const FLOWN: f64 = 5.0;
/// Greatest correction that is expected again in the next step, metres.
const EXPECTED: f64 = 3e-3;

/// Inverse mass of a vertex of the body, relative to the typical one of cloth: it gives way only where cloth cannot. With 0.02, skin
/// gave way by 15 mm in two sleeves (the walk of a woman in blouse and coat), and by 6 mm between arm and trunk in a pullover.
const BODY_SHARE: f64 = 0.002;

/// What holds each layer of cloth together: stretch and bending.
pub(super) enum Forces {
    /// Distance constraints; indices within the layer.
    Springs(Vec<Vec<Spring>>),
    /// A balance of all forces before the constraints.
    Balanced(Vec<Elastic>),
}

/// Surfaces in motion: positions, velocities, constraints.
pub(super) struct ConstraintSolver {
    pub surfaces: Surfaces,
    pub tree: SweptTree,
    forces: Forces,
    /// 1/kg.
    pub inverse_mass: Vec<f64>,
    /// Angular frequency of the pull to the place of each vertex, 1/s.
    pub frequency: Vec<f64>,
    /// Share of its velocity relative to the skin that cloth loses per second.
    pub damping: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Rounds of all constraints per step.
    pub iterations: usize,
    pub at: Vec<Point>,
    pub velocity: Vec<Vec3>,
    memory: StepMemory,
    /// Time spent on forces, search, contact and correction, over all steps.
    pub timings: [Duration; 4],
}

/// What one step leaves to the next beside positions and velocities.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct StepMemory {
    /// Share of the pull that is used, by vertex.
    ease: Vec<f64>,
    /// What the constraints added to the displacement in the last step, by vertex.
    correction: Vec<Vec3>,
    /// See [`ConstraintSolver::support`], by vertex.
    support: Vec<Vec3>,
    stopped_steps: usize,
}

/// All that a simulation needs to resume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SolverState {
    at: Vec<Point>,
    velocity: Vec<Vec3>,
    memory: StepMemory,
}

impl ConstraintSolver {
    /// Surfaces where they are at rest.
    pub fn new(
        surfaces: Surfaces,
        forces: Forces,
        mut inverse_mass: Vec<f64>,
        frequency: Vec<f64>,
        (friction, iterations): (f64, usize),
    ) -> Self {
        let body = surfaces.body_vertices();
        let mut masses = inverse_mass[body..].to_vec();
        masses.sort_by(f64::total_cmp);
        let typical = masses.get(masses.len() / 2).copied().unwrap_or(1.0);
        inverse_mass[..body].fill(typical * BODY_SHARE);
        let center =
            |f: &[u32; 3]| Point::from(f.iter().map(|&v| surfaces.rest[v as usize].coords).sum::<Vec3>() / 3.0);
        let centers: Vec<Point> = surfaces.faces.iter().map(center).collect();
        let count = surfaces.rest.len();
        let none = vec![Vec3::zeros(); count];
        Self {
            tree: SweptTree::prepare(&centers),
            forces,
            inverse_mass,
            frequency,
            damping: 0.0,
            friction,
            iterations,
            at: surfaces.rest.clone(),
            velocity: none.clone(),
            memory: StepMemory { ease: vec![1.0; count], correction: none.clone(), support: none, stopped_steps: 0 },
            timings: [Duration::ZERO; 4],
            surfaces,
        }
    }

    pub fn state(&self) -> SolverState {
        SolverState { at: self.at.clone(), velocity: self.velocity.clone(), memory: self.memory.clone() }
    }

    /// Resumes from a state of the same surfaces.
    pub fn set_state(&mut self, state: SolverState) {
        SolverState { at: self.at, velocity: self.velocity, memory: self.memory } = state;
    }

    /// Steps in which everything had to stop.
    pub fn stopped_steps(&self) -> usize {
        self.memory.stopped_steps
    }

    /// Prepares for steps of another length, in seconds.
    pub fn set_step(&mut self, secs: f64) {
        match &mut self.forces {
            Forces::Springs(layers) => layers.iter_mut().flatten().for_each(|spring| spring.set_step(secs)),
            Forces::Balanced(layers) => layers.iter_mut().for_each(|elastic| elastic.set_step(secs)),
        }
    }

    /// Moves on by one step.
    ///
    /// **Errors** layers whose forces cannot be computed.
    pub fn step(&mut self, skin: &SkinStep<'_>) -> Result<(), NumericsError> {
        let (count, SkinStep { before, places, carried, secs: step_secs }) = (self.at.len(), *skin);
        let free: Vec<Vec3> = (0..count)
            .into_par_iter()
            .map(|v| self.free_motion(v, &(places[v] - before[v]), &places[v], &carried[v], step_secs))
            .collect();
        let mut to: Vec<Point> = self.at.iter().zip(&free).map(|(at, by)| at + by).collect();
        let mut laps = vec![Instant::now()];
        let borne = self.balance(&mut to, step_secs)?;
        laps.push(Instant::now());
        let balanced: Vec<Vec3> = to.iter().zip(&self.at).map(|(to, at)| to - at).collect();
        let mut expected: Vec<Vec3> =
            balanced.iter().zip(&self.memory.correction).map(|(by, added)| by + added).collect();
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
        laps.push(Instant::now());
        let mut by = self.solved(&free, &pairs, to, borne, step_secs);
        self.hold_still(&mut by, skin);
        laps.push(Instant::now());
        let solved = by.clone();
        let step = Step { surfaces: &self.surfaces, tree: &self.tree, at: &self.at, gap: GAP };
        let corrections = step.make_safe(&mut pairs, &mut by, &mut expected, &mut slack);
        laps.push(Instant::now());
        self.timings.iter_mut().zip(laps.windows(2)).for_each(|(sum, lap)| *sum += lap[1] - lap[0]);
        let StepMemory { ease, correction, stopped_steps, .. } = &mut self.memory;
        *stopped_steps += usize::from(corrections.stopped);
        for v in 0..count {
            let corrected = (by[v] - solved[v]).norm() > CORRECTION;
            ease[v] = if corrected { (0.5 * ease[v]).max(LEAST_EASE) } else { (RECOVERY * ease[v]).min(1.0) };
            correction[v] = shortened(by[v] - balanced[v], EXPECTED);
            self.velocity[v] = by[v] / step_secs;
            self.at[v] += by[v];
        }
        if let Forces::Balanced(layers) = &self.forces {
            self.memory.support = self.support(layers, &pairs);
        }
        Ok(())
    }

    /// Away from what each vertex lies on, skin or a layer below it, as long as [`Elastic::bearing`] says; zero where it lies on nothing.
    fn support(&self, layers: &[Elastic], pairs: &[NearPair]) -> Vec<Vec3> {
        let mut support = vec![Vec3::zeros(); self.at.len()];
        let layer_of = |v: u32| self.surfaces.vertices.partition_point(|range| range.end <= v as usize);
        for pair in pairs {
            let split = usize::from(pair.split);
            let [first, second] = [0, split].map(|k| layer_of(pair.vertices[k]));
            if first == second || depth_of(pair, &self.at) < -CLEAR {
                continue;
            }
            for k in if first > second { 0..split } else { split..4 } {
                support[pair.vertices[k] as usize] += pair.normal * f64::from(pair.weights[k]);
            }
        }
        for (range, elastic) in self.surfaces.cloth().iter().zip(layers) {
            let each = support[range.clone()].iter_mut().zip(elastic.bearing(&self.at[range.clone()]));
            each.for_each(|(support, bears)| *support = support.try_normalize(LIES_ON).unwrap_or_default() * bears);
        }
        support
    }

    /// The displacement of a vertex without its neighbours: skin follows its place; cloth keeps its velocity, falls, and is
    /// pulled to its place.
    pub fn free_motion(&self, v: usize, skinned: &Vec3, place: &Point, carried: &Vec3, step_secs: f64) -> Vec3 {
        let offset = place - (self.at[v] + skinned);
        if v < self.surfaces.body_vertices() {
            return skinned + shortened(offset, BODY_PULL);
        }
        let squared = (self.frequency[v] * step_secs).powi(2);
        // An implicit step of the pull also damps the motion relative to the skin.
        let relative = (self.velocity[v] * step_secs - skinned) * ((-self.damping * step_secs).exp() / (1.0 + squared));
        let most = PULL.max(LEAST_PULL * step_secs * step_secs) * self.memory.ease[v];
        let pull = shortened((offset - relative) * (squared / (1.0 + squared)), most);
        let weight = (Vec3::new(0.0, -GRAVITY, 0.0) - carried) * (step_secs * step_secs / (1.0 + squared));
        skinned + relative + pull + weight
    }

    /// Ends a step with everything at `to`; what is not finite, or flew away, returns to its skin.
    pub fn move_to(&mut self, to: &[Point], skin: &SkinStep<'_>) {
        for (v, to) in to.iter().enumerate() {
            let to = if (to - skin.places[v]).norm() < FLOWN { *to } else { skin.places[v] };
            self.velocity[v] = (to - self.at[v]) / skin.secs;
            self.at[v] = to;
        }
    }

    /// The displacements after stretch, bending and contact.
    fn solved(
        &self,
        free: &[Vec3],
        pairs: &[NearPair],
        mut to: Vec<Point>,
        mut borne: Vec<Vec<f64>>,
        secs: f64,
    ) -> Vec<Vec3> {
        let body = self.surfaces.body_vertices();
        // Skin alone needs no contact: where it folds, the correction of displacements keeps it apart.
        let of_cloth = |pair: &&NearPair| pair.vertices.iter().any(|&v| v as usize >= body);
        let pairs: Vec<&NearPair> = pairs.iter().filter(of_cloth).collect();
        for round in 0..self.iterations {
            self.satisfy_springs(&mut to, &mut borne, secs, round % 2 == 1);
            let is_near = |pair: &&NearPair| depth_of(pair, &to) > -CLEAR;
            let contacts: Vec<&NearPair> = pairs.par_iter().copied().filter(is_near).collect();
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

    /// Balances stretch, bending and inertia of each layer. **Returns** the forces of its springs; none of constraints.
    fn balance(&mut self, to: &mut [Point], secs: f64) -> Result<Vec<Vec<f64>>, NumericsError> {
        let Forces::Balanced(layers) = &mut self.forces else { return Ok(Vec::new()) };
        let support = self.surfaces.cloth().iter().map(|range| &self.memory.support[range.clone()]);
        let mut layers: Vec<_> = own_parts(to, &self.surfaces).into_iter().zip(layers).zip(support).collect();
        layers.par_iter_mut().map(|((to, elastic), support)| elastic.balance(to, support, secs, BALANCE)).collect()
    }

    /// Cloth that moves on skin by less than friction holds stays where it is.
    fn hold_still(&self, by: &mut [Vec3], skin: &SkinStep<'_>) {
        if let Forces::Springs(_) = self.forces {
            return;
        }
        let least = self.friction * GRAVITY * skin.secs * skin.secs;
        let skinned = skin.places.iter().zip(skin.before).map(|(place, before)| place - before);
        for (by, skinned) in by.iter_mut().zip(skinned).skip(self.surfaces.body_vertices()) {
            if (*by - skinned).norm() < least {
                *by = skinned;
            }
        }
    }

    /// One round of what holds each layer together, the layers at once.
    fn satisfy_springs(&self, to: &mut [Point], borne: &mut [Vec<f64>], secs: f64, backwards: bool) {
        let parts = own_parts(to, &self.surfaces);
        match &self.forces {
            Forces::Balanced(layers) => {
                let layers = parts.into_par_iter().zip(layers).zip(borne);
                layers.for_each(|((at, elastic), borne)| elastic.relax(at, borne, secs, backwards));
            }
            Forces::Springs(layers) => {
                let layers = parts.into_par_iter().zip(self.surfaces.cloth()).zip(layers);
                layers.for_each(|((at, range), springs)| {
                    satisfy_all(springs, at, &self.inverse_mass[range.clone()], backwards);
                });
            }
        }
    }

    /// Moves the vertices of a pair apart to its gap, the lighter by more, and slows their sliding.
    fn push_apart(&self, pair: &NearPair, to: &mut [Point]) {
        let depth = depth_of(pair, to);
        if depth <= 0.0 {
            return;
        }
        let vertices = pair.vertices.map(|v| v as usize);
        let weights = pair.weights.map(f64::from);
        let each = || vertices.iter().copied().zip(weights);
        let denominator: f64 = each().map(|(v, w)| w * w * self.inverse_mass[v]).sum();
        if denominator <= 0.0 {
            return;
        }
        let slid: Vec3 = each().map(|(v, w)| (to[v] - self.at[v]) * w).sum();
        let slid = shortened(slid - pair.normal * pair.normal.dot(&slid), self.friction * depth);
        for (v, w) in each() {
            to[v] += (pair.normal * depth - slid) * (w * self.inverse_mass[v] / denominator);
        }
    }
}

/// The points of each layer of cloth.
fn own_parts<'a>(to: &'a mut [Point], surfaces: &Surfaces) -> Vec<&'a mut [Point]> {
    let mut rest = &mut to[surfaces.body_vertices()..];
    let mut parts = Vec::new();
    for range in surfaces.cloth() {
        let (own, after) = rest.split_at_mut(range.len());
        parts.push(own);
        rest = after;
    }
    parts
}

/// How far a pair is nearer than its gap, along its normal, metres.
fn depth_of(pair: &NearPair, to: &[Point]) -> f64 {
    let each = pair.vertices.iter().zip(pair.weights);
    let distance: f64 = each.map(|(&v, w)| f64::from(w) * pair.normal.dot(&to[v as usize].coords)).sum();
    f64::from(pair.gap) - distance
}
