//! Hair in a naked scan.

use crate::geometry::{PerFace, PerVertex, SurfaceIndex, TriMesh};
use crate::scan::Scan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Hair that a naked scan shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hair {
    /// Which vertices of the scan are hair. **Shapes** one entry per vertex of the scan.
    pub vertices: PerVertex<bool>,
    /// Which vertices of the model it covers. **Shapes** one entry per vertex of the model.
    pub covers: PerVertex<bool>,
    /// Area of the hair in the scan, in m².
    pub area: f64,
    /// Mean distance of the hair from the head and trunk below it, in metres.
    pub stand_off: f64,
}

impl Hair {
    /// The scan without the hair.
    ///
    /// # Panics
    /// If the hair is that of another scan.
    pub fn removed_from(&self, scan: &Scan) -> Scan {
        scan.part(&self.faces(&scan.mesh, false))
    }

    /// The hair alone.
    ///
    /// # Panics
    /// If the hair is that of another scan.
    pub fn part_of(&self, scan: &Scan) -> Scan {
        scan.part(&self.faces(&scan.mesh, true))
    }

    /// Says which vertices of the model the hair covers: those to which nothing of the scan is nearer. `posed` is the fitted
    /// model, `with_hair` the scan with its hair.
    pub(super) fn cover(&mut self, posed: &TriMesh, with_hair: &SurfaceIndex) {
        let is_below = |i: usize| {
            let at = with_hair.closest(&posed.points().0[i]);
            at.distance.is_finite() && with_hair.mesh().faces()[at.face].iter().any(|&v| self.vertices[v])
        };
        self.covers = PerVertex((0..posed.vertex_count()).into_par_iter().map(is_below).collect());
    }

    /// Which faces are hair, or are not: those with a corner in the hair are.
    fn faces(&self, mesh: &TriMesh, are_hair: bool) -> PerFace<bool> {
        mesh.faces().iter().map(|face| face.iter().any(|&v| self.vertices[v]) == are_hair).collect()
    }
}
