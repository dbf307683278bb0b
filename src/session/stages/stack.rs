//! Stack: the garment pushed clear of what lies inside, in the bind pose.

use super::dressed::Dressed;
use super::walk::{Outcome, Walk};
use crate::geometry::TriMesh;
use crate::rig::RiggedGarment;
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::stack::{StackParams, stack as stack_garment};
use serde_json::json;

pub(in crate::session) fn stack(
    walk: &mut Walk,
    step: &StepRecipe,
    rigged: Kept<RiggedGarment>,
    inner: &Dressed,
) -> Result<Kept<TriMesh>, SessionError> {
    let params: StackParams = params_of(step, Stage::Stack)?;
    let inputs = json!({ "rigged": rigged.hash, "figure": inner.figure.hash, "params": params });
    walk.stage(&step.name, Stage::Stack, inputs, |session, _tell| {
        let (rigged, figure) = (session.store.load(rigged)?, session.figure(inner.figure)?);
        let (mesh, report) =
            stack_garment(&rigged, &figure, &params).map_err(|e| SessionError::stage(&step.name, Stage::Stack, e))?;
        let left = report.layers.iter().filter(|l| l.inside_after + l.intersecting_pairs_after > 0).map(|l| {
            format!(
                "{} vertices inside and {} triangle pairs crossing '{}' are left",
                l.inside_after, l.intersecting_pairs_after, l.layer
            )
        });
        Ok(Outcome::of(mesh)
            .measured("inside_before", report.layers.iter().map(|l| l.inside_before).sum::<usize>() as f64)
            .measured("inside_after", report.inside_after() as f64)
            .measured("intersecting_pairs", report.intersecting_pairs_after() as f64)
            .measured("mean_move_of_clear_mm", report.mean_move_of_clear * 1e3)
            .measured("max_move_mm", report.max_move * 1e3)
            .found(left))
    })
}
