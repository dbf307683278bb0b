//! The scans of later steps, where all of a session make the shape of the body.

use super::scan::scan;
use super::walk::Walk;
use crate::body::Figure;
use crate::fit::{Cover, InsideParams, NakedParams, ShapeFrom};
use crate::geometry::PerVertex;
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::recipe::{GarmentKind, StepRecipe, garment_kind, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

/// A later step, as far as it says something of the body.
pub(in crate::session) struct OtherStep {
    pub name: String,
    pub scan: Kept<Scan>,
    pub kind: GarmentKind,
    pub params: InsideParams,
}

/// All later steps where the body's step asks for them, else none.
pub(in crate::session) fn other_steps(walk: &mut Walk, body: &StepRecipe) -> Result<Vec<OtherStep>, SessionError> {
    if params_of::<NakedParams>(body, Stage::Fit)?.shape_from == ShapeFrom::Naked {
        return Ok(Vec::new());
    }
    let steps: Vec<StepRecipe> = walk.session().recipe.steps.iter().filter(|s| !s.is_body()).cloned().collect();
    steps
        .iter()
        .map(|step| {
            let (kind, params) = (garment_kind::of_step(step)?, params_of(step, Stage::Pose)?);
            Ok(OtherStep { name: step.name.clone(), scan: scan(walk, step)?, kind, params })
        })
        .collect()
}

/// What stands for them among the inputs of a stage.
pub(in crate::session) fn input(others: &[OtherStep]) -> Value {
    others
        .iter()
        .map(|other| json!({ "scan": other.scan.hash, "kind": other.kind.input(), "params": other.params }))
        .collect()
}

/// What is worn in each of their scans does over the body: what came before is worn there, too.
pub(in crate::session) fn covers(others: &[OtherStep], bare: &Figure) -> Vec<PerVertex<Cover>> {
    let mut worn = PerVertex::filled(Cover::Bare, bare.body().mesh.vertex_count());
    others
        .iter()
        .map(|other| {
            let new = other.kind.template.cover(bare.body(), &bare.skeleton, &other.kind.extent);
            worn = worn.iter().zip(new.iter()).map(|(a, b)| looser(*a, *b)).collect();
            worn.clone()
        })
        .collect()
}

fn looser(a: Cover, b: Cover) -> Cover {
    match (a, b) {
        (Cover::Loose, _) | (_, Cover::Loose) => Cover::Loose,
        (Cover::Tight, _) | (_, Cover::Tight) => Cover::Tight,
        _ => Cover::Bare,
    }
}
