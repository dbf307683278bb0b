//! The garments that a scan shows for the first time: one, or those of an outfit.

use crate::body::Figure;
use crate::fit::Cover;
use crate::geometry::PerVertex;
use crate::segment::SegmentError;
use crate::session::recipe::{Garment, GarmentSpec};
use serde::Serialize;

/// The garments that a scan shows for the first time.
#[derive(Clone, Serialize)]
pub(in crate::session) struct NewGarments {
    /// Innermost first.
    pub kinds: Vec<GarmentSpec>,
    /// Whether they are those of an outfit, which may also be of one garment.
    pub is_outfit: bool,
}

impl NewGarments {
    pub fn alone(garment: &Garment) -> Self {
        Self { kinds: vec![garment.kind.clone()], is_outfit: false }
    }

    pub fn of_outfit(garments: &[Garment]) -> Self {
        Self { kinds: garments.iter().map(|garment| garment.kind.clone()).collect(), is_outfit: true }
    }

    /// Whether this is the hair of the bare scan.
    pub fn are_hair(&self) -> bool {
        self.kinds.iter().any(|spec| spec.template.grows)
    }

    /// How they cover the body together: a place is loose if it is so in one of them. What hair covers is known otherwise.
    ///
    /// **Shapes** one entry per vertex of the body.
    ///
    /// **Errors** if a template was painted on another body.
    pub fn cover(&self, figure: &Figure) -> Result<PerVertex<Cover>, SegmentError> {
        let mut covered = PerVertex::filled(Cover::Bare, figure.body().mesh.vertex_count());
        for spec in self.kinds.iter().filter(|spec| !spec.template.grows) {
            let new = spec.template.cover(figure.body(), &figure.skeleton, &spec.extent)?;
            covered = covered.iter().zip(new.iter()).map(|(a, b)| looser(*a, *b)).collect();
        }
        Ok(covered)
    }
}

/// The cover of a place that two garments cover.
pub(in crate::session::pipeline) fn looser(a: Cover, b: Cover) -> Cover {
    match (a, b) {
        (Cover::Loose, _) | (_, Cover::Loose) => Cover::Loose,
        (Cover::Tight, _) | (_, Cover::Tight) => Cover::Tight,
        _ => Cover::Bare,
    }
}
