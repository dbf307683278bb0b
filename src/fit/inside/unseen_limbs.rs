//! Limbs that the scan does not show.

use super::params::InsideMethod;
use super::problem::InsideProblem;
use crate::body::{JointId, Pose, Skeleton};
use crate::fit::correspondence::{
    Part, display_name, parts, parts_named, side_of, unseen_parts, visible_at, visible_shares,
};
use crate::fit::solver::Posed;
use crate::geometry::{Point, SurfaceIndex};

impl InsideProblem<'_> {
    /// Limbs of which the scan shows next to nothing, neither skin nor cloth around them.
    pub(crate) fn unseen_limbs(&self, previous: &Pose, pose: &Pose) -> Vec<JointId> {
        /// A limb whose end has moved by this much, in metres, must be seen by more than half: an arm that fled into a coat's
        /// trunk has cloth around half of it.
        const FAR: f64 = 0.15;
        const LEAST_WHERE_MOVED: f64 = 0.7;
        if self.params.method == InsideMethod::Paper {
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

    /// A sentence where the scan lacks the head, without which all the rest is fitted as well.
    pub(crate) fn unseen_head(&self, posed: &Posed) -> Option<&'static str> {
        let head = parts_named(&["head"], &self.body.skeleton, self.body.weights);
        let unseen = unseen_parts(&head, &self.visible_shares(&head, posed), &self.body.skeleton);
        (!unseen.is_empty()).then_some("the scan does not show the head")
    }

    /// Of each part the share of which the scan shows skin, or cloth around it.
    fn visible_shares(&self, parts: &[Part], posed: &Posed) -> Vec<f64> {
        let normals = self.normals(posed);
        let index = SurfaceIndex::prepare(&self.body_mesh(posed));
        visible_shares(&index, parts, |v, p| match self.figure_surface.is_visible(v) {
            true => visible_at(self.surface, p, &normals[v]),
            false => side_of(self.surface, p, &normals[v]).map(|side| side.place),
        })
    }

    /// How far the joints from `limb` on have moved, at most, as seen from the root: metres.
    fn end_moved(&self, limb: JointId, previous: &Pose, pose: &Pose) -> f64 {
        let skeleton = &self.body.skeleton;
        let (before, after) = (seen_from_root(skeleton, previous), seen_from_root(skeleton, pose));
        let below = skeleton.ids().filter(|&j| skeleton.is_below(j, limb));
        below.map(|j| (before[j.index()] - after[j.index()]).norm()).fold(0.0, f64::max)
    }

    /// Takes limbs out of the fit: they hang as before.
    pub(crate) fn leave_out(&mut self, limbs: &[JointId], log: &mut Vec<String>) {
        let skeleton = &self.body.skeleton;
        for &limb in limbs {
            let name = display_name(&skeleton.names[limb.index()]);
            log.push(format!("the scan does not show the {name}; it keeps the pose of the step before"));
            for (held, j) in self.held.iter_mut().zip(skeleton.ids()) {
                *held |= skeleton.is_below(j, limb);
            }
        }
        let names: Vec<&str> = limbs.iter().map(|limb| skeleton.names[limb.index()].as_str()).collect();
        for part in parts_named(&names, skeleton, self.body.weights) {
            self.left_out.0.iter_mut().zip(part.vertices.iter()).for_each(|(out, belongs)| *out |= belongs);
        }
    }
}

/// A pose whose limbs, from these joints on, are as in another, seen from where they hang.
pub(crate) fn with_limbs_of(mut pose: Pose, other: &Pose, skeleton: &Skeleton, limbs: &[JointId]) -> Pose {
    for j in skeleton.ids().filter(|&j| limbs.iter().any(|&limb| skeleton.is_below(j, limb))) {
        pose.rotations[j.index()] = other.rotations[j.index()];
    }
    pose
}

/// Mean move of the joints from one pose to another, as seen from the root: metres.
pub(crate) fn joint_change(skeleton: &Skeleton, from: &Pose, to: &Pose) -> f64 {
    let (before, after) = (seen_from_root(skeleton, from), seen_from_root(skeleton, to));
    before.iter().zip(&after).map(|(p, q)| (p - q).norm()).sum::<f64>() / before.len().max(1) as f64
}

/// The joints in the root's frame.
pub(crate) fn seen_from_root(skeleton: &Skeleton, pose: &Pose) -> Vec<Point> {
    let root = skeleton.world_from_bind(pose)[0].inverse();
    skeleton.joints_in_world(pose).iter().map(|p| root * p).collect()
}
