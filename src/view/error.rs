//! What can go wrong with a picture.

use crate::formats::FormatError;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A paint with a value for each vertex has another count than the mesh.
    #[error("the paint has {values} values, but the mesh has {vertices} vertices")]
    PaintCount {
        /// Values given.
        values: usize,
        /// Vertices to be painted.
        vertices: usize,
    },
    /// The picture could not be encoded.
    #[error("the picture could not be encoded: {0}")]
    Png(#[from] FormatError),
    /// The viewer's library could not make the recording.
    #[error("the recording could not be made: {0}")]
    Recording(String),
    /// No viewer shows the recording.
    #[error("no Rerun viewer shows it: {0}")]
    NoViewer(String),
    /// The recording could not be written.
    #[error("the recording could not be written: {0}")]
    Write(#[from] std::io::Error),
}

impl Error {
    /// What the user may do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::PaintCount { .. } => Some("give one value for each vertex, in the order of the mesh".into()),
            Self::Recording(_) => None,
            Self::NoViewer(_) => Some(
                "start one (`rerun`, from `pip install rerun-sdk` or `cargo binstall rerun-cli`), or name one that runs: --view=rerun+http://127.0.0.1:9876/proxy"
                    .into(),
            ),
            Self::Png(_) | Self::Write(_) => Some("is the disk full, or the folder read-only?".into()),
        }
    }
}
