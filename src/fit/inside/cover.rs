//! What a garment does over the body.

use serde::{Deserialize, Serialize};

/// What the next garment is expected to do at a place of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cover {
    /// Skin or inner clothes stay visible: the scan is data.
    Bare,
    /// Close cloth: the scan is one-sided data.
    Tight,
    /// Cloth that may stand off: the scan is a constraint but no data.
    Loose,
}
