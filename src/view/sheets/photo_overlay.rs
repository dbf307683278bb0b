//! A body over the photo from which it was computed.

use crate::body::BodyModel;
use crate::formats::ColorPicture;
use crate::geometry::TriMesh;
use crate::photo::{Keypoints, PhotoBody, PhotoCamera};
use crate::view::picture::Picture;
use crate::view::raster::{Grid, NOTHING, Visibility};
use crate::view::surface::Triple;
use nalgebra::Vector2;

/// Samples along each side of a pixel.
const SAMPLES_ACROSS: usize = 3;
/// Colours of the body, of its outline and bones, of keypoints and of the lines from them to where the body has them.
const BODY: [u8; 3] = [112, 142, 178];
const SKIN: [u8; 3] = [196, 186, 176];
const CLOTH: [u8; 3] = [70, 110, 170];
const INK: [u8; 3] = [30, 45, 70];
const KEYPOINT: [u8; 3] = [232, 120, 30];
/// How much of the photo the body covers.
const BODY_OPACITY: f64 = 0.62;

/// Draws the body's silhouette with its shading, its bones, and the keypoints with lines to where the body has them; over
/// the photo, or over white.
///
/// **Requires** a photo of the camera's size.
pub fn photo_overlay(
    photo: Option<&ColorPicture>,
    model: &BodyModel,
    body: &PhotoBody,
    keypoints: &Keypoints,
) -> Picture {
    let [width, height] = body.camera.size;
    let mut picture = over(photo, body.camera.size);
    let posed = model.template.with_points(body.posed(model));
    draw_surfaces(&mut picture, &body.camera, &[(&posed, BODY)], BODY_OPACITY);
    // Lines and discs that are visible at the size at which a picture is looked at, 800 px.
    let unit = (height.max(width) as f64 / 800.0).max(0.5);
    let joints = body.joints(model);
    let at = |j: usize| body.camera.project(&joints[j].coords);
    for (j, parent) in model.skeleton.parents.iter().enumerate() {
        if let Some((from, to)) = parent.and_then(|p| at(p.index())).zip(at(j)) {
            draw_line(&mut picture, [from, to], 1.6 * unit, INK, 0.8);
        }
    }
    for (keypoint, projected) in keypoints.seen.iter().zip(&body.projected) {
        draw_line(&mut picture, [keypoint.at, *projected], 1.0 * unit, KEYPOINT, 0.9);
        draw_line(&mut picture, [*projected; 2], 2.6 * unit, INK, 1.0);
        draw_line(&mut picture, [keypoint.at; 2], 5.0 * unit, [255; 3], 1.0);
        draw_line(&mut picture, [keypoint.at; 2], 3.6 * unit, KEYPOINT, 1.0);
    }
    picture
}

/// The photo, or white.
fn over(photo: Option<&ColorPicture>, [width, height]: [usize; 2]) -> Picture {
    let mut picture = Picture::filled([255; 3], width, height);
    if let Some(photo) = photo {
        picture.pixels_mut().copy_from_slice(&photo.pixels);
    }
    picture
}

/// The photo with body and keypoints as [`photo_overlay`] draws them, and beside it the body in a garment, as the photo's camera sees
/// them.
///
/// **Requires** a photo of the camera's size; body and garment in the pose of the photo, in its world.
pub fn photo_dressed(
    photo: Option<&ColorPicture>,
    model: &BodyModel,
    body: &PhotoBody,
    keypoints: &Keypoints,
    [skin, garment]: [&TriMesh; 2],
) -> Picture {
    let [width, height] = body.camera.size;
    let left = photo_overlay(photo, model, body, keypoints);
    let mut right = over(photo, body.camera.size);
    draw_surfaces(&mut right, &body.camera, &[(skin, SKIN), (garment, CLOTH)], 1.0);
    let mut both = Picture::filled([255; 3], 2 * width, height);
    for (row, pixels) in both.pixels_mut().chunks_mut(2 * width).enumerate() {
        pixels[..width].copy_from_slice(&left.pixels()[row * width..(row + 1) * width]);
        pixels[width..].copy_from_slice(&right.pixels()[row * width..(row + 1) * width]);
    }
    both
}

/// Draws surfaces as the photo's camera sees them, each in its colour.
fn draw_surfaces(picture: &mut Picture, camera: &PhotoCamera, surfaces: &[(&TriMesh, [u8; 3])], opacity: f64) {
    let [width, height] = [picture.width(), picture.height()];
    let grid =
        Grid { columns: width * SAMPLES_ACROSS, rows: height * SAMPLES_ACROSS, step: 1.0 / SAMPLES_ACROSS as f32 };
    let (mut positions, mut facing, mut faces, mut colors) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (mesh, color) in surfaces {
        let first = positions.len() as u32;
        for (p, n) in mesh.points().iter().zip(mesh.vertex_normals().iter()) {
            let in_camera = camera.camera_from_world * p;
            // What is behind the camera is far outside the picture.
            let pixel = camera.project(&p.coords).unwrap_or(Vector2::repeat(-1e9));
            let [x, y] = [pixel.x - 0.5 * width as f64, 0.5 * height as f64 - pixel.y];
            positions.push(Triple::new(x as f32, y as f32, -in_camera.z as f32));
            let toward = (camera.camera_from_world.rotation * n).dot(&-in_camera.coords.normalize());
            // Cloth is seen from inside too.
            facing.push(toward.abs());
        }
        faces.extend(mesh.faces().iter().map(|face| face.map(|v| first + v.0)));
        colors.resize(faces.len(), *color);
    }
    let seen = Visibility::draw(&positions, &faces, grid);
    for row in 0..height {
        for column in 0..width {
            let (mut sum, mut covered) = ([0.0; 3], 0.0);
            for sample in 0..SAMPLES_ACROSS * SAMPLES_ACROSS {
                let (dx, dy) = (sample % SAMPLES_ACROSS, sample / SAMPLES_ACROSS);
                let hit = seen.at(column * SAMPLES_ACROSS + dx, row * SAMPLES_ACROSS + dy);
                if hit.face != NOTHING {
                    let light = faces[hit.face as usize].iter().map(|&v| facing[v as usize]).sum::<f64>() / 3.0;
                    // Darker toward the outline, so that limbs in front of the trunk are visible.
                    let shade = 0.35 + 0.75 * light;
                    covered += 1.0;
                    for (sum, c) in sum.iter_mut().zip(colors[hit.face as usize]) {
                        *sum += f64::from(c) * shade;
                    }
                }
            }
            if covered > 0.0 {
                let color = sum.map(|c| (c / covered).min(255.0) as u8);
                let share = covered / (SAMPLES_ACROSS * SAMPLES_ACROSS) as f64;
                blend(picture, column, row, color, opacity * share);
            }
        }
    }
}

/// A line with round ends and of `radius` pixels on each side; between equal points a disc.
fn draw_line(picture: &mut Picture, [from, to]: [Vector2<f64>; 2], radius: f64, color: [u8; 3], opacity: f64) {
    let [width, height] = [picture.width(), picture.height()];
    let reach = |low: f64, high: f64, count: usize| {
        let clamped = |x: f64| x.clamp(0.0, count as f64) as usize;
        clamped((low - radius - 1.0).floor())..clamped((high + radius + 2.0).ceil())
    };
    let along = to - from;
    for row in reach(from.y.min(to.y), from.y.max(to.y), height) {
        for column in reach(from.x.min(to.x), from.x.max(to.x), width) {
            let pixel = Vector2::new(column as f64 + 0.5, row as f64 + 0.5);
            let t = ((pixel - from).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
            let ink = (radius + 0.5 - (pixel - from - along * t).norm()).clamp(0.0, 1.0);
            blend(picture, column, row, color, opacity * ink);
        }
    }
}

fn blend(picture: &mut Picture, column: usize, row: usize, color: [u8; 3], share: f64) {
    let at = row * picture.width() + column;
    for (channel, own) in picture.pixels_mut()[at].iter_mut().zip(color) {
        *channel = (f64::from(*channel) * (1.0 - share) + f64::from(own) * share).round() as u8;
    }
}
