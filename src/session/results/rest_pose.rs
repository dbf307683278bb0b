//! The figure with the bind pose that a file must have.

use super::export_character::hash_of;
use super::outputs::Outputs;
use crate::body::{Figure, Pose};
use crate::cloth::{ClothError, carried};
use crate::geometry::TriMesh;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::stack::{StackParams, reposed, reposed_as};
use std::path::Path;

impl Session {
    /// The figure with that bind pose, its layers clear of each other there: pushed clear, which is fast; where that leaves
    /// crossings, moved there with its cloth simulated. `path` is for messages.
    pub(super) fn in_rest_pose(
        &self,
        figure: &Figure,
        rest: &Pose,
        path: &Path,
        outputs: &mut Outputs,
    ) -> Result<Figure, SessionError> {
        /// Of the computation: another one computes kept surfaces anew.
        const VERSION: u32 = 1;
        let failed = |e| SessionError::bad_source(path, e);
        let layers: Vec<_> = figure.layers.iter().map(|l| (&l.mesh, &l.weights, &l.physics, &l.fabric)).collect();
        let inputs = hash_of(&(VERSION, &figure.skeleton, rest, layers))?;
        let derived = self.store.derived();
        // The T-pose and the A-pose are kept beside each other.
        let kept = format!("rest-pose.{:.8}", hash_of(rest)?.to_string());
        let found = match derived.load::<Vec<TriMesh>>(&kept, inputs) {
            Some(carried) => reposed_as(figure, rest, carried).map_err(failed)?,
            None => {
                let pushed = reposed(figure, rest, &StackParams::default()).map_err(failed)?;
                let carried = if pushed.crossing_pairs > 0 { carried(figure, rest) } else { return Ok(pushed.figure) };
                match carried {
                    Ok(carried) => {
                        derived.keep(&kept, inputs, &carried);
                        reposed_as(figure, rest, carried).map_err(failed)?
                    }
                    // They cross in the bind pose already.
                    Err(ClothError::Crossing { .. }) => pushed,
                    Err(other) => return Err(SessionError::bad_source(path, other)),
                }
            }
        };
        if found.crossing_pairs > 0 {
            let pairs = found.crossing_pairs;
            outputs.notice(format!("{pairs} pairs of faces cross in the file's bind pose"));
        }
        Ok(found.figure)
    }
}
