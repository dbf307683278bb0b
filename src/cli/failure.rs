//! Errors as people and programs see them: one sentence, a hint under it, an exit code.

use super::console::{print_aside, print_line};
use crate::session::SessionError;
use serde_json::json;
use std::process::ExitCode;

/// The work failed.
const FAILED: u8 = 1;
/// The command was wrong.
const WRONG_COMMAND: u8 = 2;

/// Tells what went wrong, and gives the exit code for it.
pub(super) fn report(error: &anyhow::Error, json: bool) -> ExitCode {
    let known = error.downcast_ref::<SessionError>();
    let hint = known.and_then(SessionError::hint);
    say(&one_line(&error.to_string()), hint.as_deref(), json);
    ExitCode::from(if known.is_some_and(SessionError::is_wrong_command) { WRONG_COMMAND } else { FAILED })
}

/// The same for arguments that cannot be parsed; help and version are no failure.
pub(super) fn report_usage(error: &clap::Error, json: bool) -> ExitCode {
    if !error.use_stderr() {
        // As above: a closed pipe is no failure.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.render().to_string();
    let message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_string();
    // Arguments that are missing stand in lines of their own.
    let missing: Vec<&str> =
        text.lines().skip(1).take_while(|l| l.starts_with("  ")).map(str::trim).filter(|l| !l.is_empty()).collect();
    let message = if missing.is_empty() { message } else { format!("{message} {}", missing.join(" ")) };
    let tip = text.lines().find_map(|l| l.trim().strip_prefix("tip: ").map(str::to_string));
    let usage = text.lines().find_map(|l| l.strip_prefix("Usage: ").map(|u| format!("usage: {u}")));
    let hint = tip.or(usage).unwrap_or_else(|| "`overcoat --help` shows the commands".into());
    let message =
        if message.is_empty() || text.starts_with("Scans of") { "no command was given".into() } else { message };
    say(&message, Some(&hint), json);
    ExitCode::from(WRONG_COMMAND)
}

fn say(message: &str, hint: Option<&str>, json: bool) {
    if json {
        print_line(&json!({ "error": { "message": message, "hint": hint } }).to_string());
        return;
    }
    print_aside(&format!("error: {message}"));
    if let Some(hint) = hint {
        print_aside(&format!("hint: {hint}"));
    }
}

fn one_line(text: &str) -> String {
    text.split('\n').map(str::trim).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}
