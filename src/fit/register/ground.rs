//! The ground, which holds up the soles that no scanner sees.

use super::targets::TargetPoint;
use crate::body::{BodyModel, HumanJoint, JointId, Side};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::Scan;

/// The ground below a standing person: no scanner sees the soles.
pub(crate) struct Ground {
    height: f64,
    pub(crate) is_foot: PerVertex<bool>,
}

impl Ground {
    pub(crate) fn under(scan: &Scan, model: &BodyModel) -> Self {
        // The lowest observed point: at most a few millimetres too high, at the edge of a sole. A stray point below is harmless.
        let height = scan.mesh.bounds().map_or(0.0, |b| b.min.y);
        let skeleton = &model.skeleton;
        let feet = Side::BOTH.map(|side| skeleton.find(HumanJoint::Foot(side)));
        let is_foot = |j: JointId| feet.iter().flatten().any(|&foot| skeleton.is_below(j, foot));
        let of_foot = model.weights.rows().iter().map(|row| is_foot(row[0].0)).collect();
        Self { height, is_foot: of_foot }
    }

    /// Gives soles below the ground that have no target one on the ground.
    pub(crate) fn hold_soles(&self, mesh: &TriMesh, targets: &mut [TargetPoint]) {
        /// Deeper soles belong to feet that the scan cuts off, whose ground is unknown. Metres.
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
