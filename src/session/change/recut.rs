//! A garment cut again after a mask has changed, in the scan's pose.

use super::masks::NewMask;
use crate::cut::Garment;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer, source};
use crate::session::pipeline::{self, Event, Forced, StageReport, Walk};
use crate::session::store::Memory;
use std::path::Path;
use std::sync::Arc;

/// A cut garment, in the pose and the world frame of its scan.
pub struct Recut {
    /// The garment.
    pub garment: Garment,
    /// Its labels on the scan.
    pub labels: Arc<Segmentation>,
    /// The stages that ran or were up to date, the cut last.
    pub reports: Vec<StageReport>,
}

impl Session {
    /// Caches loaded values in `memory` from now on.
    pub fn remember(&mut self, memory: &Memory) {
        self.store.remember(memory);
    }
}

impl Writer {
    /// Caches loaded values in `memory` from now on.
    pub fn remember(&mut self, memory: &Memory) {
        self.session.remember(memory);
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
        self.recut_by(&new, file, on_event, |_| Ok(()))
    }

    /// Adds a mask that was read and cuts its garment again, as one change; `before_saving` does what must succeed too.
    pub(super) fn recut_by(
        &mut self,
        new: &NewMask,
        file: &Path,
        on_event: &mut dyn FnMut(&Event),
        before_saving: impl FnOnce(&Self) -> Result<(), SessionError>,
    ) -> Result<Recut, SessionError> {
        let (recipe, state) = (self.session.recipe.clone(), self.session.state.clone());
        let change = self.put_mask(new, file)?;
        match self.cut_as(&change, &new.step.name, on_event) {
            Ok(recut) => {
                let saved = before_saving(self).and_then(|()| self.save(&change));
                if saved.is_err() {
                    (self.session.recipe, self.session.state) = (recipe, state);
                }
                saved.map(|()| recut)
            }
            Err(e) => {
                (self.session.recipe, self.session.state) = (recipe, state);
                self.session.refuse_to_erase_all(new, file)?;
                Err(e)
            }
        }
    }

    /// Cuts a garment again for a change that the caller saves.
    pub(super) fn cut_as(
        &mut self,
        change: &str,
        layer: &str,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Recut, SessionError> {
        source::keep_missing(&mut self.session)?;
        cut_in(Walk::make(self, change, &Forced::Nothing, on_event).at_once(), layer)
    }
}

fn cut_in(mut walk: Walk, layer: &str) -> Result<Recut, SessionError> {
    let cut = pipeline::cut_of(&mut walk, layer)?;
    let store = &walk.session().store;
    let (garment, labels) = (store.load(cut.garment)?, store.load_shared(cut.labels)?);
    Ok(Recut { garment, labels, reports: walk.into_reports() })
}
