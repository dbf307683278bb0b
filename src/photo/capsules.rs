//! The body as capsules, which must not interpenetrate.

use super::anchor::{Anchor, Posed, Rig};
use crate::body::BodyModel;
use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, UpperArm, UpperChest, UpperLeg,
};
use crate::body::Side::{Left, Right};
use crate::geometry::Vec3;

/// A segment between two anchors, with the skin's mean distance from it.
pub(super) struct Capsule {
    ends: [Anchor; 2],
    radius: f64,
}

/// Capsules, and the pairs of them that are kept apart.
///
/// **Source** Bogo 2016 §3.1, whose spheres along capsules we replace by the distance of the segments.
pub(super) struct Capsules {
    capsules: Vec<Capsule>,
    pairs: Vec<[usize; 2]>,
}

/// Share of the radius that may not be penetrated: flesh gives way, and no limb is round.
const HARD: f64 = 0.8;

/// Bones as capsules: the joints at their ends.
const BONES: [[HumanJoint; 2]; 11] = [
    [Hips, Chest],
    [UpperChest, Neck],
    [Neck, Head],
    [UpperArm(Left), LowerArm(Left)],
    [LowerArm(Left), Hand(Left)],
    [UpperArm(Right), LowerArm(Right)],
    [LowerArm(Right), Hand(Right)],
    [UpperLeg(Left), LowerLeg(Left)],
    [LowerLeg(Left), Foot(Left)],
    [UpperLeg(Right), LowerLeg(Right)],
    [LowerLeg(Right), Foot(Right)],
];

/// Pairs of bones that can meet: forearms with trunk, head, thighs and the other arm; upper arms with the waist; legs.
const MEETING: [[usize; 2]; 19] = [
    [4, 0],
    [4, 1],
    [4, 2],
    [4, 5],
    [4, 6],
    [4, 7],
    [4, 9],
    [6, 0],
    [6, 1],
    [6, 2],
    [6, 3],
    [6, 7],
    [6, 9],
    [3, 0],
    [5, 0],
    [8, 10],
    [8, 9],
    [10, 7],
    [7, 9],
];

/// Two capsules that interpenetrate.
pub(super) struct Overlap {
    /// In metres.
    pub depth: f64,
    /// From the second to the first.
    pub normal: Vec3,
    /// The closest points of the two axes.
    pub at: [Anchor; 2],
}

impl Capsules {
    /// The capsules of a model that has the joints.
    pub fn new(model: &BodyModel) -> Self {
        let mut position = [None; BONES.len()];
        let mut capsules = Vec::new();
        for (bone, at) in BONES.iter().zip(&mut position) {
            let ends = bone.map(|joint| model.skeleton.find(joint));
            let [Some(from), Some(to)] = ends else { continue };
            *at = Some(capsules.len());
            let anchors = [Anchor::joint(model, from.index()), Anchor::carried(model, to.index(), from.index())];
            let [a, b] = [from, to].map(|j| model.skeleton.joints_in_bind[j.index()].coords);
            let mut distances: Vec<f64> = (model.template.points().iter().zip(model.weights.rows().iter()))
                .filter(|(_, row)| row[0].0 == from)
                .map(|(p, _)| {
                    let t = ((p.coords - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    (p.coords - a - (b - a) * t).norm()
                })
                .collect();
            distances.sort_by(f64::total_cmp);
            let radius = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
            capsules.push(Capsule { ends: anchors, radius });
        }
        let pairs = MEETING.iter().filter_map(|&[i, j]| Some([position[i]?, position[j]?])).collect();
        Self { capsules, pairs }
    }

    /// The pairs that interpenetrate.
    pub fn overlaps(&self, rig: &Rig<'_>, posed: &Posed, shape: &[f64]) -> Vec<Overlap> {
        let axes: Vec<[Vec3; 2]> =
            self.capsules.iter().map(|c| c.ends.each_ref().map(|end| rig.place(posed, shape, end))).collect();
        let mut found = Vec::new();
        for &[i, j] in &self.pairs {
            let [s, t] = closest(&axes[i], &axes[j]);
            let on = |axis: &[Vec3; 2], t: f64| axis[0] + (axis[1] - axis[0]) * t;
            let gap = on(&axes[i], s) - on(&axes[j], t);
            let distance = gap.norm();
            let depth = HARD * (self.capsules[i].radius + self.capsules[j].radius) - distance;
            // Axes that meet have no direction apart.
            if depth > 0.0 && distance > 1e-6 {
                let at = [(i, s), (j, t)].map(|(c, t)| {
                    let [a, b] = &self.capsules[c].ends;
                    Anchor::between(a, b, t)
                });
                found.push(Overlap { depth, normal: gap / distance, at });
            }
        }
        found
    }
}

/// Where two segments are closest, as shares of their lengths (Ericson 2005, §5.1.9).
fn closest(p: &[Vec3; 2], q: &[Vec3; 2]) -> [f64; 2] {
    let (d1, d2, r) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let (b, c) = (d1.dot(&d2), d1.dot(&r));
    let denominator = a * e - b * b;
    let mut s = if denominator > 1e-12 { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = (b * s + f) / e.max(1e-12);
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = ((b * t - c) / a.max(1e-12)).clamp(0.0, 1.0);
    }
    [s, t]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_points_of_crossing_and_of_distant_segments_are_found() {
        let v = Vec3::new;
        let across = closest(&[v(0.0, 0.0, 0.0), v(2.0, 0.0, 0.0)], &[v(1.5, -1.0, 0.3), v(1.5, 1.0, 0.3)]);
        assert!((across[0] - 0.75).abs() < 1e-12 && (across[1] - 0.5).abs() < 1e-12);
        let beyond = closest(&[v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0)], &[v(2.0, 1.0, 0.0), v(3.0, 1.0, 0.0)]);
        assert_eq!(beyond, [1.0, 0.0]);
    }
}
