//! Targets of the vertices on the scan.

use super::params::RegisterParams;
use crate::body::{BodyModel, HumanJoint, JointId, Side};
use crate::fit::correspondence::{ScanHit, ScanSurface};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// The target point of a vertex and its weight (0–1).
pub(crate) type TargetPoint = Option<(Point, f64)>;

pub(crate) fn target_weights(model: &BodyModel, params: &RegisterParams) -> PerVertex<f64> {
    let skeleton = &model.skeleton;
    let part = |joint: fn(Side) -> HumanJoint| Side::BOTH.map(|side| skeleton.find(joint(side)));
    let (hands, toes) = (part(HumanJoint::Hand), part(HumanJoint::Toes));
    let below = |j: JointId, part: &[Option<JointId>; 2]| part.iter().flatten().any(|&p| skeleton.is_below(j, p));
    let pull_of_joint = |j: JointId| match j {
        j if below(j, &toes) => params.toe_pull,
        // The hand and the fingers that the model has.
        j if below(j, &hands) => params.hand_pull,
        _ => 1.0,
    };
    let pulls: Vec<f64> = skeleton.ids().map(pull_of_joint).collect();
    model.weights.rows().iter().map(|row| row.iter().map(|(j, w)| w * pulls[j.index()]).sum()).collect()
}

/// The closest point of the scan, if it faces the same way. The closest point to a toe tip that is in front of or behind the
/// scan's is the top of the foot, which does not: feet also search along their normals. **Shapes** one target per vertex.
pub(crate) fn targets(
    surface: &ScanSurface,
    mesh: &TriMesh,
    is_foot: &PerVertex<bool>,
    reach: f64,
) -> Vec<TargetPoint> {
    let normals = mesh.vertex_normals();
    (0..mesh.vertex_count())
        .into_par_iter()
        .map(|i| {
            let (p, n) = (&mesh.points().0[i], &normals.0[i]);
            let ahead = || {
                let hits = [*n, -n].into_iter().filter_map(|way| surface.along(p, &way, reach));
                hits.filter(|hit| agrees(hit, n)).map(|hit| on_plane(&hit, p, reach)).next()
            };
            target_on(surface, p, n, reach).or_else(|| if is_foot.0[i] { ahead() } else { None })
        })
        .collect()
}

/// The target of a vertex on the closest point of a scan, if it faces the same way.
pub(crate) fn target_on(surface: &ScanSurface, p: &Point, n: &Vec3, reach: f64) -> TargetPoint {
    surface.nearest(p, reach).filter(|hit| agrees(hit, n)).map(|hit| on_plane(&hit, p, reach))
}

fn agrees(hit: &ScanHit, normal: &Vec3) -> bool {
    /// Normals with a smaller cosine belong to another side of the body (arm and flank).
    const LEAST_COSINE: f64 = 0.5;
    !hit.at_rim && hit.normal.dot(normal) >= LEAST_COSINE
}

fn on_plane(hit: &ScanHit, p: &Point, reach: f64) -> (Point, f64) {
    let place = p + hit.normal * hit.normal.dot(&(hit.point - p));
    // The scan's confidence does not count here: points of low confidence are noisy, but all that fingers have.
    (place, 1.0 / (1.0 + (hit.distance / (0.5 * reach)).powi(2)).powi(2))
}
