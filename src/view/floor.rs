//! The soft shadow that a subject casts on the floor.
//!
//! It stays because a plain raster does not show where the floor is: without it the figures float. It takes 8 % of the
//! time of a picture (`render_mesh`, five layers of the demo, two views).

use super::raster::{Grid, NOTHING, Visibility};
use super::surface::Triple;
use crate::geometry::Aabb;

/// Samples along each side of the floor.
const SIZE: usize = 320;
/// Metres of floor around the subject.
const BORDER: f32 = 0.45;
/// Upper height of a slab above the floor in metres, the blur of its shadow in metres, and its darkness, 0–1: the sole
/// of a shoe leaves a sharp dark line, a skirt a wide haze.
const LEVELS: [[f32; 3]; 4] = [[0.04, 0.014, 0.60], [0.15, 0.04, 0.40], [0.6, 0.10, 0.34], [2.5, 0.20, 0.40]];

/// The darkness of the floor, prepared for one scene.
pub(super) struct Floor {
    /// Height in the world, in metres.
    pub(super) height: f64,
    middle: [f32; 2],
    grid: Grid,
    darkness: Vec<f32>,
}

impl Floor {
    /// Draws the scene as seen from below; the floor is at the lower side of `bounds`.
    ///
    /// **Shapes** `world` V × 3, `faces` F × 3.
    pub(super) fn prepare(world: &[[f32; 3]], faces: &[[u32; 3]], bounds: &Aabb) -> Self {
        let (middle, extent) = (bounds.center(), bounds.extent());
        let middle = [middle.x as f32, middle.z as f32];
        let low = bounds.min.y as f32;
        let reach = (extent.x.max(extent.z) as f32) + 2.0 * BORDER;
        let grid = Grid { columns: SIZE, rows: SIZE, step: reach / SIZE as f32 };
        let from_below: Vec<Triple> =
            world.iter().map(|p| Triple::new(p[0] - middle[0], p[2] - middle[1], low - p[1])).collect();
        let seen = Visibility::draw(&from_below, faces, grid);
        let mut darkness = vec![0.0; SIZE * SIZE];
        let mut from_height = 0.0;
        for [to_height, spread, strength] in LEVELS {
            let mut covered: Vec<f32> = (0..SIZE * SIZE)
                .map(|i| {
                    let hit = seen.at(i % SIZE, i / SIZE);
                    let height = -hit.nearness;
                    let here = hit.face != NOTHING && height >= from_height && height < to_height;
                    f32::from(u8::from(here))
                })
                .collect();
            for _ in 0..3 {
                covered = blurred(&blurred(&covered, spread / grid.step), spread / grid.step);
            }
            for (dark, cover) in darkness.iter_mut().zip(covered) {
                *dark = 1.0 - (1.0 - *dark) * (1.0 - strength * cover);
            }
            from_height = to_height;
        }
        Self { height: bounds.min.y, middle, grid, darkness }
    }

    /// Fraction of light that the scene takes from the floor at a world point.
    pub(super) fn darkness_at(&self, x: f64, z: f64) -> f32 {
        let [column, row] = self.grid.cell_of(x as f32 - self.middle[0], z as f32 - self.middle[1]);
        let (column, row) = (column - 0.5, row - 0.5);
        if !(column >= 0.0 && row >= 0.0 && column < (SIZE - 1) as f32 && row < (SIZE - 1) as f32) {
            return 0.0;
        }
        let (c, r) = (column as usize, row as usize);
        let (fc, fr) = (column - c as f32, row - r as f32);
        let at = |c: usize, r: usize| self.darkness[r * SIZE + c];
        (at(c, r) * (1.0 - fc) + at(c + 1, r) * fc) * (1.0 - fr)
            + (at(c, r + 1) * (1.0 - fc) + at(c + 1, r + 1) * fc) * fr
    }
}

/// A running mean along each row, transposed: two calls blur both axes, three such pairs are nearly a Gaussian.
fn blurred(grid: &[f32], radius: f32) -> Vec<f32> {
    let radius = (radius.round() as usize).clamp(1, SIZE / 2 - 1);
    let mut out = vec![0.0; SIZE * SIZE];
    for (row, line) in grid.chunks_exact(SIZE).enumerate() {
        let mut sum = 0.0;
        for column in 0..SIZE + radius {
            if column < SIZE {
                sum += line[column];
            }
            if column > 2 * radius {
                sum -= line[column - 2 * radius - 1];
            }
            if column >= radius {
                out[(column - radius) * SIZE + row] = sum.max(0.0) / (2 * radius + 1) as f32;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn a_low_plate_casts_a_darker_shadow_than_a_high_one() {
        let shadow = |height: f32| {
            let world =
                [[-0.2, height, -0.2], [0.2, height, -0.2], [0.2, height, 0.2], [-0.2, height, 0.2], [0.0, 0.0, 0.0]];
            let bounds = Aabb { min: Point::new(-0.2, 0.0, -0.2), max: Point::new(0.2, 1.0, 0.2) };
            Floor::prepare(&world, &[[0, 1, 2], [0, 2, 3]], &bounds)
        };
        let (low, high) = (shadow(0.01), shadow(0.9));
        assert!(low.darkness_at(0.0, 0.0) > 0.35 && high.darkness_at(0.0, 0.0) < 0.2);
        assert!(high.darkness_at(0.3, 0.0) > low.darkness_at(0.3, 0.0));
        assert_eq!(low.darkness_at(9.0, 0.0), 0.0);
    }

    #[test]
    fn a_blur_keeps_the_sum_and_the_middle() {
        let mut grid = vec![0.0; SIZE * SIZE];
        grid[100 * SIZE + 150] = 1.0;
        let soft = blurred(&blurred(&grid, 5.0), 5.0);
        assert!((soft.iter().sum::<f32>() - 1.0).abs() < 1e-3);
        assert!((soft[104 * SIZE + 146] - 1.0 / 121.0).abs() < 1e-5 && soft[106 * SIZE + 150] < 1e-6);
    }
}
