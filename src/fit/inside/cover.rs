//! What a garment does over the body.

use serde::{Deserialize, Serialize};

/// What the next garment is expected to do over a place of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cover {
    /// Skin, or what was worn before, stays visible: the scan is data there.
    Bare,
    /// Cloth that lies close: the scan is data, from inside.
    Tight,
    /// Cloth that may stand off: the scan is a wall, but no data.
    Loose,
}
