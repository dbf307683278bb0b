//! `overcoat new`: start a session.

use super::console::{Context, Done, secs};
use crate::session::{BodyModelSource, NewSession, SessionError, create};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct NewArgs {
    /// Folder of the session: a new one, or an empty one
    dir: Option<PathBuf>,
    /// A body model of your own: .npz in the SMPL layout
    #[arg(long, value_name = "FILE.npz")]
    body: Option<PathBuf>,
}

pub(super) fn run(args: NewArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let dir = match (args.dir, context.session_given) {
        (Some(dir), false) => dir,
        (Some(dir), true) => context.session.join(dir),
        (None, true) => context.session.clone(),
        (None, false) => {
            let what = "new needs a folder for the session".into();
            return Err(SessionError::BadRequest { what, hint: "overcoat new DIR".into() }.into());
        }
    };
    let source = create(&dir, &NewSession { body: args.body })?;
    let body = match &source {
        BodyModelSource::Embedded => "the embedded body model".to_string(),
        BodyModelSource::File(file) => format!("the body model {file}"),
    };
    let json = json!({
        "session": dir.display().to_string(),
        "body_model": match &source { BodyModelSource::Embedded => "embedded", BodyModelSource::File(file) => file },
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(Done::new("new", json)
        .line(format!("started a session in {} with {body}, in {}", dir.display(), secs(began.elapsed())))
        .next(format!("overcoat -C {} scan body FILE", dir.display())))
}
