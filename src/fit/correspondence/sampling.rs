//! Sample points spread evenly over a surface.

use crate::geometry::{PerVertex, VertexId};

/// About `count` vertices spread evenly over `areas`, in index order, each with the area that it represents.
///
/// Error diffusion over the index order: no random numbers, so the same mesh gives the same samples.
pub(crate) fn spread(areas: &PerVertex<f64>, count: usize) -> Vec<(VertexId, f64)> {
    let total: f64 = areas.iter().sum();
    if count == 0 || total <= 0.0 {
        return Vec::new();
    }
    let step = total / count as f64;
    let mut owed = step * 0.5;
    let mut out = Vec::with_capacity(count + 1);
    for (v, &a) in areas.enumerate() {
        owed += a;
        if owed >= step {
            out.push((v, owed.min(4.0 * step)));
            owed = 0.0;
        }
    }
    out
}
