//! Arms that no start of a standing person leads to: on the hips, crossed, behind the back, at the head.

use super::coarse_fit::CoarseFit;
use super::problem::NakedProblem;
use super::refine::ModelEstimate;
use crate::body::{JointId, Pose, Shape};
use crate::fit::correspondence::{Part, display_name, parts_named, visible_at, visible_shares};
use crate::fit::solver::Phase;
use crate::geometry::{SurfaceIndex, Vec3, VertexId, WindingField};
use nalgebra::UnitQuaternion;
use rayon::prelude::*;

/// Turns of a left upper and lower arm away from the bind pose, as axis times degrees; those of a right arm mirror them.
/// Where people put their hands, 40° apart at most: about the basin of convergence of a bent arm.
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

/// An arm, forearm or hand of which the scan shows less may be poses_in_others: of scans that were fitted rightly 0.77 of a hand
/// and 0.89 of an arm are shown at least.
const DOUBTFUL: f64 = 0.65;

/// A hand of which more lies inside the rest of the body is where no hand can be: of those fitted rightly a ninth at most.
const BURIED: f64 = 0.3;

/// Shares of parts that the scan shows.
fn shown(problem: &NakedProblem<'_>, index: &SurfaceIndex, names: &[&str]) -> (Vec<Part>, Vec<f64>) {
    let normals = index.mesh().vertex_normals_by_area();
    let parts = parts_named(names, &problem.model.skeleton, &problem.model.weights);
    let shares = visible_shares(index, &parts, |v, p| visible_at(problem.surface, p, &normals[v]));
    (parts, shares)
}

/// Whether a start has both forearms in the scan's.
pub(crate) fn forearms_are_visible(problem: &NakedProblem<'_>, pose: &Pose, shape: &Shape) -> bool {
    let index = problem.index_at(pose, shape);
    shown(problem, &index, &["leftLowerArm", "rightLowerArm"]).1.iter().all(|share| *share >= DOUBTFUL)
}

/// The upper arms of arms that may be poses_in_others.
pub(crate) fn uncertain_arms(problem: &NakedProblem<'_>, index: &SurfaceIndex) -> Vec<JointId> {
    ["left", "right"]
        .iter()
        .filter_map(|side| {
            let names = ["UpperArm", "LowerArm", "Hand"].map(|part| format!("{side}{part}"));
            let shares = shown(problem, index, &names.each_ref().map(String::as_str)).1;
            let is_doubtful = shares.iter().any(|share| *share < DOUBTFUL);
            is_doubtful.then(|| problem.model.skeleton.find_name(&names[0]))?
        })
        .collect()
}

/// A hand that was drawn into the rest of the body, for the scan does not show it where it was looked for.
pub(crate) fn buried_hand<'a>(problem: &NakedProblem<'a>, index: &SurfaceIndex, unseen: &[JointId]) -> Option<&'a str> {
    let (model, body) = (problem.model, index.mesh());
    let (hands, shares) = shown(problem, index, &["leftHand", "rightHand"]);
    let of_missing = |hand: &Part| unseen.iter().any(|&u| model.skeleton.is_below(hand.joint, u));
    let doubtful: Vec<&Part> = hands
        .iter()
        .zip(&shares)
        .filter(|(hand, share)| **share < DOUBTFUL && !of_missing(hand))
        .map(|h| h.0)
        .collect();
    if doubtful.is_empty() {
        return None;
    }
    let (field, normals) = (WindingField::prepare(body), body.vertex_normals());
    // Just below its own skin a hand is wound around once, and once more inside the rest.
    let is_inside = |v: VertexId| field.winding(&(body.points()[v] - normals[v] * 0.003)) > 1.5;
    let is_buried = |hand: &&Part| {
        let skin: Vec<VertexId> = body.vertex_ids().filter(|&v| hand.vertices[v]).collect();
        let inside = skin.par_iter().filter(|&&v| is_inside(v)).count();
        inside as f64 > BURIED * skin.len() as f64
    };
    let buried = doubtful.into_iter().find(is_buried)?;
    Some(model.skeleton.names[buried.joint.index()].as_str())
}

/// The fit again from other poses of these arms, one arm after the other; `None` where none is better.
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
        let tries: Vec<(f64, Pose)> = BENT
            .par_iter()
            .map(|turns| {
                let pose = with_arm(problem, &pose, arm, turns);
                let (pose, shape) = coarse.fit(&limbs_turn, pose, found.shape.clone());
                (problem.score(&pose, &shape), pose)
            })
            .collect();
        // The pose so far has had all of its iterations, these only a few: the best of them is tried to the end below.
        pose = tries.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    }
    let all_turn = Phase { iterations: 8, limbs_only: false, shape: true, ..limbs_turn };
    let (pose, shape) = coarse.fit(&all_turn, pose, found.shape.clone());
    let other = problem.refine(pose, shape, &mut |_| {});
    let (before, after) = (problem.score(&found.pose, &found.shape), problem.score(&other.pose, &other.shape));
    let names: Vec<String> = arms.iter().map(|a| display_name(&skeleton.names[a.index()])).collect();
    log.push(format!(
        "tried other poses of the {}: score {:.1} mm, {:.1} mm before",
        names.join(" and the "),
        after * 1e3,
        before * 1e3
    ));
    (after < before).then_some(other)
}

fn with_arm(problem: &NakedProblem<'_>, pose: &Pose, arm: JointId, turns: &[[f64; 3]; 2]) -> Pose {
    let skeleton = &problem.model.skeleton;
    let is_left = skeleton.names[arm.index()].starts_with("left");
    let turn = |deg: &[f64; 3]| {
        let [x, y, z] = deg.map(f64::to_radians);
        UnitQuaternion::from_scaled_axis(if is_left { Vec3::new(x, y, z) } else { Vec3::new(x, -y, -z) })
    };
    let mut pose = pose.clone();
    for j in skeleton.ids().filter(|&j| skeleton.is_below(j, arm)) {
        pose.rotations[j.index()] = match skeleton.names[j.index()].as_str() {
            name if name.ends_with("UpperArm") => turn(&turns[0]),
            name if name.ends_with("LowerArm") => turn(&turns[1]),
            _ => UnitQuaternion::identity(),
        };
    }
    pose
}

/// What gave way to an arm that was drawn into it goes back to where it is expected.
pub(crate) fn with_trunk_straight(problem: &NakedProblem<'_>, pose: &Pose) -> Pose {
    let mut pose = pose.clone();
    for (rotation, name) in pose.rotations.iter_mut().zip(&problem.model.skeleton.names).skip(1) {
        if TRUNK.contains(&name.as_str()) {
            *rotation = UnitQuaternion::identity();
        }
    }
    pose
}

/// What gives way to a limb that is drawn into it.
pub(crate) const TRUNK: [&str; 7] = ["spine", "chest", "upperChest", "neck", "head", "leftShoulder", "rightShoulder"];
