//! `overcoat completions`: what a shell completes, and the man pages.

use super::console::{Context, Done};
use crate::session::NewFolder;
use anyhow::Result;
use clap_complete::Shell;
use serde_json::json;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(super) struct CompletionsArgs {
    /// The shell, whose script is printed; or `man`, for a folder of man pages
    #[arg(value_enum)]
    of: Of,
    /// With `man`: the new folder
    #[arg(value_name = "FOLDER", required_if_eq("of", "man"))]
    folder: Option<PathBuf>,
}

/// The command as typed.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Of {
    Bash,
    Zsh,
    Fish,
    Man,
}

/// `program` is the command line with all its commands.
pub(super) fn run(args: CompletionsArgs, mut program: clap::Command, context: &Context) -> Result<Done> {
    let shell = match args.of {
        Of::Bash => Shell::Bash,
        Of::Zsh => Shell::Zsh,
        Of::Fish => Shell::Fish,
        Of::Man => return man_pages(args.folder.unwrap_or_default(), program, context),
    };
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut program, "overcoat", &mut script);
    let script = String::from_utf8_lossy(&script).trim_end().to_string();
    Ok(Done::new("completions", json!({ "shell": shell.to_string(), "script": script })).line(script))
}

fn man_pages(folder: PathBuf, program: clap::Command, context: &Context) -> Result<Done> {
    let path = context.input(folder);
    let folder = NewFolder::create(&path)?;
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    write_page(&program, "overcoat", &folder, &mut pages)?;
    let count = pages.len();
    Ok(Done::new("completions", json!({ "folder": path.display().to_string(), "pages": pages }))
        .line(format!("wrote {count} man pages to {}: `man -l {0}/overcoat.1`", path.display())))
}

/// Writes the page of a command and those of its commands.
fn write_page(command: &clap::Command, name: &str, folder: &NewFolder, pages: &mut Vec<String>) -> Result<()> {
    let file = format!("{name}.1");
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone().name(name.to_string()).bin_name(name.replace('-', " "))).render(&mut page)?;
    folder.write(file.as_ref(), &page)?;
    pages.push(file);
    command.get_subcommands().try_for_each(|sub| write_page(sub, &format!("{name}-{}", sub.get_name()), folder, pages))
}
