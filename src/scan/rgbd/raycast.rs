//! What a camera would see of the volume: the prediction that a new frame is held against.

use super::camera::RgbdCamera;
use super::view::Level;
use super::volume::{Reader, SIDE, Volume};
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
    /// **Source** Newcombe et al. 2011 §3.4; absent blocks are skipped.
    pub(super) fn predict(&self, level: &Level, model_from_camera: &Isometry3<f64>) -> Prediction {
        let camera = &level.camera;
        let pose = model_from_camera.cast::<f32>();
        let hits: Vec<(Point3<f32>, Vector3<f32>)> = (0..camera.height)
            .into_par_iter()
            .flat_map_iter(|row| {
                let mut reader = Reader::new(self);
                (0..camera.width)
                    .map(|column| {
                        let ray = camera.point(column as f64, row as f64, 1.0).coords.cast::<f32>();
                        let range = level.range(column, row);
                        range
                            .and_then(|range| self.march(&mut reader, &pose, &ray, range))
                            .unwrap_or_else(|| (Point3::origin(), Vector3::zeros()))
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        let (points, normals) = hits.into_iter().unzip();
        Prediction { camera: camera.clone(), camera_from_model: model_from_camera.inverse(), points, normals }
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
            let nearest = [p.x, p.y, p.z].map(|c| c.round() as i32);
            let Some((block, i)) = reader.find(nearest) else {
                before = None;
                t += to_next_block(&p, &direction);
                continue;
            };
            if block.weight[i] == 0 {
                before = None;
                t += 1.0;
                continue;
            }
            let distance = f32::from(block.distance[i]) / super::volume::FULL;
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
        let low = (c / SIDE as f32).floor() * SIDE as f32;
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
