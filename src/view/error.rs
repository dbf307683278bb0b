//! Errors of pictures and recordings.

use crate::formats::FormatError;

/// Why a picture or a recording could not be made.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A paint per vertex has another number of values than the mesh has vertices.
    #[error("the paint has {values} values, but the mesh has {vertices} vertices")]
    PaintCount {
        /// Values of the paint.
        values: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// A texture belongs to another mesh.
    #[error("the texture was made for {of_texture} faces, but the mesh has {faces}")]
    TextureFaces {
        /// Faces of the texture's coordinates.
        of_texture: usize,
        /// Faces of the mesh.
        faces: usize,
    },
    /// The picture could not be encoded.
    #[error("the picture could not be encoded: {0}")]
    Png(#[from] FormatError),
    /// The Rerun library could not make the recording.
    #[error("the recording could not be made: {0}")]
    Recording(String),
    /// No viewer could be reached.
    #[error("no Rerun viewer could be reached: {0}")]
    NoViewer(String),
    /// The recording could not be written.
    #[error("the recording could not be written: {0}")]
    Write(#[from] std::io::Error),
}

impl Error {
    /// What the user can do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::PaintCount { .. } => Some("give one value per vertex, in the order of the mesh".into()),
            Self::TextureFaces { .. } | Self::Recording(_) => None,
            Self::NoViewer(_) => Some(
                "start one (`rerun`, from `pip install rerun-sdk` or `cargo binstall rerun-cli`), or give the address of a running one: --view=rerun+http://127.0.0.1:9876/proxy"
                    .into(),
            ),
            Self::Png(_) | Self::Write(_) => Some("is the disk full, or the folder read-only?".into()),
        }
    }
}
