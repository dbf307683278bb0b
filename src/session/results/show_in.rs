//! Where what happens is shown while it happens.

use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

/// Where what happens is shown while it happens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ShowIn {
    /// The Rerun viewer that runs on this machine, or one that is started.
    Viewer,
    /// The one at this URL.
    ViewerAt(String),
    /// None: it is written to this file, for later.
    File(PathBuf),
}

impl FromStr for ShowIn {
    type Err = Infallible;

    /// Nothing, a URL, or else a path.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "" => Self::Viewer,
            url if url.contains("://") => Self::ViewerAt(url.into()),
            path => Self::File(path.into()),
        })
    }
}
