//! The verdict on each step, in one line.

use super::console::Done;
use super::context::Context;
use crate::session::{Stage, StepVerdict};

/// `coat: check it: 55 hem loops, 3 or 4 expected; …`
pub(super) fn line(step: &StepVerdict) -> String {
    format!("{}: {}", step.step, step.verdict)
}

/// The same for `--strict`: the command has failed if a step is not good.
pub(super) fn required_good(done: Done, verdicts: &[StepVerdict], context: &Context) -> Done {
    let doubtful: Vec<&str> = verdicts.iter().filter(|v| !v.verdict.is_good()).map(|v| v.step.as_str()).collect();
    if doubtful.is_empty() {
        return done;
    }
    let what = format!("{} of {} steps are not good: {}", doubtful.len(), verdicts.len(), doubtful.join(", "));
    done.failed(what, format!("`{}` shows what to look at", context.overcoat("status")))
}

/// The stages by the steps that have them.
pub(super) fn stages_hint() -> String {
    let names = |stages: &[Stage]| stages.iter().map(|stage| stage.name()).collect::<Vec<_>>().join(", ");
    format!("the stages of the body are {}; those of a garment {}", names(Stage::OF_BODY), names(Stage::OF_GARMENT))
}
