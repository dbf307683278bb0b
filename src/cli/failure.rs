//! Reports errors to people and programs: one sentence, a hint and an exit code.

use super::bodies::BodiesError;
use super::console::{Done, print_aside, print_line};
use super::drive::DriveFailure;
use super::studio::MakeError;
use crate::desk::DeskError;
use crate::session::SessionError;
use clap::error::ErrorKind;
use serde_json::json;
use std::process::ExitCode;

/// The work failed.
const FAILED: u8 = 1;
/// The command was invalid.
const WRONG_COMMAND: u8 = 2;

/// Reports an error, and returns its exit code.
pub(super) fn report(error: &anyhow::Error, json: bool) -> ExitCode {
    say(error, json);
    ExitCode::from(if is_wrong_command(error) { WRONG_COMMAND } else { FAILED })
}

/// The exit code of a command that did all or part of its work.
pub(super) fn of_part(done: &Done) -> ExitCode {
    ExitCode::from(if done.failed.is_some() { FAILED } else { 0 })
}

/// Reports that the work was done, but stdout could not be written.
pub(super) fn report_unsaid(error: &std::io::Error) -> ExitCode {
    print_aside(&format!("error: the command did its work, but its output cannot be written: {error}"));
    print_aside("hint: check where stdout leads: its disk may be full, or the program that reads it has ended");
    ExitCode::from(FAILED)
}

/// Reports arguments that cannot be parsed. Help and version are not failures.
pub(super) fn report_usage(error: &clap::Error, json: bool) -> ExitCode {
    if !error.use_stderr() {
        // A closed pipe is not a failure.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let (message, hint) = match error.kind() {
        ErrorKind::MissingSubcommand | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            ("no command was given".into(), "`overcoat --help` shows the commands".into())
        }
        _ => sentence_and_hint(&error.render().to_string()),
    };
    print(&message, Some(&hint), json);
    ExitCode::from(WRONG_COMMAND)
}

/// The parser's message in one line, and its tip or the usage.
pub(super) fn sentence_and_hint(text: &str) -> (String, String) {
    let first = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
    // The parser lists missing arguments on separate lines.
    let more = text.lines().skip(1).take_while(|l| l.starts_with("  ")).map(str::trim).filter(|l| !l.is_empty());
    let message = in_plain_words(&std::iter::once(first).chain(more).collect::<Vec<_>>().join(" "));
    let tip = text.lines().find_map(|l| l.trim().strip_prefix("tip: ").map(str::to_string));
    let usage = text.lines().find_map(|l| l.strip_prefix("Usage: ").map(|u| format!("usage: {u}")));
    (message, tip.or(usage).unwrap_or_else(|| "`overcoat COMMAND --help` explains the options".into()))
}

/// The parser's message about a number, in the words of a user.
fn in_plain_words(message: &str) -> String {
    let Some((before, why)) = message.rsplit_once("': ") else { return message.into() };
    let range = why.split_once(" is not in ").and_then(|(_, range)| range.split_once("..="));
    let plain = match (why, range) {
        ("invalid float literal", _) => "it is not a number".into(),
        ("invalid digit found in string" | "cannot parse integer from empty string", _) => {
            "it is not a whole number of 0 or more".into()
        }
        ("number too large to fit in target type", _) => "it is too large".into(),
        (_, Some((least, most))) if most == u32::MAX.to_string() => format!("give {least} or more"),
        (_, Some((least, most))) => format!("give {least} to {most}"),
        _ => why.into(),
    };
    format!("{before}': {plain}")
}

fn is_wrong_command(error: &anyhow::Error) -> bool {
    error.downcast_ref().is_some_and(SessionError::is_wrong_command)
        || error.downcast_ref().is_some_and(BodiesError::is_wrong_command)
        || error.downcast_ref().is_some_and(MakeError::is_wrong_command)
        || error.downcast_ref().is_some_and(DeskError::is_wrong_command)
}

fn hint(error: &anyhow::Error) -> Option<String> {
    let of_session = error.downcast_ref().and_then(SessionError::hint);
    let of_bodies = || error.downcast_ref().and_then(BodiesError::hint);
    let of_studio = || error.downcast_ref().and_then(MakeError::hint);
    let of_drive = || error.downcast_ref().and_then(DriveFailure::hint);
    let of_desk = || error.downcast_ref().and_then(DeskError::hint);
    of_session.or_else(of_bodies).or_else(of_studio).or_else(of_drive).or_else(of_desk)
}

/// Prints an error.
pub(super) fn say(error: &anyhow::Error, json: bool) {
    let hint = hint(error);
    print(&one_line(&error.to_string()), hint.as_deref(), json);
}

fn print(message: &str, hint: Option<&str>, json: bool) {
    if json {
        print_line(&json!({ "error": { "message": message, "hint": hint } }).to_string());
        return;
    }
    print_aside(&format!("error: {message}"));
    if let Some(hint) = hint {
        print_aside(&format!("hint: {hint}"));
    }
}

pub(super) fn one_line(text: &str) -> String {
    text.split('\n').map(str::trim).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_cannot_be_read_are_refused_in_plain_words() {
        for (said, expected) in [
            (
                "invalid value '0' for '--jobs <N>': 0 is not in 1..=64",
                "invalid value '0' for '--jobs <N>': give 1 to 64",
            ),
            ("invalid value '0' for '--n': 0 is not in 1..=4294967295", "invalid value '0' for '--n': give 1 or more"),
            (
                "invalid value 'a' for '--beta <B>': invalid float literal",
                "invalid value 'a' for '--beta <B>': it is not a number",
            ),
            ("unexpected argument '-x' found", "unexpected argument '-x' found"),
        ] {
            assert_eq!(in_plain_words(said), expected);
        }
    }
}
