//! The image that a depth camera takes of a scene, with its noise.

use super::backdrop::{Backdrop, Room};
use super::noise::DepthNoise;
use super::pinhole::PosedCamera;
use crate::geometry::{FaceId, Point, TriMesh, Vec3};
use crate::numerics::Rng;
use nalgebra::Point2;

/// A noisy RGB-D image.
///
/// **Shapes** all arrays have `lens.width * lens.height` entries, row by row from the top.
pub struct DepthImage {
    pub(super) view: PosedCamera,
    /// Metres along the view's z; 0 where nothing was measured.
    pub(super) depth: Vec<f32>,
    pub(super) color: Vec<[u8; 3]>,
    /// Cosine between the surface's normal and the ray; 0 where nothing was measured.
    pub(super) facing: Vec<f32>,
    /// True label of the pixel, see [`LabelledScene::labels`]; 0 is the room.
    pub(super) label: Vec<u8>,
}

/// Everything in front of the camera, as one mesh.
///
/// **Shapes** `colors` has one entry per vertex, `labels` one per face.
#[derive(Clone)]
pub struct LabelledScene {
    /// The surfaces, metres.
    pub mesh: TriMesh,
    /// sRGB.
    pub colors: Vec<[u8; 3]>,
    /// 1 the body, then the garments from the inside.
    pub labels: Vec<u8>,
}

/// The true surface at a pixel.
struct Fragment {
    /// Metres along the view's z; 0 where there is no surface.
    depth: f32,
    face: u32,
    /// Barycentric weights of the face's first two corners.
    weights: [f32; 2],
}

const NOTHING: u32 = u32::MAX;

impl PosedCamera {
    /// The image of a scene, with the camera's noise. `room` is the background, static in the camera's frame.
    pub(super) fn render(
        &self,
        scene: &LabelledScene,
        room: Option<&Room>,
        noise: &DepthNoise,
        rng: &mut Rng,
    ) -> DepthImage {
        let (width, height) = (self.lens.width, self.lens.height);
        let seen = self.rasterise(&scene.mesh);
        let behind: Vec<Option<Backdrop>> = (0..seen.len())
            .map(|i| room.filter(|_| seen[i].face == NOTHING).and_then(|r| r.at_pixel(self, i % width, i / width)))
            .collect();
        let exact = |i: usize| match (&seen[i], &behind[i]) {
            (fragment, _) if fragment.face != NOTHING => f64::from(fragment.depth),
            (_, Some(backdrop)) => backdrop.depth,
            _ => 0.0,
        };
        let mut image = DepthImage {
            view: self.clone(),
            depth: vec![0.0; seen.len()],
            color: vec![[0; 3]; seen.len()],
            facing: vec![0.0; seen.len()],
            label: vec![0; seen.len()],
        };
        for to in 0..seen.len() {
            let (x, y) = (to % width, to / width);
            let jitter = |rng: &mut Rng, at: usize, end: usize| {
                ((at as f64 + noise.lateral_px * rng.normal()).round().max(0.0) as usize).min(end - 1)
            };
            let from = jitter(rng, y, height) * width + jitter(rng, x, width);
            let around = [to, to - x.min(1), (to + 1).min(seen.len() - 1), to.saturating_sub(width), to + width];
            let across = around.iter().filter(|&&i| i < seen.len()).map(|&i| exact(i)).filter(|&z| z > 0.0);
            let across = across.fold([f64::INFINITY, 0.0f64], |[low, high], z| [low.min(z), high.max(z)]);
            let ray = self.point(x as f64, y as f64, 1.0).coords;
            let normal = match (&seen[from], &behind[from]) {
                (fragment, _) if fragment.face != NOTHING => {
                    self.camera_from_world * scene.mesh.face_normal(FaceId(fragment.face))
                }
                (_, Some(backdrop)) => backdrop.normal,
                _ => Vec3::zeros(),
            };
            let cosine = (normal.dot(&ray) / ray.norm()).abs();
            image.depth[to] = noise.measured(exact(from), cosine, across, rng) as f32;
            image.facing[to] = if image.depth[to] > 0.0 { cosine as f32 } else { 0.0 };
            if seen[to].face != NOTHING {
                image.label[to] = scene.labels[seen[to].face as usize];
            }
            // Colour and depth come from the same place, or sleeves would take the colour of the wall.
            let albedo = match (&seen[from], &behind[from]) {
                (fragment, _) if fragment.face != NOTHING => shaded(scene, fragment),
                (_, Some(backdrop)) => backdrop.color,
                _ => [0.0; 3],
            };
            /// Standard deviation of the colour noise of a pixel, grey levels.
            const GRAIN: f64 = 5.0;
            let grain = GRAIN * rng.normal();
            image.color[to] = albedo.map(|c| (c + grain).clamp(0.0, 255.0) as u8);
        }
        image
    }

    /// The nearest surface at each pixel, from either side of its face.
    fn rasterise(&self, mesh: &TriMesh) -> Vec<Fragment> {
        let (width, height) = (self.lens.width, self.lens.height);
        let mut seen: Vec<Fragment> =
            (0..width * height).map(|_| Fragment { depth: 0.0, face: NOTHING, weights: [0.0; 2] }).collect();
        let in_camera: Vec<Point> = mesh.points().iter().map(|p| self.camera_from_world * p).collect();
        for (f, corners) in mesh.faces().enumerate() {
            let p = corners.map(|v| in_camera[v.index()]);
            if p.iter().any(|q| q.z < 0.05) {
                continue;
            }
            let q = p.map(|q| self.pixel(&q));
            let area = (q[1] - q[0]).perp(&(q[2] - q[0]));
            if area.abs() < 1e-12 {
                continue;
            }
            let low = q[0].inf(&q[1]).inf(&q[2]);
            let high = q[0].sup(&q[1]).sup(&q[2]);
            let span =
                |a: f64, b: f64, end: usize| a.ceil().max(0.0) as usize..((b.floor() + 1.0).max(0.0) as usize).min(end);
            for y in span(low.y, high.y, height) {
                for x in span(low.x, high.x, width) {
                    let at = Point2::new(x as f64, y as f64);
                    let w: [f64; 3] =
                        std::array::from_fn(|k| (q[(k + 1) % 3] - at).perp(&(q[(k + 2) % 3] - at)) / area);
                    if w.iter().any(|&w| w < 0.0) {
                        continue;
                    }
                    let z = (1.0 / (w[0] / p[0].z + w[1] / p[1].z + w[2] / p[2].z)) as f32;
                    let fragment = &mut seen[y * width + x];
                    if fragment.face == NOTHING || z < fragment.depth {
                        *fragment = Fragment { depth: z, face: f.0, weights: [w[0] as f32, w[1] as f32] };
                    }
                }
            }
        }
        seen
    }
}

/// The colour under a broad light from above.
fn shaded(scene: &LabelledScene, fragment: &Fragment) -> [f64; 3] {
    let face = FaceId(fragment.face);
    let corners = scene.mesh.faces()[face];
    let [a, b] = fragment.weights.map(f64::from);
    let light = 0.82 + 0.18 * scene.mesh.face_normal(face).y;
    std::array::from_fn(|c| {
        let of = |k: usize| f64::from(scene.colors[corners[k].index()][c]);
        (of(0) * a + of(1) * b + of(2) * (1.0 - a - b)) * light
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studio::camera::pinhole::Lens;

    /// A wall of 1 m × 1 m through the axis, turned about the vertical.
    fn wall(turned: f64) -> LabelledScene {
        let (s, c) = (0.5 * turned.sin(), 0.5 * turned.cos());
        let points =
            vec![Point::new(-c, -0.5, s), Point::new(c, -0.5, -s), Point::new(c, 0.5, -s), Point::new(-c, 0.5, s)];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        LabelledScene { mesh, colors: vec![[200, 100, 50]; 4], labels: vec![1; 2] }
    }

    fn measured(turned: f64) -> Vec<(usize, f64)> {
        let view = &PosedCamera::ring(&Point::origin(), 2.0, 1, 1.0, &Lens::default())[0];
        let image = view.render(&wall(turned), None, &DepthNoise::default(), &mut Rng::new(1));
        image.depth.iter().enumerate().filter(|(_, d)| **d > 0.0).map(|(i, &d)| (i, f64::from(d))).collect()
    }

    #[test]
    fn a_wall_two_metres_away_is_seen_there_with_the_noise_of_the_model() {
        let seen = measured(0.0);
        let expected = (366.0f64 / 2.0).powi(2);
        assert!((seen.len() as f64 / expected - 1.0).abs() < 0.05, "{} of {expected} pixels", seen.len());
        let mean = seen.iter().map(|s| s.1).sum::<f64>() / seen.len() as f64;
        let deviation = (seen.iter().map(|s| (s.1 - mean).powi(2)).sum::<f64>() / seen.len() as f64).sqrt();
        assert!((mean - 2.0).abs() < 5e-4, "{mean}");
        assert!((deviation * 1e3 - (1.2 + 1.9 * 1.6f64.powi(2))).abs() < 0.3, "{deviation}");
        let view = &PosedCamera::ring(&Point::origin(), 2.0, 1, 1.0, &Lens::default())[0];
        let (x, y) = (seen[0].0 % view.lens.width, seen[0].0 / view.lens.width);
        let corner = view.camera_from_world.inverse() * view.point(x as f64, y as f64, 2.0);
        assert!((corner.y - 0.5).abs() < 0.03 && corner.z.abs() < 1e-9, "the first row is the top: {corner}");
        let left = view.pixel(&(view.camera_from_world * Point::new(-0.5, 0.0, 0.0)));
        assert!(left.x < 0.5 * view.lens.width as f64, "seen from the front, −x is left");
    }

    #[test]
    fn a_grazed_wall_is_lost() {
        let share = |turned: f64| measured(turned).len() as f64 / (measured(0.0).len() as f64 * turned.cos());
        assert!(share(0.8) > 0.9);
        assert!(share(1.48) < 0.1);
    }
}
