//! `overcoat fit`, `segment`, `stack`, `weights`: single stages, their parameters as flags. The flags are generated
//! from the declarations of the parameters.

use super::console::{Context, Done, Progress, secs};
use crate::parameters::Settings;
use crate::session::{Parameter, SessionError, ShowIn, Stage, StageRequest, parameters_of};
use clap::{Arg, ArgAction, ArgMatches, Command};
use serde_json::json;
use std::net::IpAddr;
use std::time::Instant;

/// A command: its stages, and the stages whose flags begin with the stage's name.
struct StageCommand {
    name: &'static str,
    stages: &'static [Stage],
    prefixed: &'static [Stage],
}

pub(super) const FIT: usize = 0;
pub(super) const SEGMENT: usize = 1;
pub(super) const STACK: usize = 2;
pub(super) const WEIGHTS: usize = 3;

const COMMANDS: [StageCommand; 4] = [
    StageCommand { name: "fit", stages: &[Stage::Fit, Stage::Register, Stage::Pose], prefixed: &[Stage::Register] },
    StageCommand { name: "segment", stages: &[Stage::Segment, Stage::Cut], prefixed: &[Stage::Cut] },
    StageCommand { name: "stack", stages: &[Stage::Rig, Stage::Stack], prefixed: &[Stage::Rig] },
    StageCommand { name: "weights", stages: &[Stage::Figure, Stage::Press], prefixed: &[Stage::Press] },
];

impl StageCommand {
    /// All parameters by flag. One flag may set the same parameter of the body and of garments.
    fn flags(&self) -> Vec<(String, Vec<&'static Parameter>)> {
        let mut flags: Vec<(String, Vec<&'static Parameter>)> = Vec::new();
        for parameter in self.stages.iter().flat_map(|&stage| parameters_of(stage)) {
            let prefix = match self.prefixed.contains(&parameter.stage) {
                true => format!("{}-", parameter.stage),
                false => String::new(),
            };
            let flag = prefix + &flag_of(parameter);
            match flags.iter_mut().find(|(known, _)| *known == flag) {
                Some((_, same)) => same.push(parameter),
                None => flags.push((flag, vec![parameter])),
            }
        }
        flags
    }

    fn parse(&self, matches: &ArgMatches) -> Result<StageRequest, SessionError> {
        let mut settings = Vec::new();
        for (flag, parameters) in self.flags() {
            let Some(text) = matches.get_one::<String>(&flag) else { continue };
            let stages = parameters.iter().map(|p| p.stage).collect();
            // A value may be valid for only one of the stages; the recipe of each step is checked when the parameter is
            // set.
            let accepted = parameters.iter().find_map(|parameter| parameter.read(text).ok());
            let setting = accepted.map_or_else(|| parameters[parameters.len() - 1].read(text), Ok)?;
            settings.push((stages, parameters[0].name.to_string(), setting));
        }
        Ok(StageRequest {
            name: self.name.into(),
            stages: self.stages.to_vec(),
            step: matches.get_one::<String>("step").cloned(),
            settings,
            reset: matches.get_flag("reset"),
            view: matches
                .try_get_one::<ShowIn>("view")
                .ok()
                .flatten()
                .cloned()
                .map(|view| view.with_bind(bind_of(matches))),
            force: matches!(matches.try_get_one::<bool>("force"), Ok(Some(true))),
        })
    }
}

/// The flags of a scan's own parameters, as typed.
#[derive(Default)]
pub(super) struct ReadingArgs(Vec<(&'static Parameter, String)>);

impl ReadingArgs {
    /// The parameters that the flags set.
    pub(super) fn settings(&self) -> Result<Settings, SessionError> {
        self.0.iter().map(|(parameter, text)| Ok((parameter.name.to_string(), parameter.read(text)?))).collect()
    }
}

impl clap::FromArgMatches for ReadingArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let typed = |p: &'static Parameter| Some((p, matches.get_one::<String>(&flag_of(p))?.clone()));
        Ok(Self(parameters_of(Stage::Scan).filter_map(typed).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl clap::Args for ReadingArgs {
    fn augment_args(command: Command) -> Command {
        command.args(parameters_of(Stage::Scan).map(|p| arg_of(flag_of(p), &[p])))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

fn flag_of(parameter: &Parameter) -> String {
    parameter.name.replace('_', "-")
}

fn arg_of(flag: String, parameters: &[&Parameter]) -> Arg {
    let about = parameters[0].about;
    let differs = |p: &&&Parameter| p.allowed != parameters[0].allowed;
    let others: String = parameters
        .iter()
        .filter(differs)
        .map(|p| format!("; stage {}: {} [{}]", p.stage, p.about, p.allowed))
        .collect();
    Arg::new(flag.clone())
        .long(flag)
        .value_name("VALUE")
        .allow_hyphen_values(true)
        .help(format!("{about} [{}; default: {}]{others}", parameters[0].allowed, defaults(parameters)))
        .help_heading("Parameters, remembered in the recipe")
}

/// The arguments of the command `COMMANDS[K]`, as typed.
pub(super) struct StageArgs<const K: usize>(ArgMatches);

impl<const K: usize> clap::FromArgMatches for StageArgs<K> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(matches.clone()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0 = matches.clone();
        Ok(())
    }
}

impl<const K: usize> clap::Args for StageArgs<K> {
    fn augment_args(command: Command) -> Command {
        let step = Arg::new("step").value_name("STEP").help("The step; by default every step that has the stage");
        let reset = Arg::new("reset")
            .long("reset")
            .action(ArgAction::SetTrue)
            .help("Forget the parameters that were set before");
        let flags = COMMANDS[K].flags().into_iter().map(|(flag, parameters)| arg_of(flag, &parameters));
        let view = Arg::new("view")
            .long("view")
            .value_name("OUT.rrd|URL")
            .num_args(0..=1)
            .require_equals(true)
            .default_missing_value("")
            .value_parser(clap::value_parser!(ShowIn))
            .help(
                "Show each iteration of the fits in the Rerun viewer at a URL; without a URL, in the one that runs on this \
                 machine or is started; with a file name, write a recording",
            );
        let force = Arg::new("force")
            .long("force")
            .action(ArgAction::SetTrue)
            .requires("view")
            .help("With --view: replace a file that Overcoat did not write, or that was changed since");
        let bind = Arg::new("bind")
            .long("bind")
            .value_name("ADDR")
            .requires("view")
            .value_parser(interface)
            .help("With --view: the interface on which a viewer that is started listens [default: 127.0.0.1]");
        let shown = if K == FIT { vec![view, bind, force] } else { Vec::new() };
        command.arg(step).arg(reset).args(shown).args(flags)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

/// The file of the recording, if the target is a file.
fn bind_of(matches: &ArgMatches) -> Option<IpAddr> {
    matches.try_get_one::<IpAddr>("bind").ok().flatten().copied()
}

/// Reads an interface for a viewer. The program itself reaches the viewer over the loopback interface.
pub(super) fn interface(text: &str) -> Result<IpAddr, String> {
    match text.parse::<IpAddr>() {
        Ok(address) if address.is_loopback() || address.is_unspecified() => Ok(address),
        _ => Err("give 127.0.0.1 for this machine only, or 0.0.0.0 or :: for all interfaces".into()),
    }
}

pub(super) fn file_of(view: &ShowIn) -> Option<String> {
    match view {
        ShowIn::File(path) => Some(path.display().to_string()),
        ShowIn::Viewer(_) | ShowIn::ViewerAt(_) => None,
    }
}

fn defaults(parameters: &[&Parameter]) -> String {
    let first = parameters[0].default();
    match parameters.iter().find(|p| p.default() != first) {
        None => first,
        Some(other) => format!("{first} for the body, {} for garments", other.default()),
    }
}

pub(super) fn run<const K: usize>(args: StageArgs<K>, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let request = COMMANDS[K].parse(&args.0)?;
    let mut writer = context.writer()?;
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count());
    let run = writer.run_stages(&request, &mut |event| progress.show(event))?;
    progress.end();
    let ran = run.reports.iter().filter(|r| r.ran).count();
    let json = json!({
        "session": context.session.display().to_string(),
        "step": request.step,
        "set": run.set,
        "ran": ran,
        "stages": run.reports,
        "recording": request.view.as_ref().and_then(file_of),
        "secs": began.elapsed().as_secs_f64(),
    });
    let took = secs(began.elapsed());
    let said = match ran {
        0 => format!("{} was up to date, in {took}", request.name),
        1 => format!("ran 1 stage in {took}"),
        n => format!("ran {n} stages in {took}"),
    };
    let mut done = Done::new(COMMANDS[K].name, json).lines(run.set.iter().map(|set| format!("set {set}"))).line(said);
    if !run.set.is_empty() {
        done = done.next(context.overcoat("undo"));
    }
    if let Some(path) = request.view.as_ref().and_then(file_of) {
        done = done.next(format!("rerun {path}"));
    }
    Ok(done.next(context.overcoat("build")).next(context.overcoat("view --sheet sheet.png")))
}
