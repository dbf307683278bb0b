//! Realigns all frames to their common surface.

use super::align::{SETTLING, align};
use super::raycast::Reach;
use super::track::{Placed, SegmentedFrame, predicted};
use super::volume::Volume;
use rayon::prelude::*;

/// Averages all posed frames into an empty volume, in order.
pub(super) fn integrated(cuts: &[SegmentedFrame], placed: &[Placed], mut volume: Volume) -> Volume {
    for p in placed {
        volume.integrate(&cuts[p.cut].view, &p.pose);
    }
    volume
}

/// Realigns each frame to the surface of the same volume. Returns the largest move, in metres at the person.
///
/// The first frame moves like all others; the caller holds the frame of reference.
pub(super) fn settle(cuts: &[SegmentedFrame], placed: &mut [Placed], volume: &Volume) -> f64 {
    let found: Vec<_> = placed
        .par_iter()
        .map(|p| {
            let view = &cuts[p.cut].view;
            align(view, &predicted(view, volume, &p.pose, Reach::Near), &p.pose, &SETTLING)
        })
        .collect();
    let mut most: f64 = 0.0;
    for (p, found) in placed.iter_mut().zip(found).filter(|(_, f)| f.overlap > 0.0) {
        let moved = (found.model_from_camera * p.pose.inverse()) * found.center - found.center;
        most = most.max(moved.norm());
        p.pose = found.model_from_camera;
        p.residual = found.residual;
    }
    most
}
