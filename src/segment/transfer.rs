//! The template's labels taken from the body to the scan.

use crate::geometry::{NearestVertex, PerVertex, TriMesh};
use crate::scan::Scan;
use rayon::prelude::*;

/// For each vertex of a scan, whether it belongs to the new garment.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Labels(pub PerVertex<bool>);

impl Labels {
    /// How many vertices belong to the garment.
    pub fn garment_vertex_count(&self) -> usize {
        self.0.iter().filter(|&&l| l).count()
    }
}

/// Each vertex of the scan takes the label of the nearest vertex of the body.
///
/// **Shapes** `prior` has one entry a vertex of `posed_body`.
///
/// **Source** Hu 2017, §6.2.
pub fn transfer(scan: &Scan, posed_body: &TriMesh, prior: &PerVertex<bool>) -> Labels {
    let nearest = NearestVertex::prepare(posed_body.points().as_slice());
    let labels: Vec<bool> =
        scan.mesh.points().0.par_iter().map(|p| nearest.nearest(p).is_some_and(|(v, _)| prior[v])).collect();
    Labels(labels.into())
}
