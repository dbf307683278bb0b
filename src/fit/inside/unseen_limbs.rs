//! Limbs that the scan does not show.

use super::params::InsideMethod;
use super::problem::InsideProblem;
use crate::body::{HumanJoint, JointId, Pose, Skeleton};
use crate::fit::correspondence::{
    JointSubtree, part, parts, parts_from, side_of, unseen_parts, visible_at, visible_shares,
};
use crate::fit::solver::Posed;
use crate::geometry::{Point, SurfaceIndex};

impl InsideProblem<'_> {
    /// Limbs of which the scan shows almost nothing, neither skin nor cloth around them.
    pub(crate) fn unseen_limbs(&self, previous: &Pose, pose: &Pose) -> Vec<JointId> {
        /// If the end of a limb has moved further than this, in metres, the scan must show more than half of the limb: an arm that
        /// was pulled into a coat's trunk has cloth around half of it.
        const FAR: f64 = 0.15;
        const LEAST_WHERE_MOVED: f64 = 0.7;
        if self.params.method == InsideMethod::Hybrid {
            return Vec::new();
        }
        let skeleton = &self.body.skeleton;
        let parts = parts(skeleton, self.body.weights);
        let shares = self.visible_shares(&parts, &self.posed(pose));
        let mut unseen = unseen_parts(&parts, &shares, skeleton);

        for (part, share) in parts.iter().zip(&shares) {
            let is_new = !unseen.iter().any(|&u| skeleton.is_below(part.joint, u));
            if is_new && *share < LEAST_WHERE_MOVED && self.end_moved(part.joint, previous, pose) > FAR {
                unseen.push(part.joint);
            }
        }
        unseen
    }

    /// A warning if the scan does not show the head, without which everything else is fitted equally well.
    pub(crate) fn unseen_head(&self, posed: &Posed) -> Option<&'static str> {
        let head = parts_from(&[HumanJoint::Head], &self.body.skeleton, self.body.weights);
        let unseen = unseen_parts(&head, &self.visible_shares(&head, posed), &self.body.skeleton);
        (!unseen.is_empty()).then_some("the scan does not show the head")
    }

    /// The share of each part of which the scan shows skin, or cloth around it. **Shapes** one share per part.
    fn visible_shares(&self, parts: &[JointSubtree], posed: &Posed) -> Vec<f64> {
        let normals = self.normals(posed);
        let index = SurfaceIndex::prepare(&self.body_mesh(posed));
        visible_shares(&index, parts, |v, p| match self.figure_surface.is_visible(v) {
            true => visible_at(self.surface, p, &normals[v]),
            false => side_of(self.surface, p, &normals[v]).map(|side| side.place),
        })
    }

    /// Greatest move of the joints from `limb` on, in the root's frame, in metres.
    fn end_moved(&self, limb: JointId, previous: &Pose, pose: &Pose) -> f64 {
        let skeleton = &self.body.skeleton;
        let (before, after) = (joints_in_root_frame(skeleton, previous), joints_in_root_frame(skeleton, pose));
        let below = skeleton.ids().filter(|&j| skeleton.is_below(j, limb));
        below.map(|j| (before[j.index()] - after[j.index()]).norm()).fold(0.0, f64::max)
    }

    /// Excludes limbs from the fit: they keep their previous pose.
    pub(crate) fn leave_out(&mut self, limbs: &[JointId], log: &mut Vec<String>) {
        let skeleton = &self.body.skeleton;
        for &limb in limbs {
            let name = skeleton.part_name(limb);
            log.push(format!("the scan does not show the {name}; it keeps the previous step's pose"));
            for (held, j) in self.held.iter_mut().zip(skeleton.ids()) {
                *held |= skeleton.is_below(j, limb);
            }
        }
        for part in limbs.iter().map(|&limb| part(limb, skeleton, self.body.weights)) {
            self.left_out.0.iter_mut().zip(part.vertices.iter()).for_each(|(out, belongs)| *out |= belongs);
        }
    }
}

/// A pose with the joint rotations of another from these limbs on.
pub(crate) fn with_limbs_of(mut pose: Pose, other: &Pose, skeleton: &Skeleton, limbs: &[JointId]) -> Pose {
    for j in skeleton.ids().filter(|&j| limbs.iter().any(|&limb| skeleton.is_below(j, limb))) {
        pose.rotations[j.index()] = other.rotations[j.index()];
    }
    pose
}

/// Mean move of the joints between two poses in the root's frame, in metres.
pub(crate) fn joint_change(skeleton: &Skeleton, from: &Pose, to: &Pose) -> f64 {
    let (before, after) = (joints_in_root_frame(skeleton, from), joints_in_root_frame(skeleton, to));
    before.iter().zip(&after).map(|(p, q)| (p - q).norm()).sum::<f64>() / before.len().max(1) as f64
}

/// The joints in the root's frame.
pub(crate) fn joints_in_root_frame(skeleton: &Skeleton, pose: &Pose) -> Vec<Point> {
    let root = skeleton.world_from_bind(pose)[0].inverse();
    skeleton.joints_in_world(pose).iter().map(|p| root * p).collect()
}
