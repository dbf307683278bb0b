//! What a camera would see of the volume: the prediction that a new frame is held against.

use super::camera::RgbdCamera;
use super::view::{Level, TILE};
use super::volume::{FULL, Reader, SIDE, Volume, floor};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

/// Surface points and normals as seen through each pixel, in the model's frame.
pub(super) struct Prediction {
    pub(super) camera: RgbdCamera,
    pub(super) camera_from_model: Isometry3<f64>,
    /// A zero normal where nothing is seen.
    pub(super) points: Vec<Point3<f32>>,
    pub(super) normals: Vec<Vector3<f32>>,
}

impl Volume {
    /// Marches a ray through each pixel of a view's level, near the depths that it shows, to the first crossing from outside
    /// in.
    ///
    /// **Source** Newcombe et al. 2011 §3.4; rays begin where the first block is seen, as in Prisacariu et al. 2017 (InfiniTAM
    /// v3 §4.2), and absent blocks are skipped.
    pub(super) fn predict(&self, level: &Level, model_from_camera: &Isometry3<f64>) -> Prediction {
        let camera = &level.camera;
        let pose = model_from_camera.cast::<f32>();
        let camera_from_model = model_from_camera.inverse();
        let (filled, across) = (self.filled_depths(camera, &camera_from_model.cast()), camera.width.div_ceil(TILE));
        let hits: Vec<(Point3<f32>, Vector3<f32>)> = (0..camera.height)
            .into_par_iter()
            .flat_map_iter(|row| {
                let mut reader = Reader::new(self);
                (0..camera.width)
                    .map(|column| {
                        let [first, last] = filled[row / TILE * across + column / TILE];
                        let range = level.range(column, row).map(|[near, far]| [near.max(first), far.min(last)]);
                        let ray = camera.point(column as f64, row as f64, 1.0).coords.cast::<f32>();
                        range
                            .and_then(|range| self.march(&mut reader, &pose, &ray, range))
                            .unwrap_or_else(|| (Point3::origin(), Vector3::zeros()))
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        let (points, normals) = hits.into_iter().unzip();
        Prediction { camera: camera.clone(), camera_from_model, points, normals }
    }

    /// Between which depths there are blocks, a tile of the image; none where the first is beyond the last.
    fn filled_depths(&self, camera: &RgbdCamera, camera_from_model: &Isometry3<f32>) -> Vec<[f32; 2]> {
        let (across, down) = (camera.width.div_ceil(TILE), camera.height.div_ceil(TILE));
        let (fx, fy, cx, cy) = (camera.fx as f32, camera.fy as f32, camera.cx as f32, camera.cy as f32);
        let mut tiles = vec![[f32::INFINITY, 0.0f32]; across * down];
        let tile_of = |c: f32, count: usize| floor((c + 0.5) / TILE as f32).clamp(0, count as i32 - 1) as usize;
        for block in &self.blocks {
            // Half a voxel more on each side: the nearest voxel is what a march looks at.
            let low = block.at.map(|c| ((c * SIDE as i32) as f32 - 0.5) * self.voxel);
            let (mut least, mut most) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            for k in 0..8 {
                let pick = |axis: usize| low[axis] + (k >> axis & 1) as f32 * self.block_size();
                let p = camera_from_model * Point3::new(pick(0), pick(1), pick(2));
                // What is behind the camera, or nearly, is no person.
                let z = p.z.max(0.05);
                for (axis, c) in [fx * p.x / z + cx, fy * p.y / z + cy, p.z].into_iter().enumerate() {
                    (least[axis], most[axis]) = (least[axis].min(c), most[axis].max(c));
                }
            }
            let seen = most[2] > 0.05
                && (most[0] > -0.5 && least[0] < camera.width as f32 - 0.5)
                && (most[1] > -0.5 && least[1] < camera.height as f32 - 0.5);
            if !seen {
                continue;
            }
            for row in tile_of(least[1], down)..=tile_of(most[1], down) {
                for [first, last] in
                    &mut tiles[row * across + tile_of(least[0], across)..=row * across + tile_of(most[0], across)]
                {
                    (*first, *last) = (first.min(least[2]), last.max(most[2]));
                }
            }
        }
        tiles
    }

    fn march(
        &self,
        reader: &mut Reader,
        pose: &Isometry3<f32>,
        ray: &Vector3<f32>,
        [near, far]: [f32; 2],
    ) -> Option<(Point3<f32>, Vector3<f32>)> {
        let origin = Point3::from(pose.translation.vector) / self.voxel;
        let direction = pose.rotation * ray.normalize();
        // In voxels from here on.
        let (mut t, end) = (near * ray.norm() / self.voxel, far * ray.norm() / self.voxel);
        let truncation = self.truncation / self.voxel;
        let mut before: Option<(f32, f32)> = None;
        while t < end {
            let p = origin + direction * t;
            let nearest = [p.x, p.y, p.z].map(|c| floor(c + 0.5));
            let Some(voxel) = reader.find(nearest) else {
                before = None;
                t += to_next_block(&p, &direction);
                continue;
            };
            if voxel.weight == 0 {
                before = None;
                t += 1.0;
                continue;
            }
            let distance = f32::from(voxel.distance) / FULL;
            if distance <= 0.0 {
                // Entered from nothing: the back of a surface.
                let (outside, _) = before?;
                return self.crossing(reader, &origin, &direction, [outside, t]);
            }
            before = Some((t, distance));
            t += (0.7 * distance * truncation).max(0.7);
        }
        None
    }

    /// The zero between two places of a ray, by the secant through trilinear values.
    fn crossing(
        &self,
        reader: &mut Reader,
        origin: &Point3<f32>,
        direction: &Vector3<f32>,
        [mut a, mut b]: [f32; 2],
    ) -> Option<(Point3<f32>, Vector3<f32>)> {
        b += 0.5;
        let mut da = reader.sample(&(origin + direction * a))?;
        let mut db = reader.sample(&(origin + direction * b))?;
        if da <= 0.0 {
            a -= 1.0;
            da = reader.sample(&(origin + direction * a))?;
        }
        if db > 0.0 {
            b += 1.0;
            db = reader.sample(&(origin + direction * b))?;
        }
        if da <= 0.0 || db > 0.0 {
            return None;
        }
        let mut t = a;
        for _ in 0..3 {
            t = a + (b - a) * da / (da - db);
            let d = reader.sample(&(origin + direction * t))?;
            if d > 0.0 {
                (a, da) = (t, d)
            } else {
                (b, db) = (t, d)
            }
            if d.abs() < 1e-3 {
                break;
            }
        }
        let p = origin + direction * t;
        let normal = reader.normal(&p)?;
        (normal.dot(direction) < 0.0).then(|| (p * self.voxel, normal))
    }

    /// Whether there is any block within a block's length of a point: for tests of overlap.
    #[cfg(test)]
    pub(super) fn is_near(&self, p: &Point3<f32>) -> bool {
        let at = [p.x, p.y, p.z].map(|c| (c / self.block_size()).floor() as i32);
        self.block_at(at) != super::volume::NONE
    }
}

/// Voxels along a ray to where it leaves the block that holds a point (with the nearest voxel counting), and a bit.
fn to_next_block(p: &Point3<f32>, direction: &Vector3<f32>) -> f32 {
    let mut least = f32::INFINITY;
    for axis in 0..3 {
        let (c, d) = (p[axis] + 0.5, direction[axis]);
        if d.abs() < 1e-6 {
            continue;
        }
        let low = (floor(c) & !(SIDE as i32 - 1)) as f32;
        let wall = if d > 0.0 { low + SIDE as f32 } else { low };
        least = least.min((wall - c) / d);
    }
    least.max(0.0) + 0.05
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::rgbd::view::View;

    #[test]
    fn a_wall_that_was_integrated_is_predicted_from_elsewhere() {
        let camera =
            RgbdCamera { width: 128, height: 128, fx: 100.0, fy: 100.0, cx: 63.5, cy: 63.5, distortion: [0.0; 5] };
        let mut volume = Volume::new(0.005, 0.02);
        let view = View::prepare(camera.clone(), vec![1.0; 128 * 128], Vec::new());
        volume.integrate(&view, &Isometry3::identity());
        assert!(volume.is_near(&Point3::new(0.0, 0.0, 1.0)));
        let pose = Isometry3::new(Vector3::new(0.1, 0.0, 0.1), Vector3::new(0.0, 0.2, 0.05));
        let seen = volume.predict(&view.levels[0], &pose);
        let hits: Vec<usize> = (0..64 * 64).filter(|&i| seen.normals[i].norm() > 0.5).collect();
        assert!(hits.len() > 1_500, "{}", hits.len());
        for i in hits {
            assert!((seen.points[i].z - 1.0).abs() < 1e-3, "{}", seen.points[i]);
            assert!((seen.normals[i] + Vector3::z()).norm() < 0.02);
        }
    }
}
