//! `overcoat step`: the list of steps, and edits of it.

use super::console::{Context, Done, Progress};
use crate::session::{Assignment, StepInfo, StepPlace};
use serde_json::json;
use std::path::{Component, Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct StepArgs {
    #[command(subcommand)]
    command: StepCommand,
}

#[derive(clap::Subcommand)]
enum StepCommand {
    /// List the steps: number, name, kind of garment, scan, masks
    List,
    /// Remove a step with its masks
    Remove {
        /// The step
        name: String,
    },
    /// Rename a garment; its masks and results stay
    Rename {
        /// The garment
        old: String,
        /// Its new name
        new: String,
    },
    /// Move a garment before or after another step
    Move {
        /// The garment
        name: String,
        /// The step before which it comes
        #[arg(long, value_name = "OTHER", required_unless_present = "after", conflicts_with = "after")]
        before: Option<String>,
        /// The step after which it comes
        #[arg(long, value_name = "OTHER")]
        after: Option<String>,
    },
    /// Set a step's scan, garment kind, limits or parameters: `set shirt template=blouse segment.color=0.5`
    #[command(
        after_help = "Keys: path, template, until, sleeve, unit, height, up, faces, remesh, surface, voxel, the other options of \
                            `overcoat scan`, and STAGE.PARAMETER for those of `overcoat fit`, `segment`, `stack` and \
                            `weights`. KEY= resets the key to its default."
    )]
    Set {
        /// The step
        name: String,
        /// What is set
        #[arg(required = true, value_name = "KEY=VALUE")]
        set: Vec<String>,
    },
}

pub(super) fn run(args: StepArgs, context: &Context) -> anyhow::Result<Done> {
    match args.command {
        StepCommand::List => list(context),
        StepCommand::Remove { name } => remove(&name, context),
        StepCommand::Rename { old, new } => rename(&old, &new, context),
        StepCommand::Move { name, before: Some(before), .. } => moved(&name, StepPlace::Before(before), context),
        StepCommand::Move { name, after: Some(after), .. } => moved(&name, StepPlace::After(after), context),
        StepCommand::Move { .. } => unreachable!("the parser requires --before or --after"),
        StepCommand::Set { name, set } => assign(&name, &set, context),
    }
}

fn list(context: &Context) -> anyhow::Result<Done> {
    let mut steps = context.reader()?.steps();
    for step in &mut steps {
        step.file = from_here(&context.session, &step.file);
    }
    let json = json!({ "session": context.session.display().to_string(), "steps": steps });
    let width = |of: fn(&StepInfo) -> usize| steps.iter().map(of).max().unwrap_or(0);
    let names = width(|step| step.name.chars().count());
    let kinds = width(|step| kind(step).chars().count());
    let files = width(|step| step.file.chars().count());
    let line = |step: &StepInfo| {
        let line = format!(
            "{:>2}  {:<names$}  {:<kinds$}  {:<files$}  {}{}",
            step.number,
            step.name,
            kind(step),
            step.file,
            masks(step.masks),
            step.outfit.as_ref().map_or(String::new(), |outfit| format!("  outfit {outfit}"))
        );
        line.trim_end().to_string()
    };
    let done = Done::new("step list", json);
    Ok(match steps.is_empty() {
        true => done.line("no steps").next(context.overcoat("scan body FILE")),
        false => done.lines(steps.iter().map(line)),
    })
}

fn kind(step: &StepInfo) -> &str {
    step.template.as_deref().unwrap_or("-")
}

fn masks(count: usize) -> String {
    match count {
        0 => "no masks".into(),
        1 => "1 mask".into(),
        n => format!("{n} masks"),
    }
}

fn remove(name: &str, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let gone = context.writer()?.remove_step(name)?;
    let with = match gone.as_slice() {
        [] => String::new(),
        masks => format!(" and its masks {}", masks.join(", ")),
    };
    let json = json!({
        "session": context.session.display().to_string(),
        "step": name,
        "masks": gone,
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(changed("step remove", json, vec![format!("removed {name}{with}; no file was deleted")], context))
}

fn rename(old: &str, new: &str, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let is_renamed = context.writer()?.rename_step(old, new)?;
    let json = json!({
        "session": context.session.display().to_string(),
        "old": old,
        "new": new,
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(match is_renamed {
        true => changed("step rename", json, vec![format!("renamed {old} to {new}")], context),
        false => Done::new("step rename", json).line(format!("nothing changed: the step is called {old} already")),
    })
}

fn moved(name: &str, place: StepPlace, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    let is_moved = writer.move_step(name, &place)?;
    let order: Vec<String> = writer.session().steps().into_iter().map(|step| step.name).collect();
    let json = json!({
        "session": context.session.display().to_string(),
        "step": name,
        "moved": is_moved,
        "order": order,
        "secs": began.elapsed().as_secs_f64(),
    });
    let order = order.join(", ");
    Ok(match is_moved {
        true => changed("step move", json, vec![format!("moved {name}: {order}")], context),
        false => Done::new("step move", json).line(format!("{name} is there already: {order}")),
    })
}

fn assign(name: &str, set: &[String], context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let set = set.iter().map(|text| Assignment::of_step(text)).collect::<Result<Vec<_>, _>>()?;
    let mut writer = context.writer()?;
    let mut progress = Progress::of_one_stage(&context.console);
    // A path is taken from the current folder, or else from the session's.
    let set: Vec<Assignment> = set.into_iter().map(|set| with_input(set, context)).collect();
    let said = writer.set_step(name, &set, Path::new(""), &mut |event| progress.show(event))?;
    progress.end();
    let json = json!({
        "session": context.session.display().to_string(),
        "step": name,
        "set": said,
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(match said.is_empty() {
        true => Done::new("step set", json).line(format!("nothing changed: {name} has these values already")),
        false => changed("step set", json, said.iter().map(|set| format!("set {set}")).collect(), context),
    })
}

fn with_input(set: Assignment, context: &Context) -> Assignment {
    match set.is_path() && !set.value.is_empty() {
        true => Assignment { value: context.input(PathBuf::from(&set.value)).display().to_string(), ..set },
        false => set,
    }
}

fn changed(command: &'static str, json: serde_json::Value, lines: Vec<String>, context: &Context) -> Done {
    Done::new(command, json).lines(lines).next(context.overcoat("build")).next(context.overcoat("undo"))
}

/// A path of the recipe, relative to the current folder as far as it can be told from the text.
fn from_here(session: &Path, file: &str) -> String {
    let mut path = PathBuf::new();
    for component in session.join(file).components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if matches!(path.components().next_back(), Some(Component::Normal(_))) => {
                path.pop();
            }
            other => path.push(other),
        }
    }
    path.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_recipe_are_shown_from_the_current_folder() {
        for (session, file, expected) in [
            (".", "../scans/0.ply", "../scans/0.ply"),
            ("alice", "../scans/0.ply", "scans/0.ply"),
            ("alice", "own.ply", "alice/own.ply"),
            ("../alice", "../../a/0.ply", "../../a/0.ply"),
            ("alice", "/scans/0.ply", "/scans/0.ply"),
        ] {
            assert_eq!(from_here(Path::new(session), file), expected, "{session} {file}");
        }
    }
}
