//! A garment on the figure of the last step, which does not change, in some pose.

use super::pictures::{ClipFrame, draw_ease};
use crate::body::Figure;
use crate::export::write_layer_ply;
use crate::geometry::{SurfaceIndex, intersecting_pairs};
use crate::scan::Unit;
use crate::segment::{Fabric, SegmentError};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{FileInput, recognized};
use crate::session::results::outputs::{Content, Outputs};
use crate::tryon::{Posed, UprightGarment, at_rest, moved_into};
use crate::view::EaseRow;
use std::path::Path;

/// A garment on a figure in a pose.
pub struct TriedPose {
    /// The garment kind.
    pub kind: String,
    /// The fabric.
    pub fabric: String,
    /// The garment and the skin.
    pub posed: Posed,
    /// Pairs of faces that cross what the figure wears below: only stacking clears a garment of what hangs loose there.
    pub crossing_clothes: usize,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
}

impl Session {
    /// Puts a garment on the figure of the last step and takes both into a frame of a clip. `kind` and `fabric` are what the garment
    /// says if `None`.
    ///
    /// **Errors** without a figure; for a file without a garment, an unknown kind or fabric, a frame that the clip does not have.
    pub fn try_pose(
        &self,
        file: &Path,
        unit: Option<Unit>,
        (kind, fabric): (Option<&str>, Option<&str>),
        frame: &ClipFrame,
    ) -> Result<TriedPose, SessionError> {
        let figure = self.figure_of_last_step()?;
        let pose = self.pose_in(frame, &figure)?;
        let (UprightGarment { mesh: own, kind: found, notes, .. }, unused) =
            recognized(&FileInput::at(file.to_path_buf(), None), &self.store, unit)?;
        let (kind, fabric) = self.kind_and_fabric(kind.unwrap_or(found), fabric)?;
        let failed = |e| SessionError::bad_source(file, e);
        let worn = at_rest(&own, &figure, &fabric.name).map_err(failed)?;
        let posed = moved_into(&pose, &worn, &own, &figure, &fabric.name).map_err(failed)?;
        let Figure { layers, skeleton } = &figure;
        let inner =
            layers.iter().skip(1).map(|layer| intersecting_pairs(&posed.garment, &layer.posed(skeleton, &pose)));
        let crossing_clothes = inner.map(|pairs| pairs.len()).sum();
        let unused = unused.into_iter().map(|warning| warning.to_string());
        let notes = notes.into_iter().chain(unused).collect();
        Ok(TriedPose { kind, fabric: fabric.name.clone(), posed, crossing_clothes, notes })
    }

    /// A kind of garment, and its usual fabric if none is named.
    pub(super) fn kind_and_fabric(
        &self,
        kind: &str,
        fabric: Option<&str>,
    ) -> Result<(String, &'static Fabric), SessionError> {
        let wrong = |e: SegmentError| SessionError::BadRequest {
            what: e.to_string(),
            hint: "`overcoat templates list` shows the kinds, `templates/fabrics.toml` the fabrics".into(),
        };
        let template = self.recipe.template(kind).map_err(wrong)?;
        Ok((kind.into(), Fabric::named(fabric.unwrap_or(&template.fabric)).map_err(wrong)?))
    }
}

impl TriedPose {
    /// Draws the garment on the skin from three sides, coloured by the air below it.
    pub fn write_picture(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let Posed { garment, skin, .. } = &self.posed;
        let index = SurfaceIndex::prepare(skin);
        let gap = garment.points().iter().map(|p| index.closest(p).distance).collect();
        let row = EaseRow { title: self.kind.clone(), notes: Vec::new(), body: skin, garment, gap: &gap };
        draw_ease(path, outputs, (&self.kind, &format!("{}: distance from the skin", self.fabric)), &[row])
    }

    /// Writes the garment in metres, where the figure is.
    pub fn write_mesh(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        outputs.write(path, Content::Mesh, |out| write_layer_ply(&self.posed.garment, None, &[], out))
    }
}
