//! `overcoat view`: the session as a Rerun recording and as pictures.

use super::console::{Context, Done, Progress, secs};
use crate::session::{Content, Film, SessionError, girth_notes};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct ViewArgs {
    /// Write a recording for the Rerun viewer
    #[arg(long, value_name = "OUT.rrd")]
    save: Option<PathBuf>,
    /// Draw every step, scan beside result, from three sides
    #[arg(long, value_name = "OUT.png")]
    sheet: Option<PathBuf>,
    /// Draw one picture of everything: the scans, the separated layers, the posed figure
    #[arg(long, value_name = "OUT.png")]
    poster: Option<PathBuf>,
    /// Draw the weights of every layer: its joints as blended colours, its physics weights per vertex and per part
    #[arg(long, value_name = "OUT.png")]
    weights: Option<PathBuf>,
    /// Draw the air between each garment and the skin as colours, with the ease at chest, waist, hip, thigh and upper arm
    #[arg(long, value_name = "OUT.png")]
    ease: Option<PathBuf>,
    /// Draw how certain each place of an estimated body is, in millimetres
    #[arg(long, value_name = "OUT.png")]
    confidence: Option<PathBuf>,
    /// Draw the frames of an animation: a film, or a new folder for one picture per frame
    #[arg(long, value_name = "OUT.gif|DIR")]
    film: Option<PathBuf>,
    /// With --film: the animation, or several to be shown side by side, as in --clip walk,turn; by default the last one
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "film")]
    clip: Vec<String>,
    /// With --film: leave out what other layers cover, as `export --hide-covered` does
    #[arg(long, requires = "film")]
    hide_covered: bool,
    /// Replace files that Overcoat did not write, or that were changed since
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: ViewArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let pictures = [&args.sheet, &args.poster, &args.weights, &args.ease, &args.confidence];
    if args.save.is_none() && args.film.is_none() && pictures.iter().all(|path| path.is_none()) {
        let what =
            "nothing to write: `view` needs --save, --sheet, --poster, --weights, --ease, --confidence or --film"
                .into();
        let hint =
            "--save OUT.rrd writes a recording for the Rerun viewer, --sheet OUT.png draws every step, --poster OUT.png one picture of all, --weights OUT.png the skin and physics weights, --ease OUT.png how wide the garments are, --confidence OUT.png how certain an estimated body is, --film OUT.gif an animation"
                .into();
        return Err(SessionError::BadRequest { what, hint }.into());
    }
    let session = context.reader()?;
    let mut outputs = session.outputs(args.force);
    let pictures = pictures.map(|path| (path, Content::Picture));
    for (path, content) in pictures.into_iter().chain([(&args.save, Content::Recording)]) {
        path.iter().try_for_each(|path| outputs.claim(path, content))?;
    }
    let mut done_lines = Vec::new();
    let mut next = Vec::new();
    if args.sheet.is_some() || args.poster.is_some() {
        let mut progress = Progress::of_one_stage(&context.console);
        session.bake_for_pictures(&mut |layer| progress.describe(format!("texture of {layer}")))?;
        progress.end();
    }
    if let Some(path) = &args.sheet {
        session.write_sheet(path, &mut outputs)?;
        done_lines.push(format!("drew {}", path.display()));
    }
    if let Some(path) = &args.poster {
        session.write_poster(path, &mut outputs)?;
        done_lines.push(format!("drew {}", path.display()));
    }
    let mut eases = serde_json::Map::new();
    if let Some(path) = &args.ease {
        for (layer, ease) in session.write_ease(path, &mut outputs)? {
            done_lines.extend(girth_notes(&ease).iter().map(|note| format!("{layer}, {}", note.replace('\t', ": "))));
            eases.insert(layer, json!({ "girths": ease.girths, "length": ease.length }));
        }
        done_lines.push(format!("drew {}", path.display()));
    }
    let mut confidence = BTreeMap::new();
    if let Some(path) = &args.confidence {
        confidence = session.write_confidence(path, &mut outputs)?;
        let parts = confidence.iter().map(|(part, half)| format!("{part} ± {:.0} mm", 1e3 * half));
        done_lines.push(format!("drew {}: {}", path.display(), parts.collect::<Vec<_>>().join(", ")));
    }
    if let Some(path) = &args.weights {
        session.write_weights(path, &mut outputs)?;
        done_lines.push(format!("drew {}", path.display()));
    }
    if let Some(target) = &args.film {
        let film = Film { target: target.clone(), animations: args.clip, hide_covered: args.hide_covered };
        let mut progress = Progress::of_one_stage(&context.console);
        let mut on_frame = |frame, count| progress.describe(format!("frame {frame} of {count}"));
        let files = session.write_film(&film, &mut outputs, &mut on_frame)?;
        progress.end();
        let shown = target.display();
        done_lines.push(if film.is_file() {
            format!("drew {shown}")
        } else {
            format!("drew {} frames in {shown}", files.len())
        });
    }
    if let Some(path) = &args.save {
        session.write_recording(path, &mut outputs)?;
        done_lines.push(format!("recorded {}", path.display()));
        next.push(format!("rerun {}", path.display()));
    }
    context.console.notices(outputs.notices());
    let json = json!({
        "session": context.session.display().to_string(),
        "recording": args.save.map(|p| p.display().to_string()),
        "sheet": args.sheet.map(|p| p.display().to_string()),
        "poster": args.poster.map(|p| p.display().to_string()),
        "ease": eases,
        "confidence": confidence,
        "film": args.film.map(|p| p.display().to_string()),
        "weights": args.weights.map(|p| p.display().to_string()),
        "secs": began.elapsed().as_secs_f64(),
    });
    next.push(context.overcoat("export character.glb"));
    let mut done = Done::new("view", json);
    done.next = next;
    let (last, others) =
        done_lines.split_last().map_or((String::new(), &[][..]), |(last, others)| (last.clone(), others));
    Ok(done.lines(others.iter().cloned()).line(format!("{last}, in {}", secs(began.elapsed()))))
}
