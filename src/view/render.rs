//! Draws a scene as seen by a camera.

use super::camera::Camera;
use super::floor::Floor;
use super::lighting::Lighting;
use super::palette::srgb_from_linear;
use super::picture::Picture;
use super::raster::{Grid, Hit, NOTHING, Visibility};
use super::scene::{Part, Scene};
use super::surface::{RenderSurface, Triple};
use rayon::prelude::*;

/// Samples along each side of a pixel: nine in all, so ten levels along an edge.
const SAMPLES_ACROSS: usize = 3;
/// Samples per pixel.
const SAMPLES: usize = SAMPLES_ACROSS * SAMPLES_ACROSS;
/// Lookups in the shadow map per sample, 36 per pixel.
const TAPS: usize = 4;
/// Linear light of the background at the upper and lower edge.
const BACKGROUND: [[f32; 3]; 2] = [[0.93, 0.935, 0.945], [0.80, 0.81, 0.825]];

/// Draws a scene.
///
/// Smooth shading by vertex normals, antialiased, with a key light and its soft shadows, a fill light and a shadow on
/// the floor. Backs of surfaces have a dark tint. An empty scene gives an empty background.
///
/// **Guarantees** equal bytes with any number of threads.
pub fn render(scene: &Scene<'_>, camera: &Camera, width: usize, height: usize) -> Picture {
    let mut picture = Picture::filled([255; 3], width, height);
    let (width, height) = (picture.width(), picture.height());
    let metres_per_pixel = camera.metres_per_pixel(width, height);
    let grid = Grid {
        columns: width * SAMPLES_ACROSS,
        rows: height * SAMPLES_ACROSS,
        step: (metres_per_pixel / SAMPLES_ACROSS as f64) as f32,
    };
    let layers = layers_of(scene, camera, grid);
    let up = Triple::from(camera.axes.map(|axis| axis.y as f32));
    let studio = Studio {
        lighting: Lighting::prepare(&layers[0].surface, up, SAMPLES, TAPS),
        layers,
        floor: floor_under(scene),
        camera,
        grid,
    };
    picture.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(row, pixels)| {
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let light = studio.pixel(column, row);
            *pixel = [light.x, light.y, light.z].map(srgb_from_linear);
        }
    });
    picture
}

/// Parts of one opacity and their visible triangles.
struct RenderPass<'a> {
    surface: RenderSurface<'a>,
    seen: Visibility,
}

/// All opaque parts as one layer, then a layer per translucent part.
fn layers_of<'a>(scene: &Scene<'a>, camera: &Camera, grid: Grid) -> Vec<RenderPass<'a>> {
    let (opaque, translucent): (Vec<Part<'a>>, Vec<Part<'a>>) = scene.parts.iter().partition(|p| p.opacity >= 1.0);
    let groups = std::iter::once(opaque.as_slice()).chain(translucent.chunks(1));
    groups
        .map(|parts| {
            let surface = RenderSurface::gather(parts, camera, parts.first().map_or(1.0, |part| part.opacity));
            let seen = Visibility::draw(&surface.positions, &surface.faces, grid);
            RenderPass { surface, seen }
        })
        .collect()
}

fn floor_under(scene: &Scene<'_>) -> Option<Floor> {
    let mut bounds = scene.bounds()?;
    bounds.min.y = scene.floor.unwrap_or(bounds.min.y);
    let (mut world, mut faces) = (Vec::new(), Vec::new());
    for part in &scene.parts {
        let first = world.len() as u32;
        world.extend(part.mesh.points().iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]));
        faces.extend(part.mesh.faces().iter().map(|face| face.map(|v| first + v.0)));
    }
    Some(Floor::prepare(&world, &faces, &bounds))
}

/// All inputs of a pixel's colour.
struct Studio<'a> {
    lighting: Lighting,
    layers: Vec<RenderPass<'a>>,
    floor: Option<Floor>,
    camera: &'a Camera,
    grid: Grid,
}

impl Studio<'_> {
    /// Mean light of a pixel's samples.
    fn pixel(&self, column: usize, row: usize) -> Triple {
        let background = self.background(column, row);
        let mut sum = Triple::zeros();
        for sample in 0..SAMPLES {
            let at =
                [column * SAMPLES_ACROSS + sample % SAMPLES_ACROSS, row * SAMPLES_ACROSS + sample / SAMPLES_ACROSS];
            sum += self.sample(at, sample, background);
        }
        sum / SAMPLES as f32
    }

    /// Light of one sample: the nearest opaque surface, blended from far to near with the translucent surfaces in front.
    fn sample(&self, [column, row]: [usize; 2], sample: usize, background: Triple) -> Triple {
        let hit = self.layers[0].seen.at(column, row);
        let mut light =
            if hit.face == NOTHING { background } else { self.shaded(0, hit, self.grid.view_of(column, row), sample) };
        if self.layers.len() == 1 {
            return light;
        }
        let mut before: Vec<(usize, Hit)> = (1..self.layers.len())
            .map(|layer| (layer, self.layers[layer].seen.at(column, row)))
            .filter(|(_, over)| over.face != NOTHING && over.nearness > hit.nearness)
            .collect();
        before.sort_by(|a, b| a.1.nearness.total_cmp(&b.1.nearness));
        for (layer, over) in before {
            let opacity = self.layers[layer].surface.opacity;
            let own = self.shaded(layer, over, self.grid.view_of(column, row), sample);
            light = light * (1.0 - opacity) + own * opacity;
        }
        light
    }

    fn shaded(&self, layer: usize, hit: Hit, [x, y]: [f32; 2], sample: usize) -> Triple {
        let surface = &self.layers[layer].surface;
        let ids = surface.faces[hit.face as usize].map(|v| v as usize);
        let [a, b, c] = ids.map(|v| surface.positions[v]);
        let flat = (b - a).cross(&(c - a));
        let is_back = flat.z < 0.0;
        let weights = barycentric([a, b, c], x, y);
        let smooth = ids.iter().zip(weights).fold(Triple::zeros(), |sum, (&v, w)| sum + surface.normals[v] * w);
        let outward = smooth.try_normalize(1e-6).or_else(|| flat.try_normalize(1e-20)).unwrap_or_else(Triple::z);
        let normal = if is_back { -outward } else { outward };
        let point = Triple::new(x, y, hit.nearness);
        let key_visible = if layer == 0 { self.lighting.key_visible(&point, &normal, sample) } else { 1.0 };
        self.lighting.reflected(&surface.albedo_at(hit.face as usize, weights), &normal, is_back, key_visible)
    }

    /// The background with the shadow on the floor.
    fn background(&self, column: usize, row: usize) -> Triple {
        let middle = SAMPLES_ACROSS / 2;
        let [x, y] = self.grid.view_of(column * SAMPLES_ACROSS + middle, row * SAMPLES_ACROSS + middle);
        let down = row as f32 * SAMPLES_ACROSS as f32 / self.grid.rows as f32;
        let paper = Triple::from(BACKGROUND[0]).lerp(&Triple::from(BACKGROUND[1]), down);
        let toward = self.camera.axes[2];
        let Some(floor) = self.floor.as_ref().filter(|_| toward.y > 0.0) else { return paper };
        let on_ray = self.camera.world_from_view([f64::from(x), f64::from(y), 0.0]);
        let on_floor = on_ray - toward * ((on_ray.y - floor.height) / toward.y);
        paper * (1.0 - floor.darkness_at(on_floor.x, on_floor.z))
    }
}

/// Barycentric coordinates of a point of the picture's plane, clamped to the triangle, also for slivers.
fn barycentric([a, b, c]: [Triple; 3], x: f32, y: f32) -> [f32; 3] {
    let cross = |p: &Triple, q: &Triple| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    let weights = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
    let sum: f32 = weights.iter().sum();
    if sum.abs() < 1e-14 {
        return [1.0 / 3.0; 3];
    }
    let inside = weights.map(|w| (w / sum).clamp(0.0, 1.0));
    let total: f32 = inside.iter().sum();
    inside.map(|w| w / total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Texture, UvMap};
    use crate::geometry::{Aabb, Point, TriMesh};
    use crate::view::Paint;

    const RED: [u8; 3] = [200, 60, 60];
    const SKIN: [u8; 3] = [226, 190, 168];

    /// A ball of radius 0.3 that rests on the floor.
    fn ball() -> TriMesh {
        let (rings, spokes) = (24_u32, 48_u32);
        let at = |ring: u32, spoke: u32| {
            let (polar, turn) = (f64::from(ring) / f64::from(rings), f64::from(spoke) / f64::from(spokes));
            let (polar, turn) = (polar * std::f64::consts::PI, turn * std::f64::consts::TAU);
            Point::new(polar.sin() * turn.sin(), 1.0 - polar.cos(), polar.sin() * turn.cos()) * 0.3
        };
        let points = (0..=rings).flat_map(|ring| (0..spokes).map(move |spoke| at(ring, spoke))).collect();
        let corner = |ring: u32, spoke: u32| ring * spokes + spoke % spokes;
        let faces: Vec<_> = (0..rings)
            .flat_map(|r| (0..spokes).map(move |s| (r, s)))
            .flat_map(|(r, s)| {
                let [a, b, c, d] = [corner(r, s), corner(r, s + 1), corner(r + 1, s + 1), corner(r + 1, s)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    fn seen(parts: &[Part<'_>]) -> Picture {
        let bounds = Aabb { min: Point::new(-0.5, 0.0, -0.5), max: Point::new(0.5, 0.9, 0.5) };
        render(&Scene::new(parts.iter().copied()), &Camera::front(&bounds), 120, 120)
    }

    /// Sum of the channels of the pixel that shows the ball at this offset from its middle, in radii.
    fn brightness(picture: &Picture, x: f64, y: f64) -> i32 {
        let metres_per_pixel = 1.0 * 1.06 / 120.0;
        let row = 60.0 - (0.3 - 0.45 + 0.3 * y) / metres_per_pixel;
        let pixel = picture.pixels()[row as usize * 120 + (60.0 + 0.3 * x / metres_per_pixel) as usize];
        pixel.iter().map(|&c| i32::from(c)).sum()
    }

    #[test]
    fn a_ball_is_lit_from_the_upper_left_and_nowhere_black() {
        let ball = ball();
        assert!(ball.signed_volume() > 0.0);
        let picture = seen(&[Part::solid(&ball, RED)]);
        let along_the_light = [-0.8, -0.4, 0.0, 0.4, 0.8].map(|t| brightness(&picture, t * 0.7, -t * 0.7));
        // The rim on the side of the lamp is in profile and loses some light again.
        assert!(along_the_light[1..].is_sorted_by(|a, b| a > b), "{along_the_light:?}");
        let darkest = picture.pixels().iter().map(|p| p.iter().map(|&c| i32::from(c)).sum::<i32>()).min();
        assert!(darkest > Some(70), "{darkest:?}");
    }

    #[test]
    fn a_texture_lies_where_its_coordinates_say() {
        let corner = |x: f64, y: f64| Point::new(x, y, 0.0);
        let points = vec![corner(-0.4, 0.0), corner(0.4, 0.0), corner(0.4, 0.8), corner(-0.4, 0.8)];
        let plate = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let ball = ball();
        // Red on the left, green on the right, finer than the triangles.
        let pixels = (0..64 * 64).map(|k| if k % 64 < 32 { [220, 20, 20] } else { [20, 200, 20] }).collect();
        let uvs = UvMap {
            coords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            corners: vec![[0, 1, 2], [0, 2, 3]].into(),
            texture: None,
        };
        let texture = Texture { side: 64, pixels };
        let textured = Part::try_new(&plate, Paint::Textured { uvs: &uvs, texture: &texture }).unwrap();
        let refused = Part::try_new(&ball, Paint::Textured { uvs: &uvs, texture: &texture });
        assert!(matches!(refused, Err(crate::view::Error::TextureFaces { of_texture: 2, .. })));
        // Other faces before it, so that its own are counted from the right one.
        let behind = ball.map_points(|p| Point::new(p.x, p.y, p.z - 2.0));
        let picture = seen(&[Part::solid(&behind, SKIN), textured]);
        for (column, brightest) in [(25, 0), (55, 0), (65, 1), (95, 1)] {
            let pixel = picture.pixels()[60 * 120 + column];
            assert!(pixel[brightest] > 2 * pixel[1 - brightest], "{pixel:?} at {column}");
        }
    }

    #[test]
    fn the_inside_is_told_from_the_outside() {
        let (ball, inside_out) = (ball(), ball().flipped());
        let (outside, inside) = (seen(&[Part::solid(&ball, SKIN)]), seen(&[Part::solid(&inside_out, SKIN)]));
        for (x, y) in [(0.0, 0.0), (0.5, 0.3), (-0.5, -0.4)] {
            let [inside, outside] = [&inside, &outside].map(|picture| brightness(picture, x, y));
            assert!(3 * inside < 2 * outside, "{inside} {outside} at {x}, {y}");
        }
    }

    #[test]
    fn a_translucent_shell_lets_the_ball_shine_through() {
        let ball = ball();
        let shell = ball.map_points(|p| Point::new(p.x * 1.2, 0.3 + (p.y - 0.3) * 1.2, p.z * 1.2));
        let blue = Part::solid(&shell, [40, 60, 220]);
        let [bare, veiled, hidden] =
            [vec![], vec![blue.with_opacity(0.5)], vec![blue]].map(|mut parts: Vec<Part<'_>>| {
                parts.push(Part::solid(&ball, RED));
                seen(&parts).pixels()[70 * 120 + 60]
            });
        assert!(bare[0] > veiled[0] && veiled[0] > hidden[0] && bare[2] < veiled[2] && veiled[2] < hidden[2]);
    }

    #[test]
    fn an_edge_has_intermediate_tones_and_the_floor_a_shadow() {
        let ball = ball();
        let (picture, empty) = (seen(&[Part::solid(&ball, RED)]), seen(&[]));
        let row = 60 - ((0.3 - 0.45) * 120.0 / 1.06) as usize;
        let tones: Vec<_> = (0..60).map(|x| picture.pixels()[row * 120 + x]).collect();
        let between = tones.iter().filter(|p| p[1] > 130 && p[1] < 200).count();
        assert!((1..=2).contains(&between), "{between}: {tones:?}");
        assert!(empty.pixels().iter().all(|p| p[0] > 225 && p[1] > 225 && p[2] > 225));
        let below = picture.pixels()[113 * 120 + 60][0] + 12 < empty.pixels()[113 * 120 + 60][0];
        assert!(below, "{:?} {:?}", picture.pixels()[113 * 120 + 60], empty.pixels()[113 * 120 + 60]);
    }

    #[test]
    fn one_thread_and_many_draw_the_same_bytes() {
        let ball = ball();
        let drawn = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| seen(&[Part::solid(&ball, RED), Part::solid(&ball, [0; 3]).with_opacity(0.3)]))
        };
        assert!(drawn(1) == drawn(4));
    }
}
