//! Everything that a page about the session shows: its steps, its figure, its animations.

use super::animation::AnimationStatus;
use super::pictures::Turned;
use super::posed_step::PosedStep;
use super::status::StepStatus;
use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{Walk, scan_of, standing};
use crate::session::store::ContentHash;
use std::path::Path;

/// A session as far as it is built. Steps are turned so that the person faces +Z and stands on the floor.
pub struct Shown {
    /// The session's name.
    pub name: String,
    /// The change that led here: its number and description.
    pub change: Option<(usize, String)>,
    /// The hash of the recipe.
    pub recipe: Option<ContentHash>,
    /// The steps, in order.
    pub steps: Vec<ShownStep>,
    /// The figure of the last step that is built, in the bind pose, on the floor.
    pub figure: Option<Figure>,
    /// What its garments carry: buttons, pockets.
    pub trim: Vec<Layer>,
    /// The animations.
    pub animations: Vec<AnimationStatus>,
}

/// A step and what of it is built.
pub struct ShownStep {
    /// The verdict and the measures.
    pub status: StepStatus,
    /// The name of the scan's file, without the folder, which is private.
    pub file: String,
    /// The hash of its content.
    pub hash: Option<ContentHash>,
    /// The cleaned scan; `None` if the file was never read.
    pub scan: Option<TriMesh>,
    /// Its colours.
    pub scan_colors: Option<PerVertex<[u8; 3]>>,
    /// Which vertices of the scan are the step's garment; `None` for the body, and where that is not built.
    pub labels: Option<PerVertex<bool>>,
    /// The figure's surfaces in the pose of the scan, innermost first; empty if that is not built.
    pub layers: Vec<TriMesh>,
    /// The hems of the step's garment, each a closed line.
    pub hems: Vec<Vec<Point>>,
    /// Where skin had to give way most to stay inside the scan, and by how much, in metres.
    pub skin_gave_way: Option<(Point, f64)>,
    /// Whether the figure has a layer of this step.
    pub has_layer: bool,
}

impl Session {
    /// Loads what is built. Runs nothing.
    ///
    /// **Errors** without a step.
    pub fn shown(&self) -> Result<Shown, SessionError> {
        if self.recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.dir().to_path_buf() });
        }
        let posed = self.posed_steps_so_far()?;
        let figure = posed.last().map(|last| standing(last.figure.clone(), &last.step.name)).transpose()?;
        let trims = posed.last().map(|last| self.trims(Some(&last.step.name))).transpose()?;
        let trim = trims.iter().zip(&figure).flat_map(|(trims, figure)| trims.layers_on(figure));
        let trim = trim.map(|(_, layer)| layer).collect();
        let mut walk = Walk::look(self);
        let mut steps = Vec::new();
        for (step, status) in self.recipe.steps.iter().zip(self.status()?) {
            let file = Path::new(&step.scan).file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
            let mut shown = ShownStep {
                status,
                file,
                hash: step.hash,
                scan: None,
                scan_colors: None,
                labels: None,
                layers: Vec::new(),
                hems: Vec::new(),
                skin_gave_way: None,
                has_layer: false,
            };
            match posed.iter().find(|posed| posed.step.name == step.name) {
                Some(posed) => shown.add(posed),
                None => match scan_of(&mut walk, step) {
                    Ok(kept) => {
                        let scan = self.store.load(kept)?;
                        (shown.scan, shown.scan_colors) = (Some(scan.mesh), scan.colors);
                    }
                    Err(SessionError::NotBuilt { .. }) => {}
                    Err(error) => return Err(error),
                },
            }
            steps.push(shown);
        }
        let head = self.history().current().head();
        Ok(Shown {
            name: self.name(),
            change: head.map(|entry| (entry.number, entry.change.clone())),
            recipe: head.map(|entry| entry.recipe),
            steps,
            figure,
            trim,
            animations: self.animations()?,
        })
    }
}

impl ShownStep {
    fn add(&mut self, posed: &PosedStep) {
        let turned = Turned::of(posed);
        let garments = posed.garments();
        let body = posed.body();
        self.has_layer = posed.has_layer();
        if let Some((_, own)) = garments.last().filter(|_| self.has_layer) {
            let place = |v: &crate::geometry::VertexId| own.points().as_slice().get(v.index()).map(|p| turned.point(p));
            let hems = posed.hem_loops.iter().flatten();
            self.hems = hems.map(|hem| hem.iter().filter_map(place).collect()).collect();
        }
        self.skin_gave_way = posed.skin_gave_way().map(|(v, depth)| (turned.point(&body.points()[v]), depth));
        self.scan = Some(turned.mesh(&posed.scan.mesh));
        self.scan_colors.clone_from(&posed.scan.colors);
        self.labels = posed.labels.as_ref().map(|labels| labels.0.clone());
        let surfaces = std::iter::once(body).chain(garments.into_iter().map(|(_, mesh)| mesh));
        self.layers = surfaces.map(|mesh| turned.mesh(&mesh)).collect();
    }
}
