//! Which vertices of a scan are the new garment (Hu 2017, §6.2): templates, transfer from the body, refinement by what
//! the scan shows, brush strokes. Moves no vertex.

mod extent;
mod region;
mod template;
mod transfer;

pub use extent::{Extent, Sleeve, Until};
pub use template::{GarmentTemplate, Limit, LimitBone};
pub use transfer::{Labels, transfer};

/// What keeps a garment from being told apart.
#[derive(Debug, thiserror::Error)]
pub enum SegmentError {
    /// No template of that name.
    #[error("there is no garment template '{name}'; there are: {}", known.join(", "))]
    UnknownTemplate {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The one spelt most alike.
        nearest: Option<String>,
    },
    /// A template's text cannot be read.
    #[error("the garment template '{name}' cannot be read: {reason}")]
    BadTemplate {
        /// File stem or path.
        name: String,
        /// What is wrong, with the line where there is one.
        reason: String,
    },
    /// `--until` or `--sleeve` says nothing we know.
    #[error("'{given}' is no {what}; one of {}, or a number from 0 to 1 ({scale})", known.join(", "))]
    BadExtent {
        /// What was given.
        given: String,
        /// `garment limit` or `sleeve length`.
        what: &'static str,
        /// The words there are.
        known: Vec<&'static str>,
        /// What the number means.
        scale: &'static str,
    },
}

impl SegmentError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::UnknownTemplate { nearest: Some(nearest), .. } => Some(format!("did you mean '{nearest}'?")),
            Self::UnknownTemplate { .. } => {
                Some("choose the kind nearest to the garment and give its limits with --until and --sleeve".into())
            }
            Self::BadTemplate { .. } => Some("see templates/garments/*.toml for the layout".into()),
            Self::BadExtent { .. } => None,
        }
    }
}
