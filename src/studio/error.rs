//! What cannot be invented.

use crate::cloth::ClothError;

/// What cannot be invented.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudioError {
    /// No such garment.
    #[error("the studio has no garment called '{name}'")]
    UnknownGarment {
        /// As asked for.
        name: String,
        /// All that there are.
        known: Vec<&'static str>,
    },
    /// A garment that nobody gets on over what is worn already.
    #[error("a {inner} does not go over a {outer}")]
    ImpossibleOrder {
        /// Worn already.
        outer: &'static str,
        /// Put on after it.
        inner: &'static str,
    },
    /// The same garment twice.
    #[error("'{name}' is worn twice")]
    WornTwice {
        /// Its name.
        name: &'static str,
    },
    /// A recording without frames, or too few to close a surface.
    #[error("{views} views see no person from all sides")]
    TooFewViews {
        /// As asked for.
        views: usize,
    },
    /// A sensor that cannot be.
    #[error("a picture of {width} × {height} pixels is too {}", if *width < 64 || *height < 64 { "small to show a person" } else { "large" })]
    BadSize {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
    /// More sway than anyone who stands.
    #[error("nobody who stands for a scan sways by {sway_mm} mm")]
    BadSway {
        /// As asked for.
        sway_mm: f64,
    },
    /// The garments cannot be draped.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A joint that no body has.
    #[error("the body has no joint called '{name}'")]
    NoSuchJoint {
        /// As asked for.
        name: &'static str,
    },
}

impl StudioError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Cloth(e) => return e.hint(),
            Self::UnknownGarment { known, .. } => format!("there are {}", known.join(", ")),
            Self::ImpossibleOrder { outer, inner } => {
                format!("name the garments from the inside out: {inner},{outer}")
            }
            Self::WornTwice { .. } => "name each garment once".into(),
            Self::TooFewViews { .. } => "give --views 8 or more; 72 are one every 5°".into(),
            Self::BadSize { .. } => "give --size 424x512, or anything from 64x64 to 4096x4096".into(),
            Self::BadSway { .. } => "give --sway 0 to 50, in millimetres".into(),
            Self::NoSuchJoint { .. } => "joints are called as in VRM: leftUpperArm, rightLowerLeg".into(),
        })
    }
}
