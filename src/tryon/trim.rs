//! Buttons, pockets and other parts of a garment's file that are not its cloth and are carried by it.

use crate::body::{Layer, SkinWeights};
use crate::geometry::{Adjacency, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, rigid_motion};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Parts up to this extent in metres are rigid: the largest buttons of coats and buckles of belts. Pockets bend with the cloth.
const RIGID: f64 = 0.06;
/// What carries a point is the cloth within this distance in metres: wide enough that a fold does not tilt it.
const PATCH: f64 = 0.02;
/// Fewest and most vertices of a patch: three determine a motion barely, hundreds do not improve it.
const PATCH_VERTICES: std::ops::Range<usize> = 9..64;
/// Cloth farther out than this in metres does not cover a part: the sleeve of an arm that hangs down.
const COVER: f64 = 0.03;

/// Parts of a garment that are carried by its cloth: none stretches, and small ones do not bend either.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trim {
    /// The parts, where they are on the garment of the file.
    mesh: TriMesh,
    /// sRGB. **Shapes** one per vertex.
    colors: Option<PerVertex<[u8; 3]>>,
    /// The patch that carries each vertex.
    patch_of: PerVertex<u32>,
    patches: Vec<Patch>,
}

/// Cloth around a place: its vertices, and where they are on the garment of the file.
type Patch = Vec<(VertexId, Point)>;

impl Trim {
    /// Parts on a garment, both where its file has them.
    ///
    /// **Shapes** `colors`: one per vertex of `mesh`.
    pub fn on_garment(cloth: &TriMesh, mesh: TriMesh, colors: Option<PerVertex<[u8; 3]>>) -> Self {
        let index = SurfaceIndex::prepare(cloth);
        let adjacency = Adjacency::prepare(cloth);
        let around = |p: &Point, radius: f64| patch(cloth, &adjacency, &index, p, radius);
        let mut patches = Vec::new();
        let mut patch_of = PerVertex::filled(0, mesh.vertex_count());
        for part in parts_of(&mesh) {
            let at: Vec<Point> = part.iter().map(|&v| mesh.points()[v]).collect();
            let center = Point::from(at.iter().map(|p| p.coords).sum::<Vec3>() / at.len().max(1) as f64);
            let reach = at.iter().map(|p| (p - center).norm()).fold(0.0, f64::max);
            let is_rigid = 2.0 * reach <= RIGID;
            if is_rigid {
                patches.push(around(&center, reach.max(PATCH)));
            }
            for (&v, p) in part.iter().zip(&at) {
                if !is_rigid {
                    patches.push(around(p, PATCH));
                }
                patch_of[v] = patches.len() as u32 - 1;
            }
        }
        Self { mesh, colors, patch_of, patches }
    }

    /// How many parts there are.
    pub fn part_count(&self) -> usize {
        parts_of(&self.mesh).len()
    }

    /// How many faces all parts have.
    pub fn face_count(&self) -> usize {
        self.mesh.face_count()
    }

    /// The parts where the cloth carries them.
    ///
    /// **Requires** the vertices of the garment that they were bound to.
    pub fn on(&self, cloth: &PerVertex<Point>) -> TriMesh {
        let motion_of = |patch: &Patch| {
            let pairs: Vec<(Point, Point)> = patch.iter().map(|&(v, was)| (was, cloth[v])).collect();
            rigid_motion(&pairs)
        };
        let motions: Vec<_> = self.patches.iter().map(motion_of).collect();
        let moved = |(p, &patch): (&Point, &u32)| match &motions[patch as usize] {
            Some((turn, shift)) => turn * p + shift,
            None => *p,
        };
        let places: Vec<Point> = self.mesh.points().iter().zip(self.patch_of.iter()).map(moved).collect();
        self.mesh.with_points(places)
    }

    /// The parts as a layer of their own, with the skin weights of the cloth that carries them.
    pub fn layer(&self, carrier: &Layer) -> Layer {
        let row_of = |patch: &Patch| {
            let share = 1.0 / patch.len().max(1) as f64;
            carrier.weights.blend(&patch.iter().map(|&(v, _)| (v, share)).collect::<Vec<_>>())
        };
        let rows: Vec<_> = self.patches.iter().map(row_of).collect();
        let weights = SkinWeights::from_rows_of_cloth(self.patch_of.iter().map(|&patch| rows[patch as usize].clone()));
        let layer = Layer::plain(&format!("{}-trim", carrier.name), self.on(carrier.mesh.points()), weights);
        Layer { colors: self.colors.clone(), ..layer }
    }

    /// Without the parts that other surfaces cover for the most part.
    pub fn uncovered(&self, cloth: &TriMesh, others: &[&TriMesh]) -> Self {
        let others: Vec<SurfaceIndex> = others.iter().map(|mesh| SurfaceIndex::prepare(mesh)).collect();
        let normals = cloth.vertex_normals();
        let placed = self.on(cloth.points());
        let is_covered = |v: VertexId| {
            let patch = &self.patches[self.patch_of[v] as usize];
            let out: Vec3 = patch.iter().map(|&(w, _)| normals[w]).sum();
            // From below the part, as thin cloth may lie inside it.
            let from = |out: Vec3| placed.points()[v] - out * (0.5 * COVER);
            let Some(out) = out.try_normalize(1e-9) else { return false };
            others.iter().any(|other| other.cast_ray(&from(out), &out, 1.5 * COVER).is_some())
        };
        let mut keeps = PerVertex::filled(true, self.mesh.vertex_count());
        for part in parts_of(&self.mesh) {
            let covered = part.iter().filter(|&&v| is_covered(v)).count();
            if 2 * covered > part.len() {
                part.iter().for_each(|&v| keeps[v] = false);
            }
        }
        self.part(&self.mesh.faces().iter().map(|face| keeps[face[0]]).collect())
    }

    /// Some of the parts.
    fn part(&self, keep: &PerFace<bool>) -> Self {
        let (mesh, from) = self.mesh.part(keep);
        Self {
            mesh,
            colors: self.colors.as_ref().map(|colors| from.iter().map(|&v| colors[v]).collect()),
            patch_of: from.iter().map(|&v| self.patch_of[v]).collect(),
            patches: self.patches.clone(),
        }
    }
}

/// The vertices of each connected part.
fn parts_of(mesh: &TriMesh) -> Vec<Vec<VertexId>> {
    let (part_of, count) = Adjacency::prepare(mesh).face_components();
    let mut parts = vec![BTreeSet::new(); count];
    for (f, face) in mesh.face_ids().zip(mesh.faces().iter()) {
        parts[part_of[f] as usize].extend(face);
    }
    parts.into_iter().map(|part| part.into_iter().collect()).collect()
}

/// The cloth around the point of it that is nearest to `p`, along edges: not the other front, which lies below.
fn patch(cloth: &TriMesh, adjacency: &Adjacency, index: &SurfaceIndex, p: &Point, radius: f64) -> Patch {
    let near = index.closest(p);
    let mut found: Vec<VertexId> = cloth.faces()[near.face].to_vec();
    let mut seen: BTreeSet<VertexId> = found.iter().copied().collect();
    let mut next = 0;
    while next < found.len() && found.len() < PATCH_VERTICES.end {
        for &w in adjacency.neighbours_of(found[next]) {
            let is_near = (cloth.points()[w] - near.point).norm() <= radius;
            if (is_near || found.len() < PATCH_VERTICES.start) && seen.insert(w) {
                found.push(w);
            }
        }
        next += 1;
    }
    found.into_iter().map(|v| (v, cloth.points()[v])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    /// A sheet of 40 × 40 cm with a vertex per centimetre.
    fn sheet() -> TriMesh {
        const SIDE: u32 = 41;
        let at = |k: u32| Point::new(0.01 * f64::from(k % SIDE), 0.01 * f64::from(k / SIDE), 0.0);
        let cells = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| y * SIDE + x));
        let faces: Vec<[u32; 3]> =
            cells.flat_map(|k| [[k, k + 1, k + SIDE], [k + 1, k + SIDE + 1, k + SIDE]]).collect();
        TriMesh::try_from_indices((0..SIDE * SIDE).map(at).collect(), &faces).unwrap()
    }

    /// A rectangle 3 mm above the sheet.
    fn rectangle(center: [f64; 2], side: f64, cells: u32) -> TriMesh {
        let at = |k: u32| {
            let [x, y] = [k % (cells + 1), k / (cells + 1)].map(|i| side * (f64::from(i) / f64::from(cells) - 0.5));
            Point::new(center[0] + x, center[1] + y, 0.003)
        };
        let corners = (0..cells).flat_map(|y| (0..cells).map(move |x| y * (cells + 1) + x));
        let faces: Vec<[u32; 3]> =
            corners.flat_map(|k| [[k, k + 1, k + cells + 1], [k + 1, k + cells + 2, k + cells + 1]]).collect();
        TriMesh::try_from_indices((0..(cells + 1) * (cells + 1)).map(at).collect(), &faces).unwrap()
    }

    /// The sheet rolled onto a cylinder with a radius of 15 cm, whose axis is along y.
    fn rolled(p: &Point) -> Point {
        let turn = p.x / 0.15;
        Point::new((0.15 + p.z) * turn.sin(), p.y, (0.15 + p.z) * turn.cos())
    }

    #[test]
    fn a_button_stays_rigid_and_where_it_is_sewn_on() {
        let button = rectangle([0.2, 0.2], 0.02, 4);
        let trim = Trim::on_garment(&sheet(), button.clone(), None);
        let on = trim.on(&sheet().points().iter().map(rolled).collect());
        for (a, b) in [(0, 24), (4, 20), (0, 4)].map(|(a, b)| (VertexId(a), VertexId(b))) {
            let length = |mesh: &TriMesh| (mesh.points()[a] - mesh.points()[b]).norm();
            assert!((length(&on) - length(&button)).abs() < 1e-12);
        }
        for (p, q) in button.points().iter().zip(on.points().iter()) {
            assert!((rolled(p) - q).norm() < 1.5e-3, "{q} instead of {}", rolled(p));
        }
    }

    #[test]
    fn a_pocket_bends_with_the_cloth() {
        let pocket = rectangle([0.2, 0.2], 0.15, 15);
        let trim = Trim::on_garment(&sheet(), pocket.clone(), None);
        let on = trim.on(&sheet().points().iter().map(rolled).collect());
        for (p, q) in pocket.points().iter().zip(on.points().iter()) {
            assert!((rolled(p) - q).norm() < 2e-3, "{q} instead of {}", rolled(p));
        }
    }

    #[test]
    fn trim_turns_rigidly_with_its_garment() {
        let cloth = sheet();
        let trim = Trim::on_garment(&cloth, rectangle([0.1, 0.3], 0.02, 3), None);
        let turn = Rotation3::new(Vector3::new(0.3, -1.2, 0.7));
        let moved = |p: &Point| turn * p + Vector3::new(1.0, -2.0, 0.5);
        let (at_rest, on) = (trim.on(cloth.points()), trim.on(&cloth.points().iter().map(moved).collect()));
        assert!(at_rest.points().iter().zip(on.points().iter()).all(|(p, q)| (moved(p) - q).norm() < 1e-9));
    }

    #[test]
    fn buttons_below_another_layer_are_left_out() {
        let cloth = sheet();
        let [left, right] = [0.1, 0.3].map(|x| rectangle([x, 0.2], 0.02, 2));
        let points: Vec<Point> = left.points().iter().chain(right.points().iter()).copied().collect();
        let faces: Vec<[u32; 3]> =
            [0, 9].iter().flat_map(|&first| left.faces().iter().map(move |face| face.map(|v| v.0 + first))).collect();
        let both = TriMesh::try_from_indices(points, &faces).unwrap();
        let trim = Trim::on_garment(&cloth, both, None);
        // Nearer to the cloth than the buttons are high.
        let over = rectangle([0.1, 0.2], 0.1, 1).map_points(|p| Point::new(p.x, p.y, 0.002));
        let seen = trim.uncovered(&cloth, &[&over]);
        assert_eq!((trim.part_count(), seen.part_count()), (2, 1));
        assert!(seen.on(cloth.points()).points().iter().all(|p| p.x > 0.2));
    }
}
