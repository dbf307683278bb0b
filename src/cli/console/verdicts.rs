//! The verdict on each step, in one line.

use super::context::Context;
use super::output::Done;
use crate::check::{StepVerdict, Verdict};
use crate::session::{Stage, StepKind};
use std::io::IsTerminal;

/// `coat: check it: 55 hem loops, 3 or 4 expected; …`; what is no doubt comes last, in brackets.
pub(in crate::cli) fn line(step: &StepVerdict) -> String {
    format!("{}: {}{}", step.step, step.verdict, notes(step))
}

fn notes(step: &StepVerdict) -> String {
    step.notes.iter().map(|note| format!(" ({note})")).collect()
}

/// The line for stderr: its first word in colour on a terminal, unless `NO_COLOR` is set.
pub(in crate::cli) fn line_for_stderr(step: &StepVerdict) -> String {
    let plain = line(step);
    let is_plain =
        !std::io::stderr().is_terminal() || std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    if is_plain { plain } else { colored(step) }
}

fn colored(step: &StepVerdict) -> String {
    let (green, yellow, red, reset) = ("\x1b[32m", "\x1b[33m", "\x1b[31m", "\x1b[0m");
    let (color, word, rest) = match &step.verdict {
        Verdict::Good => (green, "good", String::new()),
        Verdict::Check(doubt) => (yellow, "check it", format!(": {doubt}")),
        Verdict::Failed(why) => (red, "failed", format!(": {why}")),
    };
    format!("{}: {color}{word}{reset}{rest}{}", step.step, notes(step))
}

/// The command has failed if a step has.
pub(in crate::cli) fn required_unfailed(done: Done, verdicts: &[StepVerdict], context: &Context) -> Done {
    let is_failed = |v: &&StepVerdict| matches!(v.verdict, Verdict::Failed(_));
    let failed: Vec<&str> = verdicts.iter().filter(is_failed).map(|v| v.step.as_str()).collect();
    if failed.is_empty() {
        return done;
    }
    let what = format!("{} of {} steps failed: {}", failed.len(), verdicts.len(), failed.join(", "));
    done.failed(what, format!("`{}` shows the places", context.overcoat("view --sheet sheet.png")))
}

/// For `--strict`: the command has failed if a step is not good.
pub(in crate::cli) fn required_good(done: Done, verdicts: &[StepVerdict], context: &Context) -> Done {
    let doubtful: Vec<&str> = verdicts.iter().filter(|v| !v.verdict.is_good()).map(|v| v.step.as_str()).collect();
    if doubtful.is_empty() {
        return done;
    }
    let what = format!("{} of {} steps are not good: {}", doubtful.len(), verdicts.len(), doubtful.join(", "));
    done.failed(what, format!("`{}` shows what to look at", context.overcoat("status")))
}

/// The stages by the steps that have them.
pub(in crate::cli) fn stages_hint() -> String {
    let names = |stages: &[Stage]| stages.iter().map(|stage| stage.name()).collect::<Vec<_>>().join(", ");
    format!(
        "the stages of the body are {}; those of a garment {}",
        names(StepKind::Body.stages()),
        names(StepKind::Garment.stages())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_of_the_verdict_alone_is_in_colour() {
        let doubt = "55 hem loops, 4 expected; look at the hems";
        let step = StepVerdict {
            step: "coat".into(),
            verdict: Verdict::Check(doubt.into()),
            warnings: vec![],
            notes: vec!["hair".into()],
        };
        assert_eq!(line(&step), format!("coat: check it: {doubt} (hair)"));
        assert_eq!(colored(&step), format!("coat: \x1b[33mcheck it\x1b[0m: {doubt} (hair)"));
    }
}
