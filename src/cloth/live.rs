//! Cloth on a figure that is driven as its poses arrive.

use super::cloth_params::ClothParams;
use super::coupled::Simulation;
use super::error::ClothError;
use super::mode::{ClothMode, ClothSolver};
use crate::body::{Figure, Pose, Skinning};
use crate::geometry::TriMesh;

/// The interval from one pose to the next, seconds; a shorter or longer one is taken as the nearest of these.
const INTERVAL: std::ops::RangeInclusive<f64> = (1.0 / 240.0)..=0.2;

/// Cloth of a figure that moves from pose to pose, at first from the bind pose. A draft: layers may cross.
pub struct LiveCloth<'a> {
    simulation: Simulation<'a>,
    figure: &'a Figure,
    pose: Pose,
    secs: Option<f64>,
}

impl<'a> LiveCloth<'a> {
    /// The figure in the bind pose.
    ///
    /// **Errors** an unknown fabric.
    pub fn prepare(figure: &'a Figure) -> Result<Self, ClothError> {
        let how = (ClothMode::Coupled, ClothSolver::Draft);
        let simulation = Simulation::prepare(figure, Skinning::Linear, &ClothParams::default(), how)?;
        Ok(Self { simulation, figure, pose: Pose::bind(figure.skeleton.len()), secs: None })
    }

    /// Moves on to a pose at a time in seconds; returns the layers.
    ///
    /// **Guarantees** skin is where skinning puts it.
    pub fn to_pose(&mut self, pose: &Pose, secs: f64) -> Vec<TriMesh> {
        let interval = secs - self.secs.unwrap_or(f64::NEG_INFINITY);
        self.simulation.draft_frame(&self.pose, pose, 1.0 / interval.clamp(*INTERVAL.start(), *INTERVAL.end()));
        (self.pose, self.secs) = (pose.clone(), Some(secs));
        let solver = &self.simulation.solver;
        let layers = self.figure.layers.iter().zip(&solver.surfaces.vertices);
        layers.map(|(layer, range)| layer.mesh.with_points(solver.at[range.clone()].to_vec())).collect()
    }
}
