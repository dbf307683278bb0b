//! Why no body can be computed from a photo.

use super::mark::Layout;
use crate::formats::FormatError;

/// Why keypoints, a camera or a height cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PhotoError {
    /// The text is not JSON.
    #[error("the keypoints are not JSON: {reason}")]
    NotJson {
        /// The parser's message, with line and column.
        reason: String,
    },
    /// JSON, but without a list of keypoints.
    #[error("the file has no keypoints: it has neither `people`, `annotations`, `keypoints` nor `pose_landmarks`")]
    NoKeypoints,
    /// A list whose length belongs to no layout.
    #[error("person {person} has {found}; {}", known_layouts())]
    WrongCount {
        /// Counted from 1.
        person: usize,
        /// The number found, with its noun.
        found: String,
    },
    /// A coordinate that is not a finite number.
    #[error("keypoint {keypoint} of person {person} is no number")]
    NotANumber {
        /// Counted from 1.
        person: usize,
        /// Counted from 0, as trackers do.
        keypoint: usize,
    },
    /// Several people and no choice.
    #[error("the keypoints show {people} people")]
    SeveralPeople {
        /// How many.
        people: usize,
    },
    /// A choice beyond the people there are.
    #[error("there is no person {person}: the keypoints show {people}")]
    NoSuchPerson {
        /// The choice, counted from 1.
        person: usize,
        /// How many there are.
        people: usize,
    },
    /// Nothing was seen.
    #[error("no keypoint was seen: all confidences are 0")]
    NothingSeen,
    /// Too little of the person was seen.
    #[error("the keypoints show only part of a person: no {missing}")]
    PartOfABody {
        /// What is missing, in words.
        missing: &'static str,
    },
    /// The ankles are above the shoulders.
    #[error("the picture is upside down: the ankles are above the shoulders")]
    UpsideDown,
    /// Coordinates as fractions of a picture of unknown size.
    #[error("MediaPipe's landmarks are fractions of a picture whose size is unknown")]
    UnknownSize,
    /// Neither a camera nor a height.
    #[error("neither the camera nor the person's height is known, so the size of the body is not either")]
    NoScale,
    /// Keypoints as a tracker writes them, where a session's file of a photo is expected.
    #[error("these are keypoints of a tracker, without camera or height")]
    NotARecord,
    /// A height that no adult has.
    #[error("a height of {height} m is not that of an adult (1.2 to 2.3 m)")]
    Height {
        /// In metres.
        height: f64,
    },
    /// The camera beside the keypoints cannot be read.
    #[error(transparent)]
    Camera(#[from] FormatError),
    /// The lens bends straight lines.
    #[error("the camera's lens distorts the picture")]
    Distorted,
    /// The camera's pose puts it below the floor.
    #[error("the camera is below the floor, which is y = 0 of 'camera_from_world'")]
    BelowFloor,
    /// A model without the joints that keypoints name.
    #[error("the body model has no joint '{joint}', which keypoints need")]
    MissingJoint {
        /// Its VRM name.
        joint: &'static str,
    },
    /// Many keypoints are far from every body that was tried.
    #[error("no body agrees with the keypoints: {outliers} of {keypoints} are far from the best one")]
    NoAgreement {
        /// How many are far.
        outliers: usize,
        /// Of how many.
        keypoints: usize,
    },
}

fn known_layouts() -> String {
    let counts: Vec<String> =
        Layout::OF_TRIPLES.iter().map(|l| format!("{} ({})", l.point_count(), l.name())).collect();
    format!("{} triples or 33 landmarks (MediaPipe) are expected", counts.join(", "))
}

impl PhotoError {
    /// Whether the request was invalid or incomplete; otherwise a file is.
    pub fn is_wrong_command(&self) -> bool {
        matches!(
            self,
            Self::SeveralPeople { .. }
                | Self::NoSuchPerson { .. }
                | Self::UnknownSize
                | Self::NoScale
                | Self::NotARecord
                | Self::Height { .. }
        )
    }

    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::Camera(e) => return e.hint(),
            Self::NotJson { reason } if reason.contains("NaN") => {
                "write 0 as the confidence of a keypoint that was not found, not NaN"
            }
            Self::NotJson { .. } | Self::NoKeypoints | Self::WrongCount { .. } => {
                "give the file that OpenPose writes with --write_json, a COCO annotation file, or MediaPipe's pose_landmarks"
            }
            Self::NotANumber { .. } => "write 0 as the confidence of a keypoint that was not found",
            Self::SeveralPeople { .. } | Self::NoSuchPerson { .. } => {
                "choose one with --person N, counted from 1 in the order of the file"
            }
            Self::NothingSeen => "run the tracker again on a picture that shows the whole person",
            Self::PartOfABody { .. } => "take a photo that shows the whole person, from head to feet",
            Self::UpsideDown => "turn the picture by 180 degrees and run the tracker again",
            Self::UnknownSize => "give --image PHOTO.png, or --camera with width and height",
            Self::NoScale => "give --height 1.72 (metres), or --camera C.json with width, height, fx, fy, cx and cy",
            Self::NotARecord => "give them as `overcoat scan body --photo FILE`, with --height or --camera",
            Self::Height { .. } => "give the height in metres: --height 1.72",
            Self::Distorted => "undistort the picture, run the tracker on it, and give a camera without distortion",
            Self::BelowFloor => {
                "give camera_from_world of a world with Y up and the floor at y = 0, in metres, or leave it out"
            }
            Self::MissingJoint { .. } => "use the embedded model, or a model in the SMPL layout",
            Self::NoAgreement { .. } => {
                "look at the keypoints in the photo: left and right may be exchanged, or they may be those of several people"
            }
        };
        Some(hint.into())
    }
}
