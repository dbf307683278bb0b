//! Levenberg–Marquardt on the energy of a pose and shape.

use super::energy::{Energy, Equations, Stage};
use crate::body::Pose;

/// A place of the minimisation.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub pose: Pose,
    pub shape: Vec<f64>,
    pub cost: f64,
    pub flipped: usize,
}

/// Levenberg–Marquardt from a solution; never to a worse one.
pub(super) fn minimized(energy: &Energy<'_>, from: Solution, stage: Stage, steps: usize) -> Solution {
    /// Relative decrease of the cost below which it is done.
    const STILL: f64 = 1e-7;
    let mut at = from;
    let mut equations = energy.equations(&at.pose, &at.shape, stage);
    let mut damping = 1e-3;
    for _ in 0..steps {
        let Some(step) = solved(energy, &equations, damping, stage) else { break };
        let (pose, shape) = energy.rig.stepped(&at.pose, &at.shape, &step);
        let next = energy.equations(&pose, &shape, stage);
        if next.cost < equations.cost {
            let is_still = equations.cost - next.cost < STILL * equations.cost;
            (at.pose, at.shape, equations) = (pose, shape, next);
            damping = (damping * 0.3).max(1e-9);
            if is_still {
                break;
            }
        } else {
            damping *= 6.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    at.cost = equations.cost;
    at
}

fn solved(energy: &Energy<'_>, equations: &Equations, damping: f64, stage: Stage) -> Option<Vec<f64>> {
    let free = if stage.only_root { 6 } else { energy.rig.unknowns() };
    let mut matrix = equations.matrix.view((0, 0), (free, free)).into_owned();
    for k in 0..free {
        matrix[(k, k)] += damping * matrix[(k, k)].max(1e-6);
    }
    let step = matrix.cholesky()?.solve(&(-equations.gradient.rows(0, free)));
    let mut whole = vec![0.0; energy.rig.unknowns()];
    whole[..free].copy_from_slice(step.as_slice());
    Some(whole)
}
