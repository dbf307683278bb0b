//! A view's depths averaged into the volume.

use super::view::{BEYOND, UNCOLORED, View};
use super::volume::{Block, FULL, SIDE, Volume, WEIGHT_UNIT};
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
        self.blocks.par_iter_mut().with_min_len(64).filter(|b| b.stamp == stamp).for_each(|block| {
            average(block, view, &camera_from_model, voxel, truncation);
        });
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
                    let at = [p.x, p.y, p.z].map(|c| (c * inverse).floor() as i32);
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

fn average(block: &mut Block, view: &View, camera_from_model: &Isometry3<f32>, voxel: f32, truncation: f32) {
    let (w, h) = (view.camera.width as f32, view.camera.height as f32);
    let (fx, fy) = (view.camera.fx as f32, view.camera.fy as f32);
    let (cx, cy) = (view.camera.cx as f32 + 0.5, view.camera.cy as f32 + 0.5);
    let corner = Point3::from(Vector3::from(block.at.map(|c| (c * SIDE as i32) as f32 * voxel)));
    let first = camera_from_model * corner;
    let along = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| camera_from_model.rotation * e * voxel);
    let inverse = 1.0 / truncation;
    for k in 0..SIDE {
        for j in 0..SIDE {
            let row = first + along[1] * j as f32 + along[2] * k as f32;
            for i in 0..SIDE {
                let p = row + along[0] * i as f32;
                let (u, v) = (fx * p.x / p.z + cx, fy * p.y / p.z + cy);
                // Negated, so that NaN falls out too.
                if !(u >= 0.0 && v >= 0.0 && u < w && v < h && p.z > 0.0) {
                    continue;
                }
                let pixel = v as usize * view.camera.width + u as usize;
                let z = view.depth[pixel];
                let at = i + SIDE * (j + SIDE * k);
                if z == BEYOND {
                    blend(block, at, 1.0, CLEARING);
                    continue;
                }
                let evidence = view.evidence[pixel];
                if evidence <= 0.0 {
                    continue;
                }
                // Along the ray, not along z: the same truncation in the middle and at the border of the image.
                let distance = (z - p.z) * (p.coords.norm() / p.z) * inverse;
                if distance < -1.0 {
                    continue;
                }
                blend(block, at, distance.min(1.0), evidence);
                if distance.abs() < COLORED
                    && let Some(color) = view.colors.get(pixel).filter(|c| **c != UNCOLORED)
                {
                    tint(block, at, *color, evidence * evidence);
                }
            }
        }
    }
}

fn blend(block: &mut Block, at: usize, distance: f32, evidence: f32) {
    let (old, new) = (f32::from(block.weight[at]), evidence * WEIGHT_UNIT);
    let total = old + new;
    let mean = (f32::from(block.distance[at]) * old + distance * FULL * new) / total;
    block.distance[at] = mean.round() as i16;
    block.weight[at] = total.min(MOST_VIEWS * WEIGHT_UNIT).round() as u16;
}

fn tint(block: &mut Block, at: usize, color: [u8; 3], evidence: f32) {
    let (old, new) = (f32::from(block.color_weight[at]), evidence * WEIGHT_UNIT);
    let total = old + new;
    if total < 0.5 {
        return;
    }
    for (channel, value) in block.color.iter_mut().zip(color) {
        channel[at] = ((f32::from(channel[at]) * old + f32::from(value) * 256.0 * new) / total).round() as u16;
    }
    block.color_weight[at] = total.min(MOST_VIEWS * WEIGHT_UNIT).round() as u16;
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
            let mut volume = Volume::new(0.005, 0.02);
            for (z, turn) in [(1.0, 0.0f64), (1.01, 0.0), (0.99, 0.0)] {
                volume.integrate(&wall(z), &Isometry3::rotation(Vector3::z() * turn));
            }
            volume
        };
        let volume = made();
        let value = Reader::new(&volume).sample(&Point3::new(0.0, 0.0, 0.996 / 0.005)).unwrap();
        assert!((value - 0.2).abs() < 0.01, "4 mm of 20 before the wall: {value}");
        let (block, i) = Reader::new(&volume).find([0, 0, 200]).unwrap();
        assert_eq!(block.color.map(|c| c[i] / 256), [200, 100, 0]);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(made);
        assert_eq!(volume.blocks.len(), alone.blocks.len());
        assert!(volume.blocks.iter().zip(&alone.blocks).all(|(a, b)| a.distance == b.distance && a.color == b.color));
    }
}
