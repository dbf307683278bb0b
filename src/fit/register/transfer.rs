//! Transfer of skin weights to any surface near the registered one.

use super::registered_body::RegisteredBody;
use crate::body::{SkinWeights, skin, unskin};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, VertexId};
use crate::scan::Scan;
use rayon::prelude::*;

/// The skin weights at the closest point of `surface`, for each point. **Shapes** one row per point.
///
/// **Requires** `weights` with one row per vertex of `surface`, which has faces.
///
/// **Source** Hu 2017, §5.1: the closest triangle, by its barycentric coordinates.
pub fn closest_weights(points: &PerVertex<Point>, surface: &TriMesh, weights: &SkinWeights) -> SkinWeights {
    let index = SurfaceIndex::prepare(surface);
    let places: Vec<[(VertexId, f64); 3]> = points
        .0
        .par_iter()
        .map(|p| {
            let at = index.closest(p);
            let corners = surface.faces()[at.face];
            [0, 1, 2].map(|k| (corners[k], at.barycentric[k]))
        })
        .collect();
    let rows = places.iter().map(|at| weights.blend(at));
    SkinWeights::from_rows(rows).following(weights, places.iter().map(|at| at.to_vec()))
}

/// The scan itself in the bind pose with its skin weights: the body of Hu 2017, instead of the registered surface.
pub fn scan_in_bind(scan: &Scan, registered: &RegisteredBody, weights: &SkinWeights) -> (TriMesh, SkinWeights) {
    let (skeleton, pose) = (&registered.skeleton, &registered.pose);
    let posed = registered.surface.with_points(skin(registered.surface.points(), weights, skeleton, pose));
    let own = closest_weights(scan.mesh.points(), &posed, weights);
    let points = unskin(scan.mesh.points(), &own, skeleton, pose);
    (scan.mesh.with_points(points), own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Pose, embedded_model};
    use crate::fit::RegistrationReport;
    use crate::geometry::Vec3;
    use nalgebra::UnitQuaternion;

    #[test]
    fn a_scan_of_the_posed_body_comes_back_to_the_bind_pose() {
        let model = embedded_model().unwrap();
        let mut pose = Pose::bind(model.skeleton.len());
        pose.translation = Vec3::new(0.2, 0.0, -0.4);
        pose.rotations[0] = UnitQuaternion::from_euler_angles(0.0, 0.7, 0.0);
        pose.rotations[7] = UnitQuaternion::from_euler_angles(0.0, 0.0, -0.4);
        let posed = model.template.with_points(model.posed(model.template.points(), &model.skeleton, &pose));
        let registered = RegisteredBody {
            surface: model.template.clone(),
            skeleton: model.skeleton.clone(),
            pose,
            colors: None,
            uvs: None,
            report: RegistrationReport::default(),
        };
        let (bind, weights) = scan_in_bind(&Scan::from_clean_mesh(posed, None), &registered, &model.weights);
        assert_eq!(weights.len(), bind.vertex_count());
        let far = bind.points().iter().zip(model.template.points().iter()).map(|(p, q)| (p - q).norm());
        assert!(far.fold(0.0, f64::max) < 1e-6);
    }
}
