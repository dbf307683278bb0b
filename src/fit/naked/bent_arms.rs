//! Arm poses that no initial pose of a standing person converges to: hands on the hips, crossed, behind the back, at the head.

use super::coarse_fit::CoarseFit;
use super::problem::NakedProblem;
use super::refine::ModelEstimate;
use crate::body::HumanJoint::{Chest, Hand, Head, LowerArm, Neck, Shoulder, Spine, UpperArm, UpperChest};
use crate::body::{HumanJoint, JointId, Pose, Shape, Side};
use crate::fit::correspondence::{JointSubtree, parts_from, visible_at, visible_shares};
use crate::fit::solver::Phase;
use crate::geometry::{SurfaceIndex, Vec3, VertexId, WindingField};
use nalgebra::UnitQuaternion;
use rayon::prelude::*;

/// Rotations of a left upper and lower arm from the bind pose, as axis times degrees; those of a right arm are mirrored.
/// They cover where people put their hands, at most 40° apart: about the basin of convergence of a bent arm.
const BENT: [[[f64; 3]; 2]; 8] = [
    // Hanging.
    [[0.0, 0.0, -38.0], [0.0, 0.0, 0.0]],
    // On the hip.
    [[0.0, 15.0, 0.0], [0.0, -30.0, -80.0]],
    // Across the belly.
    [[-15.0, -20.0, -30.0], [-20.0, -80.0, -10.0]],
    // Across the chest.
    [[-35.0, -30.0, -20.0], [-30.0, -110.0, 10.0]],
    // Behind the back.
    [[20.0, 25.0, -30.0], [10.0, 65.0, -20.0]],
    // To the front.
    [[0.0, -75.0, 15.0], [0.0, -20.0, 0.0]],
    // Before the breast, hand up.
    [[-10.0, -20.0, -30.0], [-60.0, -90.0, 30.0]],
    // At the head.
    [[0.0, 0.0, 50.0], [0.0, -20.0, 110.0]],
];

/// An arm, forearm or hand of which the scan shows less than this share may have another pose: correct fits show at least
/// 0.77 of a hand and 0.89 of an arm.
const UNCERTAIN: f64 = 0.65;

/// A hand of which more than this share is inside the rest of the body is in an impossible pose: of correctly fitted hands at
/// most a ninth is.
const BURIED: f64 = 0.3;

/// The parts that begin at these joints, and the share of each that the scan shows.
fn visible_parts(
    problem: &NakedProblem<'_>,
    index: &SurfaceIndex,
    roots: &[HumanJoint],
) -> (Vec<JointSubtree>, Vec<f64>) {
    let normals = index.mesh().vertex_normals_by_area();
    let parts = parts_from(roots, &problem.model.skeleton, &problem.model.weights);
    let shares = visible_shares(index, &parts, |v, p| visible_at(problem.surface, p, &normals[v]));
    (parts, shares)
}

/// Whether the scan shows both forearms in this pose.
pub(crate) fn forearms_are_visible(problem: &NakedProblem<'_>, pose: &Pose, shape: &Shape) -> bool {
    let index = problem.index_at(pose, shape);
    visible_parts(problem, &index, &Side::BOTH.map(LowerArm)).1.iter().all(|share| *share >= UNCERTAIN)
}

/// The upper arm joints of arms that may have another pose.
pub(crate) fn uncertain_arms(problem: &NakedProblem<'_>, index: &SurfaceIndex) -> Vec<JointId> {
    Side::BOTH
        .into_iter()
        .filter_map(|side| {
            let shares = visible_parts(problem, index, &[UpperArm(side), LowerArm(side), Hand(side)]).1;
            let is_uncertain = shares.iter().any(|share| *share < UNCERTAIN);
            is_uncertain.then(|| problem.model.skeleton.find(UpperArm(side)))?
        })
        .collect()
}

/// A hand that the fit pulled into the rest of the body, because the scan does not show it where the fit looked for it.
pub(crate) fn buried_hand(problem: &NakedProblem<'_>, index: &SurfaceIndex, unseen: &[JointId]) -> Option<JointId> {
    let (model, body) = (problem.model, index.mesh());
    let (hands, shares) = visible_parts(problem, index, &Side::BOTH.map(Hand));
    let of_missing = |hand: &JointSubtree| unseen.iter().any(|&u| model.skeleton.is_below(hand.joint, u));
    let uncertain: Vec<&JointSubtree> = hands
        .iter()
        .zip(&shares)
        .filter(|(hand, share)| **share < UNCERTAIN && !of_missing(hand))
        .map(|h| h.0)
        .collect();
    if uncertain.is_empty() {
        return None;
    }
    let (field, normals) = (WindingField::prepare(body), body.vertex_normals());
    // Just below its own skin the winding number of a hand is one; inside the rest of the body it is two.
    let is_inside = |v: VertexId| field.winding(&(body.points()[v] - normals[v] * 0.003)) > 1.5;
    let is_buried = |hand: &&JointSubtree| {
        let skin: Vec<VertexId> = body.vertex_ids().filter(|&v| hand.vertices[v]).collect();
        let inside = skin.par_iter().filter(|&&v| is_inside(v)).count();
        inside as f64 > BURIED * skin.len() as f64
    };
    uncertain.into_iter().find(is_buried).map(|hand| hand.joint)
}

/// Refits from other poses of these arms, one arm after the other; `None` if none is better.
pub(crate) fn refit_with_bent_arms(
    problem: &NakedProblem<'_>,
    coarse: &CoarseFit,
    found: &ModelEstimate,
    arms: &[JointId],
    log: &mut Vec<String>,
) -> Option<ModelEstimate> {
    let skeleton = &problem.model.skeleton;
    let limbs_turn =
        Phase { iterations: 8, samples: 0, reach: 0.15, least_cosine: 0.3, limbs_only: true, shape: false };
    let mut pose = with_trunk_straight(problem, &found.pose);
    for &arm in arms {
        let tried: Vec<(f64, Pose)> = BENT
            .par_iter()
            .map(|turns| {
                let pose = with_arm(problem, &pose, arm, turns);
                let (pose, shape) = coarse.fit(&limbs_turn, pose, found.shape.clone());
                (problem.score(&pose, &shape), pose)
            })
            .collect();
        // The pose so far has had all iterations, these only a few: the best of them is refined below before comparing.
        pose = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    }
    let all_turn = Phase { iterations: 8, limbs_only: false, shape: true, ..limbs_turn };
    let (pose, shape) = coarse.fit(&all_turn, pose, found.shape.clone());
    let other = problem.refine(pose, shape, &mut |_| {});
    let (before, after) = (problem.score(&found.pose, &found.shape), problem.score(&other.pose, &other.shape));
    let names: Vec<String> = arms.iter().map(|a| skeleton.part_name(*a)).collect();
    log.push(format!(
        "tried other poses of the {}: score {:.1} mm, previously {:.1} mm",
        names.join(" and the "),
        after * 1e3,
        before * 1e3
    ));
    (after < before).then_some(other)
}

fn with_arm(problem: &NakedProblem<'_>, pose: &Pose, arm: JointId, turns: &[[f64; 3]; 2]) -> Pose {
    let skeleton = &problem.model.skeleton;
    let is_left = skeleton.human_joint(arm).and_then(HumanJoint::side) == Some(Side::Left);
    let turn = |deg: &[f64; 3]| {
        let [x, y, z] = deg.map(f64::to_radians);
        UnitQuaternion::from_scaled_axis(if is_left { Vec3::new(x, y, z) } else { Vec3::new(x, -y, -z) })
    };
    let mut pose = pose.clone();
    for j in skeleton.ids().filter(|&j| skeleton.is_below(j, arm)) {
        pose.rotations[j.index()] = match skeleton.human_joint(j) {
            Some(UpperArm(_)) => turn(&turns[0]),
            Some(LowerArm(_)) => turn(&turns[1]),
            _ => UnitQuaternion::identity(),
        };
    }
    pose
}

/// Resets the trunk, which yields to an arm that is pulled into it, to the expected pose.
pub(crate) fn with_trunk_straight(problem: &NakedProblem<'_>, pose: &Pose) -> Pose {
    let mut pose = pose.clone();
    let skeleton = &problem.model.skeleton;
    for joint in skeleton.ids().skip(1) {
        if skeleton.human_joint(joint).is_some_and(|joint| TRUNK.contains(&joint)) {
            pose.rotations[joint.index()] = UnitQuaternion::identity();
        }
    }
    pose
}

/// Joints that yield to a limb that is pulled into the trunk.
const TRUNK: [HumanJoint; 7] = [Spine, Chest, UpperChest, Neck, Head, Shoulder(Side::Left), Shoulder(Side::Right)];
