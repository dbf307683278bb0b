//! Finds the visible triangle at each sample of a grid: a z-buffer of face indices.
//!
//! Corners are snapped to 1/256 of a sample and the edge functions are exact integers with the top-left rule, so
//! that neighbouring triangles leave neither gap nor double cover between them (Pineda 1988; Giesen 2013).

use super::surface::Triple;
use rayon::prelude::*;

/// Steps of a corner's coordinate within one sample.
const SUBSAMPLE: i64 = 256;
/// Rows per parallel task: small enough to balance, large enough that few triangles are visited twice.
const ROWS_PER_BAND: usize = 48;
/// Triangles with a corner farther out than this many samples are not drawn: products of two coordinates must fit 64 bits.
const FARTHEST: f32 = 4.0e6;

/// No triangle here.
pub(super) const NOTHING: u32 = u32::MAX;

/// The visible triangle at one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// The triangle, or [`NOTHING`].
    pub(super) face: u32,
    /// Metres toward the camera; the greatest is visible.
    pub(super) nearness: f32,
}

/// A grid of samples over the plane of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Metres between samples.
    pub(super) step: f32,
}

impl Grid {
    /// Grid coordinates (column from the left, row from the top) of a point of the picture's plane.
    pub(super) fn cell_of(&self, x: f32, y: f32) -> [f32; 2] {
        [x / self.step + 0.5 * self.columns as f32, 0.5 * self.rows as f32 - y / self.step]
    }

    /// The centre of a sample on the picture's plane.
    pub(super) fn view_of(&self, column: usize, row: usize) -> [f32; 2] {
        [
            (column as f32 + 0.5 - 0.5 * self.columns as f32) * self.step,
            (0.5 * self.rows as f32 - row as f32 - 0.5) * self.step,
        ]
    }
}

/// The visible triangles at all samples of a grid.
pub(super) struct Visibility {
    pub(super) grid: Grid,
    hits: Vec<Hit>,
}

impl Visibility {
    /// Draws both sides of all triangles; of two at equal depth the first is visible.
    ///
    /// **Shapes** `positions` V, `faces` F × 3.
    pub(super) fn draw(positions: &[Triple], faces: &[[u32; 3]], grid: Grid) -> Self {
        let corners: Vec<SnappedVertex> = positions.par_iter().map(|p| SnappedVertex::snapped(p, &grid)).collect();
        let mut bands = vec![Vec::new(); grid.rows.div_ceil(ROWS_PER_BAND)];
        for (face, ids) in faces.iter().enumerate() {
            let Some(rows) = rows_of(ids.map(|v| corners[v as usize]), &grid) else { continue };
            for band in &mut bands[rows[0] / ROWS_PER_BAND..=rows[1] / ROWS_PER_BAND] {
                band.push(face as u32);
            }
        }
        let nothing = Hit { face: NOTHING, nearness: f32::NEG_INFINITY };
        let mut hits = vec![nothing; grid.columns * grid.rows];
        hits.par_chunks_mut(grid.columns * ROWS_PER_BAND).zip(&bands).enumerate().for_each(
            |(band, (hits, band_faces))| {
                for &face in band_faces {
                    let ids = faces[face as usize];
                    fill(face, ids.map(|v| corners[v as usize]), hits, grid.columns, band * ROWS_PER_BAND);
                }
            },
        );
        Self { grid, hits }
    }

    /// The visible triangle at one sample.
    pub(super) fn at(&self, column: usize, row: usize) -> Hit {
        self.hits[row * self.grid.columns + column]
    }

    /// The visible triangle at a point of the picture's plane; `None` outside the picture.
    pub(super) fn under(&self, x: f32, y: f32) -> Option<Hit> {
        let [column, row] = self.grid.cell_of(x, y);
        let inside = column >= 0.0 && row >= 0.0 && column < self.grid.columns as f32 && row < self.grid.rows as f32;
        inside.then(|| self.at(column as usize, row as usize))
    }
}

/// A vertex on the grid.
#[derive(Clone, Copy)]
struct SnappedVertex {
    x: i64,
    y: i64,
    nearness: f32,
}

impl SnappedVertex {
    fn snapped(p: &Triple, grid: &Grid) -> Self {
        let [x, y] = grid.cell_of(p.x, p.y);
        if !(x.abs() < FARTHEST && y.abs() < FARTHEST) {
            return Self { x: i64::MAX, y: i64::MAX, nearness: p.z };
        }
        Self { x: (x * SUBSAMPLE as f32).round() as i64, y: (y * SUBSAMPLE as f32).round() as i64, nearness: p.z }
    }
}

/// First and last sample whose centre is between two coordinates, within `count`.
fn samples_between(low: i64, high: i64, count: usize) -> Option<[usize; 2]> {
    let first = (low - SUBSAMPLE / 2 + SUBSAMPLE - 1).div_euclid(SUBSAMPLE).max(0);
    let last = (high - SUBSAMPLE / 2).div_euclid(SUBSAMPLE).min(count as i64 - 1);
    (first <= last).then_some([first as usize, last as usize])
}

fn rows_of(corners: [SnappedVertex; 3], grid: &Grid) -> Option<[usize; 2]> {
    let ys = corners.map(|c| c.y);
    let xs = corners.map(|c| c.x);
    if xs.contains(&i64::MAX) {
        return None;
    }
    let (low, high) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
    let (left, right) = (xs[0].min(xs[1]).min(xs[2]), xs[0].max(xs[1]).max(xs[2]));
    samples_between(left, right, grid.columns)?;
    samples_between(low, high, grid.rows)
}

/// Draws one triangle into the rows from `first_row` on.
fn fill(face: u32, corners: [SnappedVertex; 3], hits: &mut [Hit], columns: usize, first_row: usize) {
    let [a, mut b, mut c] = corners;
    let cross =
        |p: &SnappedVertex, q: &SnappedVertex, x: i64, y: i64| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    let mut area = cross(&a, &b, c.x, c.y);
    if area == 0 {
        return;
    }
    if area < 0 {
        std::mem::swap(&mut b, &mut c);
        area = -area;
    }
    let (left, right) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
    let Some([first_column, last_column]) = samples_between(left, right, columns) else { return };
    let offset = first_row as i64 * SUBSAMPLE;
    let (low, high) = (a.y.min(b.y).min(c.y) - offset, a.y.max(b.y).max(c.y) - offset);
    let Some([low, high]) = samples_between(low, high, hits.len() / columns) else { return };

    // Edge opposite to each corner; a sample on an edge belongs to the triangle whose top or left edge it is.
    let edges = [(&b, &c), (&c, &a), (&a, &b)];
    let bias = edges.map(|(p, q)| {
        let is_top_or_left = q.y < p.y || (q.y == p.y && q.x > p.x);
        if is_top_or_left { 0 } else { -1 }
    });
    let x = first_column as i64 * SUBSAMPLE + SUBSAMPLE / 2;
    let per_column = edges.map(|(p, q)| -(q.y - p.y) * SUBSAMPLE);
    let per_area = 1.0 / area as f32;
    for row in low..=high {
        let y = (first_row + row) as i64 * SUBSAMPLE + SUBSAMPLE / 2;
        let mut weight = edges.map(|(p, q)| cross(p, q, x, y));
        for hit in &mut hits[row * columns + first_column..=row * columns + last_column] {
            if (0..3).all(|k| weight[k] + bias[k] >= 0) {
                let [_, wb, wc] = weight.map(|w| w as f32 * per_area);
                let nearness = a.nearness + wb * (b.nearness - a.nearness) + wc * (c.nearness - a.nearness);
                if nearness > hit.nearness {
                    *hit = Hit { face, nearness };
                }
            }
            for k in 0..3 {
                weight[k] += per_column[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { columns: 64, rows: 100, step: 0.02 };

    fn draw(points: &[[f32; 3]], faces: &[[u32; 3]]) -> Visibility {
        let positions: Vec<_> = points.iter().map(|&p| Triple::from(p)).collect();
        Visibility::draw(&positions, faces, GRID)
    }

    #[test]
    fn a_fan_covers_each_sample_of_its_square_once() {
        // Corners on sample middles, where only the top-left rule decides.
        let (s, t) = (0.61_f32, 0.59_f32);
        let points = [[-s, -t, 0.0], [t, -t, 0.0], [t, s, 0.0], [-s, s, 0.0], [0.13, -0.07, 0.0]];
        let faces = [[0, 1, 4], [1, 2, 4], [4, 2, 3], [3, 0, 4]];
        let mut covers = vec![0; GRID.columns * GRID.rows];
        for face in faces {
            let seen = draw(&points, &[face]);
            for (count, hit) in covers.iter_mut().zip(&seen.hits) {
                *count += i32::from(hit.face != NOTHING);
            }
        }
        let once = covers.iter().filter(|&&count| count == 1).count();
        assert_eq!((once, covers.iter().max()), (60 * 60, Some(&1)));
    }

    #[test]
    fn the_nearer_triangle_is_seen_whatever_the_order() {
        let points = [
            [-0.5, -0.5, 0.1],
            [0.5, -0.5, 0.1],
            [0.0, 0.5, 0.1],
            [-0.5, -0.5, 0.3],
            [0.5, -0.5, 0.3],
            [0.0, 0.5, 0.3],
        ];
        let far_first = draw(&points, &[[0, 1, 2], [3, 4, 5]]);
        let near_first = draw(&points, &[[3, 4, 5], [0, 2, 1]]);
        let hit = far_first.under(0.0, 0.0).unwrap();
        assert_eq!((hit.face, near_first.under(0.0, 0.0).unwrap().face), (1, 0));
        assert!((hit.nearness - 0.3).abs() < 1e-5);
        assert_eq!(far_first.under(0.0, 5.0), None);
    }

    #[test]
    fn triangles_far_outside_do_no_harm() {
        let seen = draw(&[[-1e9, -1e9, 0.0], [1e9, 0.0, 0.0], [0.0, f32::NAN, 0.0]], &[[0, 1, 2]]);
        assert!(seen.hits.iter().all(|hit| hit.face == NOTHING));
    }
}
