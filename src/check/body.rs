//! Whether the naked scan shows a bare person who stands upright.

use super::error::CheckError;
use super::holes::largest_unseen_part;
use super::posture::Posture;
use super::statistics::{weighted_quantile, weighted_share};
use crate::body::{HumanJoint, JointId, Pose, Shape, Side, Skeleton, SkinWeights};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::{Lab, color_difference, lab_of};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is known of the body's step.
pub struct BodyResult<'a> {
    /// The naked scan, without hair that is left out.
    pub scan: &'a Scan,
    /// Vertices of `fitted` that this hair covers. **Shapes** one entry per vertex.
    pub hidden: Option<&'a PerVertex<bool>>,
    /// The model's surface as fitted, posed in the scan.
    pub fitted: &'a TriMesh,
    /// The skeleton of the registered body.
    pub skeleton: &'a Skeleton,
    /// Its pose in the scan.
    pub pose: &'a Pose,
    /// β. **Shapes** one coefficient per component of the model.
    pub shape: &'a Shape,
    /// The skin weights of `fitted`. **Shapes** one row per vertex.
    pub weights: &'a SkinWeights,
}

/// What the body's step looks like. Lengths are metres, angles radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyPlausibility {
    /// Angle between the trunk, from hips to head, and the vertical; `None` for a skeleton without these joints.
    pub tilt: Option<f64>,
    /// How far the legs are bent.
    pub posture: Posture,
    /// Share of trunk and limbs whose colour is not that of the hands; `None` without colours, or if the hands are not seen.
    pub unlike_hands_share: Option<f64>,
    /// 90th percentile of the angle between the normals of the scan and those of the fitted surface.
    pub bent_p90: Option<f64>,
    /// Median of that angle.
    pub bent_median: Option<f64>,
    /// 95th percentile of the scan's distance from the fitted surface.
    pub fitted_p95: Option<f64>,
    /// Greatest absolute coefficient of the shape, in standard deviations.
    pub deviation: f64,
    /// The area in m² of the largest part of the body that the scan does not show, and the part of the body where it is. Feet do
    /// not count: their soles are on the floor.
    pub largest_unseen: Option<(f64, String)>,
    /// The area in m² of the scanned head that is in another colour than the hands: hair, a beard, a hat. Zero without colours, and
    /// where hardly anything of the head is of that colour, as with gloves.
    pub on_head: f64,
}

/// Measures how plausible the body's step is.
///
/// **Errors** if arrays and surfaces differ in size.
pub fn check_body(result: &BodyResult) -> Result<BodyPlausibility, CheckError> {
    let BodyResult { scan, hidden, fitted, skeleton, pose, shape, weights } = result;
    CheckError::require_length("skin weights", weights.len(), fitted.vertex_count())?;
    if let Some(hidden) = hidden {
        CheckError::require_length("vertices hidden by hair", hidden.len(), fitted.vertex_count())?;
    }
    if let Some(colors) = &scan.colors {
        CheckError::require_length("colours of the scan", colors.len(), scan.mesh.vertex_count())?;
    }
    let joints = skeleton.joints_in_world(pose);
    let place = |joint| skeleton.find(joint).map(|j| joints[j.index()]);
    let trunk = place(HumanJoint::Hips).zip(place(HumanJoint::Head)).map(|(hips, head)| head - hips);
    let index = SurfaceIndex::prepare(fitted);
    let (scan_areas, scan_normals) = (scan.mesh.vertex_areas(), scan.mesh.vertex_normals_by_area());
    let on_scan: Vec<(f64, f64, f64, JointId)> = scan
        .mesh
        .vertex_ids()
        .collect::<Vec<_>>()
        .par_iter()
        .map(|&v| {
            let at = index.closest(&scan.mesh.points()[v]);
            let joint = dominant_joint(weights, at.nearest_corner(fitted));
            (at.distance, scan_normals[v].angle(&fitted.face_normal(at.face)), scan_areas[v], joint)
        })
        .collect();
    let feet = Side::BOTH.map(HumanJoint::Foot);
    let is_foot = |v| feet.iter().any(|&foot| skeleton.is_part_of(dominant_joint(weights, v), foot));
    let is_excused = |v| is_foot(v) || hidden.is_some_and(|hidden| hidden[v]);
    let largest_unseen = largest_unseen_part(fitted, &SurfaceIndex::prepare(&scan.mesh), is_excused);
    let of_joint = on_scan.iter().map(|&(_, _, area, joint)| (joint, area));
    let unlike_hands = scan.colors.as_ref().and_then(|colors| unlike_hands(skeleton, colors, of_joint));
    let bends: Vec<(f64, f64)> = on_scan.iter().map(|s| (s.1, s.2)).collect();
    Ok(BodyPlausibility {
        tilt: trunk.map(|trunk| trunk.angle(&nalgebra::Vector3::y())),
        posture: Posture::of(skeleton, pose),
        unlike_hands_share: unlike_hands.as_ref().map(|unlike| unlike.share),
        bent_p90: weighted_quantile(bends.clone(), 0.9),
        bent_median: weighted_quantile(bends, 0.5),
        fitted_p95: weighted_quantile(on_scan.iter().map(|s| (s.0, s.2)).collect(), 0.95),
        deviation: shape.0.iter().fold(0.0_f64, |most, beta| most.max(beta.abs())),
        largest_unseen: largest_unseen.map(|(area, v)| (area, skeleton.part_name(dominant_joint(weights, v)))),
        on_head: unlike_hands.map_or(0.0, |unlike| unlike.on_head),
    })
}

/// The joint that moves a vertex most.
fn dominant_joint(weights: &SkinWeights, v: VertexId) -> JointId {
    weights.rows()[v][0].0
}

/// Colours this different from the hands' are not skin, in spreads: a suntan and shadows stay below.
const NOT_SKIN_FROM: f64 = 2.5;
/// Vertices of the hands that give their colour.
const LEAST_OF_HANDS: usize = 50;

/// Share of the head of another colour from which that says nothing of the head: the hands are not bare.
const HANDS_ARE_COVERED_FROM: f64 = 0.9;

/// What is in another colour than the hands.
struct UnlikeHands {
    /// The share of trunk and limbs, without head and feet because of hair and shoes.
    share: f64,
    /// The area of the head in m².
    on_head: f64,
}

/// What is in another colour than the hands; `None` if the hands are not seen.
///
/// **Shapes** `joints`: the joint and the area of each vertex of the scan.
fn unlike_hands(
    skeleton: &Skeleton,
    colors: &PerVertex<[u8; 3]>,
    joints: impl Iterator<Item = (JointId, f64)> + Clone,
) -> Option<UnlikeHands> {
    let below = |joint, roots: &[HumanJoint]| roots.iter().any(|&root| skeleton.is_part_of(joint, root));
    let is_hand = |joint| below(joint, &Side::BOTH.map(HumanJoint::Hand));
    let feet = Side::BOTH.map(HumanJoint::Foot);
    let labs = || joints.clone().zip(colors.iter()).map(|((joint, area), &rgb)| (joint, area, lab_of(rgb)));
    let hands: Vec<Lab> = labs().filter(|(joint, ..)| is_hand(*joint)).map(|(.., lab)| lab).collect();
    if hands.len() < LEAST_OF_HANDS {
        return None;
    }
    let median = |axis: usize| weighted_quantile(hands.iter().map(|lab| (lab[axis], 1.0)).collect(), 0.5);
    let skin: Lab = [median(0)?, median(1)?, median(2)?];
    let is_other = |lab: &Lab| color_difference(lab, &skin) > NOT_SKIN_FROM;
    let is_head = |joint| below(joint, &[HumanJoint::Head]);
    let others = labs().filter(|(joint, ..)| !is_hand(*joint) && !below(*joint, &feet) && !is_head(*joint));
    let head = labs().filter(|of| is_head(of.0)).map(|(_, area, lab)| (area, is_other(&lab)));
    let hands_are_bare = weighted_share(head.clone()) < HANDS_ARE_COVERED_FROM;
    Some(UnlikeHands {
        share: weighted_share(others.map(|(_, area, lab)| (area, is_other(&lab)))),
        on_head: if hands_are_bare { head.filter(|of| of.1).map(|of| of.0).sum() } else { 0.0 },
    })
}
