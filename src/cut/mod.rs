//! Labels in, a [`Garment`] out: cut through the triangles of the scan along a smooth line, in the scan's pose.

mod beyond;
mod field;
mod hem;
mod mend;
mod patch;
mod pieces;
mod rims;
mod slice;
#[cfg(test)]
mod tests;

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

/// How a garment is cut. Lengths are metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutParams {
    /// Wiggles of the label boundary shorter than about four times this are smoothed away before the cut. 14 mm: three
    /// vertices of a 50 k-vertex scan; corners of a front opening are rounded by no more.
    pub smoothing_radius: f64,
    /// Rounds of fairing along the hem. 64: of wiggles of 5 cm an eighth stays, at 5 mm spacing.
    pub fairing_rounds: usize,
    /// Islands with less than this share of the garment's area are dropped, unless they were painted by hand. 3 %: less
    /// than one sleeve of a child's shirt, more than any speck.
    pub least_island_share: f64,
    /// Holes of the scan with less area are filled, in m². 90 cm²: the tops of a coat's shoulders, which a level camera
    /// does not see, had 42 to 81; an adult's neck has 110 or more.
    pub greatest_filled_hole: f64,
}

impl Default for CutParams {
    fn default() -> Self {
        Self { smoothing_radius: 0.014, fairing_rounds: 64, least_island_share: 0.03, greatest_filled_hole: 90e-4 }
    }
}

/// Why nothing could be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// Labels and scan do not belong together.
    #[error("there are {labels} labels, but the scan has {vertices} vertices")]
    LabelCount {
        /// Labels given.
        labels: usize,
        /// Vertices of the scan.
        vertices: usize,
    },
    /// No vertex is labelled.
    #[error(
        "no part of the scan belongs to the garment ({labelled} of {vertices} vertices are labelled, no face is left)"
    )]
    NothingLabelled {
        /// Vertices labelled as the garment.
        labelled: usize,
        /// Vertices of the scan.
        vertices: usize,
    },
    /// Filling a hole made a point that is none.
    #[error("a hole of the scan could not be filled: {0}")]
    Mesh(#[from] crate::geometry::MeshError),
    /// A linear system had no solution.
    #[error("the boundary could not be smoothed: {0}")]
    Numerics(#[from] crate::numerics::NumericsError),
}

impl CutError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::LabelCount { .. } => "labels belong to one cleaned scan: make them again for this one".into(),
            Self::NothingLabelled { .. } => {
                "is it the right template, and the right scan? --until, --sleeve or a brush mask say where it is".into()
            }
            Self::Mesh(_) | Self::Numerics(_) => {
                "the scan has faces without area: scan it again with more decimation".into()
            }
        })
    }
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
    let sliced = slice::slice(&whole.mesh, &field).with_hems_only(&whole.beside_hole);
    let sliced = pieces::without_islands(sliced, &whole, params.least_island_share, &mut findings);
    let sliced = pieces::with_bow_ties_split(sliced);
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
