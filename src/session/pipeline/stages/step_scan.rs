//! The scan of a step, or the garment from a file in its place.

use super::garment_file::garment_of;
use super::scan::{self, SCAN};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::pipeline::memo::walk::Walk;
use crate::session::recipe::StepRecipe;
use crate::session::store::Kept;

/// The scan of a step, independent of earlier steps.
pub(in crate::session) fn scan_of(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    if step.tryon {
        return garment_of(walk, step);
    }
    let inputs = scan::Inputs::of(walk.session(), step.reading()?);
    Ok(walk.at(&step.name).run(SCAN, inputs, scan::run)?.kept)
}
