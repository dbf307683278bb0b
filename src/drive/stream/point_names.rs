//! The points of the JSON formats, in the official order, and what each is used for.
//!
//! **Source** MediaPipe's `PoseLandmark`, Azure Kinect's `k4abt_joint_id_t`, Kinect v2's `JointType`.

use super::kind::StreamFormat;
use super::record::{Target, Use};
use crate::body::Side::{Left, Right};
use crate::drive::landmark::Landmark::{
    self, Ankle, Chest, Elbow, Hand, Head, Hip, Knee, Neck, Pelvis, Shoulder, Toe, Wrist,
};

/// One point of a format: its name in lower case without separators, and what it is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointName {
    /// The name.
    pub name: &'static str,
    /// What the point is used for; `None` where it is known and not used.
    pub used_for: Option<Use>,
}

const fn first(name: &'static str, landmark: Landmark) -> PointName {
    PointName { name, used_for: Some(Use { target: Target::Landmark(landmark), rank: 0 }) }
}

const fn second(name: &'static str, landmark: Landmark) -> PointName {
    PointName { name, used_for: Some(Use { target: Target::Landmark(landmark), rank: 1 }) }
}

const fn unused(name: &'static str) -> PointName {
    PointName { name, used_for: None }
}

/// The head is the middle of the ears: the nose turns with it. A hand is the middle of its outer knuckles.
const MEDIAPIPE: [PointName; 33] = [
    second("nose", Head),
    unused("lefteyeinner"),
    unused("lefteye"),
    unused("lefteyeouter"),
    unused("righteyeinner"),
    unused("righteye"),
    unused("righteyeouter"),
    first("leftear", Head),
    first("rightear", Head),
    unused("mouthleft"),
    unused("mouthright"),
    first("leftshoulder", Shoulder(Left)),
    first("rightshoulder", Shoulder(Right)),
    first("leftelbow", Elbow(Left)),
    first("rightelbow", Elbow(Right)),
    first("leftwrist", Wrist(Left)),
    first("rightwrist", Wrist(Right)),
    first("leftpinky", Hand(Left)),
    first("rightpinky", Hand(Right)),
    first("leftindex", Hand(Left)),
    first("rightindex", Hand(Right)),
    unused("leftthumb"),
    unused("rightthumb"),
    first("lefthip", Hip(Left)),
    first("righthip", Hip(Right)),
    first("leftknee", Knee(Left)),
    first("rightknee", Knee(Right)),
    first("leftankle", Ankle(Left)),
    first("rightankle", Ankle(Right)),
    unused("leftheel"),
    unused("rightheel"),
    first("leftfootindex", Toe(Left)),
    first("rightfootindex", Toe(Right)),
];

const AZURE_KINECT: [PointName; 32] = [
    first("pelvis", Pelvis),
    unused("spinenavel"),
    first("spinechest", Chest),
    first("neck", Neck),
    unused("clavicleleft"),
    first("shoulderleft", Shoulder(Left)),
    first("elbowleft", Elbow(Left)),
    first("wristleft", Wrist(Left)),
    first("handleft", Hand(Left)),
    unused("handtipleft"),
    unused("thumbleft"),
    unused("clavicleright"),
    first("shoulderright", Shoulder(Right)),
    first("elbowright", Elbow(Right)),
    first("wristright", Wrist(Right)),
    first("handright", Hand(Right)),
    unused("handtipright"),
    unused("thumbright"),
    first("hipleft", Hip(Left)),
    first("kneeleft", Knee(Left)),
    first("ankleleft", Ankle(Left)),
    first("footleft", Toe(Left)),
    first("hipright", Hip(Right)),
    first("kneeright", Knee(Right)),
    first("ankleright", Ankle(Right)),
    first("footright", Toe(Right)),
    second("head", Head),
    unused("nose"),
    unused("eyeleft"),
    first("earleft", Head),
    unused("eyeright"),
    first("earright", Head),
];

/// `SpineMid` is between navel and chest, too low for the chest, which therefore follows from neck and pelvis.
const KINECT_V2: [PointName; 25] = [
    first("spinebase", Pelvis),
    unused("spinemid"),
    second("neck", Neck),
    first("head", Head),
    first("shoulderleft", Shoulder(Left)),
    first("elbowleft", Elbow(Left)),
    first("wristleft", Wrist(Left)),
    first("handleft", Hand(Left)),
    first("shoulderright", Shoulder(Right)),
    first("elbowright", Elbow(Right)),
    first("wristright", Wrist(Right)),
    first("handright", Hand(Right)),
    first("hipleft", Hip(Left)),
    first("kneeleft", Knee(Left)),
    first("ankleleft", Ankle(Left)),
    first("footleft", Toe(Left)),
    first("hipright", Hip(Right)),
    first("kneeright", Knee(Right)),
    first("ankleright", Ankle(Right)),
    first("footright", Toe(Right)),
    first("spineshoulder", Neck),
    unused("handtipleft"),
    unused("thumbleft"),
    unused("handtipright"),
    unused("thumbright"),
];

/// The formats whose frames are JSON; of two that fit a frame equally well the first is taken.
pub const JSON_KINDS: [StreamFormat; 4] =
    [StreamFormat::Landmarks, StreamFormat::MediaPipe, StreamFormat::AzureKinect, StreamFormat::KinectV2];

/// The points of a format, in its order.
///
/// Our own names are as they are, not in lower case. Those of `.trc` are another table.
pub fn points_of(kind: StreamFormat) -> Vec<PointName> {
    match kind {
        StreamFormat::Landmarks => Landmark::ALL.map(|landmark| first(landmark.name(), landmark)).to_vec(),
        StreamFormat::MediaPipe => MEDIAPIPE.to_vec(),
        StreamFormat::AzureKinect => AZURE_KINECT.to_vec(),
        StreamFormat::KinectV2 => KINECT_V2.to_vec(),
        StreamFormat::Trc => Vec::new(),
    }
}

/// The index of the point of that name in the table of a format.
pub fn find_point(kind: StreamFormat, points: &[PointName], name: &str) -> Option<usize> {
    if kind == StreamFormat::Landmarks {
        return points.iter().position(|point| point.name == name);
    }
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    let plain = ["k4abtjoint", "jointtype"].iter().find_map(|prefix| plain.strip_prefix(prefix)).unwrap_or(&plain);
    // The C# binding of the first SDK is misspelled.
    let plain = plain.replace("clavivle", "clavicle").replace("spinenaval", "spinenavel");
    points.iter().position(|point| point.name == plain)
}
