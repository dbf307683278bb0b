//! A garment moved clear of obstacles, by the chosen method.

use super::obstacle::Obstacle;
use super::params::{StackMethod, StackParams};
use super::smooth::Smoother;
use super::{crossing, paper, push};
use crate::geometry::{PerVertex, TriMesh};
use crate::numerics::NumericsError;

/// The mesh clear of all obstacles, as far as the rounds allow, and the number of rounds spent on crossing triangles.
pub(super) fn cleared(
    mesh: &TriMesh,
    limbs: &PerVertex<[f64; 5]>,
    obstacles: &[Obstacle],
    params: &StackParams,
) -> Result<(TriMesh, usize), NumericsError> {
    match params.method {
        StackMethod::Paper => Ok((paper::push_along_normals(mesh, obstacles, params), 0)),
        StackMethod::Push => Ok((push::push(mesh, limbs, obstacles, params), 0)),
        StackMethod::Smooth => {
            let solver = Smoother::prepare(mesh, limbs, obstacles, params);
            let pushed = solver.push_clear(mesh)?;
            crossing::separate(pushed, limbs, obstacles, &solver, params)
        }
    }
}
