//! `overcoat help`: the program, a command, or the glossary.

use super::console::Done;
use crate::session::SessionError;
use serde_json::json;

/// The glossary, as in the documentation.
const GLOSSARY: &str = include_str!("../../docs/glossary.md");

#[derive(clap::Args)]
pub(super) struct HelpArgs {
    /// A command, or `words` for the glossary of terms and measures
    #[arg(value_name = "COMMAND|words")]
    topic: Vec<String>,
}

/// `program` is the command line with all its commands.
pub(super) fn run(args: HelpArgs, mut program: clap::Command) -> anyhow::Result<Done> {
    let text = match args.topic.as_slice() {
        [] => program.render_help().to_string(),
        [words] if words == "words" => GLOSSARY.to_string(),
        path => help_of(program, path)?,
    };
    Ok(Done::new("help", json!({ "topic": args.topic, "text": text })).line(text.trim_end()))
}

fn help_of(program: clap::Command, path: &[String]) -> Result<String, SessionError> {
    let mut command = program.disable_help_subcommand(true);
    command.build();
    for name in path {
        let found = command.get_subcommands().find(|c| c.get_name() == name || c.get_all_aliases().any(|a| a == name));
        command = found.cloned().ok_or_else(|| SessionError::BadRequest {
            what: format!("there is no command '{}'", path.join(" ")),
            hint: "`overcoat help` lists the commands, `overcoat help words` explains the terms".into(),
        })?;
    }
    Ok(command.render_help().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program() -> clap::Command {
        let fit = clap::Command::new("fit").alias("adjust").about("Fits").subcommand(clap::Command::new("deep"));
        clap::Command::new("overcoat").subcommand(fit)
    }

    #[test]
    fn topics_are_the_program_its_commands_and_the_glossary() {
        let text = |topic: &[&str]| {
            let topic = topic.iter().map(|word| word.to_string()).collect();
            run(HelpArgs { topic }, program()).map(|done| done.lines.join("\n"))
        };
        assert!(text(&[]).unwrap().contains("Commands:"));
        assert!(text(&["adjust"]).unwrap().contains("Usage: overcoat fit"));
        assert!(text(&["fit", "deep"]).unwrap().contains("Usage: overcoat fit deep"));
        assert!(text(&["words"]).unwrap().contains("hem loop"));
        assert!(text(&["nonsense"]).unwrap_err().to_string().contains("there is no command 'nonsense'"));
    }
}
