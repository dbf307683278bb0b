//! Joint centres and limits.

use super::anatomy::Anatomy;
use super::skin::{JOINTS, joint};
use crate::body::{Finger, JointId, Skeleton};
use crate::geometry::Vec3;

/// The joints' names.
pub(super) fn names() -> Vec<String> {
    Skeleton::body_names().into_iter().chain(Finger::all_joint_names()).collect()
}

/// The joints' parents.
pub(super) fn parents() -> Vec<Option<JointId>> {
    let of_finger = |j: usize| match (j - joint::FINGERS) % 3 {
        0 if j < joint::mirrored(joint::FINGERS) => joint::HAND,
        0 => joint::mirrored(joint::HAND),
        _ => j - 1,
    };
    let fingers = (joint::FINGERS..JOINTS).map(|j| Some(JointId(of_finger(j) as u16)));
    Skeleton::body_parents().into_iter().chain(fingers).collect()
}

/// Joint centres of both sides in the model's order.
pub(super) fn centers(body: &Anatomy) -> [Vec3; JOINTS] {
    let j = &body.joints;
    let mut all = [Vec3::zeros(); JOINTS];
    let list = [
        (joint::HIPS, j.hips),
        (joint::SPINE, j.spine),
        (joint::CHEST, j.chest),
        (joint::UPPER_CHEST, j.upper_chest),
        (joint::NECK, j.neck),
        (joint::HEAD, j.head),
        (joint::SHOULDER, j.shoulder),
        (joint::UPPER_ARM, j.upper_arm),
        (joint::LOWER_ARM, j.lower_arm),
        (joint::HAND, j.hand),
        (joint::UPPER_LEG, j.upper_leg),
        (joint::LOWER_LEG, j.lower_leg),
        (joint::FOOT, j.foot),
        (joint::TOES, j.toes),
    ];
    let fingers = body.joints.fingers.iter().flatten().copied();
    for (k, p) in list.into_iter().chain((joint::FINGERS..).zip(fingers)) {
        all[k] = p;
        let m = joint::mirrored(k);
        if m != k {
            all[m] = Vec3::new(-p.x, p.y, p.z);
        }
    }
    all
}

/// Bounds of each joint's rotation vector (degrees), x, y, z, from the bind pose; of the left side, the right is mirrored.
///
/// **Source** AAOS ranges with about a tenth added, distributed along the spine and between neck and head, turned from
/// the anatomical position into the A-pose.
pub(super) fn limits(body: &Anatomy) -> [[[f64; 2]; 3]; JOINTS] {
    let mut all = [[[0.0; 2]; 3]; JOINTS];
    let box_of = |x: [f64; 2], y: [f64; 2], z: [f64; 2]| [x, y, z];
    let [d, u, v] = body.arm;
    let list = [
        (joint::HIPS, box_of([-180.0, 180.0], [-180.0, 180.0], [-180.0, 180.0])),
        (joint::SPINE, box_of([-15.0, 40.0], [-10.0, 10.0], [-15.0, 15.0])),
        (joint::CHEST, box_of([-10.0, 25.0], [-18.0, 18.0], [-12.0, 12.0])),
        (joint::UPPER_CHEST, box_of([-8.0, 16.0], [-18.0, 18.0], [-10.0, 10.0])),
        (joint::NECK, box_of([-30.0, 30.0], [-40.0, 40.0], [-23.0, 23.0])),
        (joint::HEAD, box_of([-30.0, 30.0], [-40.0, 40.0], [-23.0, 23.0])),
        // Elevation turns the left side about +z, protraction about −y.
        (joint::SHOULDER, box_of([-10.0, 10.0], [-20.0, 20.0], [-10.0, 40.0])),
        // From 45° below the horizontal: down by 60° (the arm crosses the body's front), up by 135°.
        (joint::UPPER_ARM, box_of([-100.0, 90.0], [-135.0, 55.0], [-60.0, 135.0])),
        // Flexion turns the forearm from its direction towards the front; pronation about itself.
        (joint::LOWER_ARM, spanned(&[(-u, [-5.0, 150.0]), (d, [-90.0, 90.0]), (v, [-5.0, 5.0])])),
        // Flexion towards the palm (−u) about −v; to the thumb's side about −u.
        (joint::HAND, spanned(&[(-v, [-80.0, 85.0]), (-u, [-45.0, 25.0]), (d, [-15.0, 15.0])])),
        (joint::UPPER_LEG, box_of([-130.0, 30.0], [-45.0, 60.0], [-39.0, 50.0])),
        (joint::LOWER_LEG, box_of([-5.0, 150.0], [-15.0, 15.0], [-6.0, 6.0])),
        (joint::FOOT, box_of([-25.0, 55.0], [-20.0, 20.0], [-35.0, 30.0])),
        (joint::TOES, box_of([-80.0, 40.0], [-5.0, 5.0], [-5.0, 5.0])),
    ];
    for (k, bounds) in list.into_iter().chain((joint::FINGERS..).zip(finger_limits(body))) {
        all[k] = bounds;
        let m = joint::mirrored(k);
        if m != k {
            // Mirroring in x keeps turns about x and reverses those about y and z.
            all[m] = [bounds[0], [-bounds[1][1], -bounds[1][0]], [-bounds[2][1], -bounds[2][0]]];
        }
    }
    all
}

/// Bounds of the finger joints, in the order of their places.
fn finger_limits(body: &Anatomy) -> impl Iterator<Item = [[f64; 2]; 3]> {
    // From relaxed: a fist, and a little beyond flat.
    const BEND: [[f64; 2]; 3] = [[-30.0, 90.0], [-30.0, 95.0], [-30.0, 65.0]];
    const OF_THUMB: [[f64; 2]; 3] = [[-25.0, 40.0], [-25.0, 60.0], [-30.0, 75.0]];
    let [_, up, thumbward] = body.arm;
    (0..15).map(move |place| {
        let (finger, k) = (place / 3, place % 3);
        let joints = body.joints.fingers[finger];
        let bone = (joints[2] - joints[1]).normalize();
        let (bend, inward) = if finger == 0 { (OF_THUMB[k], -thumbward - up * 0.5) } else { (BEND[k], -up) };
        let across = bone.cross(&inward).normalize();
        let sideways = bone.cross(&across);
        let sides = if k == 0 { [-25.0, 25.0] } else { [-5.0, 5.0] };
        spanned(&[(across, bend), (sideways, sides), (bone, [-5.0, 5.0])])
    })
}

/// The box around all sums of turns about several axes.
fn spanned(turns: &[(Vec3, [f64; 2])]) -> [[f64; 2]; 3] {
    std::array::from_fn(|k| {
        turns.iter().fold([0.0, 0.0], |[low, high], (axis, [a, b])| {
            let (x, y) = (axis[k] * a, axis[k] * b);
            [low + x.min(y), high + x.max(y)]
        })
    })
}
