//! Depth flips: a bone that points toward the camera has the same image as one that points away.

use super::descent::{Solution, minimized};
use super::energy::{Energy, LAST};
use super::mark::Mark;
use crate::body::HumanJoint::{self, Foot, Hand, LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::{JointId, Pose, Side};
use crate::geometry::Vec3;
use nalgebra::{Unit, UnitQuaternion, Vector2};

/// Energies nearer than this are those of the same solution.
const LEAST_GAIN: f64 = 1e-3;
/// Iterations after each flip.
const STEPS: usize = 12;
/// Rounds over the limbs: one limb may free another.
const ROUNDS: usize = 2;

/// The solution with the lowest energy among those whose bones are flipped in depth, limb by limb: both bones of an arm or leg
/// point toward the camera or away from it, with the other limbs as they are, and all four are solved from there.
///
/// **Source** Taylor 2000: a bone of known length has two places on the ray of its end.
pub(super) fn unflipped(energy: &Energy<'_>, from: Solution) -> Solution {
    let mut best = minimized(energy, from, LAST, STEPS);
    for _ in 0..ROUNDS {
        let before = best.cost;
        for chain in limbs() {
            let signs = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
            let tried = signs.into_iter().filter_map(|signs| {
                let start = flipped(energy, &best, &chain, signs)?;
                let mut solved = minimized(energy, start, LAST, STEPS);
                solved.flipped += 1;
                Some(solved)
            });
            let other = tried.min_by(|a, b| a.cost.total_cmp(&b.cost));
            if let Some(other) = other.filter(|other| other.cost < best.cost - LEAST_GAIN) {
                best = other;
            }
        }
        if best.cost == before {
            break;
        }
    }
    best
}

fn limbs() -> [[HumanJoint; 3]; 4] {
    let [l, r] = Side::BOTH;
    let arm = |side| [UpperArm(side), LowerArm(side), Hand(side)];
    let leg = |side| [UpperLeg(side), LowerLeg(side), Foot(side)];
    [arm(l), arm(r), leg(l), leg(r)]
}

/// The chain with each bone on the near (−1) or far (1) side; `None` for a skeleton without these joints.
fn flipped(energy: &Energy<'_>, at: &Solution, chain: &[HumanJoint; 3], signs: [f64; 2]) -> Option<Solution> {
    let skeleton = &energy.rig.model.skeleton;
    let mut pose = at.pose.clone();
    for k in 0..2 {
        let joints = [skeleton.find(chain[k])?, skeleton.find(chain[k + 1])?];
        let posed = energy.rig.posed(&pose, &at.shape);
        let [from, to] = joints.map(|j| posed.place[j.index()]);
        let seen = energy.sightings.iter().find(|s| s.mark == Mark::Joint(chain[k + 1])).map(|s| s.at);
        // A joint that was not seen stays where it is in the picture.
        let pixel = seen.or_else(|| energy.camera.project(&to))?;
        let wanted = on_ray(energy, &pixel, &from, (to - from).norm(), signs[k]) - from;
        aim(energy, &mut pose, &at.shape, joints, &wanted);
    }
    // Turns the upper bones about themselves so that knees and elbows bend the way they can.
    let (pose, _) = energy.rig.anatomy.limited(&pose);
    Some(Solution { pose, ..at.clone() })
}

/// The point behind a pixel at `length` from a point: the nearer (−1) or the farther (1) of both, or the closest one of the ray.
fn on_ray(energy: &Energy<'_>, pixel: &Vector2<f64>, from: &Vec3, length: f64, sign: f64) -> Vec3 {
    let eye = energy.camera.center();
    let ray = (energy.camera.behind(pixel, 1.0) - eye).normalize();
    let along = (from - eye).dot(&ray);
    let aside = (from - eye - ray * along).norm();
    eye + ray * (along + sign * (length * length - aside * aside).max(0.0).sqrt())
}

/// Turns a joint so that its bone has the direction, by the smallest rotation.
fn aim(energy: &Energy<'_>, pose: &mut Pose, shape: &[f64], [joint, end]: [JointId; 2], wanted: &Vec3) {
    let posed = energy.rig.posed(pose, shape);
    let bone = posed.place[end.index()] - posed.place[joint.index()];
    let (Some(from), Some(to)) = (Unit::try_new(bone, 1e-9), Unit::try_new(*wanted, 1e-9)) else { return };
    let Some(turn) = UnitQuaternion::rotation_between_axis(&from, &to) else { return };
    let mut above = UnitQuaternion::identity();
    let mut at = energy.rig.model.skeleton.parents[joint.index()];
    while let Some(j) = at {
        above = pose.rotations[j.index()] * above;
        at = energy.rig.model.skeleton.parents[j.index()];
    }
    pose.rotations[joint.index()] = above.inverse() * turn * above * pose.rotations[joint.index()];
}
