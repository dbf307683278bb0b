//! The hair of the person, known from the bare scan.

use crate::body::Figure;
use crate::fit::{Cover, FittedBody};
use crate::geometry::{NearestVertex, PerVertex};
use crate::segment::Placement;
use crate::session::error::SessionError;
use crate::session::store::{Kept, Store};

/// Where hair covers the body of a figure.
///
/// **Shapes** one flag per vertex of the body.
pub(in crate::session::pipeline) struct KnownHair(pub PerVertex<bool>);

impl KnownHair {
    /// That of the bare scan; `None` if it shows no hair, or if the hair is part of the body.
    pub fn load(
        store: &Store,
        fitted: Option<Kept<FittedBody>>,
        figure: &Figure,
    ) -> Result<Option<Self>, SessionError> {
        let Some(fitted) = fitted else { return Ok(None) };
        let fitted = store.load_shared(fitted)?;
        let Some(hair) = &fitted.hair else { return Ok(None) };
        let body = &figure.body().mesh;
        if hair.covers.len() == body.vertex_count() {
            return Ok(Some(Self(hair.covers.clone())));
        }
        // The body's surface is the scan itself.
        let model = NearestVertex::prepare(fitted.surface.points().as_slice());
        let covered = |p| model.nearest(p).is_some_and(|(v, _)| hair.covers[v]);
        Ok(Some(Self(body.points().iter().map(covered).collect())))
    }

    /// The cover of each vertex of the body with the hair: it stands off like wide cloth.
    ///
    /// **Shapes** `by_garments` and the result: one entry per vertex of the body.
    pub fn over(&self, by_garments: PerVertex<Cover>) -> PerVertex<Cover> {
        let with_hair = |(cover, &covered): (&Cover, &bool)| if covered { Cover::Loose } else { *cover };
        by_garments.iter().zip(self.0.iter()).map(with_hair).collect()
    }

    /// The hair as a part of the scan to be labelled.
    pub fn placement(&self, figure: &Figure) -> Placement {
        Placement::of_covered(&figure.body().mesh, self.0.clone())
    }
}
