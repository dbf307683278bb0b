//! The landmarks that drive a figure, and one frame of them.

use crate::body::HumanJoint::{self, Foot, Head, Hips, LowerArm, LowerLeg, Neck, Toes, UpperArm, UpperChest, UpperLeg};
use crate::body::Side;
use crate::body::Side::{Left, Right};
use crate::geometry::Point;

/// A tracked place on a person: 16 as in the paper, and the ends of hands and feet where a tracker sees them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Landmark {
    /// The head.
    Head,
    /// The base of the neck.
    Neck,
    /// The chest.
    Chest,
    /// The pelvis.
    Pelvis,
    /// A shoulder.
    Shoulder(Side),
    /// An elbow.
    Elbow(Side),
    /// A wrist.
    Wrist(Side),
    /// A hip.
    Hip(Side),
    /// A knee.
    Knee(Side),
    /// An ankle.
    Ankle(Side),
    /// The knuckles, or the tip of the middle finger.
    Hand(Side),
    /// The toes.
    Toe(Side),
}

/// How many landmarks there are.
pub const LANDMARKS: usize = Landmark::ALL.len();

/// The landmarks of the pose descriptor: the first of [`Landmark::ALL`].
///
/// **Source** Lifkooee 2019, §3.2: sixteen. The paper also says fourteen (§4.1), those of its SMPL fits.
pub const DESCRIBED: usize = 16;

/// The places of a frame, one entry per [`Landmark::ALL`]; `None` where one was lost.
pub type Places = [Option<Point>; LANDMARKS];

impl Landmark {
    /// All, the sixteen of the paper first.
    pub const ALL: [Self; 20] = [
        Self::Head,
        Self::Neck,
        Self::Chest,
        Self::Pelvis,
        Self::Shoulder(Left),
        Self::Elbow(Left),
        Self::Wrist(Left),
        Self::Hip(Left),
        Self::Knee(Left),
        Self::Ankle(Left),
        Self::Shoulder(Right),
        Self::Elbow(Right),
        Self::Wrist(Right),
        Self::Hip(Right),
        Self::Knee(Right),
        Self::Ankle(Right),
        Self::Hand(Left),
        Self::Toe(Left),
        Self::Hand(Right),
        Self::Toe(Right),
    ];

    /// Its place in [`Landmark::ALL`].
    pub fn index(self) -> usize {
        Self::ALL.iter().position(|&l| l == self).unwrap_or(0)
    }

    /// The name in streams, such as `leftWrist`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Neck => "neck",
            Self::Chest => "chest",
            Self::Pelvis => "pelvis",
            Self::Shoulder(Left) => "leftShoulder",
            Self::Shoulder(Right) => "rightShoulder",
            Self::Elbow(Left) => "leftElbow",
            Self::Elbow(Right) => "rightElbow",
            Self::Wrist(Left) => "leftWrist",
            Self::Wrist(Right) => "rightWrist",
            Self::Hip(Left) => "leftHip",
            Self::Hip(Right) => "rightHip",
            Self::Knee(Left) => "leftKnee",
            Self::Knee(Right) => "rightKnee",
            Self::Ankle(Left) => "leftAnkle",
            Self::Ankle(Right) => "rightAnkle",
            Self::Hand(Left) => "leftHand",
            Self::Hand(Right) => "rightHand",
            Self::Toe(Left) => "leftToe",
            Self::Toe(Right) => "rightToe",
        }
    }

    /// The landmark of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|landmark| landmark.name() == name)
    }

    /// The side of the body; `None` in the middle.
    pub fn side(self) -> Option<Side> {
        match self {
            Self::Head | Self::Neck | Self::Chest | Self::Pelvis => None,
            Self::Shoulder(s)
            | Self::Elbow(s)
            | Self::Wrist(s)
            | Self::Hip(s)
            | Self::Knee(s)
            | Self::Ankle(s)
            | Self::Hand(s)
            | Self::Toe(s) => Some(s),
        }
    }

    /// The landmark of the other side; itself in the middle.
    pub fn mirrored(self) -> Self {
        match self {
            Self::Head | Self::Neck | Self::Chest | Self::Pelvis => self,
            Self::Shoulder(s) => Self::Shoulder(s.mirrored()),
            Self::Elbow(s) => Self::Elbow(s.mirrored()),
            Self::Wrist(s) => Self::Wrist(s.mirrored()),
            Self::Hip(s) => Self::Hip(s.mirrored()),
            Self::Knee(s) => Self::Knee(s.mirrored()),
            Self::Ankle(s) => Self::Ankle(s.mirrored()),
            Self::Hand(s) => Self::Hand(s.mirrored()),
            Self::Toe(s) => Self::Toe(s.mirrored()),
        }
    }

    /// The landmark nearer to the pelvis, from which its place follows by one segment of the body; `None` for the pelvis.
    pub fn parent(self) -> Option<Self> {
        Some(match self {
            Self::Pelvis => return None,
            Self::Chest | Self::Hip(_) => Self::Pelvis,
            Self::Neck => Self::Chest,
            Self::Head | Self::Shoulder(_) => Self::Neck,
            Self::Elbow(s) => Self::Shoulder(s),
            Self::Wrist(s) => Self::Elbow(s),
            Self::Hand(s) => Self::Wrist(s),
            Self::Knee(s) => Self::Hip(s),
            Self::Ankle(s) => Self::Knee(s),
            Self::Toe(s) => Self::Ankle(s),
        })
    }

    /// The joint at which it is, or nearest to which.
    pub fn joint(self) -> HumanJoint {
        match self {
            Self::Head => Head,
            Self::Neck => Neck,
            Self::Chest => UpperChest,
            Self::Pelvis => Hips,
            Self::Shoulder(s) => UpperArm(s),
            Self::Elbow(s) => LowerArm(s),
            Self::Wrist(s) | Self::Hand(s) => HumanJoint::Hand(s),
            Self::Hip(s) => UpperLeg(s),
            Self::Knee(s) => LowerLeg(s),
            Self::Ankle(s) => Foot(s),
            Self::Toe(s) => Toes(s),
        }
    }
}

/// Landmarks at one time, in our frame: metres, Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkFrame {
    /// Seconds since the stream began.
    pub secs: f64,
    /// Where the landmarks are.
    pub places: Places,
}

impl LandmarkFrame {
    /// How many landmarks were seen.
    pub fn seen(&self) -> usize {
        self.places.iter().flatten().count()
    }
}
