//! Renders the volume for a camera: the prediction with which a new frame is aligned.

use super::camera::{Rays, RgbdCamera};
use super::view::{Level, TILE};
use super::volume::{FULL, Reader, SIDE, Volume, floor};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

/// The surface as seen through each pixel.
pub(super) struct Prediction {
    pub(super) camera: RgbdCamera,
    pub(super) camera_from_model: Isometry3<f64>,
    pub(super) seen: Vec<PredictedPoint>,
}

/// A point of the surface and its normal toward the camera, in the model's frame; a zero normal where nothing is seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PredictedPoint {
    pub(super) point: Point3<f32>,
    pub(super) normal: Vector3<f32>,
}

/// The range of depths in which a ray searches for the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// Within [`CLOSE`] of the depths of a pixel and of the pixels up to [`BESIDE`] away: for an accurate guess.
    Near,
    /// Within [`SLACK`] of the depths of a tile and of its neighbours.
    Far,
}

/// Distance before and behind a pixel's depth, in metres: the error of the prediction of a steady turn is smaller.
const CLOSE: f32 = 0.03;
/// Pixels beside the person, so that pixels at the outline find their partners: 2 cm at 2 m and half size.
const BESIDE: usize = 2;
/// Distance before and behind a tile's depths, in metres.
const SLACK: f32 = 0.12;
/// Accuracy of a crossing, as a share of the truncation: 0.02 mm.
const EXACT: f32 = 1e-3;

impl Volume {
    /// Searches along the ray through each pixel of a frame's level, near the depths measured there, for a crossing
    /// from outside to inside.
    ///
    /// **Source** Newcombe et al. 2011 §3.4; rays begin at the first visible block, as in Prisacariu et al. 2017
    /// (InfiniTAM v3 §4.2), and skip absent blocks. For an accurate guess a ray begins at the measured depth; the
    /// distance stored there leads to the surface in two or three steps.
    pub(super) fn predict(&self, level: &Level, model_from_camera: &Isometry3<f64>, reach: Reach) -> Prediction {
        let camera = &level.camera;
        let camera_from_model = model_from_camera.inverse();
        let rays = Rays::new(camera, model_from_camera, self.voxel);
        let mut depths = vec![0.0f32; camera.width * camera.height];
        let rows = depths.par_chunks_mut(TILE * camera.width).enumerate();
        match reach {
            Reach::Near => rows.for_each(|(down, rows)| self.near_depths(level, &rays, down * TILE, rows)),
            Reach::Far => {
                let filled = self.filled_depths(camera, &camera_from_model.cast());
                rows.for_each(|(down, rows)| self.far_depths(level, &rays, &filled, down * TILE, rows));
            }
        }
        let seen = self.seen(camera, &rays, &depths);
        Prediction { camera: camera.clone(), camera_from_model, seen }
    }

    fn near_depths(&self, level: &Level, rays: &Rays, first_row: usize, depths: &mut [f32]) {
        let mut reader = Reader::new(self);
        let width = level.camera.width;
        for (i, depth) in depths.iter_mut().enumerate() {
            let (column, row) = (i % width, first_row + i / width);
            let Some(shown) = level.depth_beside(column, row, BESIDE) else { continue };
            let ray = rays.through(column, row);
            *depth = self.slide(&mut reader, &rays.origin, &ray, shown).unwrap_or_else(|| {
                self.march(&mut reader, &rays.origin, &ray, [shown - CLOSE, shown + CLOSE]).unwrap_or(0.0)
            });
        }
    }

    fn far_depths(&self, level: &Level, rays: &Rays, filled: &[[f32; 2]], first_row: usize, depths: &mut [f32]) {
        let mut reader = Reader::new(self);
        let width = level.camera.width;
        let across = width.div_ceil(TILE);
        for (i, depth) in depths.iter_mut().enumerate() {
            let (column, row) = (i % width, first_row + i / width);
            let tile = row / TILE * across + column / TILE;
            let Some([near, far]) = level.range(tile) else { continue };
            let [first, last] = filled[tile];
            let range = [(near - SLACK).max(first).max(0.05), (far + SLACK).min(last)];
            *depth = self.march(&mut reader, &rays.origin, &rays.through(column, row), range).unwrap_or(0.0);
        }
    }

    /// Steps from a depth to the surface by the distance stored there; `None` if this does not converge.
    fn slide(&self, reader: &mut Reader, origin: &Point3<f32>, ray: &Vector3<f32>, shown: f32) -> Option<f32> {
        let truncation = self.truncation / (ray.norm() * self.voxel);
        let mut distance_at = |depth: f32| reader.sample(&(origin + ray * depth)).filter(|d| d.abs() < 1.0);
        let (mut before, mut d_before) = (shown, distance_at(shown)?);
        let mut depth = shown + d_before * truncation;
        for _ in 0..3 {
            let d = distance_at(depth)?;
            if d.abs() < EXACT {
                return Some(depth);
            }
            let slope = (d - d_before) / (depth - before);
            // From outside to inside, and at least a quarter as steep as at a surface seen frontally.
            if slope * truncation > -0.25 {
                return None;
            }
            (before, d_before) = (depth, d);
            depth -= d / slope;
        }
        Some(depth)
    }

    /// The surface points and normals at the given depths.
    fn seen(&self, camera: &RgbdCamera, rays: &Rays, depths: &[f32]) -> Vec<PredictedPoint> {
        let at = |reader: &mut Reader, (i, &depth): (usize, &f32)| {
            let ray = rays.through(i % camera.width, i / camera.width);
            let p = rays.origin + ray * depth;
            let normal = (depth > 0.0).then(|| reader.normal(&p)).flatten();
            match normal.filter(|n| n.dot(&ray) < 0.0) {
                Some(normal) => PredictedPoint { point: p * self.voxel, normal },
                None => PredictedPoint::default(),
            }
        };
        depths.par_iter().enumerate().with_min_len(2048).map_init(|| Reader::new(self), at).collect()
    }

    /// Least and greatest depth of the blocks per tile of the image; there is none where the first exceeds the second.
    fn filled_depths(&self, camera: &RgbdCamera, camera_from_model: &Isometry3<f32>) -> Vec<[f32; 2]> {
        let (across, down) = (camera.width.div_ceil(TILE), camera.height.div_ceil(TILE));
        let (fx, fy, cx, cy) = (camera.fx as f32, camera.fy as f32, camera.cx as f32, camera.cy as f32);
        let mut tiles = vec![[f32::INFINITY, 0.0f32]; across * down];
        let tile_of = |c: f32, count: usize| floor((c + 0.5) / TILE as f32).clamp(0, count as i32 - 1) as usize;
        for block in &self.blocks {
            // Half a voxel more on each side, because a march reads the nearest voxel.
            let low = block.at.map(|c| ((c * SIDE as i32) as f32 - 0.5) * self.voxel);
            let (mut least, mut most) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            for k in 0..8 {
                let pick = |axis: usize| low[axis] + (k >> axis & 1) as f32 * self.block_size();
                let p = camera_from_model * Point3::new(pick(0), pick(1), pick(2));
                // The person is never behind or very close to the camera.
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

    /// The first crossing between two depths.
    fn march(
        &self,
        reader: &mut Reader,
        origin: &Point3<f32>,
        ray: &Vector3<f32>,
        [near, far]: [f32; 2],
    ) -> Option<f32> {
        let voxel = 1.0 / ray.norm();
        let inverse = ray.map(|c| 1.0 / c);
        let truncation = self.truncation / self.voxel * voxel;
        let mut depth = near;
        let mut before: Option<f32> = None;
        while depth < far {
            let p = origin + ray * depth;
            let nearest = [p.x, p.y, p.z].map(|c| floor(c + 0.5));
            let Some(found) = reader.find(nearest) else {
                before = None;
                depth += to_next_block(&p, ray, &inverse) + 0.05 * voxel;
                continue;
            };
            if found.weight() == 0 {
                before = None;
                depth += voxel;
                continue;
            }
            let distance = f32::from(found.distance()) / FULL;
            if distance <= 0.0 {
                // Entered from unknown space: the back of a surface.
                return self.crossing(reader, origin, ray, [before?, depth], voxel);
            }
            before = Some(depth);
            depth += (0.7 * distance * truncation).max(0.7 * voxel);
        }
        None
    }

    /// The zero between two depths of a ray, by the secant through trilinear values.
    fn crossing(
        &self,
        reader: &mut Reader,
        origin: &Point3<f32>,
        ray: &Vector3<f32>,
        [mut a, mut b]: [f32; 2],
        voxel: f32,
    ) -> Option<f32> {
        b += 0.5 * voxel;
        let mut da = reader.sample(&(origin + ray * a))?;
        let mut db = reader.sample(&(origin + ray * b))?;
        if da <= 0.0 {
            a -= voxel;
            da = reader.sample(&(origin + ray * a))?;
        }
        if db > 0.0 {
            b += voxel;
            db = reader.sample(&(origin + ray * b))?;
        }
        if da <= 0.0 || db > 0.0 {
            return None;
        }
        let mut depth = a;
        for _ in 0..3 {
            depth = a + (b - a) * da / (da - db);
            let d = reader.sample(&(origin + ray * depth))?;
            if d > 0.0 {
                (a, da) = (depth, d)
            } else {
                (b, db) = (depth, d)
            }
            if d.abs() < EXACT {
                break;
            }
        }
        Some(depth)
    }

    /// Whether any block is within a block's length of a point.
    #[cfg(test)]
    pub(super) fn is_near(&self, p: &Point3<f32>) -> bool {
        let at = [p.x, p.y, p.z].map(|c| (c / self.block_size()).floor() as i32);
        self.block_at(at) != super::volume::NONE
    }
}

/// Depth at which a ray leaves the block of the voxel nearest to a point.
fn to_next_block(p: &Point3<f32>, ray: &Vector3<f32>, inverse: &Vector3<f32>) -> f32 {
    let mut least = f32::INFINITY;
    for axis in 0..3 {
        let c = p[axis] + 0.5;
        let low = (floor(c) & !(SIDE as i32 - 1)) as f32;
        let wall = if ray[axis] > 0.0 { low + SIDE as f32 } else { low };
        // Parallel to a face of the block the distance is infinite, and NaN on the face itself.
        let way = (wall - c) * inverse[axis];
        least = if way < least { way } else { least };
    }
    least.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::rgbd::view::PersonFrame;

    #[test]
    fn a_wall_that_was_integrated_is_predicted_from_elsewhere() {
        let camera =
            RgbdCamera { width: 128, height: 128, fx: 100.0, fy: 100.0, cx: 63.5, cy: 63.5, distortion: [0.0; 5] };
        let mut volume = Volume::new(0.005, 0.02);
        let view = PersonFrame::prepare(camera.clone(), vec![1.0; 128 * 128], Vec::new());
        volume.integrate(&view, &Isometry3::identity());
        assert!(volume.is_near(&Point3::new(0.0, 0.0, 1.0)));
        let far_off = Isometry3::new(Vector3::new(0.1, 0.0, 0.1), Vector3::new(0.0, 0.2, 0.05));
        let nearly_there = Isometry3::new(Vector3::new(0.01, 0.0, 0.012), Vector3::new(0.0, 0.01, 0.02));
        for (pose, reach) in [(far_off, Reach::Far), (nearly_there, Reach::Far), (nearly_there, Reach::Near)] {
            let seen = volume.predict(&view.levels[0], &pose, reach).seen;
            let hits: Vec<&PredictedPoint> = seen.iter().filter(|s| s.normal.norm() > 0.5).collect();
            assert!(hits.len() > 1_500, "{reach:?}: {}", hits.len());
            for PredictedPoint { point, normal } in hits {
                assert!((point.z - 1.0).abs() < 1e-3, "{reach:?}: {point}");
                assert!((normal + Vector3::z()).norm() < 0.02);
            }
        }
        let too_close = Isometry3::translation(0.0, 0.0, 0.1);
        let nothing_near = volume.predict(&view.levels[0], &too_close, Reach::Near).seen;
        assert!(nothing_near.iter().all(|s| s.normal.norm() == 0.0), "10 cm off is not near");
    }
}
