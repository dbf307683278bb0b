//! Fillings of a scan's holes that are kept for the next cut of the same scan.

use super::error::CutError;
use super::fill_holes::filling;
use super::patch::Patch;
use crate::geometry::{Adjacency, Point, TriMesh, VertexId};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A patch over a ring, and its new points faired.
pub(super) type Fair = (Patch, Vec<Point>);
/// A ring, and the greatest number of its points.
type Ring = (Vec<VertexId>, usize);

/// The fillings of a scan's holes so far: they do not depend on labels, so a scan that is cut again has the same.
#[derive(Default)]
pub struct Fillings(Mutex<HashMap<Ring, Option<Arc<Fair>>>>);

impl Fillings {
    pub(super) fn of(
        &self,
        mesh: &TriMesh,
        adjacency: &Adjacency,
        ring: &[VertexId],
        longest: usize,
    ) -> Result<Option<Arc<Fair>>, CutError> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (ring.to_vec(), longest);
        if let Some(found) = kept().get(&key) {
            return Ok(found.clone());
        }
        let found = filling(mesh, adjacency, ring, longest)?.map(Arc::new);
        kept().insert(key, found.clone());
        Ok(found)
    }
}
