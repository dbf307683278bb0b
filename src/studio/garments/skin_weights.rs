//! Skin weights of a sewn garment.

use super::dress_form::DressForm;
use super::kind::GarmentKind;
use crate::body::{HumanJoint, JointId, Limb, Side, SkinWeights};
use crate::geometry::{Adjacency, TriMesh};

/// The weights of the nearest skin, smoothed over the cloth; tubes around both legs follow the hips.
///
/// **Shapes** one row per vertex of `sewn`.
pub(super) fn skin_weights(kind: GarmentKind, sewn: &TriMesh, form: &DressForm) -> SkinWeights {
    /// Rounds of averaging with the neighbours: about 8 cm.
    const ROUNDS: usize = 25;
    let joint_count = form.subject.skeleton.len();
    if kind == GarmentKind::Skirt {
        return SkinWeights::from_rows(sewn.points().iter().map(|_| vec![(JointId(0), 1.0)]));
    }
    let hips = form.joint(HumanJoint::UpperLeg(Side::Left)).y + 0.03;
    let mut rows: Vec<Vec<f64>> = sewn
        .points()
        .iter()
        .map(|p| {
            let mut dense = vec![0.0; joint_count];
            let nearest = form.nearest_vertex(p);
            let part = form.part(nearest);
            if kind.bridges_legs() && p.y < hips && !matches!(part.limb(), Limb::Arm(_)) {
                dense[0] = 1.0;
                return dense;
            }
            for &(j, w) in &form.subject.weights.rows()[nearest] {
                dense[j.index()] += w;
            }
            dense
        })
        .collect();
    let adjacency = Adjacency::prepare(sewn);
    for _ in 0..ROUNDS {
        rows = sewn
            .vertex_ids()
            .map(|v| {
                let around = adjacency.neighbours_of(v);
                let share = 0.5 / around.len().max(1) as f64;
                (0..joint_count)
                    .map(|j| 0.5 * rows[v.index()][j] + share * around.iter().map(|n| rows[n.index()][j]).sum::<f64>())
                    .collect()
            })
            .collect();
    }
    SkinWeights::from_rows(
        rows.into_iter().map(|row| row.into_iter().enumerate().map(|(j, w)| (JointId(j as u16), w)).collect()),
    )
}
