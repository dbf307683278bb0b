//! Allocates blocks of voxels where a frame shows the person.

use super::camera::Rays;
use super::view::{BEYOND, PersonFrame};
use super::volume::{Volume, whole};
use crate::numerics::{Kernel, Processor};
use nalgebra::Isometry3;

/// Pixels between the rays that allocate blocks: a block of 32 mm is 6 pixels wide at 2 m.
const STRIDE: usize = 2;

impl Volume {
    /// Allocates or stamps every block that the frame measures.
    pub(super) fn open_blocks(&mut self, view: &PersonFrame, model_from_camera: &Isometry3<f64>) {
        self.stamp += 1;
        let rays = Rays::new(&view.camera, model_from_camera, self.block_size());
        let reach = self.truncation / self.block_size();
        // Steps of half a block miss no relevant block: a neighbouring ray meets it.
        let steps = (4.0 * reach).ceil().max(2.0) as usize;
        let reaches: Vec<f32> = (0..=steps).map(|k| reach * (2.0 * k as f32 / steps as f32 - 1.0)).collect();
        let processor = Processor::detect();
        let mut met = Met::default();
        // The previous ray's block at each step: usually the same.
        let mut last = vec![[i32::MAX; 3]; reaches.len()];
        for row in (0..view.camera.height).step_by(STRIDE) {
            processor.dispatch(MarchRow { view, rays: &rays, reaches: &reaches, row, met: &mut met });
            for (blocks, last) in met.blocks.chunks_exact(met.depths.len().max(1)).zip(&mut last) {
                for &at in blocks {
                    if at != *last {
                        let index = self.block_or_new(at);
                        self.stamps[index as usize] = self.stamp;
                        *last = at;
                    }
                }
            }
        }
    }
}

/// The blocks that the rays of a row of pixels meet.
#[derive(Default)]
struct Met {
    /// Columns and depths of the person's pixels.
    columns: Vec<f32>,
    depths: Vec<f32>,
    /// Blocks, those of all rays at the first step, then those at the second.
    blocks: Vec<[i32; 3]>,
}

/// A row of pixels to march through with the best vector instructions of the processor.
struct MarchRow<'a> {
    view: &'a PersonFrame,
    /// In blocks.
    rays: &'a Rays,
    /// Truncation before and behind the surface, in blocks.
    reaches: &'a [f32],
    row: usize,
    met: &'a mut Met,
}

impl Kernel for MarchRow<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { view, rays, reaches, row, met } = self;
        met.columns.clear();
        met.depths.clear();
        met.blocks.clear();
        let pixels = &view.pixels[row * view.camera.width..][..view.camera.width];
        for (column, pixel) in pixels.iter().enumerate().step_by(STRIDE) {
            if pixel.evidence > 0.0 && pixel.depth < BEYOND {
                met.columns.push(column as f32);
                met.depths.push(pixel.depth);
            }
        }
        let first = rays.first + rays.down * row as f32;
        for reach in reaches {
            met.blocks.extend(met.columns.iter().zip(&met.depths).map(|(&column, &depth)| {
                let [x, y, z] = [0, 1, 2].map(|axis| first[axis] + rays.across[axis] * column);
                // Along an oblique ray the truncation covers less depth.
                let at = depth + reach / (x * x + y * y + z * z).sqrt();
                // The largest integer below.
                [rays.origin.x + x * at, rays.origin.y + y * at, rays.origin.z + z * at].map(|c| whole(c - 0.5))
            }));
        }
    }
}
