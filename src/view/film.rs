//! Films: the frames of a moving scene, seen by a camera that goes along.

use super::camera::Camera;
use super::error::Error;
use super::palette::layer_color;
use super::picture::Picture;
use super::render::render;
use super::scene::{Paint, Part, Scene};
use crate::body::Layer;
use crate::formats::write_gif;
use crate::geometry::{Aabb, Point, TriMesh, Vec3};

/// Where the camera stands, in radians: in front, to the person's left, at the height of the chest.
const DIRECTION: [f64; 2] = [0.55, 0.12];
/// How long the camera takes to follow, in seconds: long enough that steps do not shake the picture.
const FOLLOW_SECS: f64 = 0.5;

/// A GIF of frames of one size, `count` of them: every `step`-th of a motion of `fps` frames per second.
pub fn draw_gif(
    size: [usize; 2],
    count: usize,
    (step, fps): (usize, f64),
    draw: impl Fn(usize) -> Result<Picture, Error>,
    on_frame: &mut dyn FnMut(usize, usize),
) -> Result<Vec<u8>, Error> {
    // A GIF counts in hundredths of a second: what one frame is short, the next one is long.
    let end = |k: usize| (k as f64 * step as f64 / fps * 100.0).round() as u16;
    let frames = (0..count).map(|k| {
        let pixels = draw(k)?.into_pixels();
        on_frame(k + 1, count);
        Ok((pixels, end(k + 1).wrapping_sub(end(k))))
    });
    write_gif(size, frames)
}

/// The box around meshes.
pub fn around(meshes: &[TriMesh]) -> Aabb {
    let origin = Aabb { min: Point::origin(), max: Point::origin() };
    Aabb::around(meshes.iter().flat_map(|mesh| mesh.points().iter())).unwrap_or(origin)
}

/// Layer number `k` with its texture, or else in its colours. `mesh` is its surface in some pose.
pub fn painted<'a>(mesh: &'a TriMesh, layer: &'a Layer, k: usize) -> Result<Part<'a>, Error> {
    let textured = layer.uvs.as_ref().and_then(|uvs| Some((uvs, uvs.texture.as_ref()?)));
    match (textured, &layer.colors) {
        (Some((uvs, texture)), _) => Part::try_new(mesh, Paint::Textured { uvs, texture }),
        (None, Some(colors)) => Part::try_new(mesh, Paint::PerVertex(colors)),
        (None, None) => Ok(Part::solid(mesh, layer_color(k))),
    }
}

/// The camera of a film.
///
/// **Guarantees** all frames have one scale, and every point of every frame is in the picture.
#[derive(Clone, Debug)]
pub struct FilmCamera {
    /// What the camera looks at in each frame, on the floor.
    places: Vec<Point>,
    /// The box around all frames, relative to those places.
    bounds: Aabb,
}

impl FilmCamera {
    /// A camera that follows `centers`, such as a person's hips.
    ///
    /// **Shapes** `centers` and `bounds` one entry per frame; `bounds` are the boxes around the frames.
    pub fn following(centers: &[Point], bounds: &[Aabb], fps: f64) -> Self {
        let reach = (FOLLOW_SECS * fps).round() as usize;
        let level = |p: &Point| Vec3::new(p.x, 0.0, p.z);
        let place = |k: usize| {
            let around = k.saturating_sub(reach)..(k + reach + 1).min(centers.len());
            let count = around.len() as f64;
            Point::from(centers[around].iter().map(level).sum::<Vec3>() / count)
        };
        let places: Vec<Point> = (0..centers.len()).map(place).collect();
        let corners_of = |(b, place): (&Aabb, &Point)| {
            let x_and_z = [(b.min.x, b.min.z), (b.min.x, b.max.z), (b.max.x, b.min.z), (b.max.x, b.max.z)];
            let at = |y: f64| x_and_z.map(|(x, z)| Point::new(x, y, z) - place.coords);
            [at(b.min.y), at(b.max.y)].concat()
        };
        let corners: Vec<Point> = bounds.iter().zip(&places).flat_map(corners_of).collect();
        let around = Aabb::around(&corners).unwrap_or(Aabb { min: Point::origin(), max: Point::new(1.0, 1.0, 1.0) });
        // The same room to every side, so that a turning person stays in the middle: the box whose picture is as wide as the
        // upright cylinder around all frames.
        let radius = corners.iter().map(|p| p.x.hypot(p.z)).fold(0.0, f64::max);
        let wide = radius / (DIRECTION[0].cos() + DIRECTION[0].sin());
        let wide = wide.max(1e-3);
        let bounds = Aabb { min: Point::new(-wide, around.min.y, -wide), max: Point::new(wide, around.max.y, wide) };
        Self { places, bounds }
    }

    /// One frame of the film; `scene` is where it is in the world.
    pub fn draw(&self, frame: usize, scene: &Scene<'_>, width: usize, height: usize) -> Picture {
        let place = self.places.get(frame).copied().unwrap_or_else(Point::origin);
        let bounds = Aabb { min: self.bounds.min + place.coords, max: self.bounds.max + place.coords };
        let [azimuth, elevation] = DIRECTION;
        render(scene, &Camera::around(&bounds, azimuth, elevation), width, height)
    }

    /// The height of a picture of this width that shows the whole scene and nothing else.
    pub fn height_for(&self, width: usize) -> usize {
        let size = self.bounds.extent();
        // A box seen from its corner is wider than its side.
        let [azimuth, _] = DIRECTION;
        let across = size.x * azimuth.cos() + size.z * azimuth.sin();
        ((width as f64 * size.y / across.max(1e-6)).round() as usize).clamp(width / 4, width * 4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;
    use crate::view::Part;

    #[test]
    fn a_walking_box_stays_in_the_picture_at_one_scale() {
        let corners = |x: f64| {
            let at = |k: usize| Point::new(x + 0.3 * (k & 1) as f64, 1.6 * (k >> 1 & 1) as f64, 0.3 * (k >> 2) as f64);
            (0..8).map(at).collect::<Vec<_>>()
        };
        let frames: Vec<Vec<Point>> = (0..40).map(|k| corners(f64::from(k) * 0.1)).collect();
        let centers: Vec<Point> = frames.iter().map(|f| nalgebra::center(&f[0], &f[7])).collect();
        let bounds: Vec<Aabb> = frames.iter().map(|f| Aabb::around(f).unwrap()).collect();
        let camera = FilmCamera::following(&centers, &bounds, 10.0);
        let height = camera.height_for(60);
        assert!((60..240).contains(&height), "{height}");
        let faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]];
        let mut widths = Vec::new();
        for (k, points) in frames.iter().enumerate().step_by(13) {
            let mesh = TriMesh::try_from_indices(points.clone(), &faces).unwrap();
            let mut scene = Scene::new([Part::solid(&mesh, [200, 40, 40])]);
            scene.floor = Some(0.0);
            let picture = camera.draw(k, &scene, 60, height);
            let red = |p: &[u8; 3]| i32::from(p[0]) - i32::from(p[1]) > 40;
            let columns: Vec<usize> =
                (0..60).filter(|&c| (0..height).any(|r| red(&picture.pixels()[r * 60 + c]))).collect();
            assert!(columns.first() > Some(&0) && columns.last() < Some(&59), "frame {k}: {columns:?}");
            widths.push(columns.len());
        }
        let (least, most) = (widths.iter().min().unwrap(), widths.iter().max().unwrap());
        assert!(most - least <= 1, "{widths:?}");
    }
}
