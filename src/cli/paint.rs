//! `overcoat paint`: a page on this machine on which garments are painted.

use super::console::{Context, Done, Verbosity, print_aside, print_line};
use super::status::next_in;
use super::watch::ended_by_signal;
use crate::desk::Painting;
use serde_json::json;
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;

#[derive(clap::Args)]
pub(super) struct PaintArgs {
    /// The garment to begin with; the page can switch to the others
    layer: Option<String>,
    /// The port of the page [default: a free one]
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// Do not open the page in the browser
    #[arg(long)]
    no_browser: bool,
}

pub(super) fn run(args: PaintArgs, context: &Context) -> anyhow::Result<Done> {
    let ended = ended_by_signal()?;
    let painting = Painting::of_layers(&context.session, args.layer.as_deref(), args.port)?;
    let changes = serve(&painting, args.no_browser, &ended, context);
    let json = json!({ "session": context.session.display().to_string(), "changes": changes });
    let mut done = Done::new("paint", json).line(in_words(changes));
    if changes > 0 {
        done.next = next_in(&context.reader()?, context)?;
    }
    Ok(done)
}

/// Serves a page until Ctrl-C; returns the number of changes.
pub(super) fn serve(painting: &Painting, no_browser: bool, ended: &AtomicBool, context: &Context) -> usize {
    let address = painting.address();
    // With --json, stdout receives only the final object.
    let say = |line: &str| if context.console.is_json() { print_aside(line) } else { print_line(line) };
    say(&format!("painting at {address}"));
    if context.console.verbosity != Verbosity::Quiet {
        say("stop with Ctrl-C; every stroke is saved at once");
    }
    if !no_browser && !open_in_browser(&address) {
        print_aside("no browser could be opened: open the address yourself");
    }
    painting.serve(ended)
}

pub(super) fn in_words(changes: usize) -> String {
    match changes {
        0 => "painted nothing".to_string(),
        1 => "painted 1 change".to_string(),
        n => format!("painted {n} changes"),
    }
}

/// Whether the system's way to open an address could be started.
fn open_in_browser(address: &str) -> bool {
    let mut command = match std::env::consts::OS {
        "macos" => Command::new("open"),
        "windows" => {
            let mut command = Command::new("rundll32");
            command.arg("url.dll,FileProtocolHandler");
            command
        }
        _ => Command::new("xdg-open"),
    };
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let Ok(mut child) = command.spawn() else { return false };
    // It ends by itself; some browsers stay in it.
    std::thread::sleep(std::time::Duration::from_millis(300));
    !matches!(child.try_wait(), Ok(Some(status)) if !status.success())
}
