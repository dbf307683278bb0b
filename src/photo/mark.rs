//! What the keypoints of a photo are on a person, and the layouts in which trackers number them.

use crate::body::HumanJoint::{self, Foot, Hand, LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::Side::{self, Left, Right};

/// A point of the body that trackers find in a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// The centre of a joint.
    Joint(HumanJoint),
    /// Midway between the shoulder joints.
    Neck,
    /// Midway between the hip joints.
    MidHip,
    /// The tip of the nose.
    Nose,
    /// The eye.
    Eye(Side),
    /// The ear.
    Ear(Side),
    /// The tip of the big toe.
    BigToe(Side),
    /// The tip of the small toe.
    SmallToe(Side),
    /// The back of the heel.
    Heel(Side),
}

/// The order in which a tracker lists its keypoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// OpenPose's 25 points.
    Body25,
    /// OpenPose's 18 points.
    Coco18,
    /// The 17 points of COCO's annotations.
    Coco17,
    /// The 33 points of MediaPipe.
    MediaPipe33,
}

use Mark::{BigToe, Ear, Eye, Heel, Joint, MidHip, Neck, Nose, SmallToe};

const SHOULDER: [Mark; 2] = [Joint(UpperArm(Left)), Joint(UpperArm(Right))];
const ELBOW: [Mark; 2] = [Joint(LowerArm(Left)), Joint(LowerArm(Right))];
const WRIST: [Mark; 2] = [Joint(Hand(Left)), Joint(Hand(Right))];
const HIP: [Mark; 2] = [Joint(UpperLeg(Left)), Joint(UpperLeg(Right))];
const KNEE: [Mark; 2] = [Joint(LowerLeg(Left)), Joint(LowerLeg(Right))];
const ANKLE: [Mark; 2] = [Joint(Foot(Left)), Joint(Foot(Right))];

impl Layout {
    /// The layouts that OpenPose and COCO write as triples of x, y and confidence.
    pub const OF_TRIPLES: [Self; 3] = [Self::Body25, Self::Coco18, Self::Coco17];

    /// The mark of each keypoint; `None` for one that is not used, such as a finger.
    pub fn marks(self) -> Vec<Option<Mark>> {
        let (l, r) = (0, 1);
        let upper = |side: usize| [SHOULDER[side], ELBOW[side], WRIST[side]];
        let lower = |side: usize| [HIP[side], KNEE[side], ANKLE[side]];
        let face = [Eye(Right), Eye(Left), Ear(Right), Ear(Left)];
        let both = |pair: [Mark; 2]| pair;
        let marks: Vec<Mark> = match self {
            Self::Body25 => {
                let feet = [BigToe(Left), SmallToe(Left), Heel(Left), BigToe(Right), SmallToe(Right), Heel(Right)];
                let parts: [&[Mark]; 8] =
                    [&[Nose, Neck], &upper(r), &upper(l), &[MidHip], &lower(r), &lower(l), &face, &feet];
                parts.concat()
            }
            Self::Coco18 => {
                let parts: [&[Mark]; 6] = [&[Nose, Neck], &upper(r), &upper(l), &lower(r), &lower(l), &face];
                parts.concat()
            }
            Self::Coco17 => {
                let parts: [&[Mark]; 8] = [
                    &[Nose, Eye(Left), Eye(Right), Ear(Left), Ear(Right)],
                    &both(SHOULDER),
                    &both(ELBOW),
                    &both(WRIST),
                    &both(HIP),
                    &both(KNEE),
                    &both(ANKLE),
                    &[],
                ];
                parts.concat()
            }
            Self::MediaPipe33 => return mediapipe(),
        };
        marks.into_iter().map(Some).collect()
    }

    /// The number of keypoints.
    pub fn point_count(self) -> usize {
        match self {
            Self::Body25 => 25,
            Self::Coco18 => 18,
            Self::Coco17 => 17,
            Self::MediaPipe33 => 33,
        }
    }

    /// The layout's usual name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Body25 => "OpenPose BODY_25",
            Self::Coco18 => "OpenPose COCO-18",
            Self::Coco17 => "COCO-17",
            Self::MediaPipe33 => "MediaPipe's 33 landmarks",
        }
    }
}

fn mediapipe() -> Vec<Option<Mark>> {
    let mut marks = vec![None; 33];
    let mut put = |at: usize, mark: Mark| marks[at] = Some(mark);
    put(0, Nose);
    for (k, side) in Side::BOTH.into_iter().enumerate() {
        // The corners of the eyes, the mouth and the fingers are not used.
        put(2 + 3 * k, Eye(side));
        put(7 + k, Ear(side));
        put(11 + k, SHOULDER[k]);
        put(13 + k, ELBOW[k]);
        put(15 + k, WRIST[k]);
        put(23 + k, HIP[k]);
        put(25 + k, KNEE[k]);
        put(27 + k, ANKLE[k]);
        put(29 + k, Heel(side));
        put(31 + k, BigToe(side));
    }
    marks
}

impl Mark {
    /// The mark's name, as OpenPose calls it.
    pub fn name(self) -> String {
        let of = |side: Side, what: &str| format!("{} {what}", side.name());
        match self {
            Joint(UpperArm(side)) => of(side, "shoulder"),
            Joint(LowerArm(side)) => of(side, "elbow"),
            Joint(Hand(side)) => of(side, "wrist"),
            Joint(UpperLeg(side)) => of(side, "hip"),
            Joint(LowerLeg(side)) => of(side, "knee"),
            Joint(Foot(side)) => of(side, "ankle"),
            Joint(other) => other.part_name(),
            Neck => "neck".into(),
            MidHip => "mid hip".into(),
            Nose => "nose".into(),
            Eye(side) => of(side, "eye"),
            Ear(side) => of(side, "ear"),
            BigToe(side) => of(side, "big toe"),
            SmallToe(side) => of(side, "small toe"),
            Heel(side) => of(side, "heel"),
        }
    }

    /// Whether the mark is a shoulder, the neck, a hip or the mid hip: what turns with the torso.
    pub fn is_of_torso(self) -> bool {
        matches!(self, Neck | MidHip | Joint(UpperArm(_) | UpperLeg(_)))
    }

    /// Whether the mark is on the head.
    pub fn is_of_head(self) -> bool {
        matches!(self, Nose | Eye(_) | Ear(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_layout_has_its_number_of_keypoints_and_both_sides() {
        for layout in [Layout::Body25, Layout::Coco18, Layout::Coco17, Layout::MediaPipe33] {
            let marks = layout.marks();
            assert_eq!(marks.len(), layout.point_count(), "{layout:?}");
            for pair in [SHOULDER, ELBOW, WRIST, HIP, KNEE, ANKLE] {
                assert!(
                    pair.iter().all(|m| marks.iter().filter(|n| **n == Some(*m)).count() == 1),
                    "{layout:?} {pair:?}"
                );
            }
        }
        assert_eq!(Layout::Body25.marks()[21], Some(Heel(Left)));
        assert_eq!(Layout::Coco18.marks()[13], Some(ANKLE[0]));
        assert_eq!(Layout::Coco17.marks()[16], Some(ANKLE[1]));
        assert_eq!(Layout::MediaPipe33.marks()[5], Some(Eye(Right)));
    }
}
