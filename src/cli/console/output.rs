//! The output of a command: sentences for people, or one JSON object.

use serde_json::{Map, Value};
use std::cell::RefCell;
use std::io::{ErrorKind, Write};
use std::time::Duration;

/// The amount of output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::cli) enum Verbosity {
    Quiet,
    Normal,
    Verbose,
}

/// The result of a command.
pub(in crate::cli) struct Done {
    /// For programs.
    pub json: Map<String, Value>,
    /// For people.
    pub lines: Vec<String>,
    /// The command to type next, or several.
    pub next: Vec<String>,
    /// The part of the work that failed, if the rest was done: one sentence, and what to do.
    pub failed: Option<(String, String)>,
}

pub(in crate::cli) struct Console {
    json: bool,
    pub verbosity: Verbosity,
    notices: RefCell<Vec<String>>,
}

impl Done {
    /// `json` must be an object; `command` and `next` are added to it.
    pub fn new(command: &str, json: Value) -> Self {
        let mut object = Map::new();
        object.insert("command".into(), command.into());
        if let Value::Object(rest) = json {
            object.extend(rest);
        }
        Self { json: object, lines: Vec::new(), next: Vec::new(), failed: None }
    }

    pub fn line(mut self, line: impl Into<String>) -> Self {
        self.lines.push(line.into());
        self
    }

    pub fn lines(mut self, lines: impl IntoIterator<Item = String>) -> Self {
        self.lines.extend(lines);
        self
    }

    pub fn failed(mut self, what: impl Into<String>, hint: impl Into<String>) -> Self {
        self.failed = Some((what.into(), hint.into()));
        self
    }

    pub fn next(mut self, command: impl Into<String>) -> Self {
        self.next.push(command.into());
        self
    }
}

impl Console {
    pub fn new(json: bool, verbosity: Verbosity) -> Self {
        Self { json, verbosity, notices: RefCell::default() }
    }

    /// Prints a warning at once on stderr, and adds it to the JSON object.
    pub fn notices(&self, notices: &[String]) {
        if !self.json {
            notices.iter().for_each(|notice| print_aside(&format!("note: {notice}")));
        }
        self.notices.borrow_mut().extend_from_slice(notices);
    }

    /// Whether stdout receives one JSON object.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints the result of a command.
    ///
    /// **Errors** if stdout cannot be written. A pipe that is closed after some sentences is not a failure; half of a JSON
    /// object is.
    pub fn done(&self, done: &Done) -> std::io::Result<()> {
        if self.json {
            let mut object = done.json.clone();
            object.insert("next".into(), done.next.clone().into());
            if let Some((message, hint)) = &done.failed {
                object.insert("error".into(), serde_json::json!({ "message": message, "hint": hint }));
            }
            if !self.notices.borrow().is_empty() {
                object.insert("notices".into(), self.notices.borrow().clone().into());
            }
            return put_line(&Value::Object(object).to_string());
        }
        match self.done_in_sentences(done) {
            Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
            told => told,
        }
    }

    fn done_in_sentences(&self, done: &Done) -> std::io::Result<()> {
        if self.verbosity > Verbosity::Quiet {
            for line in &done.lines {
                put_line(line)?;
            }
            for (i, next) in done.next.iter().enumerate() {
                put_line(&format!("{} {next}", if i == 0 { "next:" } else { "   or" }))?;
            }
        }
        if let Some((message, hint)) = &done.failed {
            print_aside(&format!("error: {message}"));
            print_aside(&format!("hint: {hint}"));
        }
        Ok(())
    }
}

fn put_line(line: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")?;
    out.flush()
}

/// Prints a line on stdout. A closed pipe is not a failure: the reader does not want the rest.
pub(in crate::cli) fn print_line(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// Prints a line on stderr.
pub(in crate::cli) fn print_aside(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// A duration as text: `0.04 s`, `3.2 s`, `2 min 5 s`.
pub(in crate::cli) fn secs(time: Duration) -> String {
    let secs = time.as_secs_f64();
    match secs {
        s if s < 1.0 => format!("{s:.2} s"),
        s if s < 60.0 => format!("{s:.1} s"),
        s => format!("{} min {:.0} s", (s / 60.0) as u64, s % 60.0),
    }
}
