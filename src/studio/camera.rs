//! A depth camera on a ring around the person: what it sees, and how wrongly.

use super::rng::Rng;
use crate::geometry::{Point, TriMesh, Vec3};
use nalgebra::{Isometry3, Point2};

/// A pinhole camera. Its frame: x right, y down, z forward.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) camera_from_world: Isometry3<f64>,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Pixels.
    pub(super) focal: f64,
}

/// What a view saw.
pub(super) struct DepthImage {
    pub(super) view: View,
    /// Metres along the view's z; 0 where nothing came back. Row by row.
    pub(super) depth: Vec<f32>,
    pub(super) color: Vec<[u8; 3]>,
    /// Cosine between the surface's normal and the ray; 0 where nothing came back.
    pub(super) facing: Vec<f32>,
}

/// Everything that can be seen at once, with one colour a vertex.
pub(super) struct Stage {
    pub(super) mesh: TriMesh,
    pub(super) colors: Vec<[u8; 3]>,
}

/// Drop-outs begin at this angle of incidence: radians (75°, as for time of flight on cloth).
const GRAZING: f64 = 1.309;
/// Share of pixels lost anywhere, dimensionless: dark hair and multipath.
const LOST: f64 = 0.01;
/// Depths are whole millimetres, as in a 16-bit image.
const QUANTUM: f64 = 1e-3;
/// Lateral noise in pixels: half of what Nguyen (2012) found at edges, for inside a surface neighbouring pixels do not
/// trade places; with 0.8 fused scans are 1.6 times as noisy as foreign recordings.
const LATERAL: f64 = 0.4;

impl View {
    /// `count` cameras at `distance` from the vertical through `center`, each at its height and level: one turn of a
    /// turntable, seen from the person.
    pub(super) fn ring(center: &Point, distance: f64, count: usize) -> Vec<Self> {
        (0..count)
            .map(|i| {
                let around = std::f64::consts::TAU * i as f64 / count as f64;
                let eye = center + Vec3::new(around.sin(), 0.0, around.cos()) * distance;
                let camera_from_world = Isometry3::look_at_rh(&eye, center, &Vec3::y());
                // OpenGL's frame looks along −z with y up.
                let turned = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
                Self { camera_from_world: turned * camera_from_world, width: 424, height: 512, focal: 366.0 }
            })
            .collect()
    }

    /// Where a point of the camera's frame falls in the image.
    pub(super) fn pixel(&self, p: &Point) -> Point2<f64> {
        Point2::new(
            self.focal * p.x / p.z + 0.5 * self.width as f64 - 0.5,
            self.focal * p.y / p.z + 0.5 * self.height as f64 - 0.5,
        )
    }

    /// The point of the camera's frame that is seen in a pixel at that depth.
    pub(super) fn point(&self, x: f64, y: f64, depth: f64) -> Point {
        let centered = |at: f64, size: usize| at - 0.5 * size as f64 + 0.5;
        Point::new(centered(x, self.width) / self.focal * depth, centered(y, self.height) / self.focal * depth, depth)
    }

    /// The image of a stage with all the camera's faults: Nguyen's axial noise 1.2 + 1.9 (z − 0.4)² mm, lateral
    /// noise, drop-outs at grazing angles, whole millimetres.
    pub(super) fn shoot(&self, stage: &Stage, rng: &mut Rng) -> DepthImage {
        let (exact, faces) = self.rasterise(&stage.mesh);
        let mut image = DepthImage {
            view: self.clone(),
            depth: vec![0.0; exact.len()],
            color: vec![[0; 3]; exact.len()],
            facing: vec![0.0; exact.len()],
        };
        for y in 0..self.height {
            for x in 0..self.width {
                let jitter = |rng: &mut Rng, at: usize, end: usize| {
                    ((at as f64 + LATERAL * rng.normal()).round().max(0.0) as usize).min(end - 1)
                };
                let from = jitter(rng, y, self.height) * self.width + jitter(rng, x, self.width);
                let (z, noise, lost) = (f64::from(exact[from]), rng.normal(), rng.unit());
                if z <= 0.0 {
                    continue;
                }
                let face = faces[from];
                let normal = self.camera_from_world * stage.mesh.face_normal(crate::geometry::FaceId(face));
                let ray = self.point(x as f64, y as f64, 1.0).coords;
                let cosine = (normal.dot(&ray) / ray.norm()).abs();
                if lost < LOST || cosine < GRAZING.cos() * (0.6 + 0.8 * lost) {
                    continue;
                }
                let sigma = 1e-3 * (1.2 + 1.9 * (z - 0.4).powi(2));
                let to = y * self.width + x;
                image.depth[to] = (((z + sigma * noise) / QUANTUM).round() * QUANTUM) as f32;
                image.facing[to] = cosine as f32;
                image.color[to] = self.shade(stage, face, x, y, rng);
            }
        }
        image
    }

    /// Albedo under a broad light from above, and the sensor's grain.
    fn shade(&self, stage: &Stage, face: u32, x: usize, y: usize, rng: &mut Rng) -> [u8; 3] {
        /// Grey levels of noise a pixel.
        const GRAIN: f64 = 5.0;
        let corners = stage.mesh.faces()[crate::geometry::FaceId(face)];
        let seen = Point2::new(x as f64, y as f64);
        let nearness = corners
            .map(|v| 1.0 / (0.1 + (self.pixel(&(self.camera_from_world * stage.mesh.points()[v])) - seen).norm()));
        let total: f64 = nearness.iter().sum();
        let light = 0.82 + 0.18 * stage.mesh.face_normal(crate::geometry::FaceId(face)).y;
        let grain = GRAIN * rng.normal();
        std::array::from_fn(|c| {
            let albedo: f64 =
                (0..3).map(|k| f64::from(stage.colors[corners[k].index()][c]) * nearness[k] / total).sum();
            (albedo * light + grain).clamp(0.0, 255.0) as u8
        })
    }

    /// Exact depth and face of each pixel, whichever side of a face is seen.
    fn rasterise(&self, mesh: &TriMesh) -> (Vec<f32>, Vec<u32>) {
        let mut depth = vec![0.0f32; self.width * self.height];
        let mut seen = vec![0u32; self.width * self.height];
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
            for y in span(low.y, high.y, self.height) {
                for x in span(low.x, high.x, self.width) {
                    let at = Point2::new(x as f64, y as f64);
                    let w: [f64; 3] =
                        std::array::from_fn(|k| (q[(k + 1) % 3] - at).perp(&(q[(k + 2) % 3] - at)) / area);
                    if w.iter().any(|&w| w < 0.0) {
                        continue;
                    }
                    let z = (1.0 / (w[0] / p[0].z + w[1] / p[1].z + w[2] / p[2].z)) as f32;
                    let i = y * self.width + x;
                    if depth[i] == 0.0 || z < depth[i] {
                        (depth[i], seen[i]) = (z, f.0);
                    }
                }
            }
        }
        (depth, seen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall through the axis, turned about the vertical, 1 m wide.
    fn wall(turned: f64) -> Stage {
        let (s, c) = (0.5 * turned.sin(), 0.5 * turned.cos());
        let points =
            vec![Point::new(-c, -0.5, s), Point::new(c, -0.5, -s), Point::new(c, 0.5, -s), Point::new(-c, 0.5, s)];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        Stage { mesh, colors: vec![[200, 100, 50]; 4] }
    }

    fn shot(turned: f64) -> Vec<(usize, f64)> {
        let view = &View::ring(&Point::origin(), 2.0, 1)[0];
        let image = view.shoot(&wall(turned), &mut Rng::new(1));
        image.depth.iter().enumerate().filter(|(_, d)| **d > 0.0).map(|(i, &d)| (i, f64::from(d))).collect()
    }

    #[test]
    fn a_wall_two_metres_away_is_seen_there_with_the_noise_of_the_model() {
        let seen = shot(0.0);
        let expected = (366.0f64 / 2.0).powi(2);
        assert!((seen.len() as f64 / expected - 1.0).abs() < 0.05, "{} of {expected} pixels", seen.len());
        let mean = seen.iter().map(|s| s.1).sum::<f64>() / seen.len() as f64;
        let deviation = (seen.iter().map(|s| (s.1 - mean).powi(2)).sum::<f64>() / seen.len() as f64).sqrt();
        assert!((mean - 2.0).abs() < 5e-4, "{mean}");
        assert!((deviation * 1e3 - (1.2 + 1.9 * 1.6f64.powi(2))).abs() < 0.3, "{deviation}");
        let view = &View::ring(&Point::origin(), 2.0, 1)[0];
        let (x, y) = (seen[0].0 % view.width, seen[0].0 / view.width);
        let corner = view.camera_from_world.inverse() * view.point(x as f64, y as f64, 2.0);
        assert!((corner.y - 0.5).abs() < 0.03 && corner.z.abs() < 1e-9, "the first row is the top: {corner}");
        let left = view.pixel(&(view.camera_from_world * Point::new(-0.5, 0.0, 0.0)));
        assert!(left.x < 0.5 * view.width as f64, "seen from the front, −x is left");
    }

    #[test]
    fn a_grazed_wall_is_lost() {
        let share = |turned: f64| shot(turned).len() as f64 / (shot(0.0).len() as f64 * turned.cos());
        assert!(share(0.8) > 0.9);
        assert!(share(1.48) < 0.1);
    }
}
