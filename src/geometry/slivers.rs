//! Slivers: triangles so flat that their normals mean nothing. They are collapsed, or their longest edges flipped.

use super::{PerVertex, Point, TriMesh, Vec3, VertexId};

/// Rounds over what is left: each removes most of it.
const ROUNDS: usize = 8;
/// A triangle is a needle, which is collapsed along its shortest edge, if that is shorter than this many times its height; else a cap,
/// whose longest edge is flipped.
const NEEDLE: f64 = 2.0;
/// Cosine of the greatest turn of a triangle that is no sliver: 45°.
const LEAST_COSINE: f64 = 0.7;

/// A mesh without slivers.
pub struct WithoutSlivers {
    /// The mesh.
    pub mesh: TriMesh,
    /// Per vertex of the mesh the one that it was.
    pub was: PerVertex<VertexId>,
    /// Per vertex before the one that it is now; `None` if no face has it.
    pub is: PerVertex<Option<VertexId>>,
}

/// The mesh without most of the triangles of which a height is below `least_height`: needles are collapsed, the longest edges of caps are
/// flipped. Borders and everything else keep their topology, and triangles that are no slivers turn by 45° at most; where that
/// is impossible a sliver stays.
///
/// **Requires** a manifold mesh, with or without borders.
pub fn without_slivers(mesh: &TriMesh, least_height: f64) -> WithoutSlivers {
    let mut work = Work::of(mesh, least_height);
    for _ in 0..ROUNDS {
        if !work.round() {
            break;
        }
    }
    work.into_mesh(mesh)
}

/// The mesh while it changes.
struct Work {
    points: Vec<Point>,
    /// The vertices of each face; `None` if it is gone.
    faces: Vec<Option<[u32; 3]>>,
    /// The faces of each vertex, in no order.
    around: Vec<Vec<u32>>,
    /// Into which vertex each one was collapsed; itself if it was not.
    into: Vec<u32>,
    least_height: f64,
}

impl Work {
    fn of(mesh: &TriMesh, least_height: f64) -> Self {
        let faces: Vec<Option<[u32; 3]>> = mesh.faces().iter().map(|f| Some(f.map(|v| v.0))).collect();
        let mut around = vec![Vec::new(); mesh.vertex_count()];
        for (k, face) in faces.iter().flatten().enumerate() {
            face.iter().for_each(|&v| around[v as usize].push(k as u32));
        }
        let into = (0..mesh.vertex_count() as u32).collect();
        Self { points: mesh.points().0.clone(), faces, around, into, least_height }
    }

    /// Treats each sliver once; returns whether anything changed.
    fn round(&mut self) -> bool {
        let mut changed = false;
        for k in 0..self.faces.len() {
            let Some(face) = self.faces[k] else { continue };
            let corners = self.corners(&face);
            let height = least_height(&corners);
            if height >= self.least_height {
                continue;
            }
            let length = |e: usize| (corners[(e + 1) % 3] - corners[e]).norm();
            let mut edges = [0, 1, 2];
            edges.sort_by(|&a, &b| length(a).total_cmp(&length(b)));
            let edge = |e: usize| [face[e], face[(e + 1) % 3]];
            let is_needle = length(edges[0]) < NEEDLE * height.max(1e-12) || length(edges[0]) < self.least_height;
            changed |= (is_needle && self.collapse(edge(edges[0])))
                || self.flip(k as u32, edge(edges[2]))
                || (!is_needle && length(edges[0]) < 2.0 * self.least_height && self.collapse(edge(edges[0])));
        }
        changed
    }

    fn corners(&self, face: &[u32; 3]) -> [Point; 3] {
        face.map(|v| self.points[v as usize])
    }

    /// The faces that have both vertices.
    fn faces_of_edge(&self, [a, b]: [u32; 2]) -> Vec<u32> {
        let has_b = |k: &&u32| self.faces[**k as usize].is_some_and(|face| face.contains(&b));
        self.around[a as usize].iter().filter(has_b).copied().collect()
    }

    /// The neighbours of a vertex, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let faces = self.around[v as usize].iter().filter_map(|&k| self.faces[k as usize]);
        let mut all: Vec<u32> = faces.flatten().filter(|&w| w != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn is_on_border(&self, v: u32) -> bool {
        self.neighbours(v).len() != self.around[v as usize].len()
    }

    /// Collapses an edge if that keeps topology and shape.
    fn collapse(&mut self, [a, b]: [u32; 2]) -> bool {
        let gone = self.faces_of_edge([a, b]);
        let (of_a, of_b) = (self.neighbours(a), self.neighbours(b));
        let common = of_a.iter().filter(|v| of_b.binary_search(v).is_ok()).count();
        let (border_a, border_b) = (self.is_on_border(a), self.is_on_border(b));
        // Two borders may not touch, and no border may close.
        let joins_borders = border_a && border_b && gone.len() != 1;
        if gone.is_empty() || gone.len() > 2 || common != gone.len() || joins_borders || of_a.len() + of_b.len() < 7 {
            return false;
        }
        let (kept, lost) = if border_b && !border_a { (b, a) } else { (a, b) };
        let [p, q] = [kept, lost].map(|v| self.points[v as usize]);
        let place = if border_a == border_b { nalgebra::center(&p, &q) } else { p };
        let stays = |k: &&u32| !gone.contains(*k);
        let moved: Vec<u32> =
            self.around[kept as usize].iter().chain(&self.around[lost as usize]).filter(stays).copied().collect();
        let after = |v: u32| if v == kept || v == lost { place } else { self.points[v as usize] };
        let is_sound = |&k: &u32| {
            let Some(face) = self.faces[k as usize] else { return true };
            self.keeps_shape(&self.corners(&face), &face.map(after))
        };
        if !moved.iter().all(is_sound) {
            return false;
        }
        for k in gone {
            if let Some(face) = self.faces[k as usize].take() {
                face.iter().for_each(|&v| self.around[v as usize].retain(|&of| of != k));
            }
        }
        for k in std::mem::take(&mut self.around[lost as usize]) {
            if let Some(face) = &mut self.faces[k as usize] {
                face.iter_mut().filter(|v| **v == lost).for_each(|v| *v = kept);
            }
            self.around[kept as usize].push(k);
        }
        (self.points[kept as usize], self.into[lost as usize]) = (place, kept);
        true
    }

    /// Whether a triangle may become another: it turns little, or was a sliver, and becomes none.
    fn keeps_shape(&self, before: &[Point; 3], after: &[Point; 3]) -> bool {
        let (height, new_height) = (least_height(before), least_height(after));
        if height < self.least_height {
            return true;
        }
        new_height > 0.5 * self.least_height && normal(before).dot(&normal(after)) > LEAST_COSINE
    }

    /// Flips an edge of face `k` if the least height of its two faces grows and they stay where they were.
    fn flip(&mut self, k: u32, edge: [u32; 2]) -> bool {
        let both = self.faces_of_edge(edge);
        let Some(&other) = both.iter().find(|&&of| of != k).filter(|_| both.len() == 2) else { return false };
        let (Some(face), Some(next)) = (self.faces[k as usize], self.faces[other as usize]) else { return false };
        let [a, b] = edge;
        let tip = |face: [u32; 3]| face.into_iter().find(|&v| v != a && v != b);
        let (Some(c), Some(d)) = (tip(face), tip(next)) else { return false };
        if c == d
            || self.neighbours(c).binary_search(&d).is_ok()
            || self.neighbours(a).len() < 4
            || self.neighbours(b).len() < 4
        {
            return false;
        }
        // `face` runs a, b, c and `next` b, a, d.
        let new = [[a, d, c], [d, b, c]];
        let before = [face, next].map(|f| least_height(&self.corners(&f)));
        let after = new.map(|f| least_height(&self.corners(&f)));
        // The new faces lie as the larger of the old two; the sliver's own normal says nothing.
        let lies = normal(&self.corners(&next));
        let is_like = new.iter().all(|f| normal(&self.corners(f)).dot(&lies) > LEAST_COSINE);
        if after[0].min(after[1]) <= 1.5 * before[0].min(before[1]) || !is_like {
            return false;
        }
        (self.faces[k as usize], self.faces[other as usize]) = (Some(new[0]), Some(new[1]));
        self.around[b as usize].retain(|&of| of != k);
        self.around[a as usize].retain(|&of| of != other);
        self.around[d as usize].push(k);
        self.around[c as usize].push(other);
        true
    }

    fn into_mesh(self, before: &TriMesh) -> WithoutSlivers {
        let found = |mut v: u32| {
            while self.into[v as usize] != v {
                v = self.into[v as usize];
            }
            v as usize
        };
        let (mut is_now, mut was) = (vec![None; self.points.len()], Vec::new());
        for (v, around) in self.around.iter().enumerate() {
            if !around.is_empty() {
                is_now[v] = Some(VertexId::from_index(was.len()));
                was.push(VertexId::from_index(v));
            }
        }
        let is: PerVertex<Option<VertexId>> = (0..self.points.len() as u32).map(|v| is_now[found(v)]).collect();
        let points: Vec<Point> = was.iter().map(|v| self.points[v.index()]).collect();
        let faces = self.faces.iter().flatten().map(|face| face.map(|v| is.0[v as usize]));
        let faces: Vec<[VertexId; 3]> = faces.filter_map(|[a, b, c]| Some([a?, b?, c?])).collect();
        match TriMesh::try_new(points, faces) {
            Ok(mesh) => WithoutSlivers { mesh, was: PerVertex(was), is },
            // Means of finite points are finite.
            Err(_) => WithoutSlivers {
                mesh: before.clone(),
                was: before.vertex_ids().collect(),
                is: before.vertex_ids().map(Some).collect(),
            },
        }
    }
}

fn normal([a, b, c]: &[Point; 3]) -> Vec3 {
    (b - a).cross(&(c - a)).try_normalize(1e-300).unwrap_or_else(Vec3::zeros)
}

/// The least height of a triangle: twice its area over its longest edge.
fn least_height([a, b, c]: &[Point; 3]) -> f64 {
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    (b - a).cross(&(c - a)).norm() / longest.max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Adjacency, noise, sphere};

    const LEAST: f64 = 0.004;

    /// A sphere, or the upper part of one, with slivers: vertices close to others, and close to the middles of edges.
    fn with_slivers(seed: u64, is_open: bool) -> (TriMesh, TriMesh) {
        let round = sphere(16, 32);
        let keep = round.face_ids().map(|f| !is_open || round.triangle(f).iter().all(|p| p.y > -0.3)).collect();
        let round = round.part(&keep).0;
        let mut points = round.points().0.clone();
        let mut faces: Vec<[VertexId; 3]> = round.faces().0.clone();
        let mut random = noise(seed);
        for k in 0..60 {
            let at = (random().abs() * 1e6) as usize % faces.len();
            let [a, b, c] = faces[at];
            // Near a corner: two needles; near an edge: a cap.
            let shares = if k % 2 == 0 { [0.985, 0.008, 0.007] } else { [0.48, 0.515, 0.005] };
            let p = points[a.index()].coords * shares[0]
                + points[b.index()].coords * shares[1]
                + points[c.index()].coords * shares[2];
            let new = VertexId::from_index(points.len());
            points.push(Point::from(p));
            faces[at] = [a, b, new];
            faces.extend([[b, c, new], [c, a, new]]);
        }
        (round, TriMesh::try_new(points, faces).unwrap())
    }

    fn slivers(mesh: &TriMesh) -> usize {
        mesh.face_ids().filter(|&f| least_height(&mesh.triangle(f)) < LEAST).count()
    }

    #[test]
    fn a_mesh_without_slivers_stays_as_it_is() {
        let round = sphere(16, 32);
        let same = without_slivers(&round, LEAST);
        assert_eq!(same.mesh, round);
        assert!(same.was.enumerate().all(|(v, was)| v == *was));
    }

    #[test]
    fn slivers_go_and_topology_and_shape_stay() {
        for seed in 1..12 {
            for is_open in [false, true] {
                let (round, mesh) = with_slivers(seed, is_open);
                let without = without_slivers(&mesh, LEAST);
                assert!(slivers(&mesh) > 50);
                assert!(20 * slivers(&without.mesh) < slivers(&mesh), "{seed}: {}", slivers(&without.mesh));
                let (before, after) = (Adjacency::prepare(&round), Adjacency::prepare(&without.mesh));
                assert_eq!(before.boundary_loops().len(), after.boundary_loops().len(), "{seed}");
                let euler = |mesh: &TriMesh, of: &Adjacency| {
                    mesh.vertex_count() as i64 - of.edges().len() as i64 + mesh.face_count() as i64
                };
                assert_eq!(euler(&round, &before), euler(&without.mesh, &after), "{seed}");
                assert!((round.area() / without.mesh.area() - 1.0).abs() < 2e-3);
                // Every vertex is found again, near its place.
                for (v, is) in without.is.enumerate() {
                    let now = without.mesh.points()[is.unwrap()];
                    assert!((now - mesh.points()[v]).norm() < 0.03, "{seed}: {v:?}");
                }
                for (v, was) in without.was.enumerate() {
                    assert_eq!(without.is[*was], Some(v));
                }
            }
        }
    }
}
