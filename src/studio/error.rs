//! What the studio cannot generate.

use crate::cloth::ClothError;

/// What the studio cannot generate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudioError {
    /// No such garment.
    #[error("the studio has no garment called '{name}'")]
    UnknownGarment {
        /// The name given.
        name: String,
        /// All names.
        known: Vec<&'static str>,
    },
    /// No such size.
    #[error("the studio has no size called '{name}'")]
    UnknownSize {
        /// The name given.
        name: String,
        /// All names.
        known: Vec<&'static str>,
    },
    /// A size that is named twice.
    #[error("the size {name} is named twice")]
    SizeTwice {
        /// Its letters.
        name: &'static str,
    },
    /// A garment that cannot be put on over another.
    #[error("a {inner} does not go over a {outer}")]
    ImpossibleOrder {
        /// The garment worn already.
        outer: &'static str,
        /// The garment to be put on after it.
        inner: &'static str,
    },
    /// A garment that is named twice.
    #[error("'{name}' is worn twice")]
    WornTwice {
        /// Its name.
        name: &'static str,
    },
    /// A recording without frames, or with too few for a closed surface.
    #[error("{views} views see no person from all sides")]
    TooFewViews {
        /// The number given.
        views: usize,
    },
    /// An image size that is too small or too large.
    #[error("a picture of {width} × {height} pixels is too {}", if *width < 64 || *height < 64 { "small to show a person" } else { "large" })]
    BadSize {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
    /// A number of turns that no recording has.
    #[error("a recording does not have {turns} turns")]
    BadTurns {
        /// The number given.
        turns: f64,
        /// Least and greatest number.
        range: [f64; 2],
    },
    /// A camera too near or too far.
    #[error("the camera cannot be {} m away and {} m above the floor, with the wall {} m behind the person", places[0], places[1], places[2])]
    BadCameraPlace {
        /// Metres from the axis, above the floor, and from the axis to the wall.
        places: [f64; 3],
    },
    /// A scan with too few or too many triangles.
    #[error("a scan of a person does not have {faces} faces")]
    BadFaceCount {
        /// The number given.
        faces: usize,
        /// Least and greatest number.
        range: [usize; 2],
    },
    /// Voxels too small or too large.
    #[error("a scanner does not have voxels of {voxel_mm} mm")]
    BadVoxel {
        /// Their size.
        voxel_mm: f64,
        /// Least and greatest size.
        range_mm: [f64; 2],
    },
    /// More sway than that of a standing person.
    #[error("nobody who stands for a scan sways by {sway_mm} mm")]
    BadSway {
        /// The sway given.
        sway_mm: f64,
    },
    /// The garments cannot be draped.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A body model without one of the human joints.
    #[error("the body model has no joint called '{name}'")]
    MissingJoint {
        /// Its VRM name.
        name: &'static str,
    },
    /// A scene without vertices.
    #[error("there is nothing before the camera")]
    EmptyScene,
    /// A surface without one colour per vertex.
    #[error("a surface has {found} colours for {expected} vertices")]
    ColorCount {
        /// Colours.
        found: usize,
        /// Vertices.
        expected: usize,
    },
    /// A picture that is too small to show all triangles.
    #[error("a picture of {side} pixels is too small for the charts of all triangles")]
    SmallPicture {
        /// Pixels along its side.
        side: usize,
        /// The least number.
        least: usize,
    },
    /// A picture that cannot be encoded.
    #[error("the picture cannot be encoded: {reason}")]
    Picture {
        /// The encoder's message.
        reason: String,
    },
    /// A text that is not a commit hash.
    #[error("'{text}' is not the hash of a commit")]
    BadCommitHash {
        /// The text given.
        text: String,
    },
}

impl StudioError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Cloth(e) => return e.hint(),
            Self::EmptyScene | Self::ColorCount { .. } | Self::Picture { .. } => return None,
            Self::UnknownGarment { known, .. } | Self::UnknownSize { known, .. } => {
                format!("there are {}", known.join(", "))
            }
            Self::ImpossibleOrder { outer, inner } => {
                format!("name the garments from the inside out: {inner},{outer}")
            }
            Self::WornTwice { .. } => "name each garment once".into(),
            Self::SizeTwice { .. } => "name each size once".into(),
            Self::TooFewViews { .. } => "give --views 8 or more; 72 are one per 5°".into(),
            Self::BadSize { .. } => "give --size 424x512, or anything from 64x64 to 4096x4096".into(),
            Self::BadTurns { range: [least, most], .. } => format!("give --turns {least} to {most}"),
            Self::BadCameraPlace { .. } => "give lengths from 0.3 to 10 m".into(),
            Self::BadFaceCount { range: [least, most], .. } => format!("give --faces {least} to {most}"),
            Self::BadVoxel { range_mm: [least, most], .. } => format!("give voxels of {least} to {most} mm"),
            Self::BadSway { .. } => "give --sway 0 to 50, in millimetres".into(),
            Self::SmallPicture { least, .. } => format!("give {least} pixels or more"),
            Self::MissingJoint { .. } => "give a body model with the 22 body joints of VRM 1.0".into(),
            Self::BadCommitHash { .. } => "give all 40 hexadecimal digits, as `git rev-parse HEAD` prints them".into(),
        })
    }
}
