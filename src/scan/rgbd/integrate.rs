//! A view's depths averaged into the volume.

use super::view::{BEYOND, UNCOLORED, View};
use super::volume::{Block, FULL, SIDE, Tint, Volume, Voxel, WEIGHT_UNIT, floor};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

/// Every so many pixels a ray opens blocks: a block of 32 mm is 6 pixels at 2 m.
const STRIDE: usize = 2;
/// A ray that looks past the person clears what lies on it, but counts less than one that ends on a surface: a swaying
/// arm must not be rubbed out by its own neighbourhood.
const CLEARING: f32 = 0.25;
/// Colours are taken within this share of the truncation around the surface.
const COLORED: f32 = 0.5;
/// Evidence beyond which a voxel's mean goes on as a running one, in views.
const MOST_VIEWS: f32 = 900.0;

impl Volume {
    /// Averages a view seen from `model_from_camera`.
    ///
    /// **Source** Curless & Levoy 1996; Newcombe et al. 2011 §3.3.
    ///
    /// **Guarantees** the same voxels with any number of threads: each block is one thread's, views come one after
    /// the other.
    pub(super) fn integrate(&mut self, view: &View, model_from_camera: &Isometry3<f64>) {
        self.open_blocks(view, model_from_camera);
        let camera_from_model = model_from_camera.inverse().cast::<f32>();
        let (stamp, voxel, truncation) = (self.stamp, self.voxel, self.truncation);
        let averaging = Averaging::new(view, camera_from_model, voxel, truncation);
        let blocks = self.blocks.par_iter_mut().with_min_len(64);
        if self.tints.is_empty() {
            blocks.filter(|b| b.stamp == stamp).for_each(|block| averaging.average(block, None));
        } else {
            let both = blocks.zip(self.tints.par_iter_mut()).filter(|(b, _)| b.stamp == stamp);
            both.for_each(|(block, tint)| averaging.average(block, Some(tint)));
        }
    }

    /// Makes or stamps every block that the view says something about.
    fn open_blocks(&mut self, view: &View, model_from_camera: &Isometry3<f64>) {
        self.stamp += 1;
        let pose = model_from_camera.cast::<f32>();
        let origin = Point3::from(pose.translation.vector);
        let inverse = 1.0 / self.block_size();
        let mut last = [i32::MAX; 3];
        // Half a block at a step misses no block that matters: a neighbouring ray meets it.
        let steps = (4.0 * self.truncation * inverse).ceil().max(2.0) as usize;
        for row in (0..view.camera.height).step_by(STRIDE) {
            for column in (0..view.camera.width).step_by(STRIDE) {
                let i = row * view.camera.width + column;
                let z = view.depth[i];
                if view.evidence[i] <= 0.0 {
                    continue;
                }
                let ray = view.camera.point(column as f64, row as f64, 1.0).coords.cast::<f32>();
                let seen = pose.rotation * (ray * z);
                let reach = pose.rotation * ray.normalize() * self.truncation;
                for k in 0..=steps {
                    let p = origin + seen + reach * (2.0 * k as f32 / steps as f32 - 1.0);
                    let at = [p.x, p.y, p.z].map(|c| floor(c * inverse));
                    if at != last {
                        let index = self.block_or_new(at);
                        self.blocks[index as usize].stamp = self.stamp;
                        last = at;
                    }
                }
            }
        }
    }
}

/// A view seen from a block, ready to be averaged.
struct Averaging<'a> {
    view: &'a View,
    camera_from_model: Isometry3<f32>,
    voxel: f32,
    /// One over the truncation.
    inverse: f32,
    /// Steps from voxel to voxel along x, y, z, in the camera's frame.
    along: [Vector3<f32>; 3],
}

/// What a view says of a row of voxels: reckoned for all of them at once, which the processor does four at a time.
struct Row {
    /// [`OUTSIDE`] where the camera does not look.
    pixel: [u32; SIDE],
    /// From the surface, in truncations, at most 1.
    distance: [f32; SIDE],
    /// Of what the pixel shows; 0 for nothing.
    evidence: [f32; SIDE],
}

const OUTSIDE: u32 = u32::MAX;

impl<'a> Averaging<'a> {
    fn new(view: &'a View, camera_from_model: Isometry3<f32>, voxel: f32, truncation: f32) -> Self {
        let along = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| camera_from_model.rotation * e * voxel);
        Self { view, camera_from_model, voxel, inverse: 1.0 / truncation, along }
    }

    fn average(&self, block: &mut Block, mut tint: Option<&mut Tint>) {
        let corner = Point3::from(Vector3::from(block.at.map(|c| (c * SIDE as i32) as f32 * self.voxel)));
        let first = self.camera_from_model * corner;
        for (row, voxels) in block.voxels.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
            let start = first + self.along[1] * (row % SIDE) as f32 + self.along[2] * (row / SIDE) as f32;
            let seen = self.row(&start);
            let evidence = blend(voxels, &seen);
            let Some(tint) = tint.as_deref_mut() else { continue };
            for (i, &evidence) in evidence.iter().enumerate() {
                if evidence > 0.0
                    && seen.distance[i].abs() < COLORED
                    && let Some(color) = self.view.colors.get(seen.pixel[i] as usize).filter(|c| **c != UNCOLORED)
                {
                    color_in(tint, row * SIDE + i, *color, evidence * evidence);
                }
            }
        }
    }

    fn row(&self, start: &Point3<f32>) -> Row {
        let camera = &self.view.camera;
        let (w, h) = (camera.width as f32, camera.height as f32);
        let (fx, fy) = (camera.fx as f32, camera.fy as f32);
        let (cx, cy) = (camera.cx as f32 + 0.5, camera.cy as f32 + 0.5);
        let step = self.along[0];
        let (mut pixels, mut depths, mut stretch) = ([OUTSIDE; SIDE], [0.0f32; SIDE], [0.0f32; SIDE]);
        for i in 0..SIDE {
            let t = i as f32;
            let (x, y, z) = (start.x + step.x * t, start.y + step.y * t, start.z + step.z * t);
            let near = 1.0 / z;
            let (u, v) = (fx * x * near + cx, fy * y * near + cy);
            // Single ands, no early way out; NaN is no number of any side.
            let inside = (u >= 0.0) & (v >= 0.0) & (u < w) & (v < h) & (z > 0.0);
            let pixel = (v as i32).wrapping_mul(camera.width as i32).wrapping_add(u as i32);
            pixels[i] = if inside { pixel as u32 } else { OUTSIDE };
            depths[i] = z;
            // Along the ray, not along z: the same truncation in the middle and at the border of the image.
            stretch[i] = (x * x + y * y + z * z).sqrt() * near * self.inverse;
        }
        let mut row = Row { pixel: pixels, distance: [0.0; SIDE], evidence: [0.0; SIDE] };
        for (i, &pixel) in pixels.iter().enumerate() {
            if let Some(&z) = self.view.depth.get(pixel as usize) {
                row.distance[i] = z;
                row.evidence[i] = if z == BEYOND { CLEARING } else { self.view.evidence[pixel as usize] };
            }
        }
        for i in 0..SIDE {
            row.distance[i] = ((row.distance[i] - depths[i]) * stretch[i]).min(1.0);
        }
        row
    }
}

/// The nearest whole number of what is not negative and fits.
fn nearest(value: f32) -> u16 {
    (value + 0.5) as i32 as u16
}

/// Averages a row; what is behind the surface, or not seen, stays as it is. The evidence that went in.
fn blend(voxels: &mut [Voxel; SIDE], seen: &Row) -> [f32; SIDE] {
    let mut evidence = [0.0; SIDE];
    for (i, voxel) in voxels.iter_mut().enumerate() {
        // No branches: nothing new leaves mean and weight as they are, to the last bit.
        let distance = seen.distance[i];
        evidence[i] = if distance >= -1.0 { seen.evidence[i] } else { 0.0 };
        let (old, new) = (f32::from(voxel.weight), evidence[i] * WEIGHT_UNIT);
        let total = old + new;
        let mean = (f32::from(voxel.distance) * old + distance.max(-1.0) * FULL * new) / total.max(1e-6);
        voxel.distance = (mean + 0.5f32.copysign(mean)) as i32 as i16;
        voxel.weight = nearest(total.min(MOST_VIEWS * WEIGHT_UNIT));
    }
    evidence
}

fn color_in(tint: &mut Tint, at: usize, color: [u8; 3], evidence: f32) {
    let (old, new) = (f32::from(tint.weight[at]), evidence * WEIGHT_UNIT);
    let total = old + new;
    if total < 0.5 {
        return;
    }
    for (channel, value) in tint.color[at].iter_mut().zip(color) {
        *channel = nearest((f32::from(*channel) * old + f32::from(value) * 256.0 * new) / total);
    }
    tint.weight[at] = nearest(total.min(MOST_VIEWS * WEIGHT_UNIT));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::rgbd::camera::RgbdCamera;
    use crate::scan::rgbd::volume::Reader;

    #[test]
    fn a_wall_is_averaged_to_where_it_is_and_the_same_with_one_thread() {
        let camera =
            RgbdCamera { width: 64, height: 64, fx: 100.0, fy: 100.0, cx: 31.5, cy: 31.5, distortion: [0.0; 5] };
        let wall = |z: f32| View::prepare(camera.clone(), vec![z; 64 * 64], vec![[200, 100, 0]; 64 * 64]);
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
        assert_eq!(volume.tints[block].color[0].map(|c| c / 256), [200, 100, 0]);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(made);
        assert_eq!(volume.blocks.len(), alone.blocks.len());
        assert!(volume.blocks.iter().zip(&alone.blocks).all(|(a, b)| a.at == b.at && a.voxels == b.voxels));
        assert_eq!(volume.tints, alone.tints);
    }
}
