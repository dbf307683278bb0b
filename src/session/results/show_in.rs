//! The target of a recording: a viewer or a file.

use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

/// The target of a recording: a viewer or a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ShowIn {
    /// The Rerun viewer that runs on this machine, or else a new one.
    Viewer,
    /// The viewer at this URL.
    ViewerAt(String),
    /// A file, to be opened later.
    File(PathBuf),
}

impl FromStr for ShowIn {
    type Err = Infallible;

    /// Parses an empty text, a URL or a path.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "" => Self::Viewer,
            url if url.contains("://") => Self::ViewerAt(url.into()),
            path => Self::File(path.into()),
        })
    }
}
