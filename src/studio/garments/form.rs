//! The forms in which other programs save a garment.

use crate::geometry::{Adjacency, FaceId, PerVertex, Point, TriMesh, Vec3, VertexId};
use std::collections::BTreeMap;
use std::io::Write;

/// How a file shows a garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GarmentForm {
    /// One sheet of triangles.
    Sheet,
    /// Two sheets 4 mm apart, joined at the hems.
    Thick,
    /// One sheet, with buttons as parts of their own.
    Buttoned,
    /// Four pieces that meet at seams without being joined.
    Split,
    /// Mostly quads.
    Quads,
}

/// A garment in the polygons of a file.
///
/// **Shapes** one colour per point, sRGB.
pub struct GarmentFile {
    points: Vec<Point>,
    colors: Vec<[u8; 3]>,
    polygons: Vec<Vec<u32>>,
}

/// Distance of the two sheets of thick cloth, in metres: a lined jacket.
const THICKNESS: f64 = 0.004;
/// Radius and height of a button, in metres.
const BUTTON: [f64; 2] = [0.009, 0.004];
const BUTTONS: usize = 5;
const BUTTON_COLOR: [u8; 3] = [40, 36, 32];

impl GarmentFile {
    /// A garment in a form.
    ///
    /// **Requires** one colour per vertex.
    pub fn of(mesh: &TriMesh, colors: &PerVertex<[u8; 3]>, form: GarmentForm) -> Self {
        let sheet = Self {
            points: mesh.points().0.clone(),
            colors: colors.0.clone(),
            polygons: mesh.faces().iter().map(|face| face.iter().map(|v| v.0).collect()).collect(),
        };
        match form {
            GarmentForm::Sheet => sheet,
            GarmentForm::Thick => sheet.thick(mesh),
            GarmentForm::Buttoned => sheet.buttoned(mesh),
            GarmentForm::Split => sheet.split(mesh),
            GarmentForm::Quads => sheet.quads(mesh),
        }
    }

    fn thick(mut self, mesh: &TriMesh) -> Self {
        let count = self.points.len() as u32;
        let normals = mesh.vertex_normals();
        let inner: Vec<Point> = mesh.points().iter().zip(normals.iter()).map(|(p, n)| p - n * THICKNESS).collect();
        self.points.extend(inner);
        self.colors.extend(self.colors.clone());
        let own = self.polygons.clone();
        self.polygons.extend(own.iter().map(|face| face.iter().rev().map(|v| v + count).collect()));
        for ring in Adjacency::prepare(mesh).boundary_loops() {
            for (k, a) in ring.iter().enumerate() {
                let b = ring[(k + 1) % ring.len()];
                // The loop runs with the faces at it, so the strip runs against it.
                self.polygons.push(vec![b.0, a.0, a.0 + count, b.0 + count]);
            }
        }
        self
    }

    fn buttoned(mut self, mesh: &TriMesh) -> Self {
        const SIDES: u32 = 8;
        let Some(bounds) = mesh.bounds() else { return self };
        for k in 0..BUTTONS {
            let y = bounds.min.y + bounds.extent().y * (0.15 + 0.6 * k as f64 / BUTTONS as f64);
            let in_front = |p: &Point| (p.y - y).abs() + (p.x - 0.02).abs() - 0.5 * p.z;
            let Some((_, at)) = mesh.points().enumerate().min_by(|a, b| in_front(a.1).total_cmp(&in_front(b.1))) else {
                continue;
            };
            let first = self.points.len() as u32;
            for (ring, out) in [0.002, 0.002 + BUTTON[1]].into_iter().enumerate() {
                for side in 0..SIDES {
                    let (s, c) = (std::f64::consts::TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
                    self.points.push(at + Vec3::new(c * BUTTON[0], s * BUTTON[0], out));
                    let next = (side + 1) % SIDES;
                    if ring == 0 {
                        self.polygons.push([side, next, next + SIDES, side + SIDES].map(|v| v + first).to_vec());
                    }
                }
            }
            self.colors.resize(self.points.len(), BUTTON_COLOR);
            self.polygons.push((0..SIDES).rev().map(|v| v + first).collect());
            self.polygons.push((SIDES..2 * SIDES).map(|v| v + first).collect());
        }
        self
    }

    /// Front and back, left and right: as a pattern has them.
    fn split(self, mesh: &TriMesh) -> Self {
        let mut ids: BTreeMap<(usize, u32), u32> = BTreeMap::new();
        let mut out = Self { points: Vec::new(), colors: Vec::new(), polygons: Vec::new() };
        for (id, face) in mesh.faces().enumerate() {
            let center = face.iter().map(|&v| mesh.points()[v].coords).sum::<Vec3>() / 3.0;
            let piece = usize::from(center.x > 0.0) + 2 * usize::from(mesh.face_normal(id).z > 0.0);
            let corners = face.map(|v| {
                *ids.entry((piece, v.0)).or_insert_with(|| {
                    out.points.push(mesh.points()[v]);
                    out.colors.push(self.colors[v.index()]);
                    out.points.len() as u32 - 1
                })
            });
            out.polygons.push(corners.to_vec());
        }
        out
    }

    /// Pairs of triangles become quads, the squarest first.
    fn quads(mut self, mesh: &TriMesh) -> Self {
        let adjacency = Adjacency::prepare(mesh);
        let length = |a: VertexId, b: VertexId| (mesh.points()[a] - mesh.points()[b]).norm();
        let mut pairs: Vec<(f64, usize, usize, VertexId, VertexId)> = Vec::new();
        for (edge, faces) in adjacency.edges() {
            let [a, b] = *edge;
            if let [Some(f), Some(g)] = *faces {
                let apex = |of: FaceId| mesh.faces()[of].into_iter().find(|v| *v != a && *v != b);
                if let (Some(p), Some(q)) = (apex(f), apex(g)) {
                    pairs.push(((length(a, b) / length(p, q).max(1e-9)).ln().abs(), f.index(), g.index(), p, q));
                }
            }
        }
        pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut merged = vec![false; self.polygons.len()];
        let mut polygons = Vec::new();
        for (_, f, g, _, q) in pairs {
            if merged[f] || merged[g] {
                continue;
            }
            (merged[f], merged[g]) = (true, true);
            // The other apex goes between the two corners that both faces share.
            let face = mesh.faces().as_slice()[f];
            let other = mesh.faces().as_slice()[g];
            let shared = |v: &VertexId| other.contains(v);
            let mut quad = Vec::with_capacity(4);
            for k in 0..3 {
                quad.push(face[k].0);
                if shared(&face[k]) && shared(&face[(k + 1) % 3]) {
                    quad.push(q.0);
                }
            }
            polygons.push(quad);
        }
        polygons.extend(self.polygons.into_iter().zip(merged).filter(|(_, merged)| !merged).map(|(face, _)| face));
        self.polygons = polygons;
        self
    }

    /// The share of quads among the polygons.
    pub fn quad_share(&self) -> f64 {
        let quads = self.polygons.iter().filter(|polygon| polygon.len() == 4).count();
        quads as f64 / self.polygons.len().max(1) as f64
    }

    /// Writes an OBJ in centimetres, as tools for clothes do, with colours after the coordinates.
    pub fn write_obj(&self, mut out: impl Write) -> std::io::Result<()> {
        writeln!(out, "# a garment of Overcoat's studio (CC0), in centimetres")?;
        for (p, color) in self.points.iter().zip(&self.colors) {
            let [x, y, z] = [p.x, p.y, p.z].map(|x| 100.0 * x);
            let [r, g, b] = color.map(|c| f64::from(c) / 255.0);
            writeln!(out, "v {x:.4} {y:.4} {z:.4} {r:.3} {g:.3} {b:.3}")?;
        }
        for polygon in &self.polygons {
            let corners: Vec<String> = polygon.iter().map(|v| (v + 1).to_string()).collect();
            writeln!(out, "f {}", corners.join(" "))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube around the y axis.
    fn tube() -> (TriMesh, PerVertex<[u8; 3]>) {
        let (rings, around) = (6_u32, 12_u32);
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for ring in 0..rings {
            for k in 0..around {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(around)).sin_cos();
                points.push(Point::new(0.2 * s, 0.1 * f64::from(ring), 0.2 * c));
                if ring + 1 < rings {
                    let [a, b] = [ring * around + k, ring * around + (k + 1) % around];
                    faces.extend([[a, b, b + around], [a, b + around, a + around]]);
                }
            }
        }
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let colors = PerVertex::filled([9, 9, 9], mesh.vertex_count());
        (mesh, colors)
    }

    #[test]
    fn every_form_shows_the_same_cloth() {
        let (mesh, colors) = tube();
        let of = |form| GarmentFile::of(&mesh, &colors, form);
        let edges_of = |file: &GarmentFile| {
            let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
            for polygon in &file.polygons {
                for (k, &a) in polygon.iter().enumerate() {
                    let b = polygon[(k + 1) % polygon.len()];
                    *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
                }
            }
            edges
        };
        let thick = of(GarmentForm::Thick);
        assert!(edges_of(&thick).values().all(|sum| *sum == 0), "a closed shell, every edge once in each direction");
        let quads = of(GarmentForm::Quads);
        assert!(quads.quad_share() > 0.9, "{}", quads.quad_share());
        assert_eq!(quads.polygons.iter().map(|p| p.len() - 2).sum::<usize>(), mesh.face_count());
        let split = of(GarmentForm::Split);
        assert_eq!(split.polygons.len(), mesh.face_count());
        assert!(split.points.len() > mesh.vertex_count());
        assert_eq!(of(GarmentForm::Buttoned).points.len(), mesh.vertex_count() + BUTTONS * 16);
    }
}
