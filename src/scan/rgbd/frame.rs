//! Frames of a recording: decoded, checked, in metres, without lens distortion.

use super::camera::RgbdCamera;
use super::error::FusionError;
use crate::formats::{EncodedRecording, Intrinsics, linear_of_byte, read_color_picture, read_depth_png};
use crate::geometry::Point;
use nalgebra::{Matrix3x4, Vector4};

/// How a recording's frames are read.
pub(super) struct Frames<'a> {
    recording: &'a EncodedRecording,
    /// The depth camera, without distortion.
    pub(super) camera: RgbdCamera,
    undistorted: Option<Vec<u32>>,
}

/// A depth image in metres, 0 if unknown.
pub(super) struct DepthFrame {
    pub(super) depth: Vec<f32>,
}

/// The colour image of a frame, and where a point of the depth camera's frame is in it.
pub(super) struct ColorFrame {
    width: usize,
    pixels: Vec<[u8; 3]>,
    camera: RgbdCamera,
    color_from_depth: Option<Matrix3x4<f64>>,
    /// Linear light by sRGB byte.
    linear: [f32; 256],
}

impl<'a> Frames<'a> {
    pub(super) fn of(recording: &'a EncodedRecording) -> Self {
        let taken = camera_of(&recording.camera.depth);
        let undistorted = taken.is_distorted().then(|| taken.undistortion());
        Self { recording, camera: RgbdCamera { distortion: [0.0; 5], ..taken }, undistorted }
    }

    pub(super) fn count(&self) -> usize {
        self.recording.frames.len()
    }

    pub(super) fn name(&self, frame: usize) -> &str {
        &self.recording.frames[frame].name
    }

    /// Time of a frame in seconds; frames without a time are 1/30 s apart.
    pub(super) fn secs(&self, frame: usize) -> f64 {
        self.recording.frames[frame].secs.unwrap_or(frame as f64 / 30.0)
    }

    /// Whether a frame's depth image equals that of the frame before.
    pub(super) fn is_duplicate(&self, frame: usize) -> bool {
        frame > 0 && self.recording.frames[frame].depth == self.recording.frames[frame - 1].depth
    }

    pub(super) fn depth(&self, frame: usize) -> Result<DepthFrame, FusionError> {
        let file = &self.recording.frames[frame];
        let picture =
            read_depth_png(&file.depth).map_err(|source| FusionError::Image { name: file.name.clone(), source })?;
        if (picture.width, picture.height) != (self.camera.width, self.camera.height) {
            return Err(FusionError::WrongSize {
                name: file.name.clone(),
                width: picture.width,
                height: picture.height,
                expected_width: self.camera.width,
                expected_height: self.camera.height,
            });
        }
        let metres = (1.0 / self.recording.camera.depth_scale) as f32;
        let most = self.recording.camera.depth_max.map_or(f32::INFINITY, |m| m as f32);
        // Depths beyond the range of interest still show that there is something other than the person.
        let read = |raw: u16| if is_known(raw) { (f32::from(raw) * metres).min(most * 1.001) } else { 0.0 };
        let depth = match &self.undistorted {
            None => picture.depth.iter().map(|&raw| read(raw)).collect(),
            Some(from) => from.iter().map(|&i| picture.depth.get(i as usize).map_or(0.0, |&raw| read(raw))).collect(),
        };
        Ok(DepthFrame { depth })
    }

    /// The scale that the depths seem to have, if with the stated one most of what is seen is where no person stands.
    pub(super) fn likely_scale(&self) -> Option<f64> {
        /// Units per metre: millimetres, TUM's, RealSense's quarter and tenth of a millimetre, one byte of fractions, centimetres,
        /// metres.
        const USUAL: [f64; 7] = [1000.0, 5000.0, 4000.0, 10_000.0, 256.0, 100.0, 1.0];
        /// Where most of a recording of a person is, in metres from the camera.
        const PLAUSIBLE: std::ops::RangeInclusive<f64> = 0.8..=5.0;
        /// In the middle of that.
        const EXPECTED: f64 = 2.2;
        let middle = self.recording.frames.get(self.count() / 2)?;
        let mut known: Vec<u16> =
            read_depth_png(&middle.depth).ok()?.depth.into_iter().filter(|&r| is_known(r)).collect();
        known.sort_unstable();
        let median = f64::from(*known.get(known.len() / 2)?);
        let off = |scale: &f64| (median / scale / EXPECTED).ln().abs();
        let best = USUAL.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let is_wrong = !PLAUSIBLE.contains(&(median / self.recording.camera.depth_scale));
        (is_wrong && PLAUSIBLE.contains(&(median / best))).then_some(best)
    }

    /// The greatest depth of interest, in metres.
    pub(super) fn depth_max(&self) -> f32 {
        self.recording.camera.depth_max.map_or(f32::INFINITY, |m| m as f32)
    }

    /// The frame's colours; `None` if it has none, or none that can be registered to the depth.
    pub(super) fn color(&self, frame: usize) -> Result<Option<ColorFrame>, FusionError> {
        let file = &self.recording.frames[frame];
        let Some((name, bytes)) = &file.color else { return Ok(None) };
        let picture = read_color_picture(bytes).map_err(|source| FusionError::Image { name: name.clone(), source })?;
        let Some(camera) = self.color_camera(picture.width, picture.height) else { return Ok(None) };
        let color_from_depth = self.recording.camera.color_from_depth.map(|m| Matrix3x4::from_row_slice(&m));
        let linear = std::array::from_fn(|byte| linear_of_byte(byte as u8) as f32);
        Ok(Some(ColorFrame { width: picture.width, pixels: picture.pixels, camera, color_from_depth, linear }))
    }

    /// The camera of colour images of a size: that of `camera.json`, else the depth camera if the shape is the same.
    fn color_camera(&self, width: usize, height: usize) -> Option<RgbdCamera> {
        let same_shape = |w: usize, h: usize| (w * height).abs_diff(h * width) * 100 <= w * height;
        match &self.recording.camera.color {
            Some(color) if same_shape(color.width, color.height) => Some(camera_of(color).resized(width, height)),
            Some(_) => None,
            None if same_shape(self.camera.width, self.camera.height) => {
                Some(camera_of(&self.recording.camera.depth).resized(width, height))
            }
            None => None,
        }
    }

    /// What keeps the colours from being used, in one sentence; `None` if nothing does.
    pub(super) fn color_trouble(&self) -> Result<Option<String>, FusionError> {
        let with_color = self.recording.frames.iter().filter(|f| f.color.is_some()).count();
        if with_color == 0 {
            return Ok(Some("the frames have no colour, so the scan has none".into()));
        }
        let Some((name, bytes)) = self.recording.frames.iter().find_map(|f| f.color.as_ref()) else { return Ok(None) };
        let picture = read_color_picture(bytes).map_err(|source| FusionError::Image { name: name.clone(), source })?;
        if self.color_camera(picture.width, picture.height).is_none() {
            return Ok(Some(format!(
                "the colour images ({} × {} pixels) cannot be registered to the depth images ({} × {} pixels): camera.json needs a 'color' camera of that shape; the scan has no colour",
                picture.width, picture.height, self.camera.width, self.camera.height
            )));
        }
        if with_color < self.recording.frames.len() {
            let without = self.recording.frames.len() - with_color;
            return Ok(Some(format!("{without} of {} frames have no colour", self.recording.frames.len())));
        }
        Ok(None)
    }
}

impl ColorFrame {
    /// The colour of a point of the depth camera's frame.
    pub(super) fn at(&self, p: &Point) -> Option<[u8; 3]> {
        let [x, y] = self.place_of(p)?.map(f64::round);
        let inside = x >= 0.0 && y >= 0.0 && x < self.camera.width as f64 && y < self.camera.height as f64;
        inside.then(|| self.pixels[y as usize * self.width + x as usize])
    }

    /// The colour of a point of the depth camera's frame, in linear light, between the four nearest pixels.
    pub(super) fn light_at(&self, p: &Point) -> Option<[f32; 3]> {
        let [x, y] = self.place_of(p)?;
        let (left, top) = (x.floor(), y.floor());
        let inside = left >= 0.0 && top >= 0.0 && left + 1.0 < self.camera.width as f64;
        if !inside || top + 1.0 >= self.camera.height as f64 {
            return None;
        }
        let (right, down) = ((x - left) as f32, (y - top) as f32);
        let first = top as usize * self.width + left as usize;
        let mut sum = [0.0; 3];
        for (at, share) in [
            (first, (1.0 - right) * (1.0 - down)),
            (first + 1, right * (1.0 - down)),
            (first + self.width, (1.0 - right) * down),
            (first + self.width + 1, right * down),
        ] {
            sum.iter_mut().zip(self.pixels[at]).for_each(|(sum, c)| *sum += share * self.linear[usize::from(c)]);
        }
        Some(sum)
    }

    /// Mean of all pixels, as sRGB bytes.
    pub(super) fn mean(&self) -> f64 {
        let sum: u64 = self.pixels.as_flattened().iter().map(|&c| u64::from(c)).sum();
        sum as f64 / (3 * self.pixels.len().max(1)) as f64
    }

    /// How much neighbouring pixels differ beyond what a slope does, relative to the light: less in a blurred image.
    pub(super) fn sharpness(&self) -> f64 {
        let green = |at: usize| f64::from(self.pixels[at][1]);
        let rows = self.pixels.len() / self.width.max(1);
        let mut sum = 0.0;
        for y in 1..rows.saturating_sub(1) {
            for at in y * self.width + 1..(y + 1) * self.width - 1 {
                let bend =
                    green(at - 1) + green(at + 1) + green(at - self.width) + green(at + self.width) - 4.0 * green(at);
                sum += bend.abs();
            }
        }
        sum / self.pixels.len().max(1) as f64 / self.mean().max(1.0)
    }

    /// Where it shows a point of the depth camera's frame, in pixels; `None` behind the camera.
    fn place_of(&self, p: &Point) -> Option<[f64; 2]> {
        let p = match &self.color_from_depth {
            Some(m) => Point::from(m * Vector4::new(p.x, p.y, p.z, 1.0)),
            None => *p,
        };
        if p.z <= 0.0 {
            return None;
        }
        let [x, y] = self.camera.pixel(&p);
        Some(if self.camera.is_distorted() { self.camera.distorted(x, y) } else { [x, y] })
    }
}

/// Whether a pixel was measured: cameras write 0 where it was not, and some programs the greatest number.
fn is_known(raw: u16) -> bool {
    raw != 0 && raw != u16::MAX
}

fn camera_of(intrinsics: &Intrinsics) -> RgbdCamera {
    let [fx, fy, cx, cy] = intrinsics.pinhole;
    RgbdCamera { width: intrinsics.width, height: intrinsics.height, fx, fy, cx, cy, distortion: intrinsics.distortion }
}
