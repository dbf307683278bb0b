//! `overcoat drive`: tracked landmarks move the figure, as they arrive.

mod args;
mod choose;
mod error;
mod play;
mod save;
mod train;
mod vmc;

pub(super) use error::DriveFailure;

use super::console::{Context, Done};

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(super) struct DriveArgs {
    #[command(subcommand)]
    command: Option<DriveCommand>,
    #[command(flatten)]
    play: args::PlayArgs,
}

#[derive(clap::Subcommand)]
enum DriveCommand {
    /// Build a pose library for the paper's method from clips
    Train(train::TrainArgs),
}

pub(super) fn run(args: DriveArgs, context: &Context) -> anyhow::Result<Done> {
    match args.command {
        Some(DriveCommand::Train(args)) => train::train(&args, context),
        None => play::play(args.play, context),
    }
}
