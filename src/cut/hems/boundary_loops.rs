//! Classifies boundary loops: hem, hole of the scan, or hole erased by the user.

use super::hem::Faired;
use crate::cut::across_cut::AcrossCut;
use crate::cut::holes::ring_area::area_within;
use crate::cut::params::CutParams;
use crate::geometry::{Point, TriMesh, VertexId};
use std::ops::RangeInclusive;

/// A boundary loop. Length in metres, area in m².
pub(in crate::cut) struct BoundaryLoop {
    pub(in crate::cut) ring: Vec<VertexId>,
    pub(in crate::cut) length: f64,
    pub(in crate::cut) area: f64,
    /// Share of its vertices on the cut; the others were on a boundary of the scan.
    pub(in crate::cut) cut_share: f64,
    /// Whether the user erased the surface within.
    pub(in crate::cut) erased: bool,
}

impl BoundaryLoop {
    /// Measures one loop.
    pub(in crate::cut) fn of(mesh: &TriMesh, on_cut: &[bool], ring: Vec<VertexId>) -> Self {
        let points: Vec<Point> = ring.iter().map(|&v| mesh.points()[v]).collect();
        let next = |i: usize| points[(i + 1) % points.len()];
        let length = (0..points.len()).map(|i| (next(i) - points[i]).norm()).sum();
        let cut = ring.iter().filter(|v| on_cut[v.index()]).count();
        Self {
            length,
            area: area_within(&points),
            cut_share: cut as f64 / ring.len().max(1) as f64,
            erased: false,
            ring,
        }
    }

    /// Whether it was a boundary of the scan. A tenth: two loops may share a vertex or two.
    pub(in crate::cut) fn is_hole_of_scan(&self) -> bool {
        self.cut_share < 0.1
    }
}

/// All boundary loops of a garment, longest first.
pub(in crate::cut) struct BoundaryLoops(pub(in crate::cut) Vec<BoundaryLoop>);

impl BoundaryLoops {
    pub(in crate::cut) fn of(garment: &Faired, across: &AcrossCut) -> Self {
        let mut loops: Vec<BoundaryLoop> = garment
            .adjacency
            .boundary_loops()
            .into_iter()
            .map(|ring| BoundaryLoop::of(&garment.mesh, &garment.on_cut, ring))
            .collect();
        // A band erased all around a sleeve has two loops, which are hems; a hole has one.
        let within: Vec<Option<u32>> = loops.iter().map(|one| across.erased_within(&one.ring)).collect();
        for (i, one) in loops.iter_mut().enumerate() {
            one.erased = within[i].is_some() && within.iter().filter(|&&other| other == within[i]).count() == 1;
        }
        loops.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.ring[0].cmp(&b.ring[0])));
        Self(loops)
    }

    /// The hems, longest first. Reports holes and an unexpected number of hems.
    pub(in crate::cut) fn classified(
        self,
        expected: &RangeInclusive<usize>,
        params: &CutParams,
        findings: &mut Vec<String>,
    ) -> Vec<Vec<VertexId>> {
        let (mut hems, holes): (Vec<BoundaryLoop>, Vec<BoundaryLoop>) =
            self.0.into_iter().partition(|one| !one.is_hole_of_scan() && !one.erased);
        let mut holes = holes.into_iter().peekable();
        // A garment may end where the scan ends, or where the user erased it: missing hems are taken from the largest holes.
        while hems.len() < *expected.start()
            && let Some(hole) = holes.next_if(|hole| hole.area > params.greatest_filled_hole)
        {
            hems.push(hole);
        }
        let (erased, of_scan): (Vec<BoundaryLoop>, Vec<BoundaryLoop>) = holes.partition(|one| one.erased);
        for (holes, which) in [(of_scan, "of the scan left open"), (erased, "made by hand")] {
            if !holes.is_empty() {
                let largest = holes.iter().map(|h| h.area).fold(0.0, f64::max);
                let (plural, size) = if holes.len() == 1 { ("hole", "") } else { ("holes", "the largest ") };
                findings.push(format!("{} {plural} {which}, {size}{:.0} cm²", holes.len(), largest * 1e4));
            }
        }
        if !expected.contains(&hems.len()) {
            let (least, most) = (expected.start(), expected.end());
            let wanted = match most.saturating_sub(*least) {
                0 => format!("{most}"),
                1 => format!("{least} or {most}"),
                _ => format!("{least} to {most}"),
            };
            let plural = if hems.len() == 1 { "hem" } else { "hems" };
            findings.push(format!("{} {plural} found, {wanted} expected", hems.len()));
        }
        hems.sort_by(|a, b| b.length.total_cmp(&a.length).then(a.ring[0].cmp(&b.ring[0])));
        hems.into_iter().map(|one| one.ring).collect()
    }
}
