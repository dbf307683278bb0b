//! How much of each garment's motion is cloth physics.

use super::error::RigError;
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, cotangent_laplacian};
use crate::numerics::SparseCholesky;
use crate::parameters::{Allowed, Parameters, parameters};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

parameters! {
    /// How cloth physics is blended with skinning.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    pub struct PhysicsParams {
        /// Greatest share of physics in the blend: one half (Hu 2017, Eq. 9).
        pub greatest_share: f64 = 0.5, Allowed::SHARE, "Largest share of cloth physics in the blend with skinning";
        /// Length in metres over which values are smoothed, so that the blend has no step at the border of the loose
        /// part: 2 cm, about a waistband.
        pub smoothing_length: f64 = 0.02, Allowed::LENGTH, "Length over which physics weights are smoothed";
    }
}

/// Shares of cloth physics in the blend with skinning, all in 0–0.5.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhysicsWeights {
    /// Eq. 9 for the loose part; `None` if it has no vertices.
    pub loose_part: Option<f64>,
    /// Eq. 9 for the rest; `None` if it has no vertices.
    pub fitted_part: Option<f64>,
    /// One value per vertex. Before smoothing it is `min(½, (d − d_min) / (d_max − d_min))` in each part; its mean over the
    /// part is Eq. 9 if no vertex reaches the bound.
    pub per_vertex: PerVertex<f64>,
}

impl PhysicsWeights {
    /// Eq. 9 as one value per vertex: constant in each part, with a step between the parts.
    ///
    /// **Shapes** `loose` and the result: one entry per vertex.
    pub fn per_part(&self, loose: &PerVertex<bool>) -> PerVertex<f64> {
        loose.iter().map(|&l| if l { self.loose_part } else { self.fitted_part }.unwrap_or(0.0)).collect()
    }
}

/// Physics weights from the garment's distance to the naked body, both in the bind pose.
///
/// **Shapes** `loose`: one entry per vertex of the garment.
///
/// **Errors** a mask of another length, a body without faces, a parameter out of range, or a singular linear system.
///
/// **Source** Hu 2017, Eq. 9: `w_p = min(½, (mean − min) / (max − min))` of the distances to the closest points; a part
/// at the same distance everywhere has 0.
pub fn physics_weights(
    garment: &TriMesh,
    naked_body: &TriMesh,
    loose: &PerVertex<bool>,
    params: &PhysicsParams,
) -> Result<PhysicsWeights, RigError> {
    if loose.len() != garment.vertex_count() {
        let (given, expected) = (loose.len(), garment.vertex_count());
        return Err(RigError::WrongLength { what: "the mask of the loose part", given, expected });
    }
    if naked_body.face_count() == 0 {
        return Err(RigError::EmptyBody);
    }
    params.check_values()?;
    let body = SurfaceIndex::prepare(naked_body);
    let distances: Vec<f64> = garment.points().0.par_iter().map(|p| body.closest(p).distance).collect();
    let most = params.greatest_share;
    let loose_range = Range::of(&distances, |v| loose.0[v]);
    let fitted_range = Range::of(&distances, |v| !loose.0[v]);
    let raw: Vec<f64> = (0..distances.len())
        .map(|v| {
            let range = if loose.0[v] { &loose_range } else { &fitted_range };
            range.as_ref().map_or(0.0, |r| r.share(distances[v], most))
        })
        .collect();
    Ok(PhysicsWeights {
        loose_part: loose_range.as_ref().map(|r| r.share(r.mean, most)),
        fitted_part: fitted_range.as_ref().map(|r| r.share(r.mean, most)),
        per_vertex: smoothed(garment, &raw, params)?,
    })
}

struct Range {
    min: f64,
    max: f64,
    mean: f64,
}

impl Range {
    fn of(distances: &[f64], belongs: impl Fn(usize) -> bool) -> Option<Self> {
        let part: Vec<f64> = (0..distances.len()).filter(|&v| belongs(v)).map(|v| distances[v]).collect();
        let min = part.iter().copied().reduce(f64::min)?;
        let max = part.iter().copied().reduce(f64::max)?;
        Some(Self { min, max, mean: part.iter().sum::<f64>() / part.len() as f64 })
    }

    fn share(&self, distance: f64, most: f64) -> f64 {
        let width = self.max - self.min;
        if width > 0.0 { ((distance - self.min) / width).clamp(0.0, most) } else { 0.0 }
    }
}

fn smoothed(garment: &TriMesh, values: &[f64], params: &PhysicsParams) -> Result<PerVertex<f64>, RigError> {
    let laplacian = cotangent_laplacian(garment);
    let mass = laplacian.safe_mass();
    let matrix = laplacian.screened(&vec![1.0; values.len()], params.smoothing_length.powi(2), 0.0);
    let mut column: Vec<f64> = values.iter().zip(&mass).map(|(v, m)| v * m).collect();
    SparseCholesky::prepare(values.len(), &matrix)?.solve_in_place(&mut column);
    Ok(column.into_iter().map(|v| v.clamp(0.0, params.greatest_share)).collect())
}
