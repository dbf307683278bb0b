//! A garment cut again after a mask has changed, in the scan's pose.

use crate::cut::Garment;
use crate::session::error::SessionError;
use crate::session::open::{Writer, source};
use crate::session::pipeline::{self, Event, Forced, StageReport, Walk};
use crate::session::store::Memory;
use std::path::Path;

/// A cut garment, in the pose and the world frame of its scan.
pub struct Recut {
    /// The garment.
    pub garment: Garment,
    /// The stages that ran or were up to date, the cut last.
    pub reports: Vec<StageReport>,
}

impl Writer {
    /// Caches loaded values in `memory` from now on.
    pub fn remember(&mut self, memory: &Memory) {
        self.session.store.remember(memory);
    }

    /// Runs the stages that are out of date up to the cut of one garment. Each result is durable.
    pub fn recut(&mut self, layer: &str, on_event: &mut dyn FnMut(&Event)) -> Result<Recut, SessionError> {
        self.session.recipe.step(layer)?;
        source::keep_missing(&mut self.session)?;
        cut_in(Walk::make(self, "build", &Forced::Nothing, on_event), layer)
    }

    /// Adds a mask file and cuts its garment again, as one change. If either fails, the session is unchanged.
    pub fn recut_with(
        &mut self,
        layer: &str,
        file: &Path,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Recut, SessionError> {
        let new = self.session.read_new_mask(layer, file, &[])?;
        let (recipe, state) = (self.session.recipe.clone(), self.session.state.clone());
        let change = self.put_mask(&new, file)?;
        source::keep_missing(&mut self.session)?;
        match cut_in(Walk::make(self, &change, &Forced::Nothing, on_event).at_once(), layer) {
            Ok(recut) => {
                self.save(&change)?;
                Ok(recut)
            }
            Err(e) => {
                (self.session.recipe, self.session.state) = (recipe, state);
                self.session.refuse_to_erase_all(&new, file)?;
                Err(e)
            }
        }
    }
}

fn cut_in(mut walk: Walk, layer: &str) -> Result<Recut, SessionError> {
    let kept = pipeline::cut_of(&mut walk, layer)?;
    let garment = walk.session().store.load(kept)?;
    Ok(Recut { garment, reports: walk.into_reports() })
}
