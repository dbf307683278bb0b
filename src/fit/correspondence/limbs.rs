//! Which limbs the scan shows. A missing arm must not be fitted to the trunk.

use super::sampling::spread;
use super::scan_surface::ScanSurface;
use crate::body::HumanJoint::{LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::{HumanJoint, JointId, Pose, Side, Skeleton, SkinRow, SkinWeights};
use crate::geometry::{PerVertex, Point, SurfaceIndex, Vec3, VertexId};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Whole limbs first, then their ends.
const PARTS: [HumanJoint; 8] = [
    UpperArm(Side::Left),
    UpperArm(Side::Right),
    UpperLeg(Side::Left),
    UpperLeg(Side::Right),
    LowerArm(Side::Left),
    LowerArm(Side::Right),
    LowerLeg(Side::Left),
    LowerLeg(Side::Right),
];

/// A vertex belongs to a part whose joints have at least this share of its skin weights.
const BELONGS: f64 = 0.8;

/// The scan shows skin within this distance that faces the same way. Metres: six times the residual of a good fit.
const NEAR: f64 = 0.03;

/// The scan does not show a part of which less than this share is near it: holes at wrists and armpits take at most a quarter
/// of a forearm.
const LEAST_SEEN: f64 = 0.4;

/// A joint with its subtree, and the vertices that these joints move.
pub(crate) struct JointSubtree {
    pub(crate) joint: JointId,
    pub(crate) vertices: PerVertex<bool>,
}

/// The limbs of a body and their lower halves.
pub(crate) fn parts(skeleton: &Skeleton, weights: &SkinWeights) -> Vec<JointSubtree> {
    parts_from(&PARTS, skeleton, weights)
}

/// Whether a joint belongs to a leg.
pub(crate) fn of_legs(skeleton: &Skeleton) -> impl Fn(JointId) -> bool + '_ {
    let legs = Side::BOTH.map(|side| skeleton.find(UpperLeg(side)));
    move |joint| legs.iter().flatten().any(|&leg| skeleton.is_below(joint, leg))
}

/// The parts that begin at these joints, as far as the skeleton has them.
pub(crate) fn parts_from(roots: &[HumanJoint], skeleton: &Skeleton, weights: &SkinWeights) -> Vec<JointSubtree> {
    roots.iter().filter_map(|&root| skeleton.find(root)).map(|joint| part(joint, skeleton, weights)).collect()
}

/// The part that begins at a joint.
pub(crate) fn part(joint: JointId, skeleton: &Skeleton, weights: &SkinWeights) -> JointSubtree {
    let belongs = |row: &SkinRow| {
        let share: f64 = row.iter().filter(|(j, _)| skeleton.is_below(*j, joint)).map(|r| r.1).sum();
        share > BELONGS
    };
    JointSubtree { joint, vertices: weights.rows().iter().map(belongs).collect() }
}

/// The parts of a posed body that the scan does not show; the lower half of a limb only if the scan shows the whole.
///
/// The scan shows skin if it is near, and if the closest point of the body to that point of the scan is on the same part: an arm
/// that was pulled into the trunk, because the scan has no arm, is near the scan's trunk, but the body's trunk is nearer.
pub(crate) fn unseen(
    index: &SurfaceIndex,
    parts: &[JointSubtree],
    skeleton: &Skeleton,
    surface: &ScanSurface,
) -> Vec<JointId> {
    let body = index.mesh();
    let normals = body.vertex_normals_by_area();
    let shares = visible_shares(index, parts, |v, p| visible_at(surface, p, &normals[v]));
    unseen_parts(parts, &shares, skeleton)
}

/// The point where the scan shows skin with this normal.
pub(crate) fn visible_at(surface: &ScanSurface, p: &Point, normal: &Vec3) -> Option<Point> {
    surface.nearest(p, NEAR).filter(|hit| hit.normal.dot(normal) > 0.3).map(|hit| hit.point)
}

/// The share of each part that the scan shows. `place_of` finds the point of the scan for a vertex. **Shapes** one share per part.
pub(crate) fn visible_shares(
    index: &SurfaceIndex,
    parts: &[JointSubtree],
    place_of: impl Fn(VertexId, &Point) -> Option<Point> + Sync,
) -> Vec<f64> {
    /// Sample points per part: enough for a share to 4 %.
    const SAMPLES: usize = 300;
    let body = index.mesh();
    let areas = body.vertex_areas();
    let share_of = |part: &JointSubtree| {
        let of_part = areas.enumerate().map(|(v, area)| if part.vertices[v] { *area } else { 0.0 }).collect();
        let places = spread(&of_part, SAMPLES);
        let is_seen = |v: VertexId| {
            let Some(place) = place_of(v, &body.points()[v]) else { return false };
            // The vertex itself is at this distance; a little more allows for rounding.
            let near = (place - body.points()[v]).norm() * (1.0 + 1e-6) + 1e-9;
            index.closest_within(&place, near).is_some_and(|at| part.vertices[at.nearest_corner(body)])
        };
        let seen: Vec<bool> = places.par_iter().map(|p| is_seen(p.0)).collect();
        let total: f64 = places.iter().map(|p| p.1).sum();
        let of_seen: f64 = places.iter().zip(&seen).filter(|s| *s.1).map(|(p, _)| p.1).sum();
        if total > 0.0 { of_seen / total } else { 1.0 }
    };
    parts.iter().map(share_of).collect()
}

/// The parts of which the scan shows too little; the lower half of a limb only if the scan shows the whole.
pub(crate) fn unseen_parts(parts: &[JointSubtree], shares: &[f64], skeleton: &Skeleton) -> Vec<JointId> {
    let mut unseen: Vec<JointId> = Vec::new();
    for (part, share) in parts.iter().zip(shares) {
        if *share < LEAST_SEEN && !unseen.iter().any(|&u| skeleton.is_below(part.joint, u)) {
            unseen.push(part.joint);
        }
    }
    unseen
}

/// Gives the joints of a part the mirrored pose of the other side if the scan shows that, else the bind pose.
pub(crate) fn pose_like_other_side(pose: &mut Pose, skeleton: &Skeleton, part: JointId, unseen: &[JointId]) {
    for j in skeleton.ids().filter(|&j| skeleton.is_below(j, part)) {
        let visible = skeleton.mirrored(j).filter(|&o| !unseen.iter().any(|&u| skeleton.is_below(o, u)));
        pose.rotations[j.index()] = visible.map_or(UnitQuaternion::identity(), |o| {
            // The rotation mirrored at the sagittal plane.
            let turn = pose.rotations[o.index()].scaled_axis();
            UnitQuaternion::from_scaled_axis(Vector3::new(turn.x, -turn.y, -turn.z))
        });
    }
}
