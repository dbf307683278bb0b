//! Where landmarks are expected on a figure, and where they are attached to it.

use crate::body::HumanJoint::{self, LowerArm, UpperArm, UpperLeg};
use crate::body::{Figure, JointId, Pose, Skeleton, SkinWeights};
use crate::drive::landmark::Landmark;
use crate::drive::landmark::Places;
use crate::fit::Attached;
use crate::geometry::{PerVertex, Point, SurfaceIndex, Vec3, VertexId};

/// Where a landmark is expected on a figure if it is the centre of a joint; the head's is between the ears.
fn joint_center(skeleton: &Skeleton, landmark: Landmark) -> (Point, JointId) {
    let Some(joint) = skeleton.find(landmark.joint()) else { return (skeleton.joints_in_bind[0], JointId(0)) };
    let p = skeleton.joints_in_bind[joint.index()];
    let offset = match landmark {
        // The ears are 7 cm above the upper end of the neck, a knuckle a third of a forearm beyond the wrist.
        Landmark::Head => Vec3::new(0.0, 0.07, 0.02),
        Landmark::Hand(side) => {
            let elbow = skeleton.find(LowerArm(side)).map(|j| skeleton.joints_in_bind[j.index()]);
            elbow.map_or_else(Vec3::zeros, |elbow| (p - elbow) * 0.3)
        }
        _ => Vec3::zeros(),
    };
    (p + offset, joint)
}

/// The landmarks at the centres of their joints, rigidly.
pub(in crate::drive) fn at_joints(skeleton: &Skeleton) -> Attached {
    let at = Landmark::ALL.map(|landmark| joint_center(skeleton, landmark));
    Attached {
        points_in_bind: at.iter().map(|(p, _)| *p).collect(),
        weights: SkinWeights::from_rows(at.iter().map(|(_, joint)| vec![(*joint, 1.0)])),
    }
}

/// Sides of the limbs on which straps may hold the sensors, in degrees from outward to forward.
pub(super) const SENSOR_SIDES_DEG: [f64; 9] = [-45.0, 0.0, 22.5, 45.0, 67.5, 90.0, 135.0, 180.0, 270.0];

/// Distance from the skin that is assumed until it is measured, in metres.
const USUAL_OFF_SKIN: f64 = 0.01;

/// The landmarks as sensors on the skin, all on the same side of the limbs: `side` is the angle from outward to forward, in
/// radians. Those of the trunk are in front or behind: the first list has them in front, the second behind.
///
/// A place is where a ray from the joint's centre, across the limb, leaves the skin.
pub(super) fn on_the_skin(figure: &Figure, index: &SurfaceIndex, side: f64) -> [Attached; 2] {
    let (skeleton, body) = (&figure.skeleton, figure.body());
    [1.0, -1.0].map(|front| {
        let place = |landmark: Landmark| {
            let (center, joint) = joint_center(skeleton, landmark);
            let outward = landmark.side().map_or_else(Vec3::zeros, |side| Vec3::x() * side.sign());
            let direction = match landmark.side() {
                Some(_) => outward * side.cos() + Vec3::z() * side.sin(),
                None => Vec3::z() * front,
            };
            let bone = skeleton.bone_end(joint).map(|end| skeleton.joints_in_bind[end.index()]);
            let along = bone.and_then(|end| (end - skeleton.joints_in_bind[joint.index()]).try_normalize(1e-9));
            let across = match (landmark, along) {
                (Landmark::Elbow(_) | Landmark::Shoulder(_) | Landmark::Knee(_) | Landmark::Hip(_), Some(along)) => {
                    direction - along * direction.dot(&along)
                }
                _ => direction,
            };
            let across = across.try_normalize(1e-9).unwrap_or(direction);
            // From within the body the ray leaves it once; a joint's centre that is outside has no such place.
            match index.cast_ray(&center, &across, 0.3) {
                Some(hit) => {
                    let corners = body.mesh.faces()[hit.face];
                    let parts: Vec<(VertexId, f64)> = corners.into_iter().zip(hit.barycentric).collect();
                    (center + across * (hit.distance + USUAL_OFF_SKIN), body.weights.blend(&parts))
                }
                None => (center, vec![(joint, 1.0)]),
            }
        };
        let at = Landmark::ALL.map(place);
        Attached {
            points_in_bind: at.iter().map(|(p, _)| *p).collect(),
            weights: SkinWeights::from_rows_of_cloth(at.iter().map(|(_, row)| row.clone())),
        }
    })
}

/// Deviation of a landmark from its expected place, in metres: a strap slides by 2 to 3 cm, the sensors of the trunk sit
/// anywhere on it.
pub(super) fn placing(landmark: Landmark) -> f64 {
    match landmark {
        Landmark::Head | Landmark::Neck | Landmark::Chest | Landmark::Pelvis => 0.06,
        Landmark::Hand(_) | Landmark::Toe(_) => 0.05,
        Landmark::Shoulder(_) | Landmark::Hip(_) => 0.03,
        Landmark::Elbow(_) | Landmark::Wrist(_) | Landmark::Knee(_) | Landmark::Ankle(_) => 0.02,
    }
}

/// Deviation of a joint from the bind pose in a T- or A-pose, in radians.
pub(super) fn posing(joint: Option<HumanJoint>) -> f64 {
    match joint {
        Some(UpperArm(_)) => 0.6,
        Some(LowerArm(_)) => 0.5,
        Some(UpperLeg(_)) => 0.12,
        Some(HumanJoint::LowerLeg(_) | HumanJoint::Head | HumanJoint::Neck) => 0.06,
        _ => 0.03,
    }
}

/// The landmarks attached to the skin that is nearest to each in a pose; those that were not seen stay where they are.
pub(super) fn attached_to_skin(figure: &Figure, pose: &Pose, places: &Places, generic: &Attached) -> Attached {
    let (skeleton, body) = (&figure.skeleton, figure.body());
    let index = SurfaceIndex::prepare(&body.posed(skeleton, pose));
    let mut points = generic.posed(skeleton, pose).0;
    let mut rows: Vec<Vec<(JointId, f64)>> = generic.weights.rows().iter().map(|row| row.to_vec()).collect();
    for (k, place) in places.iter().enumerate() {
        let Some(place) = place else { continue };
        let at = index.closest(place);
        let corners = index.mesh().faces()[at.face];
        let parts: Vec<(VertexId, f64)> = corners.into_iter().zip(at.barycentric).collect();
        points[k] = *place;
        rows[k] = body.weights.blend(&parts);
    }
    let weights = SkinWeights::from_rows_of_cloth(rows);
    let points: PerVertex<Point> = points.into();
    Attached { points_in_bind: crate::body::unskin(&points, &weights, skeleton, pose), weights }
}
