//! The scan of a step, or the garment from a file in its place.

use super::garment_file::garment_of;
use super::scan::{self, SCAN};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::pipeline::memo::walk::Walk;
use crate::session::recipe::StepRecipe;
use crate::session::store::Kept;

/// Begins to read the scan of a step, if it is a mesh: the fusion of frames uses all threads, and shows how it goes on. A fault is
/// found when the walk comes to that step.
pub(in crate::session) fn begin_scan(walk: &mut Walk, step: Option<&StepRecipe>) {
    let Some(step) = step.filter(|step| !step.tryon) else { return };
    let Ok(reading) = step.reading() else { return };
    let inputs = scan::Inputs::of(walk.session(), reading);
    if inputs.is_mesh() {
        walk.at(&step.name).begin(SCAN, &inputs, scan::run);
    }
}

/// The scan of a step, independent of earlier steps.
pub(in crate::session) fn scan_of(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    if step.tryon {
        return garment_of(walk, step);
    }
    let inputs = scan::Inputs::of(walk.session(), step.reading()?);
    Ok(walk.at(&step.name).run(SCAN, inputs, scan::run)?.kept)
}
