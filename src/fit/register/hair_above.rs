//! Hair over the body: the head below it is not observed, but is below it.

use super::targets::TargetPoint;
use crate::body::BodyModel;
use crate::fit::correspondence::ScanSurface;
use crate::fit::naked::Hair;
use crate::geometry::{PerVertex, TriMesh};
use crate::scan::Scan;

/// The surface of the hair in the naked scan.
pub(crate) struct HairAbove {
    surface: ScanSurface,
    /// Vertices of the model that were outside the hair once: they are held until they are well below.
    held: PerVertex<bool>,
}

/// Least depth of the body below the surface of the hair, in metres.
const DEPTH: f64 = 0.002;

impl HairAbove {
    /// `scan` is the naked scan with its hair.
    pub(crate) fn prepare(hair: &Hair, scan: &Scan, model: &BodyModel) -> Self {
        let held = PerVertex::filled(false, model.template.vertex_count());
        Self { surface: ScanSurface::prepare(&hair.part_of(scan)), held }
    }

    /// Gives vertices without a target that are outside the hair one below it.
    pub(crate) fn hold_below(&mut self, mesh: &TriMesh, targets: &mut [TargetPoint]) {
        /// Hair that is farther off is that of another place, metres.
        const REACH: f64 = 0.03;
        /// Normals with a smaller cosine belong to another side of the hair.
        const LEAST_COSINE: f64 = 0.3;
        let normals = mesh.vertex_normals();
        for (v, p) in mesh.points().enumerate() {
            if targets[v.index()].is_some() {
                continue;
            }
            let hit = self.surface.nearest(p, REACH).filter(|hit| !hit.at_rim);
            let Some(hit) = hit.filter(|hit| hit.normal.dot(&normals[v]) > LEAST_COSINE) else { continue };
            let depth = hit.normal.dot(&(hit.point - p));
            self.held[v] = if self.held[v] { depth < 3.0 * DEPTH } else { depth < DEPTH };
            if self.held[v] {
                targets[v.index()] = Some((p + hit.normal * (depth - DEPTH), 1.0));
            }
        }
    }
}
