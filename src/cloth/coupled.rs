//! The state of a simulation on a moving figure: physics and skinning blended within one solver, so that the blend cannot make
//! layers cross.

use super::cloth_params::ClothParams;
use super::constraint_solver::{ConstraintSolver, Forces};
use super::crossing_free::surfaces::Surfaces;
use super::draft::Draft;
use super::elastic::Elastic;
use super::error::ClothError;
use super::known_fabric::fabric_named;
use super::layer::ClothLayer;
use super::mass_spring::step::{MassSpringLayers, Moving};
use super::mode::{ClothMode, ClothSolver};
use super::skin_step::{GRAVITY, SkinStep};
use super::springs::springs_of;
use crate::body::{Figure, Layer, Pose, Skinning};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use nalgebra::Matrix3;

/// Greatest rotation of a joint per step, degrees: triangles of the demo are 1 to 2 cm wide and 1 mm apart.
const STEP_DEG: f64 = 4.0;
/// Steps per frame at 30 frames per second; the greatest number is reached at 36° per frame, faster than people move.
const STEPS: std::ops::RangeInclusive<f64> = 2.0..=12.0;
/// Steps of a draft, and the greatest rotation of a joint within them, degrees: straight ways cut 5 % off an arc of 36°.
const DRAFT_STEPS: usize = 4;
const DRAFT_DEG: f64 = 36.0;
/// A joint that turns further within a frame, degrees, or a root that moves farther, metres, jumps: skin takes cloth along, at rest.
const JUMP_DEG: f64 = 60.0;
const JUMP: f64 = 0.5;
/// Iterations of the constraints per step.
const ITERATIONS: usize = 5;
/// Coefficient of friction. Cloth that is squeezed between arm and trunk by skinning would be dragged along by more.
const FRICTION: f64 = 0.1;
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
    pub solver: ConstraintSolver,
    physics: Physics,
    /// The places of the last pose of a draft.
    last: Option<Places>,
}

/// What moves the solver's state.
enum Physics {
    Constraints,
    MassSpring(Box<MassSpringLayers>),
    Draft(Draft),
}

/// The skinned place of every vertex, and gravity as its skin would carry it along: turned by the skin from the bind pose.
type Places = (Vec<Point>, Vec<Vec3>);

impl<'a> Simulation<'a> {
    /// The figure in the bind pose.
    ///
    /// **Errors** an unknown fabric; triangles that are too small for mass–spring steps.
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
        let (mut springs, mut elastic, mut fabrics) = (Vec::new(), Vec::new(), Vec::new());
        let mut inverse_mass = vec![0.0; surfaces.rest.len()];
        for (k, (layer, mesh)) in figure.layers.iter().zip(&meshes).enumerate().skip(1) {
            let fabric = fabric_named(layer.fabric.as_deref().unwrap_or(UNKNOWN_FABRIC))?;
            let areas = mesh.vertex_areas();
            for (v, area) in surfaces.vertices[k].clone().zip(areas.iter()) {
                inverse_mass[v] = 1.0 / (area * fabric.density).max(1e-6);
            }
            match solver {
                ClothSolver::Constraints => {
                    let mass = inverse_mass[surfaces.vertices[k].clone()].iter().map(|w| 1.0 / w).collect();
                    elastic.push(Elastic::of(mesh, &fabric, mass, frequencies(layer, params, mode)));
                }
                ClothSolver::MassSpring => fabrics.push(fabric),
                ClothSolver::Draft => {
                    let pinned = PerVertex::filled(false, mesh.vertex_count());
                    springs.push(springs_of(&ClothLayer { rest: mesh.clone(), pinned, fabric }, 1.0));
                }
            }
        }
        let physics = match solver {
            ClothSolver::Constraints => Physics::Constraints,
            ClothSolver::MassSpring => {
                let layers = MassSpringLayers::prepare(&meshes, fabrics, &surfaces.vertices, &inverse_mass);
                if let Some((cloth, share)) = layers.too_fine() {
                    return Err(ClothError::TooFine { layer: figure.layers[1 + cloth].name.clone(), share });
                }
                Physics::MassSpring(Box::new(layers))
            }
            ClothSolver::Draft => Physics::Draft(Draft::prepare(&meshes, &surfaces, springs)),
        };
        let frequency = figure.layers.iter().flat_map(|layer| frequencies(layer, params, mode)).collect();
        let forces = Forces::Balanced(elastic);
        let mut solver = ConstraintSolver::new(surfaces, forces, inverse_mass, frequency, (FRICTION, ITERATIONS));
        solver.damping = params.damping;
        Ok(Self { figure, skinning, solver, physics, last: None })
    }

    pub fn places(&self, pose: &Pose) -> Places {
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
        match &self.physics {
            Physics::MassSpring(layers) => layers.least_stiffness(),
            Physics::Constraints | Physics::Draft(_) => 1.0,
        }
    }

    /// Moves on by one frame.
    ///
    /// **Errors** layers whose forces cannot be computed.
    pub fn frame(&mut self, from: &Pose, to: &Pose, fps: f64) -> Result<(), ClothError> {
        if let Physics::Draft(_) = self.physics {
            self.draft_frame(from, to, fps);
            return Ok(());
        }
        let turned = turned_deg(from, to);
        let steps = (turned / STEP_DEG).ceil().max((STEPS.start() * 30.0 / fps).ceil()).clamp(1.0, *STEPS.end());
        let step_secs = 1.0 / (fps * steps);
        self.solver.set_step(step_secs);
        let mut before = self.places(from).0;
        for step in 1..=steps as usize {
            let (places, carried) = self.places(&from.toward(to, step as f64 / steps));
            let skin = SkinStep { before: &before, places: &places, carried: &carried, secs: step_secs };
            if let Physics::MassSpring(layers) = &mut self.physics {
                let ConstraintSolver { at, velocity, frequency, damping, surfaces, .. } = &mut self.solver;
                layers.step(Moving { at, velocity, frequency, damping: *damping }, &surfaces.vertices, &skin);
            } else {
                self.solver.step(&skin)?;
            }
            before = places;
        }
        Ok(())
    }

    /// Moves a draft on by one frame; what is no draft stays.
    pub fn draft_frame(&mut self, from: &Pose, to: &Pose, fps: f64) {
        let turned = turned_deg(from, to);
        if turned > JUMP_DEG || (to.translation - from.translation).norm() > JUMP {
            self.jump(from, to);
            return;
        }
        let parts = (turned / DRAFT_DEG).ceil().max(1.0);
        for part in 1..=parts as usize {
            self.draft(from, &from.toward(to, part as f64 / parts), 1.0 / (fps * parts));
        }
    }

    /// Skin takes cloth along to a pose, from the last one, or at first from `start`.
    fn jump(&mut self, start: &Pose, to: &Pose) {
        let (begin, _) = self.last.take().unwrap_or_else(|| self.places(start));
        let end = self.places(to);
        for (at, (from, to)) in self.solver.at.iter_mut().zip(begin.iter().zip(&end.0)) {
            *at += to - from;
        }
        self.solver.velocity.fill(Vec3::zeros());
        self.last = Some(end);
    }

    /// Moves on to a pose within `secs`, from the last one, or at first from `start`. Between them skin moves straight.
    fn draft(&mut self, start: &Pose, to: &Pose, secs: f64) {
        let (begin, _) = self.last.take().unwrap_or_else(|| self.places(start));
        let end = self.places(to);
        let Physics::Draft(draft) = &mut self.physics else { return };
        draft.follow(&self.solver);
        let step_secs = secs / DRAFT_STEPS as f64;
        draft.set_step(step_secs);
        let mut before = begin.clone();
        for step in 1..=DRAFT_STEPS {
            let share = step as f64 / DRAFT_STEPS as f64;
            let places: Vec<Point> = begin.iter().zip(&end.0).map(|(a, b)| a + (b - a) * share).collect();
            draft.step(
                &mut self.solver,
                &SkinStep { before: &before, places: &places, carried: &end.1, secs: step_secs },
            );
            before = places;
        }
        self.last = Some(end);
    }
}

/// The greatest turn of a joint from one pose to another, degrees.
fn turned_deg(from: &Pose, to: &Pose) -> f64 {
    let rotations = from.rotations.iter().zip(&to.rotations);
    rotations.map(|(a, b)| a.angle_to(b).to_degrees()).fold(0.0, f64::max)
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
