//! A step with the figure in the pose of its scan.

use crate::body::{Figure, Pose, unskin};
use crate::fit::{FittedBody, PoseInside};
use crate::geometry::{Point, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::Labels;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{self, OfStep, PosedGarments, SoFar, StepResults, Walk, along_normals};
use crate::session::recipe::StepRecipe;

/// A built step, loaded. Everything is in the frame of the cleaned scan: metres, Y up.
pub(in crate::session) struct PosedStep {
    pub step: StepRecipe,
    pub scan: Scan,
    /// The figure, including the step's garment.
    pub figure: Figure,
    pub pose: Pose,
    /// Results of the body's step.
    pub fitted: Option<FittedBody>,
    /// The fitted surface in its pose, with the model's own weights: the figure's body may be another surface.
    surface_of_fit: Option<TriMesh>,
    /// Results of a garment's step.
    pub labels: Option<Labels>,
    /// The boundary loops of the step's garment that are hems.
    pub hem_loops: Option<Vec<Vec<VertexId>>>,
    body: TriMesh,
    /// How far skin had to give way to stay inside the scan: metres, at most 0.
    ///
    /// **Shapes** one entry per vertex of the body; none for the bare body.
    offsets: Vec<f64>,
    /// All garments, innermost first.
    garments: PosedGarments,
}

impl Session {
    /// All steps but those that failed, or those up to the named one. Runs nothing.
    pub(in crate::session) fn posed_steps(&self, last: Option<&str>) -> Result<Vec<PosedStep>, SessionError> {
        if let Some(name) = last {
            self.recipe.step(name)?;
        }
        if self.recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.dir().to_path_buf() });
        }
        let results = pipeline::steps(&mut Walk::look(self), last)?;
        self.all_posed(&results)
    }

    /// The steps before the first that is not built, but those that failed. Runs nothing.
    pub(in crate::session) fn posed_steps_so_far(&self) -> Result<Vec<PosedStep>, SessionError> {
        let SoFar { results, ended, .. } = pipeline::steps_so_far(&mut Walk::look(self), None);
        match ended {
            Ok(()) | Err(SessionError::NotBuilt { .. }) => {}
            Err(error) => return Err(error),
        }
        self.all_posed(&results)
    }

    /// The names of the steps that failed, and that later steps do without. Runs nothing.
    pub(in crate::session) fn failed_steps(&self) -> Result<Vec<&str>, SessionError> {
        let results = pipeline::steps(&mut Walk::look(self), None)?;
        let failed = self.recipe.steps.iter().zip(&results).filter(|(_, results)| results.failed);
        Ok(failed.map(|(step, _)| step.name.as_str()).collect())
    }

    fn all_posed(&self, results: &[StepResults]) -> Result<Vec<PosedStep>, SessionError> {
        let built = self.recipe.steps.iter().zip(results).filter(|(_, results)| !results.failed);
        built.map(|(step, results)| self.posed_step(step, results)).collect()
    }

    fn posed_step(&self, step: &StepRecipe, results: &StepResults) -> Result<PosedStep, SessionError> {
        let scan = self.store.load(results.scan)?;
        let (step, figure) = (step.clone(), self.figure(results.figure)?);
        match results.of {
            OfStep::Body { fitted, registered, .. } => {
                let fitted = self.store.load(fitted)?;
                let posed = self.body_model()?.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
                let pose = self.store.load(registered)?.pose;
                Ok(PosedStep {
                    step,
                    scan,
                    body: figure.body().posed(&figure.skeleton, &pose),
                    figure,
                    pose,
                    surface_of_fit: Some(fitted.surface.with_points(posed)),
                    fitted: Some(fitted),
                    labels: None,
                    hem_loops: None,
                    offsets: Vec::new(),
                    garments: PosedGarments::new(),
                })
            }
            OfStep::Garment { inside, labels, garment, pressed } => {
                let PoseInside { pose, offsets, .. } = self.store.load(inside)?;
                Ok(PosedStep {
                    step,
                    scan,
                    body: along_normals(&figure.body().posed(&figure.skeleton, &pose), &offsets)?,
                    figure,
                    pose,
                    fitted: None,
                    surface_of_fit: None,
                    labels: Some(self.store.load(labels)?.labels),
                    hem_loops: Some(self.store.load(garment)?.hem_loops),
                    offsets: offsets.0,
                    garments: self.store.load(pressed)?,
                })
            }
        }
    }
}

impl PosedStep {
    /// Whether the figure has the step's layer: not if the scan shows nothing of its garment.
    pub fn has_layer(&self) -> bool {
        self.figure.layers.iter().any(|layer| layer.name == self.step.name)
    }

    /// The body, with the step's offsets.
    pub fn body(&self) -> TriMesh {
        self.body.clone()
    }

    /// The vertex of the body that had to give way most, and by how much; `None` if none had to.
    pub fn skin_gave_way(&self) -> Option<(VertexId, f64)> {
        let moved = self.offsets.iter().enumerate().filter(|(_, offset)| **offset < 0.0);
        let deepest = moved.min_by(|a, b| a.1.total_cmp(b.1))?;
        Some((VertexId::from_index(deepest.0), -deepest.1))
    }

    /// The body before registration, if the step has one.
    pub fn body_of_fit(&self) -> Option<TriMesh> {
        self.surface_of_fit.clone()
    }

    /// The posed garments, innermost first: the new one as observed, the others as it presses them.
    pub fn garments(&self) -> Vec<(String, TriMesh)> {
        self.figure.garments().iter().zip(&self.garments).map(|(l, mesh)| (l.name.clone(), mesh.clone())).collect()
    }

    /// The figure whose skinning into this step's pose gives the posed surfaces, offsets included.
    pub fn figure_for_pose(&self) -> Figure {
        let mut figure = self.figure.clone();
        let surfaces = std::iter::once(self.body()).chain(self.garments().into_iter().map(|(_, mesh)| mesh));
        for (layer, posed) in figure.layers.iter_mut().zip(surfaces) {
            let points = unskin(posed.points(), &layer.weights, &figure.skeleton, &self.pose);
            layer.mesh = layer.mesh.with_points(points);
        }
        figure
    }

    /// Joint centres, in the order of the skeleton.
    pub fn joints(&self) -> Vec<Point> {
        self.figure.skeleton.joints_in_world(&self.pose)
    }
}
