//! The ground that a person stands on.

use super::targets::Target;
use crate::body::{BodyModel, JointId};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::Scan;

/// What a standing person stands on: soles are what no scanner sees.
pub(crate) struct Ground {
    height: f64,
    pub(crate) is_foot: PerVertex<bool>,
}

impl Ground {
    pub(crate) fn under(scan: &Scan, model: &BodyModel) -> Self {
        // The lowest that was seen: at most a few millimetres of a sole's edge too high. A stray point below it holds less.
        let height = scan.mesh.bounds().map_or(0.0, |b| b.min.y);
        let skeleton = &model.skeleton;
        let feet = ["leftFoot", "rightFoot"].map(|name| skeleton.find_name(name));
        let is_foot = |j: JointId| feet.iter().flatten().any(|&foot| skeleton.is_below(j, foot));
        let of_foot = model.weights.rows().iter().map(|row| is_foot(row[0].0)).collect();
        Self { height, is_foot: of_foot }
    }

    /// Draws soles that have sunk below the ground and match nothing up to it.
    pub(crate) fn hold_soles(&self, mesh: &TriMesh, targets: &mut [Target]) {
        /// Soles further down belong to feet that the scan cuts off: nothing is known of their ground. Metres.
        const DEEPEST: f64 = 0.03;
        for (v, p) in mesh.points().enumerate() {
            let depth = self.height - p.y;
            if self.is_foot[v] && (0.0..DEEPEST).contains(&depth) {
                let on_ground = Point::new(p.x, self.height, p.z);
                targets[v.index()].get_or_insert((on_ground, 1.0));
            }
        }
    }
}
