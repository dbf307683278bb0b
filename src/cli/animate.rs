//! `overcoat animate`: a clip moves the figure.

use super::console::{Context, Done, Progress, secs};
use crate::body::Skinning;
use crate::cloth::{ClothMode, ClothParams, ClothSolver};
use crate::motion::{FrameRange, MotionParams};
use crate::parameters::{Declared, Parameters, Settings};
use crate::session::{NewAnimation, SessionError, ShowIn};
use clap::{Arg, ArgMatches, Command};
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct AnimateArgs {
    /// A clip: .bvh, the animation of a .glb, .gltf or .vrma, an .npz of SMPL poses, the .jsonl of `drive --save`; or one of walk, turn, squat, idle
    #[arg(required_unless_present = "remove")]
    clip: Option<String>,
    /// The animation's name in a file of several; by default the first
    #[arg(long, value_name = "NAME")]
    clip_name: Option<String>,
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
    /// How layers move: by skinning alone, which takes a second; by cloth physics alone; by both, blended afterwards, where
    /// layers may cross; or by both, coupled, which takes a second or more per frame and lets no two layers cross [default:
    /// coupled, lbs where there is no garment]
    #[arg(long, value_parser = mode, value_name = "lbs|physics|post|coupled")]
    mode: Option<ClothMode>,
    /// Compute cloth fast enough to watch, twenty times as fast: layers may cross, and nobody looks whether they do
    #[arg(long, conflicts_with = "solver")]
    draft: bool,
    /// What computes cloth physics: constraints, or mass–spring with Runge–Kutta steps, where layers may cross, and which refuses
    /// small triangles, as scanned garments have them
    #[arg(long, value_parser = solver, value_name = "xpbd|rk4")]
    solver: Option<ClothSolver>,
    /// Simulate a layer as if it were of another fabric, as in jeans=denim; may be given several times
    #[arg(long, value_parser = fabric, value_name = "LAYER=FABRIC")]
    fabric: Vec<(String, String)>,
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
    motion: ParameterArgs<MotionParams>,
    #[command(flatten)]
    cloth: ParameterArgs<ClothParams>,
    /// Remove the animation of that name
    #[arg(long, value_name = "NAME", conflicts_with_all = ["clip", "clip_name", "fps", "frames", "skinning", "mode", "draft", "solver", "fabric", "name", "preview"])]
    remove: Option<String>,
}

fn skinning(text: &str) -> Result<Skinning, String> {
    let found = Skinning::ALL.into_iter().find(|(name, _)| *name == text);
    found.map(|(_, skinning)| skinning).ok_or_else(|| "give lbs or dq".into())
}

fn mode(text: &str) -> Result<ClothMode, String> {
    let found = ClothMode::ALL.into_iter().find(|(name, _)| *name == text);
    found.map(|(_, mode)| mode).ok_or_else(|| "give lbs, physics, post or coupled".into())
}

fn solver(text: &str) -> Result<ClothSolver, String> {
    // A draft has a flag of its own.
    let mut offered = ClothSolver::ALL.into_iter().filter(|(_, solver)| *solver != ClothSolver::Draft);
    let found = offered.find(|(name, _)| *name == text);
    found.map(|(_, solver)| solver).ok_or_else(|| "give xpbd or rk4".into())
}

fn fabric(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((layer, fabric)) if !layer.is_empty() && !fabric.is_empty() => Ok((layer.into(), fabric.into())),
        _ => Err("give LAYER=FABRIC, as in jeans=denim".into()),
    }
}

/// The flags of the parameters of retargeting or of cloth, as typed. They are generated from the declarations.
struct ParameterArgs<P>(Vec<(Declared, String)>, PhantomData<P>);

impl<P: Parameters> ParameterArgs<P> {
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

impl<P: Parameters> clap::FromArgMatches for ParameterArgs<P> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let typed = |declared: Declared| {
            let text = matches.get_one::<String>(&flag_of(&declared))?.clone();
            Some((declared, text))
        };
        Ok(Self(P::declared().into_iter().filter_map(typed).collect(), PhantomData))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<P: Parameters + Default + Serialize> clap::Args for ParameterArgs<P> {
    fn augment_args(command: Command) -> Command {
        let defaults = serde_json::to_value(P::default()).unwrap_or_default();
        command.args(P::declared().into_iter().map(|declared| {
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
        clip_name: args.clip_name,
        name: args.name,
        fps: args.fps,
        frames: args.frames,
        skinning: args.skinning,
        mode: args.mode,
        solver: if args.draft { Some(ClothSolver::Draft) } else { args.solver },
        fabrics: args.fabric.into_iter().collect(),
        cloth: args.cloth.settings()?,
        motion: args.motion.settings()?,
        view: args.preview,
        force: args.force,
    };
    let own_stages = if new.mode_in(writer.session()).is_simulated() { 2 } else { 1 };
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count() + own_stages);
    let (animation, reports) = writer.animate(&new, &mut |event| progress.show(event))?;
    progress.end();
    let measures: BTreeMap<&String, f64> =
        reports.iter().flat_map(|r| &r.measures).map(|(name, x)| (name, *x)).collect();
    let findings: Vec<&String> = reports.iter().flat_map(|report| &report.findings).collect();
    let ran = reports.iter().any(|report| report.ran);
    let count = |measure: &str| measures.get(&measure.to_string()).copied().unwrap_or_default();
    let (frames, lead) = (count("frames"), count("lead_frames"));
    let (moved, layers) = match animation.mode() {
        ClothMode::Skinned => (
            "skinned only",
            "skinned only: cloth does not swing, and the frames are not checked for intersections".into(),
        ),
        ClothMode::Physics | ClothMode::Blended | ClothMode::Coupled => (
            "cloth",
            format!(
                "cloth: {}; it swings by {:.0} mm, its loosest hem by {:.0} mm; skin gave way by up to {:.1} mm",
                match measures.get(&"crossing_pairs".to_string()) {
                    Some(pairs) => format!("{pairs:.0} pairs of faces cross in all frames"),
                    None => "a draft".into(),
                },
                count("swing_mm"),
                count("hem_swing_mm"),
                count("yielded_mm")
            ),
        ),
    };
    let json = json!({
        "session": context.session.display().to_string(),
        "animation": animation,
        "ran": ran,
        "measures": measures,
        "findings": findings,
        "layers": moved,
        "secs": began.elapsed().as_secs_f64(),
    });
    let name = &animation.name;
    let done = if ran { "made" } else { "was up to date" };
    let mut lines = vec![
        format!(
            "{name}: {done}, {frames:.0} {} after {lead:.0} from the bind pose, in {}",
            if frames == 1.0 { "frame" } else { "frames" },
            secs(began.elapsed())
        ),
        layers,
    ];
    lines.extend(findings.iter().map(|finding| format!("  {finding}")));
    Ok(Done::new("animate", json)
        .lines(lines)
        .next(context.overcoat(&format!("view --film {name}.gif")))
        .next(context.overcoat("export character.glb")))
}
