//! Skin weights of the template: each part is assigned to bones along its axis, the parts are blended by their shares,
//! and diffusion over the mesh smooths the result.

use super::anatomy::{Anatomy, Joints};
use super::carry::Ownership;
use super::field::{BodyPart, Form};
use super::mesh::HalfMesh;
use crate::geometry::Vec3;
use crate::numerics::smoothstep;

/// The number of joints.
pub(super) const JOINTS: usize = 52;
/// Bones of the fingers of one hand.
const FINGER_BONES: usize = 15;
/// Influences per vertex: one set of joints of glTF.
const INFLUENCES: usize = 4;
/// Diffusion rounds over the mesh, about ±√n edges wide.
const ROUNDS: usize = 14;
/// The same among the bones of a hand, which are four to eight edges long.
const ROUNDS_IN_HAND: usize = 2;

/// Joints by number: [`crate::body::HumanJoint::BODY`], and the fingers of the left and of the right hand.
pub(super) mod joint {
    pub const HIPS: usize = 0;
    pub const SPINE: usize = 1;
    pub const CHEST: usize = 2;
    pub const UPPER_CHEST: usize = 3;
    pub const NECK: usize = 4;
    pub const HEAD: usize = 5;
    pub const SHOULDER: usize = 6;
    pub const UPPER_ARM: usize = 7;
    pub const LOWER_ARM: usize = 8;
    pub const HAND: usize = 9;
    pub const UPPER_LEG: usize = 14;
    pub const LOWER_LEG: usize = 15;
    pub const FOOT: usize = 16;
    pub const TOES: usize = 17;
    /// The first of the left hand's 15 finger joints.
    pub const FINGERS: usize = 22;
    /// The joint's counterpart on the other side.
    pub fn mirrored(j: usize) -> usize {
        match j {
            6..=9 | 14..=17 => j + 4,
            10..=13 | 18..=21 => j - 4,
            22..=36 => j + 15,
            37..=51 => j - 15,
            _ => j,
        }
    }
}

type JointWeights = [f64; JOINTS];

/// Weights for each vertex of the whole mesh (V × J): each row sums to one and has at most four entries.
pub(super) fn weights(body: &Anatomy, mesh: &HalfMesh, owners: &Ownership) -> Vec<JointWeights> {
    let mut half: Vec<JointWeights> = mesh
        .points
        .iter()
        .enumerate()
        .map(|(v, p)| {
            let mut row = [0.0; JOINTS];
            for &(k, share) in owners.of(v) {
                let part = &body.field.primitives[k as usize];
                let t = if let Form::Loft(loft) = &part.form { loft.along(p) } else { 0.0 };
                for (j, w) in bones(body, part.region, p, t) {
                    row[j] += share * w;
                }
            }
            row
        })
        .collect();
    let mirror = mesh.mirror();
    let full_row = |half: &[JointWeights], v: usize| -> JointWeights {
        if v < half.len() { half[v] } else { swapped(&half[mirror[v] as usize]) }
    };
    // Neighbours in the whole mesh: on the midline both sides count.
    for _ in 0..ROUNDS {
        half = (0..half.len())
            .map(|v| {
                let mut sum = [0.0; JOINTS];
                let mut n = 0.0;
                let mut add = |row: &JointWeights| {
                    sum.iter_mut().zip(row).for_each(|(a, b)| *a += b);
                    n += 1.0;
                };
                for w in &mesh.neighbours[v] {
                    add(&half[*w as usize]);
                    if mesh.points[v].x == 0.0 {
                        add(&swapped(&half[*w as usize]));
                    }
                }
                std::array::from_fn(|j| 0.4 * half[v][j] + 0.6 * sum[j] / n)
            })
            .collect();
    }
    for (v, row) in half.iter_mut().enumerate() {
        if mesh.points[v].x == 0.0 {
            let other = swapped(row);
            row.iter_mut().zip(&other).for_each(|(a, b)| *a = 0.5 * (*a + b));
        }
        prune(row, mesh.points[v].x == 0.0);
    }
    for (row, fingers) in half.iter_mut().zip(finger_shares(body, mesh)) {
        divide_hand(row, &fingers);
    }
    (0..mesh.whole_count()).map(|v| full_row(&half, v)).collect()
}

/// Shares of the finger bones in each vertex of the half mesh; the rest of a hand is its palm.
fn finger_shares(body: &Anatomy, mesh: &HalfMesh) -> Vec<[f64; FINGER_BONES]> {
    let of_point = |p: &Vec3| {
        let mut bones = [0.0; FINGER_BONES];
        for (share, part) in body.field.shares(p).iter().zip(&body.field.primitives) {
            if let BodyPart::Finger(place) = part.region {
                bones[place as usize] += share;
            }
        }
        bones
    };
    let mut shares: Vec<_> = mesh.points.iter().map(of_point).collect();
    for _ in 0..ROUNDS_IN_HAND {
        let around = |(v, near): (usize, &Vec<u32>)| {
            let mut sum = shares[v];
            near.iter().for_each(|w| sum.iter_mut().zip(shares[*w as usize]).for_each(|(a, b)| *a += b));
            sum.map(|share| share / (near.len() + 1) as f64)
        };
        shares = mesh.neighbours.iter().enumerate().map(around).collect();
    }
    shares
}

/// Divides the weight of the hand among palm and fingers: the sum over the hand stays, and so does what moves with the wrist.
fn divide_hand(row: &mut JointWeights, fingers: &[f64; FINGER_BONES]) {
    let of_hand = row[joint::HAND];
    let others = row.iter().filter(|w| **w > 0.0).count() - usize::from(of_hand > 0.0);
    let mut parts: Vec<(usize, f64)> = (joint::FINGERS..).zip(fingers.iter().copied()).collect();
    parts.push((joint::HAND, 1.0 - fingers.iter().sum::<f64>()));
    parts.retain(|(_, share)| *share > 1e-3);
    parts.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    parts.truncate(INFLUENCES - others.min(INFLUENCES - 1));
    let sum: f64 = parts.iter().map(|part| part.1).sum();
    row[joint::HAND] = 0.0;
    for (j, share) in parts {
        row[j] = of_hand * share / sum;
    }
}

/// The weights of the mirrored vertex.
fn swapped(row: &JointWeights) -> JointWeights {
    std::array::from_fn(|j| row[joint::mirrored(j)])
}

/// Keeps the four largest; on the midline the pairs stay pairs.
fn prune(row: &mut JointWeights, on_plane: bool) {
    let mut order: Vec<usize> = (0..JOINTS).filter(|j| row[*j] > 1e-4).collect();
    order.sort_by(|a, b| row[*b].total_cmp(&row[*a]).then(a.cmp(b)));
    let mut keep: Vec<usize> = order.iter().copied().take(INFLUENCES).collect();
    if on_plane {
        let whole = keep.clone();
        keep.retain(|j| whole.contains(&joint::mirrored(*j)));
    }
    for (j, weight) in row.iter_mut().enumerate() {
        if !keep.contains(&j) {
            *weight = 0.0;
        }
    }
    let sum: f64 = row.iter().sum();
    row.iter_mut().for_each(|w| *w /= sum);
}

/// Which bones move a point of a region, before any smoothing; `t` is the position along the axis of the region.
fn bones(body: &Anatomy, region: BodyPart, p: &Vec3, t: f64) -> Vec<(usize, f64)> {
    let j: &Joints = &body.joints;
    let s = body.scale();
    let at = |bone: usize| vec![(bone, 1.0)];
    match region {
        BodyPart::Torso | BodyPart::Yoke => {
            let chain = [
                (joint::HIPS, j.spine.y - 0.02),
                (joint::SPINE, j.chest.y),
                (joint::CHEST, j.upper_chest.y),
                (joint::UPPER_CHEST, j.neck.y + 0.02),
                (joint::NECK, f64::INFINITY),
            ];
            let mut all = along(&chain, p.y, 0.05 * s);
            // The shoulder blade and collar bone follow the clavicle joint outward of it.
            let low = smooth_step(body.levels.chest - 0.02, body.levels.axilla + 0.03, p.y);
            let out = low * smooth_step(0.35 * j.upper_arm.x, 0.85 * j.upper_arm.x, p.x);
            all.iter_mut().for_each(|w| w.1 *= 1.0 - out);
            all.push((joint::SHOULDER, out));
            all
        }
        BodyPart::Neck => {
            let part = smooth_step(-0.3, 1.1, (p - j.neck).dot(&(j.head - j.neck)) / (j.head - j.neck).norm_squared());
            vec![(joint::NECK, 1.0 - part), (joint::HEAD, part)]
        }
        BodyPart::Head => at(joint::HEAD),
        BodyPart::ArmpitFold => {
            let t = (p - j.upper_arm).dot(&body.arm[0]);
            let both = bones(body, BodyPart::Yoke, p, t).into_iter().chain(bones(body, BodyPart::Arm, p, t));
            both.map(|(bone, w)| (bone, 0.5 * w)).collect()
        }
        BodyPart::Arm => {
            let elbow = (j.lower_arm - j.upper_arm).dot(&body.arm[0]);
            let wrist = (j.hand - j.upper_arm).dot(&body.arm[0]);
            let root = smooth_step(-0.045 * s, 0.035 * s, t);
            let bend = smooth_step(elbow - 0.045 * s, elbow + 0.045 * s, t);
            let hand = smooth_step(wrist - 0.035 * s, wrist + 0.030 * s, t);
            vec![
                (joint::SHOULDER, 1.0 - root),
                (joint::UPPER_ARM, root * (1.0 - bend)),
                (joint::LOWER_ARM, bend * (1.0 - hand)),
                (joint::HAND, hand),
            ]
        }
        // The fingers' shares of the hand are determined afterwards.
        BodyPart::Hand | BodyPart::Finger(_) => at(joint::HAND),
        BodyPart::Leg => {
            let knee = (j.lower_leg - j.upper_leg).dot(&body.leg[0]);
            let ankle = (j.foot - j.upper_leg).dot(&body.leg[0]);
            // In front of the hip the fold lies higher than behind, under the seat.
            let root = smooth_step(-0.07 * s, 0.075 * s, t);
            let bend = smooth_step(knee - 0.060 * s, knee + 0.060 * s, t);
            let foot = smooth_step(ankle - 0.045 * s, ankle + 0.025 * s, t);
            vec![
                (joint::HIPS, 1.0 - root),
                (joint::UPPER_LEG, root * (1.0 - bend)),
                (joint::LOWER_LEG, bend * (1.0 - foot)),
                (joint::FOOT, foot),
            ]
        }
        BodyPart::Foot => {
            let forward = (p - j.toes).dot(&body.foot[0]);
            let toes = smooth_step(-0.020 * s, 0.022 * s, forward);
            vec![(joint::FOOT, 1.0 - toes), (joint::TOES, toes)]
        }
    }
}

/// Bones one above the other, each up to its height, cross-faded over ± `fade`.
fn along(chain: &[(usize, f64)], y: f64, fade: f64) -> Vec<(usize, f64)> {
    let mut rest = 1.0;
    let mut all = Vec::with_capacity(chain.len());
    for &(bone, end) in chain {
        let beyond = if end.is_finite() { smooth_step(end - fade, end + fade, y) } else { 0.0 };
        all.push((bone, rest * (1.0 - beyond)));
        rest *= beyond;
    }
    all
}

fn smooth_step(a: f64, b: f64, x: f64) -> f64 {
    smoothstep((x - a) / (b - a))
}
