//! Laws of retargeting on rigs of other makes, and bad clips.

mod bad_clips;
mod feet;
mod floor;
mod pose_clips;
mod recognition;
mod retargeting;
pub(super) mod rigs;

use crate::body::{Figure, embedded_model};
use std::sync::OnceLock;

/// The mean body, without clothes.
pub(super) fn figure() -> &'static Figure {
    static FIGURE: OnceLock<Figure> = OnceLock::new();
    FIGURE.get_or_init(|| {
        let model = embedded_model().unwrap();
        let (mesh, skeleton) = model.shaped(&model.mean_shape());
        Figure::bare(skeleton, mesh, model.weights.clone())
    })
}
