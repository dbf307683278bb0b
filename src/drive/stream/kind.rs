//! The formats of streams, and what each says about its frame.

use crate::scan::{Unit, Up};

/// A format of streams of landmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StreamFormat {
    /// Our own JSON lines.
    Landmarks,
    /// MediaPipe Pose, 33 world landmarks.
    MediaPipe,
    /// Azure Kinect, 32 joints.
    AzureKinect,
    /// Kinect v2, 25 joints.
    KinectV2,
    /// Markers in OpenSim's `.trc`.
    Trc,
}

impl StreamFormat {
    /// All variants.
    pub const ALL: [Self; 5] = [Self::Landmarks, Self::MediaPipe, Self::AzureKinect, Self::KinectV2, Self::Trc];

    /// The name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Landmarks => "landmarks as JSON lines",
            Self::MediaPipe => "MediaPipe Pose world landmarks",
            Self::AzureKinect => "Azure Kinect joints",
            Self::KinectV2 => "Kinect v2 joints",
            Self::Trc => "OpenSim .trc markers",
        }
    }

    /// The unit that the format prescribes; `None` where the file states it.
    pub(super) fn unit(self) -> Option<Unit> {
        match self {
            Self::Landmarks | Self::MediaPipe | Self::KinectV2 => Some(Unit::Metre),
            Self::AzureKinect => Some(Unit::Millimetre),
            Self::Trc => None,
        }
    }

    /// The axis that points up in the format.
    pub(super) fn up(self) -> Up {
        match self {
            Self::Landmarks | Self::KinectV2 | Self::Trc => Up::PlusY,
            Self::MediaPipe | Self::AzureKinect => Up::MinusY,
        }
    }

    /// Whether the frame is that of a camera, whose z points away from it, so that a person who faces the camera faces −z.
    pub(super) fn is_of_a_camera(self) -> bool {
        matches!(self, Self::MediaPipe | Self::AzureKinect | Self::KinectV2)
    }

    /// Whether the origin moves with the hips, so that the stream does not contain the person's travel.
    pub fn is_hip_centred(self) -> bool {
        self == Self::MediaPipe
    }

    /// Whether the points are centres of joints rather than places on or off the skin.
    pub fn are_joint_centres(self) -> bool {
        matches!(self, Self::MediaPipe | Self::AzureKinect | Self::KinectV2)
    }
}
