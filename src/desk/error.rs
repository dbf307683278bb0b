//! Errors of the pages.

use crate::session::SessionError;
use crate::stack::StackError;

/// An error of a page, or of its server.
#[derive(Debug, thiserror::Error)]
pub enum DeskError {
    /// The session cannot be read or changed.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The layers of the figure cannot be compared.
    #[error("the layers of the figure cannot be compared: {0}")]
    Layers(#[from] StackError),
    /// A picture of the page cannot be drawn.
    #[error("a picture of the page cannot be drawn: {0}")]
    Picture(#[from] crate::view::Error),
    /// A picture of the page cannot be encoded.
    #[error("a picture of the page cannot be encoded: {0}")]
    Encoding(#[from] crate::formats::FormatError),
    /// The surfaces cannot be compressed.
    #[error("the surfaces of the page cannot be compressed: {0}")]
    Packing(std::io::Error),
    /// The server of the page cannot begin.
    #[error("the page cannot be served on port {port} of this machine: {reason}")]
    Port {
        /// The requested port; 0 for any.
        port: u16,
        /// Why.
        reason: String,
    },
    /// There is nothing to paint.
    #[error("the session has no garment to paint")]
    NothingToPaint,
}

impl DeskError {
    /// What to do.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Session(error) => error.hint(),
            Self::Layers(_) => Some("build the session again: `overcoat build`".into()),
            Self::Port { .. } => Some("leave out --port, so that a free port is taken".into()),
            Self::NothingToPaint => Some("scan a garment first: `overcoat scan NAME FILE --template …`".into()),
            Self::Picture(_) | Self::Encoding(_) | Self::Packing(_) => None,
        }
    }

    /// Whether the request was invalid; otherwise the work failed.
    pub fn is_wrong_command(&self) -> bool {
        match self {
            Self::Session(error) => error.is_wrong_command(),
            Self::Port { .. } | Self::NothingToPaint => true,
            _ => false,
        }
    }
}
