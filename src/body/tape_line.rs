//! Where a tape goes around a body, and around what is worn there.

use super::human_joint::HumanJoint::UpperArm;
use super::human_joint::Side;
use super::{JointId, Skeleton, SkinRow, SkinWeights};
use crate::geometry::{PerVertex, Point, Vec3};

/// A place of a body in the bind pose where a tape goes around it.
#[derive(Clone, Debug)]
pub struct TapeLine {
    /// `chest`, `waist`, `hip`, `thigh`, `upper arm`.
    pub name: &'static str,
    /// The girth of the body there, metres.
    pub girth: f64,
    /// A point of the plane.
    pub origin: Point,
    /// Two unit axes that span it.
    pub axes: [Vec3; 2],
    /// What the tape goes around.
    pub(super) around: Around,
}

/// What a tape goes around.
#[derive(Clone, Copy, Debug)]
pub(super) enum Around {
    /// The trunk without the arms.
    Trunk,
    /// What follows a joint, and partly the one before it.
    Limb(JointId),
}

impl Around {
    /// Which vertices of the body belong to it; at the root of a limb also those that mostly follow the joint before it.
    ///
    /// **Shapes** one entry per row of `weights`.
    pub fn vertices(self, skeleton: &Skeleton, weights: &SkinWeights) -> PerVertex<bool> {
        match self {
            Self::Trunk => of_trunk(skeleton, weights),
            Self::Limb(limb) => {
                let before = skeleton.parents[limb.index()].filter(|parent| parent.index() > 0);
                following(skeleton, weights, 0.3, |j| skeleton.is_below(j, limb) || Some(j) == before)
            }
        }
    }
}

impl TapeLine {
    /// Which vertices of cloth lie around the same part of the body. Of a limb, only those that follow it: a plane across the upper
    /// arm also cuts the trunk's cloth.
    ///
    /// **Shapes** one entry per row of `weights`.
    pub fn vertices(&self, skeleton: &Skeleton, weights: &SkinWeights) -> PerVertex<bool> {
        match self.around {
            Around::Trunk => of_trunk(skeleton, weights),
            Around::Limb(limb) => following(skeleton, weights, 0.5, |j| skeleton.is_below(j, limb)),
        }
    }
}

fn of_trunk(skeleton: &Skeleton, weights: &SkinWeights) -> PerVertex<bool> {
    let is_arm = |joint| Side::BOTH.iter().any(|&side| skeleton.is_part_of(joint, UpperArm(side)));
    following(skeleton, weights, 0.5, |joint| !is_arm(joint))
}

/// The vertices that follow some joints by more than a share of their weight.
fn following(
    skeleton: &Skeleton,
    weights: &SkinWeights,
    share: f64,
    counts: impl Fn(JointId) -> bool,
) -> PerVertex<bool> {
    let is_own: Vec<bool> = skeleton.ids().map(counts).collect();
    let of_row = |row: &SkinRow| row.iter().filter(|e| is_own[e.0.index()]).map(|e| e.1).sum::<f64>();
    weights.rows().iter().map(|row| of_row(row) > share).collect()
}
