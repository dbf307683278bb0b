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
    #[error(
        "the garment has {rims} long opening{}: a skirt has two, trousers and open jackets three, tops and dresses four",
        if *rims == 1 { "" } else { "s" }
    )]
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
    /// For a child, a doll, or no person at all.
    #[error("the garment's longest opening measures {longest:.2} m, which fits no adult")]
    NotForAdults {
        /// Metres.
        longest: f64,
    },
    /// A system of equations on its surface has no solution.
    #[error(transparent)]
    Numerics(#[from] crate::numerics::NumericsError),
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

impl TryOnError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Empty => "export the garment again as triangles or polygons".into(),
            Self::Closed => "cut the openings for body and limbs open, and export one sheet of cloth".into(),
            Self::SeveralParts { .. } => {
                "join the parts, or put each on as a garment of its own: scarf and coat are two".into()
            }
            Self::OtherRims { .. } => {
                "close slits and pockets, and open what is closed; shoes and gloves cannot be tried on".into()
            }
            Self::Skewed { .. } => "check that the file holds the garment as it is worn, not its flat pattern".into(),
            Self::NotForAdults { .. } => "give --unit if the unit was not recognised".into(),
            Self::Numerics(error) => return error.hint(),
            Self::Rig(error) => return error.hint(),
            Self::Stack(error) => return error.hint(),
            Self::Cloth(error) => return error.hint(),
        })
    }
}
