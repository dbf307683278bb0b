//! A garment cut anew after a mask has changed: as far as a person wants to see it at once, in the scan's pose.

use super::flow;
use super::open::Writer;
use super::walk::{Event, Forced, StageReport, Walk};
use super::{Memory, SessionError, source};
use crate::cut::Garment;
use std::path::Path;

/// A garment as it was cut last, in the pose and the world frame of its scan.
pub struct Recut {
    /// The garment.
    pub garment: Garment,
    /// The stages that were walked through, the cut last.
    pub reports: Vec<StageReport>,
}

impl Writer {
    /// Has what it loads at hand from now on, in `memory`.
    pub fn remember(&mut self, memory: &Memory) {
        self.session.store.remember(memory);
    }

    /// Runs what is stale up to the cut of one garment; what comes after it stays stale. Each result is durable.
    pub fn recut(&mut self, layer: &str, on_event: &mut dyn FnMut(&Event)) -> Result<Recut, SessionError> {
        self.session.recipe.step(layer)?;
        source::keep_missing(&mut self.session)?;
        let forced = Forced::Nothing;
        let mut walk = Walk::make(self, "build", &forced, on_event);
        let kept = flow::cut_of(&mut walk, layer)?;
        let reports = walk.into_reports();
        Ok(Recut { garment: self.session.store.load(kept)?, reports })
    }

    /// Takes a mask file up and cuts its garment anew. If either fails, the session is as it was.
    pub fn recut_with(
        &mut self,
        layer: &str,
        file: &Path,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Recut, SessionError> {
        let new = self.session.read_new_mask(layer, file)?;
        self.take_mask(&new, file)?;
        let recut = self.recut(layer, on_event);
        if recut.is_err() {
            self.session.recipe.step_mut(layer)?.masks = new.step.masks.clone();
            self.save(&format!("mask {layer} withdrawn"))?;
            self.session.refuse_to_erase_all(&new, file)?;
        }
        recut
    }
}
