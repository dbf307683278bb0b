//! The surface that is re-meshed: manifold, with triangles small enough for the fields, and with its borders as curves.

use super::borders::Borders;
use super::error::QuadError;
use crate::geometry::{Point, TriMesh, Vec3, closest_on_triangle};
use std::collections::HashMap;

/// A manifold surface, its neighbourhoods and its borders.
pub(super) struct Surface {
    pub points: Vec<Point>,
    /// Unit normals of the vertices; of those without area some unit vector.
    pub normals: Vec<Vec3>,
    /// A third of the area around each vertex, in m².
    pub areas: Vec<f64>,
    pub faces: Vec<[u32; 3]>,
    pub faces_of: Lists,
    pub borders: Borders,
    /// Whether it encloses something, as a body does; cloth has borders.
    pub is_solid: bool,
}

/// One list per vertex, in one array.
pub(super) struct Lists {
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// Sorts pairs of (list, item) by list; the items of a list keep their order.
    pub fn of(count: usize, pairs: &[(u32, u32)]) -> Self {
        let mut start = vec![0u32; count + 1];
        pairs.iter().for_each(|(list, _)| start[*list as usize + 1] += 1);
        (0..count).for_each(|i| start[i + 1] += start[i]);
        let mut cursor = start.clone();
        let mut items = vec![0u32; pairs.len()];
        for &(list, item) in pairs {
            items[cursor[list as usize] as usize] = item;
            cursor[list as usize] += 1;
        }
        Self { start, items }
    }

    /// The items of a list.
    pub fn get(&self, list: usize) -> &[u32] {
        &self.items[self.start[list] as usize..self.start[list + 1] as usize]
    }
}

impl Surface {
    /// Checks the surface, splits edges longer than `longest`, and walks along its borders.
    pub fn prepare(mesh: &TriMesh, longest: f64) -> Result<Self, QuadError> {
        let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|f| f.map(|v| v.0)).collect();
        let faces: Vec<[u32; 3]> = faces.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect();
        let area = mesh.area();
        if faces.is_empty() || area.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            return Err(QuadError::NoArea { faces: mesh.face_count() });
        }
        check_manifold(&faces)?;
        let (mut points, mut faces) = with_single_fans(mesh.points().as_slice(), faces);
        while split_long_edges(&mut points, &mut faces, longest) {}
        Ok(Self::of(points, faces))
    }

    fn of(points: Vec<Point>, faces: Vec<[u32; 3]>) -> Self {
        let pairs: Vec<(u32, u32)> =
            (0u32..).zip(&faces).flat_map(|(f, face)| face.iter().map(move |&v| (v, f)).collect::<Vec<_>>()).collect();
        let faces_of = Lists::of(points.len(), &pairs);
        let mut areas = vec![0.0; points.len()];
        let mut normals = vec![Vec3::zeros(); points.len()];
        for &[a, b, c] in &faces {
            let [p, q, r] = [a, b, c].map(|v| points[v as usize]);
            let vector = (q - p).cross(&(r - p));
            for v in [a, b, c] {
                areas[v as usize] += vector.norm() / 6.0;
                normals[v as usize] += vector;
            }
        }
        normals.iter_mut().for_each(|n| *n = n.try_normalize(1e-300).unwrap_or_else(Vec3::y));
        // A vertex among slivers still counts a little, so that averages are defined.
        let least = 1e-6 * areas.iter().sum::<f64>() / areas.len() as f64;
        areas.iter_mut().for_each(|area| *area = area.max(least));
        let borders = Borders::of(&points, &faces);
        let is_solid = borders.curves.is_empty();
        Self { points, normals, areas, faces, faces_of, borders, is_solid }
    }

    /// The next point of the surface downhill from a face: it stays on its own side of a fold, however close the other side is.
    pub fn closest_from(&self, from: u32, p: &Point) -> (u32, Point) {
        let at = |f: u32| closest_on_triangle(p, &self.faces[f as usize].map(|v| self.points[v as usize]));
        let (mut face, (mut barycentric, mut point)) = (from, at(from));
        let mut best = (p - point).norm_squared();
        loop {
            let before = face;
            // Inside of a face no neighbour is nearer.
            if barycentric.iter().all(|&w| w > 0.0) {
                return (face, point);
            }
            for (v, _) in self.faces[face as usize].into_iter().zip(barycentric).filter(|(_, w)| *w > 0.0) {
                for &f in self.faces_of.get(v as usize) {
                    let (b, q) = at(f);
                    let distance = (p - q).norm_squared();
                    if distance < best {
                        (face, barycentric, point, best) = (f, b, q, distance);
                    }
                }
            }
            if face == before {
                return (face, point);
            }
        }
    }

    /// The mean of the normals of a face's corners.
    pub fn normal_of_face(&self, face: u32) -> Vec3 {
        let sum: Vec3 = self.faces[face as usize].iter().map(|&w| self.normals[w as usize]).sum();
        sum.try_normalize(1e-9).unwrap_or_else(Vec3::y)
    }

    /// Vertices joined by an edge, each pair in both directions, ascending.
    pub fn edges(&self) -> Vec<(u32, u32)> {
        let mut edges: Vec<(u32, u32)> =
            self.faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }
}

/// An edge lies between at most two faces, which walk it in opposite directions.
fn check_manifold(faces: &[[u32; 3]]) -> Result<(), QuadError> {
    let mut sides: Vec<[u32; 2]> = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    sides.sort_unstable();
    let doubled = sides.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if doubled > 0 { Err(QuadError::NotManifold { edges: doubled }) } else { Ok(()) }
}

/// Vertices at which two fans of faces touch become two, one per fan.
fn with_single_fans(points: &[Point], mut faces: Vec<[u32; 3]>) -> (Vec<Point>, Vec<[u32; 3]>) {
    // The fans are the connected parts of the corners, joined across edges.
    let mut part: Vec<u32> = (0..faces.len() as u32 * 3).collect();
    let mut corner_of_side: HashMap<[u32; 2], u32> = HashMap::with_capacity(part.len());
    for (f, face) in (0u32..).zip(&faces) {
        for k in 0..3 {
            corner_of_side.insert([face[k as usize], face[(k as usize + 1) % 3]], 3 * f + k);
        }
    }
    for (f, face) in (0u32..).zip(&faces) {
        for k in 0..3u32 {
            let [a, b] = [face[k as usize], face[(k as usize + 1) % 3]];
            if let Some(&across) = corner_of_side.get(&[b, a]) {
                // Of the face across, the side begins in b and ends in a.
                let end_across = across / 3 * 3 + (across % 3 + 1) % 3;
                join(&mut part, 3 * f + k, end_across);
                join(&mut part, 3 * f + (k + 1) % 3, across);
            }
        }
    }
    let mut new_points = Vec::with_capacity(points.len());
    let mut vertex_of_part: Vec<u32> = vec![u32::MAX; part.len()];
    for corner in 0..part.len() as u32 {
        let root = find(&mut part, corner) as usize;
        let [f, k] = [corner as usize / 3, corner as usize % 3];
        if vertex_of_part[root] == u32::MAX {
            vertex_of_part[root] = new_points.len() as u32;
            new_points.push(points[faces[f][k] as usize]);
        }
        faces[f][k] = vertex_of_part[root];
    }
    (new_points, faces)
}

fn find(part: &mut [u32], mut at: u32) -> u32 {
    while part[at as usize] != at {
        part[at as usize] = part[part[at as usize] as usize];
        at = part[at as usize];
    }
    at
}

fn join(part: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(part, a), find(part, b));
    part[a.max(b) as usize] = a.min(b);
}

/// Splits the edges longer than `longest` in their middles, in all faces at once; whether there were any.
fn split_long_edges(points: &mut Vec<Point>, faces: &mut Vec<[u32; 3]>, longest: f64) -> bool {
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    for face in faces.iter() {
        for k in 0..3 {
            let [a, b] = [face[k], face[(k + 1) % 3]];
            let [p, q] = [points[a as usize], points[b as usize]];
            if (q - p).norm() > longest {
                middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    points.push(nalgebra::center(&p, &q));
                    points.len() as u32 - 1
                });
            }
        }
    }
    if middles.is_empty() {
        return false;
    }
    let mut split = Vec::with_capacity(faces.len() + 2 * middles.len());
    for &[a, b, c] in faces.iter() {
        let middle = |a: u32, b: u32| middles.get(&[a.min(b), a.max(b)]).copied();
        let distance = |a: u32, b: u32| (points[a as usize] - points[b as usize]).norm_squared();
        // Turned so that the first side is split, and the last is not unless all are.
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        let turned = match [ab.is_some(), bc.is_some(), ca.is_some()] {
            [false, true, _] => [b, c, a],
            [false, false, true] | [true, false, true] => [c, a, b],
            _ => [a, b, c],
        };
        let [a, b, c] = turned;
        match [middle(a, b), middle(b, c), middle(c, a)] {
            [Some(m), None, None] => split.extend([[a, m, c], [m, b, c]]),
            [Some(m), Some(n), None] => {
                split.push([m, b, n]);
                if distance(a, n) <= distance(m, c) {
                    split.extend([[a, m, n], [a, n, c]]);
                } else {
                    split.extend([[a, m, c], [m, n, c]]);
                }
            }
            [Some(m), Some(n), Some(o)] => split.extend([[a, m, o], [m, b, n], [o, n, c], [m, n, o]]),
            _ => split.push([a, b, c]),
        }
    }
    *faces = split;
    true
}
