//! Cuts a [`Garment`] out of a labelled scan: through its triangles, along a smooth line, in the scan's pose.

mod across_cut;
mod below_hair;
mod body_below;
mod color_evidence;
mod edge_search;
mod enclosed;
mod error;
mod field;
mod hems;
mod holes;
mod params;
mod pieces;
mod slice;
#[cfg(test)]
mod tests;
mod underlap;

pub use body_below::BodyBelow;
pub use error::CutError;
pub use hems::raggedness::{RaggedHem, most_ragged_hem};
pub use holes::earlier_cuts::EarlierCuts;
pub use params::CutParams;

use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId, WithoutSlivers, without_slivers};
use crate::parameters::Parameters;
use crate::scan::Scan;
use crate::segment::Segmentation;
use holes::earlier_cuts::FilledSurface;
use serde::{Deserialize, Serialize};
use slice::Slice;
use std::ops::RangeInclusive;
use underlap::Underlapped;

/// A garment: one sheet, its outer surface.
///
/// **Shapes** `colors` and `is_seen`: one per vertex of `mesh`.
///
/// **Frame** the world, in the scan's pose; metres.
///
/// **Guarantees** manifold, oriented as the scan; the vertex order depends only on scan and labels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Garment {
    /// Its surface.
    pub mesh: TriMesh,
    /// Colours as scanned.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Which vertices the scan shows; the others were filled, or continue the garment under another one.
    pub is_seen: PerVertex<bool>,
    /// Boundary loops that are hems, longest first.
    pub hem_loops: Vec<Vec<VertexId>>,
    /// What was dropped, filled or not as expected: one sentence each.
    pub findings: Vec<String>,
}

impl Garment {
    /// A garment of which the scan shows nothing.
    pub fn absent() -> Self {
        Self {
            mesh: TriMesh::empty(),
            colors: None,
            is_seen: PerVertex(Vec::new()),
            hem_loops: Vec::new(),
            findings: Vec::new(),
        }
    }

    /// The part of a body whose vertices are covered, as a garment that lies on the skin.
    ///
    /// **Shapes** `covered`: one entry per vertex of `body`.
    pub fn on_skin(body: &TriMesh, covered: &PerVertex<bool>) -> Self {
        let keep = body.faces().iter().map(|face| face.iter().all(|&v| covered[v])).collect();
        let (mesh, _) = body.part(&keep);
        let mut hem_loops = Adjacency::prepare(&mesh).boundary_loops();
        hem_loops.sort_by_key(|hem| std::cmp::Reverse(hem.len()));
        Self { is_seen: PerVertex::filled(true, mesh.vertex_count()), mesh, hem_loops, ..Self::absent() }
    }

    /// Whether the scan shows nothing of it.
    pub fn is_absent(&self) -> bool {
        self.mesh.face_count() == 0
    }
}

/// Cuts the garment out of the scan.
///
/// `around` is the adjacency of the scan's mesh, `expected_loops` the number of hems of the garment's template, least and
/// greatest.
///
/// Holes of the scan in the garment are filled where they are small, or where the body continues below them: at the crown, on
/// the shoulders, at the soles. Where hair hides the garment it continues along the body.
///
/// Where the scan shows a garment that is worn over this one, this one continues below it, unseen.
///
/// Labels given by the user are cut exactly, however small; elsewhere what is too small is noise. A hole that the user
/// erased within the cloth stays open and is reported; it counts as a hem only if a hem is missing.
///
/// **Shapes** `segmentation`: one entry per vertex of the scan.
///
/// **Errors** if the labels, the adjacency or the colours belong to another scan, if a parameter is out of range, if no face
/// is left, or if a linear system has no solution.
///
/// **Source** Hu 2017, §6.2. In the paper a person repaints the rough segmentation on a quad mesh (Jakob et al. 2015), which
/// takes about 90 seconds and gives the smooth hem. Here the cut is automatic and on triangles; everything in this module
/// is ours: the smooth signed field, the cut along its zero line, fairing of the hem, and the treatment of holes.
pub fn cut(
    scan: &Scan,
    around: &Adjacency,
    segmentation: &Segmentation,
    body: &BodyBelow,
    expected_loops: RangeInclusive<usize>,
    params: &CutParams,
) -> Result<Garment, CutError> {
    cut_again(scan, around, segmentation, body, expected_loops, params, &EarlierCuts::default())
}

/// Like [`cut`], for a scan that is cut many times: what the labels have not changed since the last cut is not computed again.
///
/// **Requires** that `earlier` is of this scan.
pub fn cut_again(
    scan: &Scan,
    around: &Adjacency,
    segmentation: &Segmentation,
    body: &BodyBelow,
    expected_loops: RangeInclusive<usize>,
    params: &CutParams,
    earlier: &EarlierCuts,
) -> Result<Garment, CutError> {
    check_arguments(scan, around, segmentation, body, &expected_loops, params)?;
    let (vertices, labels) = (scan.mesh.vertex_count(), &segmentation.labels);
    let mut findings = Vec::new();
    let body = &*earlier.body(body);
    let continued = below_hair::without_hair(scan, around, segmentation, body.surface(), &mut findings)?;
    let (scan, segmentation) = continued.as_ref().map_or((scan, segmentation), |(scan, whole)| (scan, whole));
    // What continues below hair is another scan, which depends on the labels.
    let own = EarlierCuts::default();
    let earlier = if continued.is_some() { &own } else { earlier };
    let filled = holes::fill_holes::filled(scan, around, segmentation, body, params, earlier, &mut findings)?;
    let FilledSurface { mesh: surface, adjacency, .. } = &*filled.surface;
    let field = field::signed_field(&filled, adjacency, params.smoothing_radius)?;
    let at_edge = edge_search::at_edges_of_cloth(&filled, adjacency, field, params, &mut findings)?;
    // What continues below hair has the garment's label now, and had not.
    let is_seen = |v: VertexId| v.index() < vertices && (labels.0[v] || !segmentation.labels.0[v]);
    let along = |field: &PerVertex<f64>, findings: &mut Vec<String>| -> Result<Slice, CutError> {
        let sliced = slice::slice(surface, field)?.with_hems_only(&filled.beside_hole).seen_where(is_seen);
        let sliced = pieces::without_fins(sliced);
        let sliced = pieces::without_islands(sliced, &filled, params.least_island_share, findings);
        let sliced = pieces::with_bow_ties_split(sliced)?;
        if sliced.mesh.face_count() == 0 {
            return Err(CutError::NothingLabelled { labelled: labels.garment_vertex_count(), vertices });
        }
        holes::fill_holes::close_pinholes(sliced, &filled)
    };
    let mut sliced = along(&at_edge, &mut findings)?;
    let surplus = enclosed::hem_count(&sliced).saturating_sub(*expected_loops.end());
    if let Some((closed, areas)) = enclosed::closed(&filled, adjacency, &at_edge, surplus) {
        sliced = along(&closed, &mut Vec::new())?;
        let (count, plural) = (areas.len(), if areas.len() == 1 { "" } else { "s" });
        let area = areas.iter().sum::<f64>() * 1e4;
        findings.push(format!("closed {count} place{plural} within the garment, {area:.0} cm² in total"));
    }
    let across = across_cut::AcrossCut::of(&sliced, &filled, adjacency);
    let faired = hems::hem::faired(sliced, &filled, adjacency, params);
    let faired = hems::crumples::smoothed(faired, &mut findings)?;
    let loops = hems::boundary_loops::BoundaryLoops::of(&faired, &across);
    let hem_loops = loops.classified(&expected_loops, params, &mut findings);
    let with_underlap =
        underlap::continued(&faired.mesh, hem_loops, &scan.mesh, &segmentation.under, body.surface(), params.underlap);
    let Underlapped { mesh, like, hem_loops, area } = with_underlap;
    if area > 0.0 {
        findings.push(format!("continued by {:.0} cm² under the garment over it", area * 1e4));
    }
    let own = faired.mesh.vertex_count();
    let is_seen = like.enumerate().map(|(v, of)| v.index() < own && faired.is_seen[of.index()]).collect();
    let colors = faired.colors.map(|colors| like.iter().map(|&v| colors[v]).collect());
    Ok(without_slivers_of(Garment { mesh, colors, is_seen, hem_loops, findings }))
}

/// Triangles of a garment are no flatter than this share of its edges' mean length: 0.4 mm. Below the hair of the foreign person c a jacket
/// had sheets of slivers that lay on each other, within the rounding of its coordinates; and what simulates cloth
/// takes its springs from them.
const LEAST_HEIGHT_PER_EDGE: f64 = 0.05;

/// The garment with its slivers collapsed.
fn without_slivers_of(garment: Garment) -> Garment {
    let least_height = LEAST_HEIGHT_PER_EDGE * garment.mesh.mean_edge_length();
    let WithoutSlivers { mesh, was, is } = without_slivers(&garment.mesh, least_height);
    let of_loop = |hem: &Vec<VertexId>| {
        let mut hem: Vec<VertexId> = hem.iter().filter_map(|&v| is[v]).collect();
        hem.dedup();
        if hem.len() > 1 && hem.first() == hem.last() {
            hem.pop();
        }
        hem
    };
    Garment {
        mesh,
        colors: garment.colors.map(|colors| was.iter().map(|&v| colors[v]).collect()),
        is_seen: was.iter().map(|&v| garment.is_seen[v]).collect(),
        hem_loops: garment.hem_loops.iter().map(of_loop).collect(),
        findings: garment.findings,
    }
}

fn check_arguments(
    scan: &Scan,
    around: &Adjacency,
    segmentation: &Segmentation,
    body: &BodyBelow,
    expected_loops: &RangeInclusive<usize>,
    params: &CutParams,
) -> Result<(), CutError> {
    let (vertices, faces) = (scan.mesh.vertex_count(), scan.mesh.face_count());
    let below_hair = segmentation.below_hair.as_ref().map_or(vertices, PerVertex::len);
    let Segmentation { labels, by_hand, under, .. } = segmentation;
    for given in [labels.0.len(), by_hand.len(), under.len(), below_hair] {
        if given != vertices {
            return Err(CutError::LabelCount { labels: given, vertices });
        }
    }
    let colors = scan.colors.as_ref().map_or(vertices, PerVertex::len);
    for (what, given, expected) in [
        ("vertices of the adjacency", around.vertex_count(), vertices),
        ("faces of the adjacency", around.face_count(), faces),
        ("colours", colors, vertices),
        ("covered vertices of the body", body.covered.len(), body.mesh.vertex_count()),
    ] {
        if given != expected {
            return Err(CutError::WrongLength { what, given, expected });
        }
    }
    if expected_loops.is_empty() {
        return Err(CutError::BadLoopRange { least: *expected_loops.start(), most: *expected_loops.end() });
    }
    Ok(params.check_values()?)
}
