//! Pose: the figure dressed so far, inside the next scan.

use super::flow::Dressed;
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::Walk;
use super::{SessionError, StageError};
use crate::fit::PoseInside;
use crate::scan::Scan;
use serde_json::json;

pub(super) fn pose(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    inner: &Dressed,
) -> Result<Kept<PoseInside>, SessionError> {
    let inputs = json!({ "scan": scan.hash, "figure": inner.figure.hash, "start": inner.pose.hash() });
    walk.stage(&step.name, Stage::Pose, inputs, |_session, _tell| {
        Err(SessionError::stage(&step.name, Stage::Pose, StageError::NotAvailable))
    })
}

/// How far skin may lie outside the noisy scan and still count as inside, in metres.
pub(super) fn margin() -> f64 {
    0.002
}
