//! A chart of a surface flattened with least distortion of angles.
//!
//! **Source** Lévy 2002, least squares conformal maps: for each triangle the complex gradient of the map should be
//! that of a similarity; two vertices are fixed.

use crate::geometry::{FaceId, Point, TriMesh, VertexId};
use crate::numerics::SparseCholesky;
use std::collections::BTreeMap;

/// A chart on the plane, in metres: its area is that of the surface.
pub(super) struct Flat {
    /// The chart's faces with their corners on the mesh.
    pub faces: Vec<(FaceId, [VertexId; 3])>,
    places: BTreeMap<VertexId, [f64; 2]>,
}

/// Flattens the faces of a chart; `None` if its equations cannot be solved (a chart in several pieces).
pub(super) fn flatten(mesh: &TriMesh, faces: &[FaceId]) -> Option<Flat> {
    let faces: Vec<(FaceId, [VertexId; 3])> = faces.iter().map(|f| (*f, mesh.faces()[*f])).collect();
    let mut index: BTreeMap<VertexId, usize> = faces.iter().flat_map(|f| f.1).map(|v| (v, 0)).collect();
    index.values_mut().enumerate().for_each(|(k, i)| *i = k);
    let points: Vec<Point> = index.keys().map(|v| mesh.points()[*v]).collect();
    let held = farthest_pair(&points);
    let span = (points[held[0]] - points[held[1]]).norm();

    // Unknowns: u and v of every vertex that is not held.
    let mut column = vec![usize::MAX; points.len()];
    let mut free = 0;
    for (k, c) in column.iter_mut().enumerate() {
        if !held.contains(&k) {
            *c = 2 * free;
            free += 1;
        }
    }
    let value_of_held = |k: usize, part: usize| if k == held[1] && part == 1 { span } else { 0.0 };
    let mut triplets = Vec::new();
    let mut right = vec![0.0; 2 * free];
    for (_, corners) in &faces {
        let at = corners.map(|v| index[&v]);
        for row in rows_of(at.map(|k| points[k])) {
            // Each row is a sum over the six unknowns of its corners: ½ (row · x)².
            let entries: Vec<(usize, usize, f64)> =
                (0..3).flat_map(|k| [(at[k], 0, row[k][0]), (at[k], 1, row[k][1])]).collect();
            let constant: f64 = entries
                .iter()
                .filter(|(k, ..)| column[*k] == usize::MAX)
                .map(|(k, part, factor)| factor * value_of_held(*k, *part))
                .sum();
            for &(k, part, factor) in entries.iter().filter(|(k, ..)| column[*k] != usize::MAX) {
                right[column[k] + part] -= factor * constant;
                for &(l, other, weight) in entries.iter().filter(|(l, ..)| column[*l] != usize::MAX) {
                    triplets.push((column[k] + part, column[l] + other, factor * weight));
                }
            }
        }
    }
    let solution = SparseCholesky::prepare(2 * free, &triplets).ok()?.solve(&right);
    let place = |k: usize| match column[k] {
        usize::MAX => [value_of_held(k, 0), value_of_held(k, 1)],
        c => [solution[c], solution[c + 1]],
    };
    let places = index.iter().map(|(v, &k)| (*v, place(k))).collect();
    let mut flat = Flat { faces, places };
    flat.scale_to(mesh);
    Some(flat)
}

/// The two equations of a triangle: for each corner the coefficients of its u and its v.
fn rows_of([a, b, c]: [Point; 3]) -> [[[f64; 2]; 3]; 2] {
    let x_axis = (b - a).normalize();
    let normal = (b - a).cross(&(c - a));
    let y_axis = normal.cross(&x_axis).try_normalize(1e-30).unwrap_or_default();
    let flat = [a, b, c].map(|p| [(p - a).dot(&x_axis), (p - a).dot(&y_axis)]);
    let scale = 1.0 / normal.norm().max(1e-12).sqrt();
    let edge = |k: usize| {
        let (p, q) = (flat[(k + 1) % 3], flat[(k + 2) % 3]);
        [(q[0] - p[0]) * scale, (q[1] - p[1]) * scale]
    };
    let w = [edge(0), edge(1), edge(2)];
    [w.map(|[x, y]| [x, -y]), w.map(|[x, y]| [y, x])]
}

/// Two points far apart: from the first to the farthest, and from there to the farthest again.
fn farthest_pair(points: &[Point]) -> [usize; 2] {
    let from = |k: usize| {
        (0..points.len()).fold(k, |best, l| {
            if (points[l] - points[k]).norm_squared() > (points[best] - points[k]).norm_squared() { l } else { best }
        })
    };
    let one = from(0);
    [one, from(one)]
}

impl Flat {
    /// Vertices and their coordinates, in the order of the mesh.
    pub fn vertices(&self) -> impl Iterator<Item = (VertexId, [f64; 2])> + '_ {
        self.places.iter().map(|(v, p)| (*v, *p))
    }

    /// Width and height; the lower left corner is the origin once it [stands](Self::stand).
    pub fn size(&self) -> [f64; 2] {
        self.places.values().fold([0.0; 2], |[w, h]: [f64; 2], [x, y]| [w.max(*x), h.max(*y)])
    }

    /// Turns it so that its box is the narrowest of those tried and stands upright, and moves it to the origin.
    pub fn stand(&mut self) {
        /// Steps of 3°: a chart three times as long as broad is at most 5 % broader than necessary.
        const STEPS: usize = 60;
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            move |[x, y]: [f64; 2]| [cos * x - sin * y, sin * x + cos * y]
        };
        let bounds = |angle: f64| {
            let turn = turned(angle);
            let all = self.places.values().map(|p| turn(*p));
            all.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[a, b, c, d], [x, y]| {
                [a.min(x), b.min(y), c.max(x), d.max(y)]
            })
        };
        let width = |angle: f64| {
            let [a, _, c, _] = bounds(angle);
            c - a
        };
        let best = (0..STEPS)
            .map(|k| std::f64::consts::PI * k as f64 / STEPS as f64)
            .fold(0.0, |best, angle| if width(angle) < width(best) - 1e-9 { angle } else { best });
        let ([left, base, ..], turn) = (bounds(best), turned(best));
        for p in self.places.values_mut() {
            let [x, y] = turn(*p);
            *p = [x - left, y - base];
        }
    }

    /// Scales it to the area that it has on the mesh.
    fn scale_to(&mut self, mesh: &TriMesh) {
        let on_mesh: f64 = self.faces.iter().map(|(f, _)| mesh.face_area(*f)).sum();
        let flat: f64 = self.faces.iter().map(|(_, corners)| signed_area(corners.map(|v| self.places[&v])).abs()).sum();
        let factor = (on_mesh / flat.max(1e-12)).sqrt();
        self.places.values_mut().for_each(|p| *p = p.map(|x| x * factor));
    }
}

/// Area of a triangle on the plane, positive counter-clockwise.
pub(super) fn signed_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_tube_unrolls_to_a_rectangle() {
        let (around, along) = (12, 9);
        let at = |i: usize, j: usize| {
            let angle = std::f64::consts::PI * i as f64 / around as f64;
            Point::new(0.1 * angle.cos(), 0.05 * j as f64, 0.1 * angle.sin())
        };
        let points: Vec<Point> = (0..=along).flat_map(|j| (0..=around).map(move |i| at(i, j))).collect();
        let id = |i: usize, j: usize| (j * (around + 1) + i) as u32;
        let mut faces = Vec::new();
        for j in 0..along {
            for i in 0..around {
                faces.push([id(i, j), id(i, j + 1), id(i + 1, j)]);
                faces.push([id(i + 1, j), id(i, j + 1), id(i + 1, j + 1)]);
            }
        }
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let mut flat = flatten(&mesh, &mesh.face_ids().collect::<Vec<_>>()).unwrap();
        flat.stand();
        let [width, height] = flat.size();
        assert!((0.313..0.329).contains(&width) && (0.449..0.470).contains(&height), "{width} x {height}");
        let areas: Vec<f64> = flat.faces.iter().map(|(_, c)| signed_area(c.map(|v| flat.places[&v]))).collect();
        assert!(areas.iter().all(|a| *a > 0.0) || areas.iter().all(|a| *a < 0.0), "no face is turned over");
    }
}
