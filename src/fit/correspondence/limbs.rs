//! Limbs that the scan does not show: a missing arm must not be looked for in the trunk.

use super::sampling::spread;
use super::scan_surface::ScanSurface;
use crate::body::{JointId, Pose, Skeleton, SkinWeights};
use crate::geometry::{PerVertex, Point, SurfaceIndex, Vec3, VertexId};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Whole limbs first, then their ends.
const PARTS: [&str; 8] = [
    "leftUpperArm",
    "rightUpperArm",
    "leftUpperLeg",
    "rightUpperLeg",
    "leftLowerArm",
    "rightLowerArm",
    "leftLowerLeg",
    "rightLowerLeg",
];

/// A vertex belongs to a part that moves it by this much.
const BELONGS: f64 = 0.8;

/// Skin this near to the scan, facing the same way, is seen. Metres: six times the residual of a good fit.
const NEAR: f64 = 0.03;

/// A part of which less is near the scan is not in it: holes at wrists and armpits take a quarter of a forearm at most.
const LEAST_SEEN: f64 = 0.4;

/// A joint and all below it, with the vertices that they move.
pub(crate) struct Part {
    pub(crate) joint: JointId,
    pub(crate) vertices: PerVertex<bool>,
}

/// The limbs of a body, and their ends.
pub(crate) fn parts(skeleton: &Skeleton, weights: &SkinWeights) -> Vec<Part> {
    parts_named(&PARTS, skeleton, weights)
}

/// Whether a joint is a leg's.
pub(crate) fn of_legs(skeleton: &Skeleton) -> impl Fn(JointId) -> bool + '_ {
    let legs = ["leftUpperLeg", "rightUpperLeg"].map(|name| skeleton.find_name(name));
    move |joint| legs.iter().flatten().any(|&leg| skeleton.is_below(joint, leg))
}

/// What joints of these names move.
pub(crate) fn parts_named(names: &[&str], skeleton: &Skeleton, weights: &SkinWeights) -> Vec<Part> {
    names
        .iter()
        .filter_map(|name| skeleton.find_name(name))
        .map(|joint| Part {
            joint,
            vertices: weights
                .rows()
                .iter()
                .map(|row| {
                    let share: f64 = row.iter().filter(|(j, _)| skeleton.is_below(*j, joint)).map(|r| r.1).sum();
                    share > BELONGS
                })
                .collect(),
        })
        .collect()
}

/// The parts of a posed body that the scan does not show; the end of a limb only where the whole is shown.
///
/// Skin is shown where the scan is near and its place there is nearest to the same part: an arm that fled into the trunk
/// for want of its own surface has the trunk's near it, but the trunk lies nearer to that.
pub(crate) fn unseen(index: &SurfaceIndex, parts: &[Part], skeleton: &Skeleton, surface: &ScanSurface) -> Vec<JointId> {
    let body = index.mesh();
    let normals = body.vertex_normals_by_area();
    let shares = visible_shares(index, parts, |v, p| visible_at(surface, p, &normals[v]));
    unseen_parts(parts, &shares, skeleton)
}

/// Where the scan shows skin with this normal.
pub(crate) fn visible_at(surface: &ScanSurface, p: &Point, normal: &Vec3) -> Option<Point> {
    surface.nearest(p, NEAR).filter(|hit| hit.normal.dot(normal) > 0.3).map(|hit| hit.point)
}

/// Of each part the share that has a place on the scan which is nearest to the same part.
pub(crate) fn visible_shares(
    index: &SurfaceIndex,
    parts: &[Part],
    place_of: impl Fn(VertexId, &Point) -> Option<Point> + Sync,
) -> Vec<f64> {
    /// SamplePlaces of a part: a share of it to 4 %.
    const SAMPLES: usize = 300;
    let body = index.mesh();
    let areas = body.vertex_areas();
    let share_of = |part: &Part| {
        let of_part = areas.enumerate().map(|(v, area)| if part.vertices[v] { *area } else { 0.0 }).collect();
        let places = spread(&of_part, SAMPLES);
        let is_seen = |v: VertexId| {
            let Some(place) = place_of(v, &body.points()[v]) else { return false };
            // The vertex itself is that near; a little more, for rounding.
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

/// The parts of which too little is seen; the end of a limb only where the whole is seen.
pub(crate) fn unseen_parts(parts: &[Part], shares: &[f64], skeleton: &Skeleton) -> Vec<JointId> {
    let mut unseen: Vec<JointId> = Vec::new();
    for (part, share) in parts.iter().zip(shares) {
        if *share < LEAST_SEEN && !unseen.iter().any(|&u| skeleton.is_below(part.joint, u)) {
            unseen.push(part.joint);
        }
    }
    unseen
}

/// Gives the joints of a part the pose of the other side, where that is shown, else the bind pose.
pub(crate) fn pose_like_other_side(pose: &mut Pose, skeleton: &Skeleton, part: JointId, unseen: &[JointId]) {
    for j in skeleton.ids().filter(|&j| skeleton.is_below(j, part)) {
        let name = &skeleton.names[j.index()];
        let other = match name.strip_prefix("left") {
            Some(rest) => skeleton.find_name(&format!("right{rest}")),
            None => name.strip_prefix("right").and_then(|rest| skeleton.find_name(&format!("left{rest}"))),
        };
        let shown = other.filter(|&o| !unseen.iter().any(|&u| skeleton.is_below(o, u)));
        pose.rotations[j.index()] = shown.map_or(UnitQuaternion::identity(), |o| {
            // The mirror image of a turn across the plane between left and right.
            let turn = pose.rotations[o.index()].scaled_axis();
            UnitQuaternion::from_scaled_axis(Vector3::new(turn.x, -turn.y, -turn.z))
        });
    }
}

/// `rightUpperArm` → "right arm", `leftLowerLeg` → "left lower leg".
pub(crate) fn display_name(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words.replace("upper ", "")
}
