//! The arguments of `overcoat drive STREAM`.

use crate::scan::{Unit, Up};
use crate::session::ShowIn;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(super) struct PlayArgs {
    /// A stream of landmarks: our JSON lines, MediaPipe Pose, Kinect, or an OpenSim .trc; `-` reads standard input as it
    /// arrives. It begins with 2 seconds in a T- or A-pose
    #[arg(value_name = "STREAM|-", required_unless_present = "vmc")]
    pub stream: Option<PathBuf>,
    /// Receive the bones of a live tracker on this port of this machine, in the VMC protocol (usually 39539 or 39540); ends when
    /// the tracker is silent for 5 seconds
    #[arg(long, value_name = "PORT", conflicts_with_all = ["stream", "film", "unit", "up", "height", "raw", "method", "library", "key_interval", "between", "among"])]
    pub vmc: Option<u16>,
    /// How landmarks become a figure: by inverse kinematics, or by the paper's Laplacian offsets with its pose recognition
    #[arg(long, value_enum, default_value = "ik")]
    pub method: MethodWord,
    /// With --method laplacian: a pose library of `drive train` instead of the one that comes with the program
    #[arg(long, value_name = "LIBRARY.poses")]
    pub library: Option<PathBuf>,
    /// With --method laplacian: solve for a key pose at this interval only, in seconds, and interpolate between; the figure is
    /// late by as much [default: every frame]
    #[arg(long, value_name = "SECS", value_parser = interval, default_value = "0", hide_default_value = true)]
    pub key_interval: f64,
    /// With --key-interval: interpolate rotations and solve with them, or move vertices straight, as the paper does
    #[arg(long, value_enum, default_value = "rotations")]
    pub between: BetweenWord,
    /// Choose the figure whose size is nearest to the wearer's among this session's and these sessions'; needs a file
    #[arg(long, value_name = "SESSION", num_args = 1..)]
    pub among: Vec<PathBuf>,
    /// Write the poses as a clip, frame by frame; `animate` takes it
    #[arg(long, value_name = "CLIP.jsonl")]
    pub save: Option<PathBuf>,
    /// Draw a film of the landmarks and the figure side by side
    #[arg(long, value_name = "OUT.gif")]
    pub film: Option<PathBuf>,
    /// Show it in the Rerun viewer at a URL; without a URL, in the one that runs on this machine or is started; with a file
    /// name, write a recording. This is the default where neither --save nor --film is given
    #[arg(long, value_name = "OUT.rrd|URL", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub view: Option<ShowIn>,
    /// Unit of the stream (m, dm, cm, mm, in); guessed by default
    #[arg(long)]
    pub unit: Option<Unit>,
    /// Axis of the stream that points up (+y, -z, …); guessed by default
    #[arg(long, value_name = "±AXIS", allow_hyphen_values = true)]
    pub up: Option<Up>,
    /// Stature of the wearer in metres; by default it follows from the landmarks
    #[arg(long, value_name = "METRES", value_parser = stature)]
    pub height: Option<f64>,
    /// Move garments by cloth physics, fast enough to watch: layers may cross; without it, they follow the skin
    #[arg(long)]
    pub cloth: bool,
    /// Take the landmarks as they are: no filter, and no bridge over short losses
    #[arg(long)]
    pub raw: bool,
    /// Replace files that Overcoat did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum MethodWord {
    Ik,
    Laplacian,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum BetweenWord {
    Rotations,
    Linear,
}

fn interval(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(secs) if (0.0..=10.0).contains(&secs) => Ok(secs),
        _ => Err("give seconds, 0 to 10".into()),
    }
}

fn stature(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(metres) if (1.2..=2.3).contains(&metres) => Ok(metres),
        _ => Err("give the stature of an adult in metres, 1.2 to 2.3".into()),
    }
}
