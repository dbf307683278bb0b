//! The colour images of a recording as photographs of the fused surface, from known places.

use super::FramePose;
use super::camera::RgbdCamera;
use super::error::FusionError;
use super::frame::{ColorFrame, DepthFrame, Frames};
use super::view::JUMP;
use crate::formats::EncodedRecording;
use crate::geometry::{Point, Vec3};
use nalgebra::Isometry3;
use rayon::prelude::*;

/// Most photographs that are held: one per 4° of a turn, and for a large camera half a gigabyte.
const MOST: usize = 90;
/// Mean of the pixels of a photograph that shows something, as sRGB bytes.
const LEAST_LIGHT: f64 = 12.0;
/// Least sharpness as a share of the median: what is below was shaken.
const LEAST_SHARPNESS: f64 = 0.35;
/// Pixels of the depth image to each side that must show the same surface: beside an outline, colours are those of both.
const MARGIN: isize = 2;

/// A colour image, where it was taken, and what it shows by its depths.
pub struct Photograph {
    camera_from_model: Isometry3<f64>,
    /// Where the camera was, in the model's frame.
    pub centre: Point,
    /// Sharpness as a share of the recording's median.
    pub sharpness: f64,
    camera: RgbdCamera,
    depth: DepthFrame,
    color: ColorFrame,
}

/// The colour images of the frames with poses, without those that are dark or blurred; at most 90, evenly in time.
///
/// **Errors** for a frame that cannot be read.
pub fn photographs(recording: &EncodedRecording, poses: &[FramePose]) -> Result<Vec<Photograph>, FusionError> {
    let frames = Frames::of(recording);
    let stride = poses.len().div_ceil(MOST).max(1);
    let taken: Vec<Result<Option<Photograph>, FusionError>> =
        poses.par_iter().step_by(stride).map(|pose| photograph(&frames, pose)).collect();
    // The first bad frame is reported, not the one that was read first.
    let taken: Vec<Option<Photograph>> = taken.into_iter().collect::<Result<_, FusionError>>()?;
    let mut taken: Vec<Photograph> = taken.into_iter().flatten().collect();
    let mut all: Vec<f64> = taken.iter().map(|photograph| photograph.sharpness).collect();
    all.sort_by(f64::total_cmp);
    let median = all.get(all.len() / 2).copied().unwrap_or(1.0).max(f64::MIN_POSITIVE);
    taken.iter_mut().for_each(|photograph| photograph.sharpness /= median);
    taken.retain(|photograph| photograph.sharpness >= LEAST_SHARPNESS);
    Ok(taken)
}

fn photograph(frames: &Frames, pose: &FramePose) -> Result<Option<Photograph>, FusionError> {
    if pose.frame >= frames.count() {
        return Ok(None);
    }
    let Some(color) = frames.color(pose.frame)? else { return Ok(None) };
    if color.mean() < LEAST_LIGHT {
        return Ok(None);
    }
    let depth = frames.depth(pose.frame)?;
    let centre = Point::from(pose.model_from_camera.translation.vector);
    let camera_from_model = pose.model_from_camera.inverse();
    let sharpness = color.sharpness();
    Ok(Some(Photograph { camera_from_model, centre, sharpness, camera: frames.camera.clone(), depth, color }))
}

impl Photograph {
    /// What it shows of a point of the model, in linear light; `None` if something is before it, or it is beside an outline.
    pub fn color_of(&self, p: &Point) -> Option<[f32; 3]> {
        let p = self.camera_from_model * p;
        if p.z <= 0.0 {
            return None;
        }
        let [x, y] = self.camera.pixel(&p).map(|c| c.round() as isize);
        for (dx, dy) in [(0, 0), (-MARGIN, 0), (MARGIN, 0), (0, -MARGIN), (0, MARGIN)] {
            let [x, y] = [usize::try_from(x + dx).ok()?, usize::try_from(y + dy).ok()?];
            if x >= self.camera.width || y >= self.camera.height {
                return None;
            }
            let seen = self.depth.depth[y * self.camera.width + x];
            if (seen - p.z as f32).abs() > JUMP {
                return None;
            }
        }
        self.color.light_at(&p)
    }

    /// Unit vector from a point of the model to the camera.
    pub fn toward(&self, p: &Point) -> Vec3 {
        (self.centre - p).try_normalize(1e-9).unwrap_or_else(Vec3::zeros)
    }
}
