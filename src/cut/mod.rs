//! Labels in, a [`Garment`] out: cut through the triangles of the scan along a smooth line, in the scan's pose.

mod beyond;
mod error;
mod field;
mod hem;
mod mend;
mod params;
mod patch;
mod pieces;
mod rims;
mod slice;
#[cfg(test)]
mod tests;

pub use error::CutError;
pub use params::CutParams;

use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::Segmentation;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// The garment as seen from outside.
///
/// **Frame** the world, in the scan's pose.
///
/// **Guarantees** manifold, oriented as the scan; vertex order depends on scan and labels alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Garment {
    /// Its surface.
    pub mesh: TriMesh,
    /// Colours as scanned.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Boundary loops that are hems, longest first.
    pub hem_loops: Vec<Vec<VertexId>>,
    /// What was dropped, filled or not as expected, a sentence each.
    pub findings: Vec<String>,
}

/// Cuts the garment out of the scan.
///
/// `around`: the adjacency of the scan's mesh.
///
/// Where labels were given by hand they are cut as they are, however small; elsewhere what is too small is noise. A hole
/// that was erased in the midst of the cloth stays open, and is told; it is no hem, unless a hem is missing.
///
/// `expected_loops`: how many hems the garment's template has, fewest and most.
pub fn cut(
    scan: &Scan,
    around: &Adjacency,
    segmentation: &Segmentation,
    expected_loops: RangeInclusive<usize>,
    params: &CutParams,
) -> Result<Garment, CutError> {
    let (vertices, labels) = (scan.mesh.vertex_count(), &segmentation.labels);
    if labels.0.len() != vertices {
        return Err(CutError::LabelCount { labels: labels.0.len(), vertices });
    }
    let mut findings = Vec::new();
    let whole = mend::mended(scan, around, segmentation, params, &mut findings)?;
    let adjacency = whole.adjacency.as_ref().unwrap_or(around);
    let field = field::signed_field(&whole, adjacency, params.smoothing_radius)?;
    let sliced = slice::slice(&whole.mesh, &field)?.with_hems_only(&whole.beside_hole);
    let sliced = pieces::without_islands(sliced, &whole, params.least_island_share, &mut findings);
    let sliced = pieces::with_bow_ties_split(sliced)?;
    if sliced.mesh.face_count() == 0 {
        return Err(CutError::NothingLabelled { labelled: labels.garment_vertex_count(), vertices });
    }
    let sliced = mend::without_pores(sliced, &whole)?;
    let beyond = beyond::Beyond::of(&sliced, &whole, adjacency);
    let faired = hem::faired(sliced, &whole, adjacency, params);
    let rims = rims::Rims::of(&faired, &beyond);
    let hem_loops = rims.judged(&expected_loops, params, &mut findings);
    Ok(Garment { mesh: faired.mesh, colors: faired.colors, hem_loops, findings })
}
