//! The command line: arguments as typed, arguments as validated, run. One file per command. Results go to stdout,
//! progress to stderr.

mod animate;
pub mod bodies;
mod body;
mod branch;
mod build;
mod completions;
mod console;
mod demo;
mod drive;
mod export;
mod failure;
mod fsck;
mod help;
mod log;
mod mask;
mod measure;
mod new;
mod paint;
mod photo;
mod record;
mod redo;
mod replay;
mod report;
mod scan;
mod stages;
mod status;
mod step;
mod studio;
mod templates;
mod tryon;
mod undo;
mod view;
mod watch;

use crate::session::SessionError;
use clap::{CommandFactory, Parser, Subcommand};
use console::{Commands, Console, Context, Done, Verbosity, fault};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

/// The heading of the options that every command has.
const GLOBAL: &str = "Global options";

/// Scans of a person being dressed, one garment after another, into a rigged, layered character.
#[derive(Parser)]
#[command(
    name = "overcoat",
    version,
    disable_help_subcommand = true,
    after_help = "Start with: overcoat demo\n`overcoat help COMMAND` explains a command, `overcoat help words` the terms."
)]
struct Args {
    /// The session's folder, instead of the current one
    #[arg(short = 'C', global = true, value_name = "DIR", help_heading = GLOBAL)]
    session: Option<PathBuf>,
    /// Print one JSON object on stdout and nothing else
    #[arg(long, global = true, help_heading = GLOBAL)]
    json: bool,
    /// Print errors only
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = GLOBAL)]
    quiet: bool,
    /// Print more: every measure, with its unit
    #[arg(short, long, global = true, help_heading = GLOBAL)]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build a character from the scans that come with the program
    Demo(demo::DemoArgs),
    /// Start a session
    New(new::NewArgs),
    /// Add a scan: the bare body first, then each garment, from the inside out
    Scan(scan::ScanArgs),
    /// Put a garment from a mesh file, instead of a scan, onto the figure
    #[command(name = "tryon")]
    TryOn(tryon::TryOnArgs),
    /// Run every stage that is out of date
    Build(build::BuildArgs),
    /// Run the fit only: the body model to the bare scan, the figure inside a garment's scan
    Fit(stages::StageArgs<{ stages::FIT }>),
    /// Run up to the garment's labels and outline
    Segment(stages::StageArgs<{ stages::SEGMENT }>),
    /// Run up to the garment's bind-pose shape, clear of the layers inside
    Stack(stages::StageArgs<{ stages::STACK }>),
    /// Run up to the skin and physics weights of the garment on the figure
    #[command(alias = "weigh")]
    Weights(stages::StageArgs<{ stages::WEIGHTS }>),
    /// List the steps, or edit them: remove, rename, move, set
    Step(step::StepArgs),
    /// Correct a garment's labels by brush strokes or a label file
    Mask(mask::MaskArgs),
    /// Paint garments on a page in the browser: brush, lasso, undo; the cut follows each stroke
    Paint(paint::PaintArgs),
    /// Cut and rebuild a garment whenever its mask file is saved
    Watch(watch::WatchArgs),
    /// A guided prompt through a dressing session
    Record(record::RecordArgs),
    /// Show the verdict on each step, what is out of date, and with -v every measure
    Status(status::StatusArgs),
    /// Undo the last change: a scan, a mask, a parameter
    Undo(undo::UndoArgs),
    /// Redo what was undone
    Redo(redo::RedoArgs),
    /// List the changes, done and undone
    Log(log::LogArgs),
    /// Try something else without losing the current state
    Branch(branch::BranchArgs),
    /// Check every file of the session and rebuild what is damaged or missing
    Fsck(fsck::FsckArgs),
    /// Run a recipe in a new session, on the same scans or on those of other people
    Replay(replay::ReplayArgs),
    /// Write the figure, or a step, as files
    Export(export::ExportArgs),
    /// Write a recording for the Rerun viewer, or a picture of every step
    View(view::ViewArgs),
    /// Write one page about the session: every step, the layers in 3D, verdicts, measures
    Report(report::ReportArgs),
    /// Move the figure by a motion-capture clip, or by one of ours
    Animate(animate::AnimateArgs),
    /// Move the figure by tracked landmarks, as they arrive
    Drive(drive::DriveArgs),
    /// Compare the session with ground truth
    Measure(measure::MeasureArgs),
    /// Generate a synthetic subject and its scans, with ground truth
    Studio(studio::StudioArgs),
    /// Body models: look at one, measure a body, build or import one
    Body(body::BodyArgs),
    /// List the kinds of garment, or paint one on the body
    Templates(templates::TemplatesArgs),
    /// Print what a shell needs to complete commands, or write man pages
    Completions(completions::CompletionsArgs),
    /// Explain a command, or the terms and measures (`help words`)
    Help(help::HelpArgs),
}

/// Runs the program and returns its exit code: 0 done, 1 the work failed, 2 the command was wrong.
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    let json = args.iter().any(|a| a == "--json");
    let parsed = match Args::try_parse_from(&args) {
        Ok(parsed) => parsed,
        Err(e) => return failure::report_usage(&e, json),
    };
    let verbosity = match (parsed.quiet, parsed.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    };
    let context = Context {
        session_given: parsed.session.is_some(),
        session: parsed.session.unwrap_or_else(|| PathBuf::from(".")),
        console: Console::new(parsed.json, verbosity),
    };
    match fault::caught(parsed.verbose, || run(parsed.command, &context)) {
        Ok(done) => match context.console.done(&done) {
            Ok(()) => failure::of_part(&done),
            Err(e) => failure::report_unsaid(&e),
        },
        Err(e) => failure::report(&e, parsed.json),
    }
}

/// The commands as `record` runs them.
const COMMANDS: Commands = Commands { names: command_names, run: run_typed };

fn command_names() -> Vec<String> {
    let names = |c: &clap::Command| {
        std::iter::once(c.get_name()).chain(c.get_all_aliases()).map(String::from).collect::<Vec<_>>()
    };
    Args::command().get_subcommands().flat_map(names).collect()
}

/// Runs a command as typed, without the program's name.
fn run_typed(words: &[String], context: &Context) -> anyhow::Result<Done> {
    let typed = std::iter::once("overcoat".to_string()).chain(words.iter().cloned());
    match Args::try_parse_from(typed) {
        Ok(parsed) => run(parsed.command, context),
        Err(e) if !e.use_stderr() => {
            Ok(Done::new("help", serde_json::json!({})).line(e.render().to_string().trim_end()))
        }
        Err(e) => {
            let (what, hint) = failure::sentence_and_hint(&e.render().to_string());
            Err(SessionError::BadRequest { what, hint }.into())
        }
    }
}

fn run(command: Command, context: &Context) -> anyhow::Result<Done> {
    match command {
        Command::Demo(args) => demo::run(args, context),
        Command::New(args) => new::run(args, context),
        Command::Scan(args) => scan::run(args, context),
        Command::TryOn(args) => tryon::run(args, context),
        Command::Build(args) => build::run(args, context),
        Command::Fit(args) => stages::run(args, context),
        Command::Segment(args) => stages::run(args, context),
        Command::Stack(args) => stages::run(args, context),
        Command::Weights(args) => stages::run(args, context),
        Command::Step(args) => step::run(args, context),
        Command::Mask(args) => mask::run(args, context),
        Command::Paint(args) => paint::run(args, context),
        Command::Watch(args) => watch::run(args, context),
        Command::Record(args) => record::run(args, context, COMMANDS),
        Command::Status(args) => status::run(args, context),
        Command::Undo(args) => undo::run(args, context),
        Command::Redo(args) => redo::run(args, context),
        Command::Log(args) => log::run(args, context),
        Command::Branch(args) => branch::run(args, context),
        Command::Fsck(args) => fsck::run(args, context),
        Command::Replay(args) => replay::run(args, context),
        Command::Export(args) => export::run(args, context),
        Command::View(args) => view::run(args, context),
        Command::Report(args) => report::run(args, context),
        Command::Animate(args) => animate::run(args, context),
        Command::Drive(args) => drive::run(args, context),
        Command::Measure(args) => measure::run(args, context),
        Command::Studio(args) => studio::run(args, context),
        Command::Body(args) => body::run(args, context),
        Command::Templates(args) => templates::run(args, context),
        Command::Completions(args) => completions::run(args, Args::command(), context),
        Command::Help(args) => help::run(args, Args::command()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commands_are_well_formed() {
        Args::command().debug_assert();
    }
}
