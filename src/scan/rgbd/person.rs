//! Segments the person in a frame.

use super::camera::RgbdCamera;
use super::frame::ColorFrame;
use super::pieces::pixel_components;
use super::survey::{FURNITURE, SceneSurvey, is_still};
use super::view::{BEYOND, OUTLINE, PersonFrame, UNCOLORED};

/// Size below which a piece is a speck, in pixels: flying pixels between a hand and the wall.
const LEAST_PIECE: usize = 40;
/// Least number of pixels of a person.
const LEAST_PERSON: usize = 800;
/// Margin around the person in pixels, so that the space beside the person is known to be empty.
const MARGIN: usize = 6;

/// Pixel size in metres from which the pixels next to a person mostly show the background. On a leg with a radius of 8
/// cm, the outermost 3 mm are steeper than 75° and give no depth. With pixels of 5.5 mm, half of these pixels are the
/// person's.
const RIM: f64 = 0.008;

/// Segments the person in a frame; `None` if nobody is there.
pub(super) fn cut_out(survey: &SceneSurvey, depth: &[f32], color: Option<&ColorFrame>) -> Option<PersonFrame> {
    let camera = &survey.camera;
    let mut person = survey.foreground(depth);
    for (i, z) in person.iter_mut().enumerate().filter(|(_, z)| **z > 0.0) {
        let p = survey.model_from_camera * point(camera, i, *z);
        let inside = p.x.hypot(p.z) < survey.radius && p.y > survey.heights[0] && p.y < survey.heights[1];
        if !inside {
            *z = 0.0;
        }
    }
    let found = pixel_components(camera, &person);
    let (mut pixels, mut still) = (vec![0usize; found.count], vec![0usize; found.count]);
    for (i, &piece) in found.of_pixel.iter().enumerate().filter(|(_, p)| **p != u32::MAX) {
        pixels[piece as usize] += 1;
        still[piece as usize] += usize::from(is_still(survey.still[i], person[i]));
    }
    let largest = (0..found.count).max_by_key(|&k| (pixels[k], usize::MAX - k))?;
    let stays: Vec<bool> = (0..found.count)
        .map(|k| k == largest || pixels[k] >= LEAST_PIECE && (still[k] as f64) < FURNITURE * pixels[k] as f64)
        .collect();
    let is_person = |i: usize| found.of_pixel[i] != u32::MAX && stays[found.of_pixel[i] as usize];
    let (mut low, mut high, mut count) = ([usize::MAX; 2], [0usize; 2], 0);
    for i in (0..person.len()).filter(|&i| is_person(i)) {
        let at = [i % camera.width, i / camera.width];
        for k in 0..2 {
            low[k] = low[k].min(at[k]);
            high[k] = high[k].max(at[k]);
        }
        count += 1;
    }
    if count < LEAST_PERSON {
        return None;
    }
    let size = [camera.width, camera.height];
    let low: [usize; 2] = std::array::from_fn(|k| low[k].saturating_sub(MARGIN));
    let high: [usize; 2] = std::array::from_fn(|k| (high[k] + MARGIN + 1).min(size[k]));
    // Whole pixels also at a quarter of the size.
    let [width, height] = std::array::from_fn(|k| (high[k] - low[k]) / 4 * 4);
    let cropped =
        RgbdCamera { width, height, cx: camera.cx - low[0] as f64, cy: camera.cy - low[1] as f64, ..camera.clone() };
    let free = if survey.nothing_behind { around(camera, depth) } else { Vec::new() };
    // Half of the narrow pixels next to a person belong to the person but gave no depth because of their slope.
    let distance = survey.model_from_camera.translation.vector.xz().norm();
    let narrow = distance / camera.fx < RIM;
    let mut cut = Vec::with_capacity(width * height);
    let mut colors = Vec::new();
    for row in low[1]..low[1] + height {
        for column in low[0]..low[0] + width {
            let i = row * camera.width + column;
            cut.push(match free.get(i) {
                _ if is_person(i) => depth[i],
                Some(true) if narrow && touches(camera, i, &is_person) => OUTLINE,
                Some(true) => BEYOND,
                _ => beside(survey, i, depth[i]),
            });
            if let Some(color) = color {
                let seen = if is_person(i) { color.at(&point(camera, i, depth[i])) } else { None };
                colors.push(seen.unwrap_or(UNCOLORED));
            }
        }
    }
    Some(PersonFrame::prepare(cropped, cut, colors))
}

/// The pixels without depth that are connected to the image's border. A gap within the person is not included: hair and
/// black cloth give no depth either.
fn around(camera: &RgbdCamera, depth: &[f32]) -> Vec<bool> {
    let (w, h) = (camera.width, camera.height);
    let mut free = vec![false; depth.len()];
    let on_border = |i: usize| i.is_multiple_of(w) || i % w == w - 1 || i < w || i >= w * (h - 1);
    let mut stack: Vec<usize> = (0..depth.len()).filter(|&i| on_border(i) && depth[i] <= 0.0).collect();
    stack.iter().for_each(|&i| free[i] = true);
    while let Some(i) = stack.pop() {
        let next = [
            (i % w > 0, i.wrapping_sub(1)),
            (i % w + 1 < w, i + 1),
            (i >= w, i.wrapping_sub(w)),
            (i + w < w * h, i + w),
        ];
        for (_, j) in next.into_iter().filter(|n| n.0) {
            if !free[j] && depth[j] <= 0.0 {
                free[j] = true;
                stack.push(j);
            }
        }
    }
    free
}

/// Whether `is` holds for one of the eight neighbouring pixels.
fn touches(camera: &RgbdCamera, pixel: usize, is: &dyn Fn(usize) -> bool) -> bool {
    let (x, y) = (pixel % camera.width, pixel / camera.width);
    (y.saturating_sub(1)..(y + 2).min(camera.height))
        .any(|row| (x.saturating_sub(1)..(x + 2).min(camera.width)).any(|column| is(row * camera.width + column)))
}

/// The depth of a pixel beside the person: [`BEYOND`] for a free ray, 0 if unknown.
fn beside(survey: &SceneSurvey, pixel: usize, z: f32) -> f32 {
    if z <= 0.0 {
        return 0.0;
    }
    let p = survey.model_from_camera * point(&survey.camera, pixel, z);
    // Near the feet, floor and sole cannot be distinguished; a speck within reach may be a finger.
    let near = p.x.hypot(p.z) < survey.radius && p.y < survey.heights[1];
    if near { 0.0 } else { BEYOND }
}

fn point(camera: &RgbdCamera, pixel: usize, z: f32) -> crate::geometry::Point {
    camera.point((pixel % camera.width) as f64, (pixel / camera.width) as f64, f64::from(z))
}
