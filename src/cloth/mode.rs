//! How the layers of an animation move.

use serde::{Deserialize, Serialize};

/// How the layers of an animation move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClothMode {
    /// By skinning alone: fast; cloth does not swing, and layers may cross.
    #[default]
    #[serde(rename = "lbs")]
    Skinned,
    /// By physics and skinning in one solver: layers cannot cross.
    #[serde(rename = "coupled")]
    Coupled,
}

impl ClothMode {
    /// All, with their names on the command line and in files.
    pub const ALL: [(&'static str, Self); 2] = [("lbs", Self::Skinned), ("coupled", Self::Coupled)];
}
