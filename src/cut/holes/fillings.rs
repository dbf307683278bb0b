//! Fillings of holes, which are kept for the next cut of the same scan.

use super::patch::Patch;
use super::thin_plate::ThinPlate;
use crate::cut::error::CutError;
use crate::geometry::{Adjacency, Point, TriMesh, Vec3, VertexId};
use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

/// A patch over a ring, and its new points faired.
pub(in crate::cut) type Fair = (Patch, Vec<Point>);
/// A ring, and the greatest number of its points.
type Ring = (Vec<VertexId>, usize);

/// The fillings of a scan's holes so far: they do not depend on labels, so a scan that is cut again has the same.
#[derive(Default)]
pub struct Fillings(Mutex<HashMap<Ring, Option<Arc<Fair>>>>);

impl Fillings {
    pub(in crate::cut) fn of(
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

/// A patch over a ring, and its new points faired; `None` if the ring cannot be filled.
pub(in crate::cut) fn filling(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    ring: &[VertexId],
    longest: usize,
) -> Result<Option<Fair>, CutError> {
    let around: Vec<Point> = ring.iter().map(|&v| mesh.points()[v]).collect();
    let taken = |i: usize, j: usize| {
        let apart = i.abs_diff(j);
        apart > 1 && apart < ring.len() - 1 && adjacency.neighbours_of(ring[i]).contains(&ring[j])
    };
    let Some(patch) = Patch::over(&around, longest, taken) else { return Ok(None) };
    let inner = faired(mesh, adjacency, ring, &patch)?;
    Ok(Some((patch, inner)))
}

/// The new points of a patch, continuing the surface around it: a thin plate, `min Σ |x − weighted mean of neighbours|²`
/// over the patch and its ring.
fn faired(mesh: &TriMesh, adjacency: &Adjacency, ring: &[VertexId], patch: &Patch) -> Result<Vec<Point>, CutError> {
    let (count, new) = (ring.len(), patch.points.len() - ring.len());
    if new == 0 {
        return Ok(Vec::new());
    }
    let mut joined: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); patch.points.len()];
    for face in &patch.faces {
        for k in 0..3 {
            joined[face[k]].insert(face[(k + 1) % 3]);
            joined[face[(k + 1) % 3]].insert(face[k]);
        }
    }
    let mut plate = ThinPlate::new(new);
    for (i, at) in patch.points.iter().enumerate() {
        // The row: x_i − mean of its neighbours; known points go to the right-hand side.
        let outside: Vec<VertexId> = match ring.get(i) {
            Some(&v) => adjacency.neighbours_of(v).iter().copied().filter(|w| !ring.contains(w)).collect(),
            None => Vec::new(),
        };
        // Weights 1 / length: a slope is not a bend even if the edges to one side are longer.
        let weight = |p: &Point| 1.0 / (p - at).norm().max(1e-6);
        let over: Vec<(usize, f64)> = joined[i].iter().map(|&j| (j, weight(&patch.points[j]))).collect();
        let fixed: Vec<(Point, f64)> = outside.iter().map(|&w| mesh.points()[w]).map(|p| (p, weight(&p))).collect();
        let total: f64 = over.iter().map(|n| n.1).chain(fixed.iter().map(|n| n.1)).sum();
        let mut known: Vec3 = fixed.iter().map(|(p, w)| p.coords * (-w / total)).sum();
        let mut row: Vec<(usize, f64)> = Vec::new();
        for (j, factor) in over.iter().map(|&(j, w)| (j, -w / total)).chain([(i, 1.0)]) {
            match j.checked_sub(count) {
                Some(unknown) => row.push((unknown, factor)),
                None => known += patch.points[j].coords * factor,
            }
        }
        plate.add(&row, known);
    }
    Ok(plate.solved()?)
}
