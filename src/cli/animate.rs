//! `overcoat animate`: a clip moves the figure.

use super::console::{Context, Done, Progress, secs};
use crate::body::Skinning;
use crate::motion::{FrameRange, MotionParams};
use crate::parameters::{Declared, Parameters, Settings};
use crate::session::{NewAnimation, SessionError, ShowIn};
use clap::{Arg, ArgMatches, Command};
use serde_json::json;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct AnimateArgs {
    /// A clip: .bvh, or the animation of a .glb or .gltf; or one of walk, turn, squat, idle
    #[arg(required_unless_present = "remove")]
    clip: Option<String>,
    /// Frames per second; by default the clip's own, or an even part of them if they are more than 60
    #[arg(long, value_name = "N")]
    fps: Option<f64>,
    /// Use these frames only, counted from 0; B is not included
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// How joints move the surfaces: linear blending, as everywhere, or dual quaternions, which keep the volume of twisted
    /// limbs
    #[arg(long, value_parser = skinning, value_name = "lbs|dq")]
    skinning: Option<Skinning>,
    /// The animation's name; by default the clip's. An animation of the same name is replaced
    #[arg(long)]
    name: Option<String>,
    /// Play it in the Rerun viewer at a URL; without a URL, in the one that runs on this machine or is started; with a file
    /// name, write a recording
    #[arg(long, value_name = "OUT.rrd|URL", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    preview: Option<ShowIn>,
    /// With --preview: replace a file that Overcoat did not write, or that was changed since
    #[arg(long, requires = "preview")]
    force: bool,
    #[command(flatten)]
    motion: MotionArgs,
    /// Remove the animation of that name
    #[arg(long, value_name = "NAME", conflicts_with_all = ["clip", "fps", "frames", "skinning", "name", "preview"])]
    remove: Option<String>,
}

fn skinning(text: &str) -> Result<Skinning, String> {
    let found = Skinning::ALL.into_iter().find(|(name, _)| *name == text);
    found.map(|(_, skinning)| skinning).ok_or_else(|| "give lbs or dq".into())
}

/// The flags of the parameters of retargeting, as typed. They are generated from the declarations.
struct MotionArgs(Vec<(Declared, String)>);

impl MotionArgs {
    fn settings(&self) -> Result<Settings, SessionError> {
        let read = |(declared, text): &(Declared, String)| match declared.allowed.read(text) {
            Some(setting) => Ok((declared.name.to_string(), setting)),
            None => Err(SessionError::BadRequest {
                what: format!("--{} cannot be '{text}'", flag_of(declared)),
                hint: format!("give {}", declared.allowed),
            }),
        };
        self.0.iter().map(read).collect()
    }
}

fn flag_of(declared: &Declared) -> String {
    declared.name.replace('_', "-")
}

impl clap::FromArgMatches for MotionArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let typed = |declared: Declared| {
            let text = matches.get_one::<String>(&flag_of(&declared))?.clone();
            Some((declared, text))
        };
        Ok(Self(MotionParams::declared().into_iter().filter_map(typed).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl clap::Args for MotionArgs {
    fn augment_args(command: Command) -> Command {
        let defaults = serde_json::to_value(MotionParams::default()).unwrap_or_default();
        command.args(MotionParams::declared().into_iter().map(|declared| {
            let Declared { name, allowed, about } = declared;
            Arg::new(flag_of(&declared))
                .long(flag_of(&declared))
                .value_name("VALUE")
                .allow_hyphen_values(true)
                .help(format!("{about} [{allowed}; default: {}]", defaults[name]))
                .help_heading("Parameters, remembered in the recipe")
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

pub(super) fn run(args: AnimateArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    if let Some(name) = &args.remove {
        writer.remove_animation(name)?;
        let json = json!({ "session": context.session.display().to_string(), "removed": name });
        return Ok(Done::new("animate", json).line(format!("removed the animation {name}")));
    }
    let new = NewAnimation {
        clip: args.clip.unwrap_or_default(),
        name: args.name,
        fps: args.fps,
        frames: args.frames,
        skinning: args.skinning,
        motion: args.motion.settings()?,
        view: args.preview,
        force: args.force,
    };
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count() + 1);
    let (animation, report) = writer.animate(&new, &mut |event| progress.show(event))?;
    progress.end();
    let count = |measure: &str| report.measures.get(measure).copied().unwrap_or_default();
    let (frames, lead) = (count("frames"), count("lead_frames"));
    let json = json!({
        "session": context.session.display().to_string(),
        "animation": animation,
        "ran": report.ran,
        "measures": report.measures,
        "findings": report.findings,
        "layers": "skinned only",
        "secs": began.elapsed().as_secs_f64(),
    });
    let name = &animation.name;
    let done = if report.ran { "made" } else { "was up to date" };
    let mut lines = vec![
        format!(
            "{name}: {done}, {frames:.0} {} after {lead:.0} from the bind pose, in {}",
            if frames == 1.0 { "frame" } else { "frames" },
            secs(began.elapsed())
        ),
        "skinned only: cloth does not swing, and the frames are not checked for intersections".into(),
    ];
    lines.extend(report.findings.iter().map(|finding| format!("  {finding}")));
    Ok(Done::new("animate", json)
        .lines(lines)
        .next(context.overcoat(&format!("view --film {name}.gif")))
        .next(context.overcoat("export character.glb")))
}
