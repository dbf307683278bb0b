//! Textured scans: the colours of a scan as a picture, with texture coordinates, as photogrammetry gives them.

use super::error::StudioError;
use crate::formats::{EncodedPicture, FormatError, RawMaterial, RawMesh, RawTexture, write_color_png};
use rayon::prelude::*;
use std::collections::HashMap;

/// Pixels around a chart that repeat its border: what linear interpolation sees, and a half for rounding.
const MARGIN: f64 = 1.5;
/// Least pixels along the side of a cell of two charts.
const LEAST_CELL: usize = 10;

/// A picture with a chart for each triangle, two in each square cell.
///
/// Every edge is a seam, which is the worst case for those who read such a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleAtlas {
    side: usize,
    cell: usize,
    columns: usize,
    faces: usize,
}

impl TriangleAtlas {
    /// An atlas for that many triangles in a square picture of `side` pixels.
    ///
    /// **Errors** if the charts would be too small to be read.
    pub fn try_new(faces: usize, side: usize) -> Result<Self, StudioError> {
        let columns = (1..).find(|n| 2 * n * n >= faces).unwrap_or(1);
        let cell = side / columns;
        if cell < LEAST_CELL {
            return Err(StudioError::SmallPicture { side, least: LEAST_CELL * columns });
        }
        Ok(Self { side, cell, columns, faces })
    }

    /// Where a point of a triangle lies, from the lower left of the picture; `at` are the shares of the second and the
    /// third corner.
    pub fn coords(&self, face: usize, at: [f64; 2]) -> [f64; 2] {
        let (corner, cell) = (self.corner(face / 2), self.cell as f64);
        let along = at.map(|share| MARGIN + share * (cell - 4.0 * MARGIN));
        let in_cell = if face.is_multiple_of(2) { along } else { along.map(|a| cell - a) };
        // Pixels are counted from the upper left.
        [(corner[0] + in_cell[0]) / self.side as f64, 1.0 - (corner[1] + in_cell[1]) / self.side as f64]
    }

    /// The pixels, row by row from the top: `color` gives the colour of a triangle at the shares of its second and third
    /// corner.
    pub fn paint(&self, color: impl Fn(usize, [f64; 2]) -> [u8; 3] + Sync) -> Vec<[u8; 3]> {
        let cell = self.cell as f64;
        let pixel = |k: usize| {
            let (x, y) = (k % self.side, k / self.side);
            let (column, row) = (x / self.cell, y / self.cell);
            let at = [(x % self.cell) as f64 + 0.5, (y % self.cell) as f64 + 0.5];
            let second = at[0] + at[1] >= cell;
            let face = 2 * (row * self.columns + column) + usize::from(second);
            if column >= self.columns || face >= self.faces {
                return [0; 3];
            }
            let along = if second { at.map(|a| cell - a) } else { at };
            let [b, c] = along.map(|a| ((a - MARGIN) / (cell - 4.0 * MARGIN)).clamp(0.0, 1.0));
            let most = (b + c).max(1.0);
            color(face, [b / most, c / most])
        };
        (0..self.side * self.side).into_par_iter().map(pixel).collect()
    }

    fn corner(&self, cell: usize) -> [f64; 2] {
        [(cell % self.columns * self.cell) as f64, (cell / self.columns * self.cell) as f64]
    }
}

/// A scan with a picture of its colours instead of colours of vertices, each triangle divided into `parts`² of the same
/// shape.
///
/// **Requires** colours of vertices.
///
/// **Errors** if the picture is too small, or the scan has no colours.
pub fn with_picture(scan: &RawMesh, parts: usize, side: usize) -> Result<RawMesh, StudioError> {
    let expected = scan.points.len();
    let colors = scan.colors.as_ref().filter(|colors| colors.len() == expected);
    let found = scan.colors.as_ref().map_or(0, Vec::len);
    let colors = colors.ok_or(StudioError::ColorCount { found, expected })?;
    let atlas = TriangleAtlas::try_new(scan.faces.len(), side)?;
    let pixels = atlas.paint(|face, [b, c]| {
        let corners = scan.faces[face].map(|v| colors[v as usize].map(f64::from));
        std::array::from_fn(|k| {
            let mixed = corners[0][k] * (1.0 - b - c) + corners[1][k] * b + corners[2][k] * c;
            mixed.round() as u8
        })
    });
    let picture = write_color_png([side, side], &pixels);
    let picture = picture.map_err(|e: FormatError| StudioError::Picture { reason: e.to_string() })?;
    let mut divided = Divided::of(scan, parts.max(1));
    let share = |k: usize| k as f64 / divided.parts as f64;
    let per_face = grid(divided.parts);
    let coords = (0..scan.faces.len())
        .flat_map(|face| per_face.iter().map(move |&[i, j]| (face, [i, j])))
        .map(|(face, [i, j])| atlas.coords(face, [share(i), share(j)]).map(|c| c as f32))
        .collect();
    let texture = RawTexture {
        coords,
        corners: Some(std::mem::take(&mut divided.corners)),
        face_materials: vec![0; divided.faces.len()],
        materials: vec![RawMaterial { name: "scan".into(), picture: Some(0), ..RawMaterial::default() }],
        pictures: vec![EncodedPicture { name: "scan.png".into(), bytes: picture }],
    };
    Ok(RawMesh { points: divided.points, faces: divided.faces, texture: Some(texture), ..RawMesh::default() })
}

/// The places of a triangle's points by their steps towards the second and the third corner.
fn grid(parts: usize) -> Vec<[usize; 2]> {
    (0..=parts).flat_map(|j| (0..=parts - j).map(move |i| [i, j])).collect()
}

/// A mesh of which each triangle is divided.
struct Divided {
    parts: usize,
    points: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    /// The place of each corner among those of all triangles' grids.
    corners: Vec<[u32; 3]>,
}

impl Divided {
    fn of(mesh: &RawMesh, parts: usize) -> Self {
        let mut divided = Self { parts, points: mesh.points.clone(), faces: Vec::new(), corners: Vec::new() };
        if parts == 1 {
            divided.faces = mesh.faces.clone();
            divided.corners = (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
            return divided;
        }
        let places = grid(parts);
        let at = |i: usize, j: usize| (0..j).map(|row| parts + 1 - row).sum::<usize>() + i;
        let mut on_edges: HashMap<(u32, u32), u32> = HashMap::new();
        let mut of_grid = vec![0; places.len()];
        for (f, &[a, b, c]) in mesh.faces.iter().enumerate() {
            for (slot, &[i, j]) in of_grid.iter_mut().zip(&places) {
                *slot = divided.vertex([a, b, c], [parts - i - j, i, j], &mut on_edges);
            }
            let first = (f * places.len()) as u32;
            for &[i, j] in places.iter().filter(|[i, j]| i + j < parts) {
                let upright = [at(i, j), at(i + 1, j), at(i, j + 1)];
                let turned = (i + j + 1 < parts).then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                for corners in std::iter::once(upright).chain(turned) {
                    divided.faces.push(corners.map(|k| of_grid[k]));
                    divided.corners.push(corners.map(|k| first + k as u32));
                }
            }
        }
        divided
    }

    /// The vertex at steps towards each corner: a corner, one on an edge that two triangles share, or a new one.
    fn vertex(&mut self, corners: [u32; 3], steps: [usize; 3], on_edges: &mut HashMap<(u32, u32), u32>) -> u32 {
        if let Some(k) = (0..3).find(|&k| steps[k] == self.parts) {
            return corners[k];
        }
        if let Some(k) = (0..3).find(|&k| steps[k] == 0) {
            let (a, b, step) = (corners[(k + 1) % 3], corners[(k + 2) % 3], steps[(k + 2) % 3]);
            let (from, to, step) = if a < b { (a, b, step) } else { (b, a, self.parts - step) };
            let known = on_edges.get(&(from, to)).copied();
            let first = known.unwrap_or_else(|| {
                let first = self.points.len() as u32;
                on_edges.insert((from, to), first);
                for k in 1..self.parts {
                    let mut shares = [0; 3];
                    (shares[0], shares[1]) = (self.parts - k, k);
                    self.push([from, to, to], shares);
                }
                first
            });
            return first + step as u32 - 1;
        }
        self.push(corners, steps);
        self.points.len() as u32 - 1
    }

    fn push(&mut self, corners: [u32; 3], steps: [usize; 3]) {
        let points = corners.map(|v| self.points[v as usize]);
        let mixed = |c: usize| (0..3).map(|k| points[k][c] * steps[k] as f64).sum::<f64>() / self.parts as f64;
        self.points.push(std::array::from_fn(mixed));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_texture_picture;
    use crate::geometry::{Adjacency, TriMesh, sphere};

    fn ball() -> RawMesh {
        let mesh = sphere(8, 12);
        let points: Vec<[f64; 3]> = mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect();
        let colors = points.iter().map(|p| p.map(|c| (120.0 + 100.0 * c).round() as u8)).collect();
        let faces = mesh.faces().iter().map(|f| f.map(|v| v.0)).collect();
        RawMesh { points, faces, colors: Some(colors), ..RawMesh::default() }
    }

    #[test]
    fn a_divided_scan_is_the_same_closed_surface() {
        let whole = ball();
        let mesh = |raw: &RawMesh| {
            TriMesh::try_from_indices(raw.points.iter().map(|&p| p.into()).collect(), &raw.faces).unwrap()
        };
        for parts in [1, 2, 5] {
            let divided = with_picture(&whole, parts, 512).unwrap();
            assert_eq!(divided.faces.len(), parts * parts * whole.faces.len());
            let surface = mesh(&divided);
            assert!((surface.area() / mesh(&whole).area() - 1.0).abs() < 1e-12);
            assert_eq!(Adjacency::prepare(&surface).boundary_edges().len(), 0);
        }
    }

    #[test]
    fn the_picture_has_the_colour_of_each_vertex_at_its_coordinates() {
        let whole = ball();
        let colors = whole.colors.as_ref().unwrap();
        let divided = with_picture(&whole, 1, 512).unwrap();
        let texture = divided.texture.unwrap();
        let picture = read_texture_picture(&texture.pictures[0].bytes).unwrap();
        for (f, &face) in divided.faces.iter().enumerate() {
            for (v, [u, w]) in face.into_iter().zip(texture.coords_of(f, face).unwrap()) {
                let (x, y) = ((u * 512.0) as usize, ((1.0 - w) * 512.0) as usize);
                let found = picture.pixels[y * 512 + x];
                // Half a pixel of a chart of 20.
                assert!((0..3).all(|k| found[k].abs_diff(colors[v as usize][k]) <= 5), "{f} {v}");
            }
        }
    }

    #[test]
    fn a_picture_that_is_too_small_is_refused() {
        let said = with_picture(&ball(), 1, 60).unwrap_err().to_string();
        assert_eq!(said, "a picture of 60 pixels is too small for the charts of all triangles");
        let bare = RawMesh { colors: None, ..ball() };
        assert!(matches!(with_picture(&bare, 1, 512), Err(StudioError::ColorCount { found: 0, .. })));
    }
}
