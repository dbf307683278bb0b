//! Stack: the garment pushed clear of what lies inside, in the bind pose.

use super::SessionError;
use super::flow::Dressed;
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Walk};
use crate::geometry::TriMesh;
use crate::rig::RiggedGarment;
use serde_json::json;

pub(super) fn stack(
    walk: &mut Walk,
    step: &StepRecipe,
    rigged: Kept<RiggedGarment>,
    inner: &Dressed,
) -> Result<Kept<TriMesh>, SessionError> {
    let inputs = json!({ "rigged": rigged.hash, "figure": inner.figure.hash });
    walk.stage(&step.name, Stage::Stack, inputs, |session, _tell| {
        let rigged = session.store.load(rigged)?;
        Ok(Outcome::of(rigged.mesh).found(["not pushed clear: this version cannot stack yet".to_string()]))
    })
}
