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
    /// Which vertices belong to it.
    ///
    /// **Shapes** one entry per row of `weights`.
    pub fn vertices(self, skeleton: &Skeleton, weights: &SkinWeights) -> PerVertex<bool> {
        let is_own: Vec<bool> = skeleton.ids().map(|j| self.counts(skeleton, j)).collect();
        let share = |row: &SkinRow| row.iter().filter(|e| is_own[e.0.index()]).map(|e| e.1).sum::<f64>();
        weights.rows().iter().map(|row| share(row) > self.least()).collect()
    }

    fn counts(self, skeleton: &Skeleton, joint: JointId) -> bool {
        match self {
            Self::Trunk => !Side::BOTH.iter().any(|&side| skeleton.is_part_of(joint, UpperArm(side))),
            Self::Limb(limb) => {
                let parent = skeleton.parents[limb.index()].filter(|parent| parent.index() > 0);
                skeleton.is_below(joint, limb) || Some(joint) == parent
            }
        }
    }

    /// The share of its weight above which a vertex belongs to it.
    fn least(self) -> f64 {
        match self {
            Self::Trunk => 0.5,
            Self::Limb(_) => 0.3,
        }
    }
}

impl TapeLine {
    /// Which vertices of cloth lie around the same part of the body.
    ///
    /// **Shapes** one entry per row of `weights`.
    pub fn vertices(&self, skeleton: &Skeleton, weights: &SkinWeights) -> PerVertex<bool> {
        self.around.vertices(skeleton, weights)
    }
}
