//! Why a mesh is not a usable scan.

use crate::geometry::MeshError;

/// Why a mesh cannot be used as a scan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// A parameter has a value that it may not have.
    #[error(transparent)]
    Parameter(#[from] crate::parameters::NotAllowed),
    /// No vertices at all.
    #[error("the file holds no vertices")]
    Empty,
    /// A point cloud.
    #[error("the file holds {points} points but no faces: a surface is needed")]
    NoFaces {
        /// The number of points.
        points: usize,
    },
    /// Coordinates that are not numbers.
    #[error("vertex {vertex} has a coordinate that is not a number ({count} such vertices of {of})")]
    NotFinite {
        /// The first, counted from 0.
        vertex: usize,
        /// How many vertices have such a coordinate.
        count: usize,
        /// Of how many vertices.
        of: usize,
    },
    /// An attribute array has the wrong length.
    #[error("there are {points} points but {given} {what}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The number of points.
        points: usize,
    },
    /// The faces do not fit the points.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No face has area.
    #[error("none of the {faces} faces has an area")]
    NoArea {
        /// The number of faces.
        faces: usize,
    },
    /// Too small or too large.
    #[error("{what} is {height:.3} of the file's units tall, {reading}: a person is 0.4 to 2.5 m tall")]
    NotPersonSize {
        /// What was measured.
        what: String,
        /// Its height, in the file's unit.
        height: f64,
        /// What that is in metres, by the units that were tried.
        reading: String,
    },
    /// A stated height that no person has.
    #[error("a person is not {height} m tall")]
    BadHeight {
        /// In metres.
        height: f64,
    },
    /// A request for fewer faces than a person needs.
    #[error("a scan of {faces} faces is too coarse for a person")]
    TooFewFaces {
        /// The number asked for.
        faces: usize,
        /// The least number.
        least: usize,
    },
    /// Noise hides the shape.
    #[error(
        "the surface is too noisy: its vertices scatter by about {noise_mm:.0} mm (for an adult), and neighbouring faces differ by {angle_deg:.0}° on average"
    )]
    Noisy {
        /// Mean angle between neighbouring faces.
        angle_deg: f64,
        /// Noise per coordinate, if the person is as tall as an adult.
        noise_mm: f64,
    },
    /// A person who squats, sits or bends.
    #[error("this is not one person standing upright: {evidence}")]
    NotStanding {
        /// The evidence.
        evidence: String,
    },
    /// More than one person.
    #[error("there seem to be two people in the scan: {evidence}")]
    TwoPeople {
        /// The evidence.
        evidence: String,
    },
}

impl ScanError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::Parameter(_) => return None,
            Self::Empty => "was the export interrupted? Write the file again",
            Self::NoFaces { .. } => "mesh the points first, for example with Poisson reconstruction in MeshLab",
            Self::NotFinite { .. } => "remove such vertices, for example with MeshLab's cleaning filters",
            Self::WrongLength { .. } | Self::Mesh(_) => "the file is damaged; write it again",
            Self::NoArea { .. } => "was the mesh flattened or scaled to nothing on export?",
            Self::Noisy { .. } => {
                "reduce the noise to 3 mm: fuse more frames, or smooth the mesh, for example with MeshLab's Taubin filter"
            }
            Self::NotStanding { .. } => {
                "scan the person alone, standing upright in an A-pose: legs straight, arms held away from the body"
            }
            Self::BadHeight { .. } => "give --height in metres, 0.4 to 2.5",
            Self::NotPersonSize { .. } => {
                "say the person's height with --height 1.72, or the unit with --unit, and the axis that points up with --up"
            }
            Self::TooFewFaces { least, .. } => return Some(format!("give --faces {least} or more, or leave it out")),
            Self::TwoPeople { .. } => "give a scan of one person alone; cut the other one away first",
        };
        Some(hint.into())
    }
}
