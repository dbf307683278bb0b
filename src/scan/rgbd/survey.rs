//! Finds the static background, the floor and the turning person from a sample of the frames.

use super::axis::Axis;
use super::camera::RgbdCamera;
use super::error::FusionError;
use super::frame::Frames;
use super::pieces::{PixelComponents, pixel_components};
use super::planes::{Plane, large_planes};
use super::view::JUMP;
use crate::geometry::{Point, Vec3};
use crate::numerics::quantile;
use nalgebra::{Isometry3, Matrix3, Rotation3, Unit, UnitQuaternion};
use rayon::prelude::*;

/// The scene as estimated before any frame is tracked.
pub(super) struct SceneSurvey {
    pub(super) camera: RgbdCamera,
    pub(super) planes: Vec<Plane>,
    /// Index of the floor among the planes.
    pub(super) floor: Option<usize>,
    /// Whether no background was measured: pixels without depth around the person are then free space.
    pub(super) nothing_behind: bool,
    /// Background depth per pixel; 0 where something moves or the depth is unknown.
    pub(super) still: Vec<f32>,
    pub(super) depth_max: f32,
    /// The upright frame: Y up along the axis, the camera on the side of +Z, the floor (or the lowest point) at 0.
    pub(super) model_from_camera: Isometry3<f64>,
    /// The initial estimate of the axis, in the model's frame.
    pub(super) axis: Axis,
    /// Metres from the axis within which the person stays.
    pub(super) radius: f64,
    /// Range of the person's heights.
    pub(super) heights: [f64; 2],
    pub(super) findings: Vec<String>,
}

/// Number of surveyed frames: enough to see each side of a person twice.
const LOOKED_AT: usize = 12;
/// Relative change of depth below which a pixel is static.
const STILL: f32 = 0.02;
/// Share of static pixels from which a component is furniture.
pub(super) const FURNITURE: f64 = 0.7;
/// Range of a person's largest extent, in metres: a crouching child, and an adult with spread arms.
const SIZE: [f64; 2] = [0.4, 2.6];
/// Least visible area of a person, in m².
const LEAST_AREA: f64 = 0.04;
/// Greatest distance of a fingertip from the axis, with a margin, in metres.
const REACH: f64 = 1.2;
/// Share of the background that is deeper than before, above which the camera has moved.
const MOVED: f64 = 0.15;

/// Distance behind the person from which a surface is background, in metres.
const BEHIND: f32 = 0.3;
/// Background with less than this share of the person's pixels is specks and is ignored.
const NO_BACKGROUND: f64 = 0.01;

/// A surveyed frame.
struct SurveyedFrame {
    frame: usize,
    depth: Vec<f32>,
}

impl SceneSurvey {
    /// Surveys frames spread over the recording.
    pub(super) fn of(frames: &Frames) -> Result<Self, FusionError> {
        let camera = frames.camera.clone();
        let seen = look(frames)?;
        let still = still(&seen);
        let mut planes = large_planes(&camera, &seen[0].depth);
        planes.retain(|plane| !is_of_the_person(plane, &camera, &seen[0].depth, &still));
        refuse_moved_camera(frames, &camera, &planes, &seen)?;
        let mut survey = Self {
            still,
            camera,
            planes,
            floor: None,
            nothing_behind: false,
            depth_max: frames.depth_max(),
            model_from_camera: Isometry3::identity(),
            axis: Axis { point: Point::origin(), direction: Vec3::y_axis() },
            radius: REACH,
            heights: [f64::NEG_INFINITY, f64::INFINITY],
            findings: Vec::new(),
        };
        let bodies: Vec<Vec<Point>> = seen.par_iter().map(|s| survey.body(&s.depth)).collect();
        if bodies.iter().all(|b| b.is_empty()) && seen.iter().any(|s| survey.anybody(&s.depth)) {
            return Err(FusionError::NoTurn { count: frames.count(), turned_deg: 0.0 });
        }
        if let Some(k) = bodies.iter().position(|b| b.is_empty()) {
            // A frame without a person may be an accident; half of all frames may not.
            if bodies.iter().filter(|b| b.is_empty()).count() * 2 >= bodies.len() {
                let (name, likely) = (frames.name(seen[k].frame).into(), frames.likely_scale());
                return Err(FusionError::NobodyInView { name, likely });
            }
        }
        survey.nothing_behind =
            survey.planes.is_empty() && seen.iter().zip(&bodies).all(|(s, b)| has_no_background(s, b));
        let bodies: Vec<Vec<Point>> = bodies.into_iter().filter(|b| !b.is_empty()).collect();
        survey.stand_upright(&bodies);
        survey.measure(&bodies);
        survey.find_platform(&seen);
        Ok(survey)
    }

    /// The points of the turning person, in the camera's frame: the largest component of a person's size, and loose
    /// ones near it.
    fn body(&self, depth: &[f32]) -> Vec<Point> {
        let found = pixel_components(&self.camera, &self.foreground(depth));
        let sizes = self.sizes(&found, depth);
        let main = sizes.iter().filter(|s| s.is_person()).max_by(|a, b| a.area.total_cmp(&b.area));
        let Some(main) = main else { return Vec::new() };
        let near = |s: &&Size| s.still < FURNITURE && s.pixels > 50 && (s.middle - main.middle).norm() < REACH;
        let kept: std::collections::BTreeSet<u32> =
            sizes.iter().filter(near).map(|s| s.piece).chain([main.piece]).collect();
        (0..depth.len()).filter(|&i| kept.contains(&found.of_pixel[i])).map(|i| self.point(i, depth[i])).collect()
    }

    /// Whether a component of a person's size exists, static or not.
    fn anybody(&self, depth: &[f32]) -> bool {
        let found = pixel_components(&self.camera, &self.foreground(depth));
        self.sizes(&found, depth).iter().any(Size::has_the_size)
    }

    fn point(&self, pixel: usize, z: f32) -> Point {
        self.camera.point((pixel % self.camera.width) as f64, (pixel / self.camera.width) as f64, f64::from(z))
    }

    /// Depths of the pixels that are not floor, wall or out of range; 0 elsewhere.
    pub(super) fn foreground(&self, depth: &[f32]) -> Vec<f32> {
        let keeps = |i: usize, z: f32| {
            let p = self.point(i, z);
            let off_planes = self.planes.iter().enumerate().all(|(k, plane)| {
                let height = plane.height(&p);
                if self.floor == Some(k) { height > plane.band } else { height.abs() > plane.band.max(0.01 * p.z) }
            });
            z > 0.0 && z <= self.depth_max && off_planes
        };
        depth.iter().enumerate().map(|(i, &z)| if keeps(i, z) { z } else { 0.0 }).collect()
    }

    fn sizes(&self, found: &PixelComponents, depth: &[f32]) -> Vec<Size> {
        let mut sizes: Vec<Size> = (0..found.count as u32).map(Size::nothing).collect();
        let pixel_area = 1.0 / (self.camera.fx * self.camera.fy);
        for (i, &piece) in found.of_pixel.iter().enumerate() {
            if let Some(size) = sizes.get_mut(piece as usize) {
                let p = self.point(i, depth[i]);
                size.pixels += 1;
                size.area += p.z * p.z * pixel_area;
                size.middle += p.coords;
                size.low = size.low.inf(&p.coords);
                size.high = size.high.sup(&p.coords);
                size.still += f64::from(u8::from(is_still(self.still[i], depth[i])));
            }
        }
        for size in &mut sizes {
            size.middle /= size.pixels.max(1) as f64;
            size.still /= size.pixels.max(1) as f64;
        }
        sizes
    }

    /// Finds the up direction, the floor, and the axis through the person's middle.
    fn stand_upright(&mut self, bodies: &[Vec<Point>]) {
        let middles: Vec<Vec3> =
            bodies.iter().map(|b| b.iter().map(|p| p.coords).sum::<Vec3>() / b.len() as f64).collect();
        let middle = middles.iter().sum::<Vec3>() / middles.len() as f64;
        let long = longest_direction(bodies, &middles);
        // The floor is the plane perpendicular to the person's length and below all of their points.
        self.floor = (0..self.planes.len())
            .filter(|&k| self.planes[k].normal.dot(&long).abs() > 0.8)
            .max_by(|&a, &b| self.planes[a].normal.dot(&long).abs().total_cmp(&self.planes[b].normal.dot(&long).abs()));
        let up = match self.floor {
            Some(k) => self.planes[k].normal,
            None => {
                // Up is the top of the image or one of its sides; the direction of the head is determined later.
                if long.y.abs() > 0.5 { -long * long.y.signum() } else { -long * long.x.signum() }
            }
        };
        let toward_camera = -(middle - up * up.dot(&middle));
        let back = toward_camera.try_normalize(1e-6).unwrap_or_else(|| -Vec3::z());
        let rotation = Matrix3::from_rows(&[up.cross(&back).transpose(), up.transpose(), back.transpose()]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let lowest = match self.floor {
            Some(k) => -self.planes[k].offset,
            None => quantile(bodies.iter().flatten().map(|p| up.dot(&p.coords)).collect(), 0.002),
        };
        let origin = middle + up * (lowest - up.dot(&middle));
        self.model_from_camera = Isometry3::from_parts((-(rotation * origin)).into(), rotation);
        self.axis = Axis { point: Point::origin(), direction: Unit::new_unchecked(Vec3::y()) };
        self.findings.push(match self.floor {
            Some(k) => format!(
                "removed the floor, {:.2} m below the camera{}",
                self.planes[k].offset,
                if self.planes.len() > 1 { ", and the walls" } else { "" }
            ),
            None => "no floor was found: the person's long axis points up".into(),
        });
        if self.nothing_behind {
            self.findings
                .push("no background was measured: pixels without depth around the person count as free space".into());
        }
    }

    fn measure(&mut self, bodies: &[Vec<Point>]) {
        let in_model = |p: &Point| self.model_from_camera * p;
        let far: Vec<f64> = bodies.iter().flatten().map(in_model).map(|p| p.x.hypot(p.z)).collect();
        let heights: Vec<f64> = bodies.iter().flatten().map(|p| in_model(p).y).collect();
        self.radius = (quantile(far, 0.998) + 0.12).clamp(0.3, REACH + 0.1);
        self.heights = [quantile(heights.clone(), 0.0005) - 0.03, quantile(heights, 0.9995) + 0.05];
        if self.floor.is_some() {
            self.heights[0] = self.heights[0].max(0.0);
        }
    }

    /// A turntable's top is level, low and larger than feet. Everything at its height or below is removed.
    fn find_platform(&mut self, seen: &[SurveyedFrame]) {
        /// Least level area within a layer of 2 cm, in m²: feet have a tenth of it.
        const LEAST_TOP: f64 = 0.07;
        const LAYER: f64 = 0.01;
        /// Search range above the lowest point, in metres.
        const LOW: f64 = 0.4;
        let base = self.heights[0];
        let mut area = vec![0.0; (LOW / LAYER) as usize];
        let up = self.model_from_camera.rotation.inverse() * Vec3::y();
        for s in seen {
            for (i, &z) in self.foreground(&s.depth).iter().enumerate().filter(|(_, z)| **z > 0.0) {
                let p = self.point(i, z);
                let at = self.model_from_camera * p;
                let layer = (at.y - base) / LAYER;
                if at.x.hypot(at.z) < self.radius && layer >= 0.0 && (layer as usize) < area.len() {
                    // The area of a level surface of that many pixels. Upright surfaces are overestimated, but have few
                    // pixels.
                    let slope = up.dot(&p.coords).abs() / p.coords.norm();
                    let pixel = p.coords.norm_squared() / (self.camera.fx * self.camera.fy);
                    area[layer as usize] += pixel / slope.max(0.2) / seen.len() as f64;
                }
            }
        }
        let top = (0..area.len() - 1).rev().find(|&k| area[k] + area[k + 1] > LEAST_TOP);
        let Some(k) = top else { return };
        let (below, above) = (area[k], area[k + 1]);
        let height = base + LAYER * (k as f64 + 0.5 + above / (below + above));
        self.heights[0] = height + 0.01;
        self.findings.push(format!("removed a turntable {:.0} cm high", 100.0 * height.max(0.0)));
        let lift = Isometry3::translation(0.0, -height, 0.0);
        self.model_from_camera = lift * self.model_from_camera;
        self.heights = self.heights.map(|h| h - height);
    }
}

/// Whether a depth is that of the static background at its pixel.
pub(super) fn is_still(still: f32, z: f32) -> bool {
    still > 0.0 && (z - still).abs() < STILL * still
}

/// Properties of a component.
struct Size {
    piece: u32,
    pixels: usize,
    area: f64,
    middle: Vec3,
    low: Vec3,
    high: Vec3,
    /// Share of pixels that do not change from frame to frame.
    still: f64,
}

impl Size {
    fn nothing(piece: u32) -> Self {
        let [low, high] = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
        Self { piece, pixels: 0, area: 0.0, middle: Vec3::zeros(), low, high, still: 0.0 }
    }

    fn is_person(&self) -> bool {
        self.has_the_size() && self.still < FURNITURE
    }

    fn has_the_size(&self) -> bool {
        let longest = (self.high - self.low).amax();
        self.area > LEAST_AREA && (SIZE[0]..SIZE[1]).contains(&longest)
    }
}

/// The surveyed frames, decoded.
fn look(frames: &Frames) -> Result<Vec<SurveyedFrame>, FusionError> {
    let count = frames.count();
    let chosen: Vec<usize> = (0..count.min(LOOKED_AT)).map(|i| i * count / count.min(LOOKED_AT)).collect();
    let seen: Vec<Result<SurveyedFrame, FusionError>> =
        chosen.par_iter().map(|&frame| Ok(SurveyedFrame { frame, depth: frames.depth(frame)?.depth })).collect();
    // Report the first bad frame, not the one that was read first.
    let seen: Vec<SurveyedFrame> = seen.into_iter().collect::<Result<_, FusionError>>()?;
    let empty: Vec<&SurveyedFrame> = seen.iter().filter(|s| s.depth.iter().all(|&z| z == 0.0)).collect();
    if let Some(first) = empty.first().filter(|_| 2 * empty.len() >= seen.len()) {
        let name = frames.name(first.frame).into();
        return Err(FusionError::NoDepth { name, count: empty.len(), of: seen.len() });
    }
    let with_depth: Vec<SurveyedFrame> = seen.into_iter().filter(|s| s.depth.iter().any(|&z| z > 0.0)).collect();
    let known = known_depths(&with_depth[0]);
    let (nearest, farthest) = (quantile(known.clone(), 0.01), quantile(known, 0.99));
    // With the stated scale, most may be where no person stands, although something is nearer.
    let likely = frames.likely_scale();
    let median = quantile(known_depths(&with_depth[0]), 0.5);
    if farthest < 0.3 || nearest > 8.0 || (likely.is_some() && !(0.8..=9.0).contains(&median)) {
        let name = frames.name(with_depth[0].frame).into();
        return Err(FusionError::WrongScale { name, nearest, farthest, likely });
    }
    Ok(with_depth)
}

fn known_depths(frame: &SurveyedFrame) -> Vec<f64> {
    frame.depth.iter().filter(|z| **z > 0.0).map(|&z| f64::from(z)).collect()
}

/// Per pixel the depth that it has in nearly all frames, or 0.
fn still(seen: &[SurveyedFrame]) -> Vec<f32> {
    let pixels = seen[0].depth.len();
    (0..pixels)
        .into_par_iter()
        .with_min_len(4096)
        .map(|i| {
            let mut known: Vec<f32> = seen.iter().map(|s| s.depth[i]).filter(|&z| z > 0.0).collect();
            if known.len() < 3 || 2 * known.len() < seen.len() {
                return 0.0;
            }
            known.sort_by(f32::total_cmp);
            // The deeper half is the background behind a passing person.
            let (middle, deep) = (known[known.len() / 2], known[known.len() * 9 / 10]);
            if deep - middle < STILL * middle { middle } else { 0.0 }
        })
        .collect()
}

/// Whether a frame shows no background: the person was already segmented, or the background is out of range.
fn has_no_background(seen: &SurveyedFrame, body: &[Point]) -> bool {
    let farthest = body.iter().map(|p| p.z as f32).fold(0.0, f32::max);
    let behind = seen.depth.iter().filter(|z| **z > farthest + BEHIND).count();
    behind as f64 <= NO_BACKGROUND * body.len() as f64
}

/// Whether a plane is flat cloth: most of it moves, and something is beyond it. The front of a coat and the arms beside it can be
/// as flat and as large as a wall; a wall that moves with the camera has nothing beyond.
///
/// **Shapes** `depth` and `still`: one entry per pixel.
fn is_of_the_person(plane: &Plane, camera: &RgbdCamera, depth: &[f32], still: &[f32]) -> bool {
    let (mut on, mut moving, mut beyond) = (0, 0, 0);
    for (i, &z) in depth.iter().enumerate().filter(|(_, z)| **z > 0.0) {
        let height = plane.height(&camera.point((i % camera.width) as f64, (i / camera.width) as f64, f64::from(z)));
        if height.abs() < plane.band {
            on += 1;
            moving += usize::from(!is_still(still[i], z));
        }
        beyond += usize::from(height < -f64::from(JUMP));
    }
    2 * moving > on && 2 * beyond > on
}

/// Refuses a moving camera: a static one never sees deeper than the background measured before.
fn refuse_moved_camera(
    frames: &Frames,
    camera: &RgbdCamera,
    planes: &[Plane],
    seen: &[SurveyedFrame],
) -> Result<(), FusionError> {
    let first = &seen[0];
    let background: Vec<usize> = (0..first.depth.len())
        .step_by(3)
        .filter(|&i| {
            let z = f64::from(first.depth[i]);
            let p = camera.point((i % camera.width) as f64, (i / camera.width) as f64, z);
            z > 0.0 && planes.iter().any(|plane| plane.height(&p).abs() < plane.band)
        })
        .collect();
    // Without background nothing can be checked, which is not an error.
    if background.len() * 3 < first.depth.len() / 10 {
        return Ok(());
    }
    for later in &seen[1..] {
        let known: Vec<usize> = background.iter().copied().filter(|&i| later.depth[i] > 0.0).collect();
        let deeper = known.iter().filter(|&&i| later.depth[i] > 1.06 * first.depth[i]).count();
        let nearer = known.iter().filter(|&&i| later.depth[i] < 0.94 * first.depth[i]).count();
        let share = |count: usize| count as f64 / known.len().max(1) as f64;
        if share(deeper) > MOVED || share(nearer) > 0.7 {
            return Err(FusionError::CameraMoved {
                first: frames.name(first.frame).into(),
                name: frames.name(later.frame).into(),
            });
        }
    }
    Ok(())
}

/// The direction of the person's largest extent over all surveyed frames.
fn longest_direction(bodies: &[Vec<Point>], middles: &[Vec3]) -> Vec3 {
    let mut spread = Matrix3::zeros();
    for (body, middle) in bodies.iter().zip(middles) {
        for p in body.iter().step_by(7) {
            let d = p.coords - middle;
            spread += d * d.transpose();
        }
    }
    let eigen = spread.symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor, a wall at 3.4 m, and at 2 m a board as large as a coat with wide sleeves, turned away from the camera.
    fn room(camera: &RgbdCamera, turned: f64) -> SurveyedFrame {
        let of_pixel = |i: usize| {
            let ray = camera.point((i % camera.width) as f64, (i / camera.width) as f64, 1.0);
            // On the board z = 2 + x tan(turned).
            let z = 2.0 / (1.0 - ray.x * turned.tan());
            let is_board = (z * ray.x / turned.cos()).abs() < 0.6 && (z * ray.y).abs() < 0.8;
            let floor = if ray.y > 0.0 { 0.9 / ray.y } else { f64::INFINITY };
            if is_board { z as f32 } else { floor.min(3.4) as f32 }
        };
        let pixels = camera.width * camera.height;
        SurveyedFrame { frame: 0, depth: (0..pixels).map(of_pixel).collect() }
    }

    #[test]
    fn flat_cloth_is_no_wall_and_a_wall_is_none_of_the_person_even_if_the_camera_moves() {
        let camera =
            RgbdCamera { width: 424, height: 512, fx: 366.0, fy: 366.0, cx: 211.5, cy: 255.5, distortion: [0.0; 5] };
        let seen: Vec<SurveyedFrame> = (0..12).map(|k| room(&camera, 0.5 * f64::from(k))).collect();
        let planes = large_planes(&camera, &seen[0].depth);
        let of_the_person = |still: &[f32]| -> Vec<f64> {
            let own = planes.iter().filter(|plane| is_of_the_person(plane, &camera, &seen[0].depth, still));
            own.map(|plane| (plane.offset * 100.0).round()).collect()
        };
        assert_eq!(planes.len(), 3);
        assert_eq!(of_the_person(&still(&seen)), [200.0]);
        assert_eq!(of_the_person(&vec![0.0; seen[0].depth.len()]), [200.0], "nothing stands still");
    }
}
