//! A step as it was worn: the figure in the pose of its scan.

use crate::body::{Figure, Pose, unskin};
use crate::fit::{FittedBody, PoseInside};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::Scan;
use crate::segment::Labels;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::StepRecipe;
use crate::session::stages::{Dressed, StepPose, Walk, Worn, along_normals, steps};

/// A built step, loaded. Everything is in the frame of the cleaned scan: metres, Y up.
pub(in crate::session) struct WornStep {
    pub step: StepRecipe,
    pub scan: Scan,
    /// With what the step brought.
    pub figure: Figure,
    pub pose: Pose,
    /// Of the body's step.
    pub fitted: Option<FittedBody>,
    /// Its surface as posed, with the model's own weights: the figure's body may be another surface.
    surface_of_fit: Option<TriMesh>,
    /// Of a garment's step.
    pub labels: Option<Labels>,
    offsets: Option<PerVertex<f64>>,
    /// All garments, innermost first.
    garments: Worn,
}

impl Session {
    /// All steps, or those up to the one named. Runs nothing.
    pub(in crate::session) fn worn_steps(&self, last: Option<&str>) -> Result<Vec<WornStep>, SessionError> {
        if let Some(name) = last {
            self.recipe.step(name)?;
        }
        if self.recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.dir().to_path_buf() });
        }
        let dressed = steps(&mut Walk::look(self), last)?;
        self.recipe.steps.iter().zip(&dressed).map(|(step, dressed)| self.worn(step, dressed)).collect()
    }

    fn worn(&self, step: &StepRecipe, dressed: &Dressed) -> Result<WornStep, SessionError> {
        let (scan, figure) = (self.store.load(dressed.scan)?, self.figure(dressed.figure)?);
        let step = step.clone();
        Ok(match dressed.pose {
            StepPose::Naked { fitted, registered } => {
                let fitted: FittedBody = self.store.load(fitted)?;
                let posed = self.body_model()?.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
                WornStep {
                    step,
                    scan,
                    figure,
                    pose: self.store.load(registered)?.pose,
                    surface_of_fit: Some(fitted.surface.with_points(posed)),
                    fitted: Some(fitted),
                    labels: None,
                    offsets: None,
                    garments: Worn::new(),
                }
            }
            StepPose::Inside { inside, segmentation, worn } => {
                let PoseInside { pose, offsets, .. } = self.store.load(inside)?;
                let (labels, garments) = (Some(self.store.load(segmentation)?.labels), self.store.load(worn)?);
                WornStep {
                    step,
                    scan,
                    figure,
                    pose,
                    fitted: None,
                    surface_of_fit: None,
                    labels,
                    offsets: Some(offsets),
                    garments,
                }
            }
        })
    }
}

impl WornStep {
    /// The body, with the step's offsets.
    pub fn body(&self) -> TriMesh {
        let posed = self.figure.body().posed(&self.figure.skeleton, &self.pose);
        match &self.offsets {
            Some(offsets) => along_normals(&posed, offsets),
            None => posed,
        }
    }

    /// The body before registration, where the step has one.
    pub fn body_of_fit(&self) -> Option<TriMesh> {
        self.surface_of_fit.clone()
    }

    /// What is worn at this step, innermost first: the new garment as observed, the others as it presses them.
    pub fn garments(&self) -> Vec<(String, TriMesh)> {
        self.figure.garments().iter().zip(&self.garments).map(|(l, mesh)| (l.name.clone(), mesh.clone())).collect()
    }

    /// The figure whose skinning into this step's pose gives all surfaces as they were worn, offsets and all.
    pub fn figure_as_worn(&self) -> Figure {
        let mut figure = self.figure.clone();
        let surfaces = std::iter::once(self.body()).chain(self.garments().into_iter().map(|(_, mesh)| mesh));
        for (layer, worn) in figure.layers.iter_mut().zip(surfaces) {
            let points = unskin(worn.points(), &layer.weights, &figure.skeleton, &self.pose);
            layer.mesh = layer.mesh.with_points(points);
        }
        figure
    }

    /// Joint centres, in the order of the skeleton.
    pub fn joints(&self) -> Vec<Point> {
        self.figure.skeleton.joints_in_world(&self.pose)
    }
}
