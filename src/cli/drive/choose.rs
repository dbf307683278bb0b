//! The figure whose size is nearest to the wearer's, of several sessions.

use super::error::DriveFailure;
use crate::body::Figure;
use crate::drive::{LandmarkFrame, StreamOptions, StreamReader, size_difference, still_window, why_not_still};
use crate::session::{Session, SessionError};
use std::path::{Path, PathBuf};

/// A session of several, with why.
pub(super) struct Chosen {
    pub session: Session,
    pub figure: Figure,
    /// Why, where several could be.
    pub note: Option<String>,
}

/// Compares the lengths of the limbs and the height of the shoulders while the wearer stands still.
pub(super) fn nearest_in_size(
    stream: &Path,
    options: StreamOptions,
    own: (&Path, Session),
    others: &[PathBuf],
) -> anyhow::Result<Chosen> {
    if stream.as_os_str() == "-" {
        return Err(SessionError::BadRequest {
            what: "a figure cannot be chosen for a stream that is still to come".into(),
            hint: "record it to a file first, or leave --among out".into(),
        }
        .into());
    }
    let file = std::fs::File::open(stream).map_err(|e| SessionError::reading(stream, e))?;
    let mut reader = StreamReader::new(std::io::BufReader::new(file), options);
    let mut frames: Vec<LandmarkFrame> = Vec::new();
    while let Some(next) = reader.next_frame() {
        // Lines that cannot be read are reported when the stream is played.
        frames.extend(next);
    }
    let mut from = 0;
    let wearer = loop {
        match still_window(&frames[from..]) {
            Ok((wearer, _)) => break wearer,
            Err(0) => return Err(DriveFailure::from(why_not_still(&frames)).into()),
            Err(moving) => from += moving,
        }
    };
    let mut found: Option<(f64, Session, Figure)> = None;
    let mut sizes = Vec::new();
    let others = others.iter().map(|path| Session::open(path).map(|session| (path.as_path(), session)));
    for next in std::iter::once(Ok(own)).chain(others) {
        let (path, session) = next?;
        let figure = session.figure_of_last_step()?;
        let Some(difference) = size_difference(&figure, &wearer) else { continue };
        sizes.push(format!("{} {:.0} %", path.display(), difference * 100.0));
        if found.as_ref().is_none_or(|(least, ..)| difference < *least) {
            found = Some((difference, session, figure));
        }
    }
    let Some((_, session, figure)) = found else { return Err(DriveFailure::from(why_not_still(&frames)).into()) };
    let note = format!(
        "the figure of {} is driven: the wearer's size differs from the figures' by {}",
        session.dir().display(),
        sizes.join(", ")
    );
    Ok(Chosen { session, figure, note: Some(note) })
}
