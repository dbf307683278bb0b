//! What earlier cuts of a scan leave for the next one, of which a stroke changes little. No result depends on it.

use super::along_body::BodyIndex;
use super::fillings::Fillings;
use crate::cut::body_below::BodyBelow;
use crate::cut::color_evidence::ColorEvidence;
use crate::geometry::{Adjacency, MeshError, NearestVertex, PerVertex, Point, TriMesh, Vec3, VertexId, manifold_part};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// What is kept of the cuts of one scan.
#[derive(Default)]
pub struct EarlierCuts {
    pub(in crate::cut) fillings: Fillings,
    without_fins: OnceLock<Option<(TriMesh, Adjacency)>>,
    body: Mutex<Option<Arc<BodyIndex>>>,
    surface: Mutex<Option<Arc<FilledSurface>>>,
}

/// A scan's surface without its small holes.
pub(in crate::cut) struct FilledSurface {
    pub(in crate::cut) mesh: TriMesh,
    pub(in crate::cut) adjacency: Adjacency,
    pub(in crate::cut) normals: PerVertex<Vec3>,
    pub(in crate::cut) vertices: NearestVertex,
    colors_said: Mutex<HashMap<usize, Arc<ColorEvidence>>>,
}

/// Locks, also after a panic of another thread: what is protected is replaced as a whole.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl EarlierCuts {
    /// The body, prepared for queries.
    pub(in crate::cut) fn body(&self, body: &BodyBelow) -> Arc<BodyIndex> {
        let mut kept = locked(&self.body);
        match kept.as_ref().filter(|kept| kept.is_of(body)) {
            Some(kept) => kept.clone(),
            None => kept.insert(Arc::new(BodyIndex::prepare(body))).clone(),
        }
    }

    /// The scan without faces at edges of more than two, and its adjacency; `None` if it has no such edge. All vertices stay.
    ///
    /// A hole beside a fin has its border in two loops, of which one is no hole.
    pub(in crate::cut) fn without_fins(&self, scan: &TriMesh) -> Option<&(TriMesh, Adjacency)> {
        let found = self.without_fins.get_or_init(|| {
            let keep = manifold_part(scan);
            if keep.iter().all(|&kept| kept) {
                return None;
            }
            let faces: Vec<[VertexId; 3]> =
                scan.faces().enumerate().filter(|(f, _)| keep[*f]).map(|(_, face)| *face).collect();
            let mesh = TriMesh::try_new(scan.points().0.clone(), faces).expect("faces of a mesh over its points");
            let adjacency = Adjacency::prepare(&mesh);
            Some((mesh, adjacency))
        });
        found.as_ref()
    }

    /// The surface of these points and faces.
    ///
    /// **Errors** if they are no mesh.
    pub(in crate::cut) fn surface(
        &self,
        points: Vec<Point>,
        faces: Vec<[VertexId; 3]>,
    ) -> Result<Arc<FilledSurface>, MeshError> {
        let mut kept = locked(&self.surface);
        let is_of = |kept: &&Arc<FilledSurface>| kept.mesh.points().0 == points && kept.mesh.faces().0 == faces;
        match kept.as_ref().filter(is_of) {
            Some(kept) => Ok(kept.clone()),
            None => Ok(kept.insert(Arc::new(FilledSurface::prepare(TriMesh::try_new(points, faces)?))).clone()),
        }
    }
}

impl FilledSurface {
    pub(in crate::cut) fn prepare(mesh: TriMesh) -> Self {
        let around = || (mesh.vertex_normals(), NearestVertex::prepare(mesh.points().as_slice()));
        let (adjacency, (normals, vertices)) = rayon::join(|| Adjacency::prepare(&mesh), around);
        Self { mesh, adjacency, normals, vertices, colors_said: Mutex::default() }
    }

    /// What the colours say in a round of the search for edges; `now` is given what they said in that round of the last cut.
    pub(in crate::cut) fn colors_say(
        &self,
        round: usize,
        now: impl FnOnce(Option<&ColorEvidence>) -> ColorEvidence,
    ) -> Arc<ColorEvidence> {
        let before = locked(&self.colors_said).get(&round).cloned();
        let found = Arc::new(now(before.as_deref()));
        locked(&self.colors_said).insert(round, found.clone());
        found
    }
}
