//! Fins and touching sheets: faces that make an edge belong to more than two.

use super::{FaceId, PerFace, TriMesh, VertexId};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Which faces to keep so that every edge belongs to at most two, one on each side of it.
///
/// Of the faces that share a side of an edge those go first that hang on fewest neighbours (a fin), then the smallest. In a
/// manifold, consistently oriented mesh all faces stay.
///
/// **Shapes** one flag per face.
pub fn manifold_part(mesh: &TriMesh) -> PerFace<bool> {
    let mut all: Vec<Side> = mesh.face_ids().flat_map(|f| sides(mesh, f)).collect();
    all.par_sort_unstable();
    if all.windows(2).all(|two| two[0] != two[1]) {
        return PerFace::filled(true, mesh.face_count());
    }
    let mut work = Work::of(mesh);
    while let Some(side) = work.crowded.first().copied() {
        let rank = |f: FaceId| (work.neighbour_count(f), mesh.face_area(f));
        let worst = work.faces_of[&side].iter().copied().min_by(|&a, &b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        match worst {
            Some(face) => work.remove(face),
            None => break,
        }
    }
    work.keep
}

/// An edge as one face walks it.
type Side = [VertexId; 2];

struct Work<'a> {
    mesh: &'a TriMesh,
    keep: PerFace<bool>,
    faces_of: BTreeMap<Side, Vec<FaceId>>,
    /// The sides that more than one face has.
    crowded: BTreeSet<Side>,
}

impl<'a> Work<'a> {
    fn of(mesh: &'a TriMesh) -> Self {
        let mut faces_of: BTreeMap<Side, Vec<FaceId>> = BTreeMap::new();
        for f in mesh.face_ids() {
            sides(mesh, f).into_iter().for_each(|side| faces_of.entry(side).or_default().push(f));
        }
        let crowded = faces_of.iter().filter(|of| of.1.len() > 1).map(|of| *of.0).collect();
        Self { mesh, keep: PerFace::filled(true, mesh.face_count()), faces_of, crowded }
    }

    /// The number of edges of a face beyond which another one lies.
    fn neighbour_count(&self, f: FaceId) -> usize {
        let is_shared = |[a, b]: &Side| self.faces_of.get(&[*b, *a]).is_some_and(|others| !others.is_empty());
        sides(self.mesh, f).iter().filter(|side| is_shared(side)).count()
    }

    fn remove(&mut self, f: FaceId) {
        self.keep[f] = false;
        for side in sides(self.mesh, f) {
            if let Some(faces) = self.faces_of.get_mut(&side) {
                faces.retain(|&of| of != f);
                if faces.len() < 2 {
                    self.crowded.remove(&side);
                }
            }
        }
    }
}

fn sides(mesh: &TriMesh, f: FaceId) -> [Side; 3] {
    let [a, b, c] = mesh.faces()[f];
    [[a, b], [b, c], [c, a]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, noise, sphere};

    fn is_manifold(mesh: &TriMesh) -> bool {
        let mut seen = BTreeSet::new();
        mesh.face_ids().flat_map(|f| sides(mesh, f)).all(|side| seen.insert(side))
    }

    /// A sphere with further faces, and how many faces it had.
    fn with_faces(added: impl IntoIterator<Item = [u32; 3]>, points: &[Point]) -> (TriMesh, usize) {
        let round = sphere(12, 24);
        let mut all = round.points().0.clone();
        all.extend_from_slice(points);
        let mut faces = round.faces().0.clone();
        faces.extend(added.into_iter().map(|f| f.map(VertexId)));
        (TriMesh::try_new(all, faces).unwrap(), round.face_count())
    }

    #[test]
    fn a_manifold_mesh_stays_as_it_is() {
        let (round, _) = with_faces([], &[]);
        assert!(manifold_part(&round).iter().all(|&kept| kept));
    }

    #[test]
    fn fins_go_and_the_surface_stays() {
        let round = sphere(12, 24);
        let outside = round.vertex_count() as u32;
        for f in [5, 100, 333] {
            let [a, b, _] = round.faces().0[f].map(|v| v.0);
            for fin in [[a, b, outside], [b, a, outside]] {
                let (mesh, own) = with_faces([fin], &[Point::new(0.0, 5.0, 0.0)]);
                let kept = manifold_part(&mesh);
                assert!((0..mesh.face_count()).all(|f| kept.0[f] == (f < own)), "{fin:?}");
            }
        }
    }

    #[test]
    fn whatever_is_added_the_rest_is_manifold_and_mostly_stays() {
        for seed in 0..20u64 {
            let round = sphere(12, 24);
            let mut noise = noise(seed);
            let mut pick = || (noise().abs() * round.vertex_count() as f64) as u32;
            let added: Vec<[u32; 3]> =
                (0..30).map(|_| [pick(), pick(), pick()]).filter(|[a, b, c]| a != b && b != c && c != a).collect();
            let (mesh, own) = with_faces(added, &[]);
            let kept = manifold_part(&mesh);
            let (part, _) = mesh.part(&kept);
            assert!(is_manifold(&part));
            assert!((0..own).filter(|&f| kept.0[f]).count() > own - 20, "{seed}");
        }
    }
}
