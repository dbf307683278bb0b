//! Why a garment cannot be put on.

/// Why a mesh is no garment that can be put on.
#[derive(Debug, thiserror::Error)]
pub enum TryOnError {
    /// No faces, or only faces without area.
    #[error("the garment has no faces")]
    Empty,
    /// No opening to put it on by.
    #[error("the garment's mesh is closed: it has no opening for the body")]
    Closed,
    /// Several large parts.
    #[error("the garment consists of {parts} large parts that are not joined")]
    SeveralParts {
        /// How many.
        parts: usize,
    },
    /// Another number of openings than any garment has.
    #[error("the garment has {rims} long openings: a skirt has two, trousers and open jackets three, tops and dresses four")]
    OtherRims {
        /// How many.
        rims: usize,
    },
    /// The openings give no frame.
    #[error("the garment's {what} gives no direction: its openings lie on each other")]
    Skewed {
        /// Which.
        what: &'static str,
    },
    /// No skin weights.
    #[error(transparent)]
    Rig(#[from] crate::rig::RigError),
    /// It cannot be brought outside the layers.
    #[error(transparent)]
    Stack(#[from] crate::stack::StackError),
    /// It cannot be simulated.
    #[error(transparent)]
    Cloth(#[from] crate::cloth::ClothError),
}
