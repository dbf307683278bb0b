//! Integrates the depths of a frame into the volume.

use super::view::{PersonFrame, UNKNOWN_COLOR};
use super::volume::{Block, FULL, SIDE, Tint, Volume, Voxel, WEIGHT_UNIT, whole};
use crate::numerics::{Kernel, Processor};
use nalgebra::{Isometry3, Matrix3, Vector3};
use rayon::prelude::*;

/// Distance from the surface within which colours are averaged, as a share of the truncation.
const COLORED: f32 = 0.5;
/// Evidence above which a voxel's mean becomes a running mean, in views.
const MOST_VIEWS: f32 = 900.0;

impl Volume {
    /// Integrates a frame taken from `model_from_camera`.
    ///
    /// **Source** Curless & Levoy 1996; Newcombe et al. 2011 §3.3.
    ///
    /// **Guarantees** the same voxels with any number of threads and with any processor's vector instructions: one
    /// thread updates each block, frames follow one another, and the vector instructions round like the scalar ones.
    pub(super) fn integrate(&mut self, view: &PersonFrame, model_from_camera: &Isometry3<f64>) {
        self.open_blocks(view, model_from_camera);
        let averaging = Averaging::new(view, model_from_camera, self.voxel, self.truncation);
        let (stamp, processor) = (self.stamp, Processor::detect());
        let blocks = self.blocks.par_iter_mut().zip(&self.stamps).with_min_len(64);
        if self.tints.is_empty() {
            let seen = blocks.filter(|(_, s)| **s == stamp);
            seen.for_each(|(block, _)| processor.dispatch(Average { averaging: &averaging, block, tint: None }));
        } else {
            let seen = blocks.zip(self.tints.par_iter_mut()).filter(|((_, s), _)| **s == stamp);
            seen.for_each(|((block, _), tint)| {
                processor.dispatch(Average { averaging: &averaging, block, tint: Some(tint) });
            });
        }
    }
}

/// Number of voxels processed together: one layer of a block, long enough for vector instructions.
const LAYER: usize = SIDE * SIDE;

/// A frame prepared for integration.
struct Averaging<'a> {
    view: &'a PersonFrame,
    /// Projection to homogeneous pixel coordinates: column times depth, row times depth, depth.
    image_from_model: Matrix3<f32>,
    image_from_origin: Vector3<f32>,
    voxel: f32,
    /// 1 / truncation.
    inverse: f32,
    /// Homogeneous offset of each voxel of a layer from the first one: columns, rows and depths.
    offsets: [[f32; LAYER]; 3],
    /// Homogeneous offset between layers.
    deeper: Vector3<f32>,
}

/// A block to update with the best vector instructions of the processor. Everything it calls is `inline(always)`, so
/// that it is compiled for these instructions.
struct Average<'a, 'b> {
    averaging: &'b Averaging<'a>,
    block: &'b mut Block,
    tint: Option<&'b mut Tint>,
}

impl Kernel for Average<'_, '_> {
    #[inline(always)]
    fn run(self) {
        self.averaging.average(self.block, self.tint);
    }
}

/// The measurements of a frame for one layer of voxels.
struct VoxelLayer {
    pixel: [u32; LAYER],
    /// Distance from the surface, in truncations, at most 1.
    distance: [f32; LAYER],
    /// 0 behind the surface and where nothing was measured.
    evidence: [f32; LAYER],
}

impl<'a> Averaging<'a> {
    fn new(view: &'a PersonFrame, model_from_camera: &Isometry3<f64>, voxel: f32, truncation: f32) -> Self {
        let camera = &view.camera;
        let image = Matrix3::new(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
        let camera_from_model = model_from_camera.inverse();
        let image_from_model = image * camera_from_model.rotation.to_rotation_matrix().into_inner();
        let along = image_from_model * f64::from(voxel);
        let offset =
            |axis: usize, i: usize| along[(axis, 0)] * (i % SIDE) as f64 + along[(axis, 1)] * (i / SIDE) as f64;
        Self {
            view,
            image_from_model: image_from_model.cast(),
            image_from_origin: (image * camera_from_model.translation.vector).cast(),
            voxel,
            inverse: 1.0 / truncation,
            offsets: std::array::from_fn(|axis| std::array::from_fn(|i| offset(axis, i) as f32)),
            deeper: along.column(2).into_owned().cast(),
        }
    }

    #[inline(always)]
    fn average(&self, block: &mut Block, mut tint: Option<&mut Tint>) {
        let corner = Vector3::from(block.at.map(|c| (c * SIDE as i32) as f32 * self.voxel));
        let first = self.image_from_model * corner + self.image_from_origin;
        let per_metre = self.per_metre(&first);
        for (k, voxels) in block.voxels.as_chunks_mut::<LAYER>().0.iter_mut().enumerate() {
            let seen = self.layer(&(first + self.deeper * k as f32), per_metre);
            let (distances, evidences) = (seen.distance.as_chunks::<SIDE>().0, seen.evidence.as_chunks::<SIDE>().0);
            let voxels = voxels.as_chunks_mut::<SIDE>().0;
            let (rows, count) = rows_with(evidences);
            for row in rows.into_iter().take(count) {
                blend(&mut voxels[row], &distances[row], &evidences[row]);
            }
            if let Some(tint) = tint.as_deref_mut()
                && !self.view.colors.is_empty()
            {
                let (pixels, layer) = (seen.pixel.as_chunks::<SIDE>().0, &mut tint.as_chunks_mut::<SIDE>().0[k]);
                let evidence = near_surface(&seen);
                let evidences = evidence.as_chunks::<SIDE>().0;
                let (rows, count) = rows_with(evidences);
                for row in rows.into_iter().take(count) {
                    self.color_in(&mut layer[row], &pixels[row], &evidences[row]);
                }
            }
        }
    }

    /// Averages the colours of a row, near the surface.
    #[inline(always)]
    fn color_in(&self, tint: &mut [[u16; SIDE]; 4], pixels: &[u32; SIDE], new: &[f32; SIDE]) {
        let colors = pixels.map(|pixel| self.view.colors[pixel as usize]);
        let [red, green, blue, weight] = tint;
        let old = weight.map(f32::from);
        let (mut share, mut total) = ([0.0; SIDE], [0.0; SIDE]);
        for i in 0..SIDE {
            let known = u32::from(colors[i] != UNKNOWN_COLOR).wrapping_neg();
            let new = f32::from_bits(new[i].to_bits() & known);
            let sum = old[i] + new;
            // Evidence that the bits of the weight cannot hold is dropped.
            let counts = u32::from(sum >= 0.5).wrapping_neg();
            share[i] = f32::from_bits((new / sum).to_bits() & counts);
            let most = if sum < MOST_VIEWS * WEIGHT_UNIT { sum } else { MOST_VIEWS * WEIGHT_UNIT };
            total[i] = if sum >= 0.5 { most } else { old[i] };
        }
        *weight = total.map(|total| whole(total) as u16);
        for (c, mean) in [red, green, blue].into_iter().enumerate() {
            let mut sum = [0.0; SIDE];
            for i in 0..SIDE {
                let (old, value) = (f32::from(mean[i]), (colors[i] >> (8 * c) & 0xff) as i32 as f32 * 256.0);
                sum[i] = old + (value - old) * share[i];
            }
            *mean = sum.map(|sum| whole(sum) as u16);
        }
    }

    /// Truncations per metre of depth at a block. The truncation is measured along the ray, so it is equal in the
    /// middle and at the border of the image. The factor changes by less than 1 % over a block and does not shift the
    /// zero.
    #[inline(always)]
    fn per_metre(&self, first: &Vector3<f32>) -> f32 {
        let camera = &self.view.camera;
        let middle = 0.5 * (SIDE - 1) as f32;
        let across =
            [0, 1, 2].map(|axis| first[axis] + self.offsets[axis][LAYER - 1] * 0.5 + self.deeper[axis] * middle);
        let x = (across[0] / across[2] - camera.cx as f32) / camera.fx as f32;
        let y = (across[1] / across[2] - camera.cy as f32) / camera.fy as f32;
        (1.0 + x * x + y * y).sqrt() * self.inverse
    }

    #[inline(always)]
    fn layer(&self, first: &Vector3<f32>, per_metre: f32) -> VoxelLayer {
        let (width, height) = (self.view.camera.width as u32, self.view.camera.height as u32);
        let nowhere = width * height;
        let [columns, rows, depths] = &self.offsets;
        let mut layer = VoxelLayer { pixel: [0; LAYER], distance: [0.0; LAYER], evidence: [0.0; LAYER] };
        let mut depth = [0.0; LAYER];
        for (i, depth) in depth.iter_mut().enumerate() {
            let z = first.z + depths[i];
            let near = 1.0 / z;
            let column = whole((first.x + columns[i]) * near) as u32;
            let row = whole((first.y + rows[i]) * near) as u32;
            // Bitwise `&`, no short circuit. The cast makes negative numbers and NaN large.
            let inside = (column < width) & (row < height) & (z > 0.0);
            let pixel = row.wrapping_mul(width).wrapping_add(column);
            layer.pixel[i] = if inside { pixel } else { nowhere };
            *depth = z;
        }
        for i in 0..LAYER {
            let pixel = self.view.pixels[layer.pixel[i] as usize];
            layer.distance[i] = pixel.depth;
            layer.evidence[i] = pixel.evidence;
        }
        for (i, depth) in depth.into_iter().enumerate() {
            let distance = (layer.distance[i] - depth) * per_metre;
            // A mask instead of a branch, which would prevent vectorisation.
            let counts = u32::from(distance >= -1.0).wrapping_neg();
            layer.evidence[i] = f32::from_bits(layer.evidence[i].to_bits() & counts);
            layer.distance[i] = if distance < 1.0 { distance } else { 1.0 };
        }
        layer
    }
}

/// The rows of a layer that have any evidence, and their number. They are collected first, so that the processor can
/// prefetch the next row.
#[inline(always)]
fn rows_with(evidence: &[[f32; SIDE]]) -> ([usize; SIDE], usize) {
    let (mut rows, mut count) = ([0; SIDE], 0);
    for (row, evidence) in evidence.iter().enumerate() {
        // No value is negative, so the combined bits are 0 only if all values are 0.
        let any = evidence.iter().fold(0, |bits, e| bits | e.to_bits()) != 0;
        rows[count % SIDE] = row;
        count += usize::from(any);
    }
    (rows, count)
}

/// Evidence for the colours of a layer, in units of weight; 0 far from the surface.
#[inline(always)]
fn near_surface(seen: &VoxelLayer) -> [f32; LAYER] {
    let mut new = [0.0; LAYER];
    for (i, new) in new.iter_mut().enumerate() {
        let counts = u32::from(seen.distance[i].abs() < COLORED).wrapping_neg();
        *new = f32::from_bits((seen.evidence[i] * seen.evidence[i] * WEIGHT_UNIT).to_bits() & counts);
    }
    new
}

/// Averages a row. Voxels behind the surface and voxels without a measurement do not change.
#[inline(always)]
fn blend(voxels: &mut [Voxel; SIDE], distance: &[f32; SIDE], evidence: &[f32; SIDE]) {
    for (i, voxel) in voxels.iter_mut().enumerate() {
        // No branches: zero evidence leaves mean and weight unchanged to the last bit.
        let (old, new) = ((voxel.0 >> 16) as i32 as f32, evidence[i] * WEIGHT_UNIT);
        let total = old + new;
        let divisor = if total > 1e-6 { total } else { 1e-6 };
        let mean = (((voxel.0 << 16) as i32 >> 16) as f32 * old + distance[i] * FULL * new) / divisor;
        let weight = if total < MOST_VIEWS * WEIGHT_UNIT { total } else { MOST_VIEWS * WEIGHT_UNIT };
        voxel.0 = (whole(weight) as u32) << 16 | (whole(mean) as u32 & 0xffff);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::rgbd::camera::RgbdCamera;
    use crate::scan::rgbd::volume::Reader;
    use nalgebra::Point3;

    #[test]
    fn a_wall_is_averaged_to_where_it_is_and_the_same_with_one_thread() {
        let camera =
            RgbdCamera { width: 64, height: 64, fx: 100.0, fy: 100.0, cx: 31.5, cy: 31.5, distortion: [0.0; 5] };
        let wall = |z: f32| PersonFrame::prepare(camera.clone(), vec![z; 64 * 64], vec![[200, 100, 0]; 64 * 64]);
        let made = || {
            let mut volume = Volume::colored(0.005, 0.02);
            for (z, turn) in [(1.0, 0.0f64), (1.01, 0.0), (0.99, 0.0)] {
                volume.integrate(&wall(z), &Isometry3::rotation(Vector3::z() * turn));
            }
            volume
        };
        let volume = made();
        let value = Reader::new(&volume).sample(&Point3::new(0.0, 0.0, 0.996 / 0.005)).unwrap();
        assert!((value - 0.2).abs() < 0.01, "4 mm of 20 before the wall: {value}");
        let block = volume.block_at([0, 0, 25]) as usize;
        assert_eq!([0, 1, 2].map(|c| volume.tints[block][0][c][0] / 256), [200, 100, 0]);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(made);
        assert_eq!(volume.blocks.len(), alone.blocks.len());
        assert!(volume.blocks.iter().zip(&alone.blocks).all(|(a, b)| a.at == b.at && a.voxels == b.voxels));
        assert_eq!(volume.tints, alone.tints);
    }

    #[test]
    fn the_processors_vector_instructions_change_no_bit() {
        let camera =
            RgbdCamera { width: 64, height: 64, fx: 100.0, fy: 90.0, cx: 31.0, cy: 33.5, distortion: [0.0; 5] };
        // Bumps with an edge beside them, in many colours, some unknown.
        let bumps =
            (0..64 * 64).map(|i| if i % 64 < 50 { 1.0 + 0.03 * (i as f32 * 0.11).sin() } else { f32::INFINITY });
        let colors =
            (0..64 * 64).map(|i: usize| if i.is_multiple_of(7) { [0; 3] } else { [i as u8, (i / 3) as u8, 9] });
        let view = PersonFrame::prepare(camera, bumps.collect(), colors.collect());
        let pose = |k: usize| Isometry3::new(Vector3::new(0.01 * k as f64, 0.2, 0.0), Vector3::new(0.1, 0.02, 0.3));
        let (mut volume, mut plain) = (Volume::colored(0.005, 0.02), Volume::colored(0.005, 0.02));
        for k in 0..4 {
            volume.integrate(&view, &pose(k));
            plain.open_blocks(&view, &pose(k));
            let averaging = Averaging::new(&view, &pose(k), plain.voxel, plain.truncation);
            for (i, block) in plain.blocks.iter_mut().enumerate().filter(|(i, _)| plain.stamps[*i] == plain.stamp) {
                averaging.average(block, Some(&mut plain.tints[i]));
            }
        }
        assert!(volume.blocks.len() > 100 && volume.blocks.len() == plain.blocks.len());
        assert!(volume.blocks.iter().zip(&plain.blocks).all(|(a, b)| a.at == b.at && a.voxels == b.voxels));
        assert_eq!(volume.tints, plain.tints);
        assert!(volume.tints.iter().flatten().flatten().flatten().any(|&c| c > 0));
    }
}
