//! Corrective offsets by pose (pose blend shapes), as in the SMPL family.

use super::Pose;
use crate::geometry::{PerVertex, Vec3, VertexId};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Corrective offsets of the surface in the bind pose, linear in features of the joint rotations.
///
/// **Shapes** `V × features` offsets, in metres per unit of a feature, row by row.
///
/// **Source** Loper 2015 (SMPL), Eq. 9: features are the entries of `R_j − 1` of all joints but the root, row by row;
/// Osman 2020 (STAR): the quaternion `(x, y, z, w − 1)` of all joints but the root.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseDirs {
    offsets: Vec<Vec3>,
    features: usize,
    kind: Features,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Features {
    /// Nine per joint.
    Matrix,
    /// Four per joint.
    Quaternion,
}

impl PoseDirs {
    /// Offsets for a model with this many vertices and joints; `None` if their count fits no known kind of feature.
    ///
    /// **Shapes** `offsets`: `vertices × features`, row by row.
    pub fn try_new(offsets: Vec<Vec3>, vertices: usize, joints: usize) -> Option<Self> {
        let features = offsets.len() / vertices.max(1);
        let turning = joints.saturating_sub(1);
        let kind = match features {
            0 => return None,
            n if n == 9 * turning => Features::Matrix,
            n if n == 4 * turning => Features::Quaternion,
            _ => return None,
        };
        (offsets.len() == features * vertices).then_some(Self { offsets, features, kind })
    }

    /// The number of features.
    pub fn feature_count(&self) -> usize {
        self.features
    }

    /// The offsets, `V × features`, row by row.
    pub fn offsets(&self) -> &[Vec3] {
        &self.offsets
    }

    /// The corrective offset of each vertex of the model in `pose`, in the axes of the bind pose.
    ///
    /// **Shapes** `V × 3`, in metres.
    pub fn in_pose(&self, pose: &Pose) -> PerVertex<Vec3> {
        let features = self.features_of(pose);
        self.offsets
            .par_chunks(self.features)
            .map(|row| row.iter().zip(&features).map(|(offset, f)| offset * *f).sum::<Vec3>())
            .collect::<Vec<_>>()
            .into()
    }

    /// The offsets of some of the model's vertices, in their order.
    pub(crate) fn of_vertices(&self, kept: &[VertexId]) -> Self {
        let row = |v: &VertexId| self.offsets[v.index() * self.features..(v.index() + 1) * self.features].to_vec();
        Self { offsets: kept.iter().flat_map(row).collect(), ..*self }
    }

    fn features_of(&self, pose: &Pose) -> Vec<f64> {
        let turning = pose.rotations.iter().skip(1);
        match self.kind {
            Features::Matrix => turning
                .flat_map(|r| {
                    let m = r.to_rotation_matrix().into_inner() - nalgebra::Matrix3::identity();
                    (0..9).map(move |k| m[(k / 3, k % 3)])
                })
                .collect(),
            // q and −q are one rotation; STAR was trained on those with w ≥ 0.
            Features::Quaternion => turning
                .flat_map(|r| {
                    let q = if r.w < 0.0 { -r.into_inner() } else { r.into_inner() };
                    [q.i, q.j, q.k, q.w - 1.0]
                })
                .collect(),
        }
    }
}

/// How a surface follows the corrective offsets of a model.
///
/// The offsets belong to the model and are large. A stored figure holds only which of them each vertex follows; the
/// reader restores them ([`super::StoredFigure::with_offsets`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PoseOffsets {
    #[serde(skip)]
    dirs: Option<Arc<PoseDirs>>,
    /// Per vertex the vertices of the model that it follows, with shares; `None` for the model's own surface.
    places: Option<PerVertex<Vec<(VertexId, f64)>>>,
}

impl PoseOffsets {
    /// The model's own surface.
    pub fn of_model(dirs: Arc<PoseDirs>) -> Self {
        Self { dirs: Some(dirs), places: None }
    }

    /// Another surface, each of whose vertices follows some vertices of this one.
    ///
    /// **Shapes** `places`: per vertex of the other surface the vertices that it follows, with factors.
    pub fn followed(&self, places: impl Iterator<Item = Vec<(VertexId, f64)>>) -> Self {
        let on_model = |(v, share): (VertexId, f64)| match &self.places {
            None => vec![(v, share)],
            Some(own) => own[v].iter().map(|&(u, s)| (u, s * share)).collect(),
        };
        let places = places.map(|at| at.into_iter().flat_map(on_model).collect()).collect();
        Self { dirs: self.dirs.clone(), places: Some(places) }
    }

    /// Several surfaces one after another, each with its vertex count; `None` if all of them are rigid.
    pub fn joined<'a>(parts: impl Iterator<Item = (Option<&'a Self>, usize)> + Clone) -> Option<Self> {
        let dirs = parts.clone().find_map(|(part, _)| part)?.dirs.clone();
        let places = parts.flat_map(|(part, count)| {
            (0..count).map(move |v| match part {
                None => Vec::new(),
                Some(Self { places: None, .. }) => vec![(VertexId::from_index(v), 1.0)],
                Some(Self { places: Some(own), .. }) => own.0[v].clone(),
            })
        });
        Some(Self { places: Some(places.collect()), dirs })
    }

    pub fn dirs(&self) -> Option<&Arc<PoseDirs>> {
        self.dirs.as_ref()
    }

    pub fn set_dirs(&mut self, dirs: &Arc<PoseDirs>) {
        self.dirs = Some(Arc::clone(dirs));
    }

    /// The corrective offset of each vertex of the surface.
    ///
    /// **Shapes** `V × 3`.
    pub fn in_pose(&self, pose: &Pose) -> Option<PerVertex<Vec3>> {
        let of_model = self.dirs.as_ref()?.in_pose(pose);
        let Some(places) = &self.places else { return Some(of_model) };
        let at = |row: &Vec<(VertexId, f64)>| row.iter().map(|&(v, share)| of_model[v] * share).sum();
        Some(places.iter().map(at).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use nalgebra::UnitQuaternion;

    #[test]
    fn the_bind_pose_moves_nothing_and_a_bent_joint_moves_what_follows_it() {
        let points: PerVertex<Point> = vec![Point::origin(), Point::new(0.0, 1.0, 0.0)].into();
        for (features, feature) in [(9, 1), (4, 2)] {
            let mut offsets = vec![Vec3::zeros(); 2 * features];
            offsets[features + feature] = Vec3::new(0.0, 0.0, 0.5);
            let dirs = PoseDirs::try_new(offsets, 2, 2).unwrap();
            assert!(dirs.in_pose(&Pose::bind(2)).iter().all(|d| d.norm() == 0.0));
            let mut pose = Pose::bind(2);
            pose.rotations[1] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), 0.3);
            let moved: PerVertex<Point> = points.iter().zip(dirs.in_pose(&pose).iter()).map(|(p, d)| p + d).collect();
            // Entry (0, 1) of the matrix is −sin 0.3; z of the quaternion is sin 0.15.
            let expected = if features == 9 { -0.3f64.sin() } else { 0.15f64.sin() };
            assert!((moved.0[1].z - 0.5 * expected).abs() < 1e-12);
            assert_eq!(moved.0[0], points.0[0]);
            // Half of the model's offset, and half of that again: a quarter.
            let whole = PoseOffsets::of_model(Arc::new(dirs));
            let half = |v| vec![(VertexId(v), 0.5)];
            let cloth = whole.followed([half(0), half(1)].into_iter()).followed(std::iter::once(half(1)));
            let moved = cloth.in_pose(&pose).unwrap();
            assert!(moved.len() == 1 && (moved.0[0].z - 0.125 * expected).abs() < 1e-12);
        }
        assert!(PoseDirs::try_new(vec![Vec3::zeros(); 10], 2, 2).is_none());
    }
}
