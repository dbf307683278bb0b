//! Finds the human joints of a skeleton of unknown names by its structure: five long chains, of which two pairs are equally
//! long, meet in two places.

use super::clip::Clip;
use super::rig_map::RigMap;
use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use crate::body::Side;
use crate::geometry::{Point, Vec3};
use std::collections::BTreeMap;

/// A bone shorter than this share of its chain connects two joints of one place, such as a hip's connector.
const SHORT_BONE_PER_CHAIN: f64 = 0.02;
/// A trunk shorter than this share of a leg is that of no person: five equal legs of a spider have none.
const LEAST_TRUNK_PER_LEG: f64 = 0.1;
/// The neck is at least this share of the chain from its lower end to the top of the head: C7 is at 0.86 of stature, the
/// upper end of the neck at 0.92.
const NECK_PER_HEAD: f64 = 0.3;
/// Two limbs of one person differ by less than this share: rigs are built symmetric, scanned ones nearly.
const LIMB_DIFFERENCE: f64 = 0.15;

/// The human joints by structure, in the rest pose.
///
/// **Errors** what was not found, as a clause.
pub(super) fn map_by_structure(clip: &Clip) -> Result<RigMap, String> {
    let tree = Tree::of(clip);
    let ends = tree.five_ends().ok_or("it has fewer than five chains of bones: two arms, two legs, a head")?;
    let plan = Plan::best(&tree, &ends).ok_or("no two pairs of its chains are arms and legs of equal length")?;
    let mut joints: BTreeMap<HumanJoint, Vec<usize>> = BTreeMap::new();
    joints.insert(Hips, vec![plan.hips]);
    // From the hips up; the joint from which spine and legs start is not part of the spine.
    let spine = tree.below(plan.chest, plan.base);
    let [low, middle, high] = tree.thirds(&spine);
    joints.extend([(Spine, low), (Chest, middle), (UpperChest, high)]);
    let above = tree.below(plan.head, plan.chest);
    let [neck, head] = tree.neck_and_head(&above);
    joints.extend([(Neck, neck), (Head, head)]);
    let [left_leg, left_arm] = plan.sides(&tree, Side::Left);
    let [right_leg, right_arm] = plan.sides(&tree, Side::Right);
    for (side, leg, arm) in [(Side::Left, left_leg, left_arm), (Side::Right, right_leg, right_arm)] {
        let leg = tree.below(leg, plan.hips);
        let [_, upper, lower, end, rest] = tree.limb(&leg, &LEG).ok_or("a leg has no three joints")?;
        joints.extend([(UpperLeg(side), upper), (LowerLeg(side), lower), (Foot(side), end), (Toes(side), rest)]);
        let arm = tree.below(arm, plan.chest);
        let [shoulder, upper, lower, end, _] = tree.limb(&arm, &ARM).ok_or("an arm has no three joints")?;
        joints.extend([
            (Shoulder(side), shoulder),
            (UpperArm(side), upper),
            (LowerArm(side), lower),
            (Hand(side), end),
        ]);
    }
    Ok(RigMap::new(None, joints))
}

/// The skeleton in the rest pose, with the ends of bones as further nodes.
struct Tree {
    parents: Vec<Option<usize>>,
    points: Vec<Point>,
    /// Number of joints; nodes from here on are ends of bones.
    joint_count: usize,
}

impl Tree {
    fn of(clip: &Clip) -> Self {
        let mut parents: Vec<Option<usize>> = clip.joints.iter().map(|joint| joint.parent).collect();
        let mut points: Vec<Point> = clip.rest.iter().map(|t| Point::from(t.translation.vector)).collect();
        for (j, joint) in clip.joints.iter().enumerate() {
            if let Some(end) = joint.end {
                parents.push(Some(j));
                points.push(clip.rest[j] * Point::from(end));
            }
        }
        Self { parents, points, joint_count: clip.joints.len() }
    }

    fn bone(&self, node: usize) -> f64 {
        self.parents[node].map_or(0.0, |parent| (self.points[node] - self.points[parent]).norm())
    }

    /// The nodes from `from` up to `to`, both included; up to the root if `to` is not above.
    fn path(&self, from: usize, to: usize) -> Vec<usize> {
        let mut path = vec![from];
        let mut at = from;
        while at != to {
            let Some(parent) = self.parents[at] else { break };
            path.push(parent);
            at = parent;
        }
        path
    }

    /// The nodes below `above` down to `to`, outwards.
    fn below(&self, to: usize, above: usize) -> Vec<usize> {
        self.path(to, above).into_iter().rev().skip(1).collect()
    }

    /// The ends of the five longest chains, each measured from where it leaves the longer ones.
    fn five_ends(&self) -> Option<[usize; 5]> {
        // The top of the body, so that no chain starts at a root far away.
        let mut is_leaf = vec![true; self.parents.len()];
        for parent in self.parents.iter().flatten() {
            is_leaf[*parent] = false;
        }
        let mut reached = vec![false; self.parents.len()];
        let root = self.branching()?;
        reached[root] = true;
        let mut ends = Vec::new();
        for _ in 0..5 {
            let mut best: Option<(f64, usize)> = None;
            for leaf in (0..self.parents.len()).filter(|&n| is_leaf[n] && !reached[n]) {
                let (mut length, mut at, mut is_below) = (0.0, leaf, true);
                while !reached[at] {
                    length += self.bone(at);
                    match self.parents[at] {
                        Some(parent) => at = parent,
                        None => {
                            is_below = false;
                            break;
                        }
                    }
                }
                if is_below && best.is_none_or(|(longest, _)| length > longest) {
                    best = Some((length, leaf));
                }
            }
            let (length, leaf) = best?;
            if length <= 0.0 {
                return None;
            }
            let mut at = leaf;
            while !reached[at] {
                reached[at] = true;
                at = self.parents[at]?;
            }
            ends.push(leaf);
        }
        ends.try_into().ok()
    }

    /// The first node, from the root, with more than one child.
    fn branching(&self) -> Option<usize> {
        let children = |of: usize| self.parents.iter().filter(|parent| **parent == Some(of)).count();
        (0..self.joint_count).find(|&n| children(n) > 1)
    }

    /// The last node that the paths of two nodes to the root share.
    fn meeting(&self, a: usize, b: usize) -> Option<usize> {
        let to_root = |mut at: usize| {
            let mut path = vec![at];
            while let Some(parent) = self.parents[at] {
                path.push(parent);
                at = parent;
            }
            path
        };
        let of_b = to_root(b);
        to_root(a).into_iter().find(|node| of_b.contains(node))
    }

    fn length(&self, path: &[usize]) -> f64 {
        path.windows(2).map(|pair| (self.points[pair[0]] - self.points[pair[1]]).norm()).sum()
    }

    /// A chain in three parts of about equal length.
    fn thirds(&self, chain: &[usize]) -> [Vec<usize>; 3] {
        if chain.len() <= 3 {
            return match chain {
                [] => [vec![], vec![], vec![]],
                [a] => [vec![*a], vec![], vec![]],
                [a, b] => [vec![*a], vec![*b], vec![]],
                _ => [vec![chain[0]], vec![chain[1]], vec![chain[2]]],
            };
        }
        let total = self.length(chain).max(1e-12);
        let mut parts = [vec![], vec![], vec![]];
        for (k, &node) in chain.iter().enumerate() {
            let along = self.length(&chain[..=k]) / total;
            parts[((along * 3.0) as usize).min(2)].push(node);
        }
        parts
    }

    /// The chain above the chest in two parts; one joint alone is the head.
    fn neck_and_head(&self, chain: &[usize]) -> [Vec<usize>; 2] {
        let total = self.length(chain);
        let joints: Vec<usize> = chain.iter().copied().filter(|&node| node < self.joint_count).collect();
        let is_head = |k: &usize| self.length(&chain[..=*k]) >= NECK_PER_HEAD * total;
        let head = (1..joints.len()).find(is_head).unwrap_or(0);
        [joints[..head].to_vec(), joints[head..].iter().take(1).copied().collect()]
    }

    /// A chain outwards as: what comes before the limb, its upper part, its lower part, hand or foot, and what follows. The
    /// parts are those whose lengths are the most like a person's.
    fn limb(&self, chain: &[usize], proportions: &Proportions) -> Option<[Vec<usize>; 5]> {
        let total = self.length(chain);
        // Only joints turn; the end of the last bone is none.
        let count = chain.iter().take_while(|&&node| node < self.joint_count).count();
        let span = |a: usize, b: usize| (self.points[chain[a]] - self.points[chain[b]]).norm();
        let mut best: Option<(f64, [usize; 3])> = None;
        for start in 0..count {
            for knee in start + 1..count {
                for end in knee + 1..count {
                    let (upper, lower) = (span(start, knee), span(knee, end));
                    if upper.min(lower) < SHORT_BONE_PER_CHAIN * total {
                        continue;
                    }
                    let rest = self.length(&chain[end..]);
                    let off = |found: f64, expected: f64| (found / expected).ln().abs();
                    let end_cost = if rest > 0.0 { 0.5 * off(lower / rest, proportions.lower_per_end) } else { NO_END };
                    // The joints of a twisted part are in line.
                    let bend = (self.length(&chain[start..=end]) - upper - lower) / total;
                    // A collar bone or a connector comes before a limb, not half of it.
                    let before = self.length(&chain[..=start]) / total;
                    let shape = off(upper / lower, proportions.upper_per_lower) + end_cost;
                    let cost = shape + 4.0 * bend + 2.0 * (before - LONGEST_START).max(0.0);
                    if best.is_none_or(|(least, _)| cost < least) {
                        best = Some((cost, [start, knee, end]));
                    }
                }
            }
        }
        let (_, [start, knee, end]) = best?;
        let joints = |from: usize, to: usize| chain[from..to].to_vec();
        let after = joints(end + 1, count.max(end + 1)).into_iter().take(1).collect();
        Some([joints(0, start), joints(start, knee), joints(knee, end), vec![chain[end]], after])
    }
}

/// Share of a chain that may come before the limb: a collar bone is 0.2 of an arm.
const LONGEST_START: f64 = 0.3;

/// How the parts of a limb compare in length.
struct Proportions {
    upper_per_lower: f64,
    /// The lower part relative to hand or foot, along the chain.
    lower_per_end: f64,
}

/// Drillis and Contini's fractions of stature: upper arm 0.186, forearm 0.146, hand 0.108.
const ARM: Proportions = Proportions { upper_per_lower: 1.27, lower_per_end: 1.35 };
/// Thigh 0.245, shank 0.246, and from the ankle to the tip of the toes about 0.16.
const LEG: Proportions = Proportions { upper_per_lower: 1.0, lower_per_end: 1.6 };
/// The cost of a hand or foot without length: more than that of one of twice the usual length, less than that of a limb
/// whose parts have the ratio 1:3.
const NO_END: f64 = 0.7;

/// Which chain is which limb.
struct Plan {
    hips: usize,
    /// Where spine and legs start: the hips, or a joint above them.
    base: usize,
    chest: usize,
    legs: [usize; 2],
    arms: [usize; 2],
    head: usize,
}

impl Plan {
    /// The most symmetric way to see two arms, two legs and a head in five chains.
    fn best(tree: &Tree, ends: &[usize; 5]) -> Option<Self> {
        let mut best: Option<(f64, Self)> = None;
        for head in 0..5 {
            let others: Vec<usize> = (0..5).filter(|&k| k != head).map(|k| ends[k]).collect();
            for [a, b, c, d] in [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2]] {
                let pairs = [[others[a], others[b]], [others[c], others[d]]];
                for [legs, arms] in [pairs, [pairs[1], pairs[0]]] {
                    if let Some((cost, plan)) = Self::try_new(tree, legs, arms, ends[head])
                        && best.as_ref().is_none_or(|(least, _)| cost < *least)
                    {
                        best = Some((cost, plan));
                    }
                }
            }
        }
        best.map(|(_, plan)| plan)
    }

    fn try_new(tree: &Tree, legs: [usize; 2], arms: [usize; 2], head: usize) -> Option<(f64, Self)> {
        let (hips, chest) = (tree.meeting(legs[0], legs[1])?, tree.meeting(arms[0], arms[1])?);
        let (base, neck) = (tree.meeting(hips, chest)?, tree.meeting(head, arms[0])?);
        // Neck and arms leave the spine near each other; the legs leave it elsewhere.
        if chest == base || neck == base || tree.path(neck, base).last() != Some(&base) {
            return None;
        }
        let lengths = |ends: [usize; 2], from: usize| ends.map(|end| tree.length(&tree.path(end, from)));
        let difference = |[a, b]: [f64; 2]| (a - b).abs() / a.max(b).max(1e-12);
        let (leg, arm) = (lengths(legs, hips), lengths(arms, chest));
        let (leg_difference, arm_difference) = (difference(leg), difference(arm));
        let trunk = tree.length(&tree.path(chest, base));
        if leg_difference.max(arm_difference) > LIMB_DIFFERENCE || trunk < LEAST_TRUNK_PER_LEG * leg[0] {
            return None;
        }
        // Legs end on the far side of the hips from the head.
        let up = tree.points[chest] - tree.points[hips];
        let is_upright = legs.iter().all(|&leg| (tree.points[leg] - tree.points[hips]).dot(&up) < 0.0);
        let cost = leg_difference + arm_difference + if is_upright { 0.0 } else { 1.0 };
        Some((cost, Self { hips, base, chest, legs, arms, head }))
    }

    /// The ends of a side's leg and arm.
    fn sides(&self, tree: &Tree, side: Side) -> [usize; 2] {
        let up = (tree.points[self.chest] - tree.points[self.hips]).try_normalize(1e-12).unwrap_or_else(Vec3::y);
        // Without feet, the left is taken to be +x, as in our frame.
        let left = up.cross(&self.forward(tree, &up)).try_normalize(1e-9).unwrap_or_else(Vec3::x);
        let across = tree.points[self.legs[0]] - tree.points[self.legs[1]];
        let is_first_left = across.dot(&left) > 0.0;
        let leg = self.legs[usize::from(is_first_left != (side == Side::Left))];
        let arm_across = tree.points[self.arms[0]] - tree.points[self.arms[1]];
        let is_first_left = (arm_across.dot(&across) > 0.0) == is_first_left;
        [leg, self.arms[usize::from(is_first_left != (side == Side::Left))]]
    }

    /// Where the toes point: from each ankle to the end of its chain, across the up direction.
    fn forward(&self, tree: &Tree, up: &Vec3) -> Vec3 {
        let toes = self.legs.iter().map(|&leg| match tree.limb(&tree.below(leg, self.hips), &LEG) {
            Some([_, _, _, foot, _]) => tree.points[leg] - tree.points[foot[0]],
            None => Vec3::zeros(),
        });
        let sum: Vec3 = toes.sum();
        sum - up * sum.dot(up)
    }
}
