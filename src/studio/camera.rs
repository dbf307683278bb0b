//! A depth camera on a ring around the person: what it sees, and how wrongly.

use super::noise::DepthNoise;
use super::room::{Backdrop, Room};
use crate::geometry::{FaceId, Point, TriMesh, Vec3};
use crate::numerics::Rng;
use nalgebra::{Isometry3, Point2, UnitQuaternion};

/// A pinhole lens before a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Focal length, pixels.
    pub focal: f64,
}

impl Default for Lens {
    /// A second Kinect on its side.
    fn default() -> Self {
        Self { width: 424, height: 512, focal: 366.0 }
    }
}

impl Lens {
    /// Where the optical axis meets the image: pixels, the middle of the first pixel being 0.
    pub fn center(&self) -> [f64; 2] {
        [0.5 * self.width as f64 - 0.5, 0.5 * self.height as f64 - 0.5]
    }
}

/// A pinhole camera. Its frame: x right, y down, z forward.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) camera_from_world: Isometry3<f64>,
    pub(super) lens: Lens,
}

/// What a view saw.
pub(super) struct DepthImage {
    pub(super) view: View,
    /// Metres along the view's z; 0 where nothing came back. Row by row.
    pub(super) depth: Vec<f32>,
    pub(super) color: Vec<[u8; 3]>,
    /// Cosine between the surface's normal and the ray; 0 where nothing came back.
    pub(super) facing: Vec<f32>,
    /// What is really seen there, see [`Stage::labels`]; 0 is the room.
    pub(super) label: Vec<u8>,
}

/// Everything that can be seen at once, with one colour a vertex.
#[derive(Clone)]
pub(super) struct Stage {
    pub(super) mesh: TriMesh,
    pub(super) colors: Vec<[u8; 3]>,
    /// One a face: 1 the body, then the garments from the inside.
    pub(super) labels: Vec<u8>,
}

/// What is exactly seen.
struct Sight {
    /// 0 where nothing is.
    depth: f32,
    face: u32,
    /// Weights of the face's first two corners.
    weights: [f32; 2],
}

const NOTHING: u32 = u32::MAX;

impl View {
    /// `count` cameras at `distance` from the vertical through `center`, each at its height and level: `turns` turns
    /// of a turntable, seen from the person.
    pub(super) fn ring(center: &Point, distance: f64, count: usize, turns: f64, lens: &Lens) -> Vec<Self> {
        (0..count)
            .map(|i| {
                let around = turns * std::f64::consts::TAU * i as f64 / count as f64;
                let eye = center + Vec3::new(around.sin(), 0.0, around.cos()) * distance;
                let camera_from_world = Isometry3::look_at_rh(&eye, center, &Vec3::y());
                // OpenGL's frame looks along −z with y up.
                let turned = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
                Self { camera_from_world: turned * camera_from_world, lens: *lens }
            })
            .collect()
    }

    /// Where a point of the camera's frame falls in the image.
    pub(super) fn pixel(&self, p: &Point) -> Point2<f64> {
        let [cx, cy] = self.lens.center();
        Point2::new(self.lens.focal * p.x / p.z + cx, self.lens.focal * p.y / p.z + cy)
    }

    /// The point of the camera's frame that is seen in a pixel at that depth.
    pub(super) fn point(&self, x: f64, y: f64, depth: f64) -> Point {
        let [cx, cy] = self.lens.center();
        Point::new((x - cx) / self.lens.focal * depth, (y - cy) / self.lens.focal * depth, depth)
    }

    /// The image of a stage, with all the camera's faults. Behind the stage is `room`, which stays where it is seen
    /// from the camera.
    pub(super) fn shoot(&self, stage: &Stage, room: Option<&Room>, noise: &DepthNoise, rng: &mut Rng) -> DepthImage {
        let (width, height) = (self.lens.width, self.lens.height);
        let seen = self.rasterise(&stage.mesh);
        let behind: Vec<Option<Backdrop>> = (0..seen.len())
            .map(|i| room.filter(|_| seen[i].face == NOTHING).and_then(|r| r.seen(self, i % width, i / width)))
            .collect();
        let exact = |i: usize| match (&seen[i], &behind[i]) {
            (sight, _) if sight.face != NOTHING => f64::from(sight.depth),
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
                (sight, _) if sight.face != NOTHING => {
                    self.camera_from_world * stage.mesh.face_normal(FaceId(sight.face))
                }
                (_, Some(backdrop)) => backdrop.normal,
                _ => Vec3::zeros(),
            };
            let cosine = (normal.dot(&ray) / ray.norm()).abs();
            image.depth[to] = noise.measured(exact(from), cosine, across, rng) as f32;
            image.facing[to] = if image.depth[to] > 0.0 { cosine as f32 } else { 0.0 };
            if seen[to].face != NOTHING {
                image.label[to] = stage.labels[seen[to].face as usize];
            }
            // Colour and depth come from one place, or the wall would rub off on sleeves.
            let albedo = match (&seen[from], &behind[from]) {
                (sight, _) if sight.face != NOTHING => lit(stage, sight),
                (_, Some(backdrop)) => backdrop.color,
                _ => [0.0; 3],
            };
            /// Grey levels of noise a pixel.
            const GRAIN: f64 = 5.0;
            let grain = GRAIN * rng.normal();
            image.color[to] = albedo.map(|c| (c + grain).clamp(0.0, 255.0) as u8);
        }
        image
    }

    /// What each pixel shows exactly, whichever side of a face is seen.
    fn rasterise(&self, mesh: &TriMesh) -> Vec<Sight> {
        let (width, height) = (self.lens.width, self.lens.height);
        let mut seen: Vec<Sight> =
            (0..width * height).map(|_| Sight { depth: 0.0, face: NOTHING, weights: [0.0; 2] }).collect();
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
                    let sight = &mut seen[y * width + x];
                    if sight.face == NOTHING || z < sight.depth {
                        *sight = Sight { depth: z, face: f.0, weights: [w[0] as f32, w[1] as f32] };
                    }
                }
            }
        }
        seen
    }
}

/// Albedo under a broad light from above.
fn lit(stage: &Stage, sight: &Sight) -> [f64; 3] {
    let face = FaceId(sight.face);
    let corners = stage.mesh.faces()[face];
    let [a, b] = sight.weights.map(f64::from);
    let light = 0.82 + 0.18 * stage.mesh.face_normal(face).y;
    std::array::from_fn(|c| {
        let of = |k: usize| f64::from(stage.colors[corners[k].index()][c]);
        (of(0) * a + of(1) * b + of(2) * (1.0 - a - b)) * light
    })
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
        Stage { mesh, colors: vec![[200, 100, 50]; 4], labels: vec![1; 2] }
    }

    fn shot(turned: f64) -> Vec<(usize, f64)> {
        let view = &View::ring(&Point::origin(), 2.0, 1, 1.0, &Lens::default())[0];
        let image = view.shoot(&wall(turned), None, &DepthNoise::default(), &mut Rng::new(1));
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
        let view = &View::ring(&Point::origin(), 2.0, 1, 1.0, &Lens::default())[0];
        let (x, y) = (seen[0].0 % view.lens.width, seen[0].0 / view.lens.width);
        let corner = view.camera_from_world.inverse() * view.point(x as f64, y as f64, 2.0);
        assert!((corner.y - 0.5).abs() < 0.03 && corner.z.abs() < 1e-9, "the first row is the top: {corner}");
        let left = view.pixel(&(view.camera_from_world * Point::new(-0.5, 0.0, 0.0)));
        assert!(left.x < 0.5 * view.lens.width as f64, "seen from the front, −x is left");
    }

    #[test]
    fn a_grazed_wall_is_lost() {
        let share = |turned: f64| shot(turned).len() as f64 / (shot(0.0).len() as f64 * turned.cos());
        assert!(share(0.8) > 0.9);
        assert!(share(1.48) < 0.1);
    }
}
