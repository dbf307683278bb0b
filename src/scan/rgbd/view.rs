//! One frame restricted to the person, for tracking: smoothed points and normals at two sizes.

use super::camera::{RgbdCamera, depth_noise};
use nalgebra::{Point3, Vector3};

/// The depth of a ray that passes the person and ends on the background: the space up to the wall is free.
pub(super) const BEYOND: f32 = f32::INFINITY;
/// Evidence of a ray that passes the person. It clears the space along it, but counts less than a ray that ends on a
/// surface, so that the rays beside a swaying arm do not erase it.
const CLEARING: f32 = 0.25;
/// The depth of a pixel without a measurement beside the person's outline.
pub(super) const OUTLINE: f32 = -1.0;
/// The colour of a pixel outside the colour image.
pub(super) const UNCOLORED: [u8; 3] = [0; 3];
/// The packed colour of a pixel without a colour.
pub(super) const UNKNOWN_COLOR: u32 = 0;
/// Neighbouring pixels farther apart than this belong to different surfaces, in metres: a forearm is 10 cm in front of
/// the trunk; noise at 3 m is 14 mm.
pub(super) const JUMP: f32 = 0.04;
/// A person with fewer pixels is tracked at full size, because a quarter of the pixels would be too few points.
const FEW_PIXELS: usize = 8_000;
/// Radius of the smoothing, in pixels.
const SMOOTH_REACH: usize = 2;
/// Pixels to either side over which a normal is taken, at half size: 2 cm at 2 m.
const NORMAL_REACH: usize = 2;

/// A frame restricted to the person.
pub(super) struct PersonFrame {
    /// The camera of the cut-out.
    pub(super) camera: RgbdCamera,
    /// Row by row, and at the end one without evidence, for points outside the image.
    pub(super) pixels: Vec<Pixel>,
    /// One colour per pixel, red in the lowest byte, and at the end an unknown one; empty if the frame has no colours.
    pub(super) colors: Vec<u32>,
    /// Half and quarter size; full and half size for a small image.
    pub(super) levels: [Level; 2],
}

/// The measurement of a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixel {
    /// Metres along the camera's z to the person; [`BEYOND`] beside the person.
    pub(super) depth: f32,
    /// 0 to 1: less at grazing angles, little beside an edge, [`CLEARING`] beside the person, 0 if unknown.
    pub(super) evidence: f32,
}

/// Points of a frame at reduced resolution, in the camera's frame.
pub(super) struct Level {
    /// The camera at that size.
    pub(super) camera: RgbdCamera,
    pub(super) points: Vec<Point3<f32>>,
    pub(super) normals: Vec<Vector3<f32>>,
    /// Smoothed depth of each pixel, 0 beside the person.
    depth: Vec<f32>,
    /// Least and greatest depth in and around each tile of [`TILE`]² pixels; empty ranges away from the person.
    tiles: Vec<[f32; 2]>,
}

/// Pixels along a tile's side: 4 at half size are 5 cm at 2 m, about the error of a guess.
pub(super) const TILE: usize = 4;

/// A depth image with its size.
struct Map {
    width: usize,
    height: usize,
    depth: Vec<f32>,
}

impl PersonFrame {
    /// Smooths the depths, and computes normals and evidence. `depth` holds metres, 0, [`OUTLINE`] or [`BEYOND`].
    pub(super) fn prepare(camera: RgbdCamera, depth: Vec<f32>, colors: Vec<[u8; 3]>) -> Self {
        let map = Map { width: camera.width, height: camera.height, depth };
        let smooth = map.smoothed();
        let normals = smooth.normals(&camera, NORMAL_REACH);
        let pixels = pixels(&camera, &map, &normals);
        let seen = map.depth.iter().filter(|z| is_depth(**z)).count();
        let half = if seen < FEW_PIXELS { smooth } else { smooth.halved() };
        let half_camera = camera.resized(half.width, half.height);
        let quarter = half.halved();
        let quarter_camera = camera.resized(quarter.width, quarter.height);
        let levels = [half.level(half_camera), quarter.level(quarter_camera)];
        let packed = |color: [u8; 3]| u32::from_le_bytes([color[0], color[1], color[2], 0]);
        let colors =
            if colors.is_empty() { Vec::new() } else { colors.into_iter().chain([UNCOLORED]).map(packed).collect() };
        Self { camera, pixels, colors, levels }
    }
}

impl Level {
    /// Range of the depths of a tile and its neighbours; `None` away from the person.
    pub(super) fn range(&self, tile: usize) -> Option<[f32; 2]> {
        Some(self.tiles[tile]).filter(|[near, far]| near <= far)
    }

    /// The depth of a pixel, or of a neighbour `away` pixels to one side; `None` far from the person.
    pub(super) fn depth_beside(&self, column: usize, row: usize, away: usize) -> Option<f32> {
        let (width, height) = (self.camera.width, self.camera.height);
        let here = row * width + column;
        let beside = [
            (true, 0, 0),
            (column >= away, 0, away),
            (column + away < width, away, 0),
            (row >= away, 0, away * width),
            (row + away < height, away * width, 0),
        ];
        beside.into_iter().filter(|b| b.0).map(|(_, on, back)| self.depth[here + on - back]).find(|&z| z > 0.0)
    }
}

fn is_depth(z: f32) -> bool {
    z > 0.0 && z < BEYOND
}

impl Map {
    /// Bilateral smoothing with rational weights (no exponentials: an eighth of the time, and as good here).
    fn smoothed(&self) -> Self {
        let (w, h) = (self.width, self.height);
        let mut out = vec![0.0f32; w * h];
        let reach = SMOOTH_REACH as isize;
        for y in 0..h {
            for x in 0..w {
                let z = self.depth[y * w + x];
                if !is_depth(z) {
                    continue;
                }
                let inverse = 1.0 / (3.0 * depth_noise(f64::from(z)) as f32).powi(2);
                let (mut sum, mut total) = (0.0, 0.0);
                for dy in -reach..=reach {
                    let row = y as isize + dy;
                    if row < 0 || row >= h as isize {
                        continue;
                    }
                    for dx in -reach..=reach {
                        let column = x as isize + dx;
                        if column < 0 || column >= w as isize {
                            continue;
                        }
                        let d = self.depth[row as usize * w + column as usize] - z;
                        // Pixels without depth and beyond the person are excluded as well.
                        if d.abs() < JUMP {
                            let far = d * d * inverse;
                            let weight = 1.0 / ((1.0 + far * far) * (2.0 + (dx * dx + dy * dy) as f32));
                            sum += weight * d;
                            total += weight;
                        }
                    }
                }
                out[y * w + x] = z + sum / total;
            }
        }
        Self { width: w, height: h, depth: out }
    }

    /// Halves the size: each pixel is the mean of those of its four that lie on the nearest surface.
    fn halved(&self) -> Self {
        let (w, h) = (self.width / 2, self.height / 2);
        let mut out = vec![0.0f32; w * h];
        for y in 0..h {
            for x in 0..w {
                let four =
                    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.depth[(2 * y + dy) * self.width + 2 * x + dx]);
                let nearest = four.into_iter().filter(|&z| is_depth(z)).fold(BEYOND, f32::min);
                let (mut sum, mut count) = (0.0, 0);
                for z in four.into_iter().filter(|&z| is_depth(z) && z < nearest + JUMP) {
                    sum += z;
                    count += 1;
                }
                // Fewer than half of the pixels on one surface means an edge.
                if count >= 3 {
                    out[y * w + x] = sum / count as f32;
                }
            }
        }
        Self { width: w, height: h, depth: out }
    }

    /// Normals toward the camera from differences over `reach` pixels to either side; zero where there is an edge.
    fn normals(&self, camera: &RgbdCamera, reach: usize) -> Vec<Vector3<f32>> {
        let (w, h) = (self.width, self.height);
        let (fx, fy, cx, cy) = (camera.fx as f32, camera.fy as f32, camera.cx as f32, camera.cy as f32);
        let at = |x: usize, y: usize| {
            let z = self.depth[y * w + x];
            Vector3::new((x as f32 - cx) / fx * z, (y as f32 - cy) / fy * z, z)
        };
        let mut normals = vec![Vector3::zeros(); w * h];
        for y in reach..h.saturating_sub(reach) {
            for x in reach..w.saturating_sub(reach) {
                let z = self.depth[y * w + x];
                let arms = [(x - reach, y), (x + reach, y), (x, y - reach), (x, y + reach)];
                let near = |&(x, y): &(usize, usize)| (self.depth[y * w + x] - z).abs() < JUMP * reach as f32;
                if !is_depth(z) || !arms.iter().all(near) {
                    continue;
                }
                let [left, right, above, below] = arms.map(|(x, y)| at(x, y));
                let normal = (below - above).cross(&(right - left));
                normals[y * w + x] = normal.try_normalize(1e-12).unwrap_or_else(Vector3::zeros);
            }
        }
        normals
    }

    fn level(self, camera: RgbdCamera) -> Level {
        let normals_at = self.normals(&camera, 1);
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for (i, n) in normals_at.iter().enumerate().filter(|(_, n)| n.norm_squared() > 0.5) {
            let p = camera.point((i % self.width) as f64, (i / self.width) as f64, f64::from(self.depth[i]));
            points.push(p.cast());
            normals.push(*n);
        }
        let tiles = self.tiles();
        Level { camera, points, normals, depth: self.depth, tiles }
    }

    /// The range of depths per tile, together with those of the eight tiles around it.
    fn tiles(&self) -> Vec<[f32; 2]> {
        let (across, down) = (self.width.div_ceil(TILE), self.height.div_ceil(TILE));
        let mut tiles = vec![[f32::INFINITY, 0.0f32]; across * down];
        for (i, &z) in self.depth.iter().enumerate().filter(|(_, z)| is_depth(**z)) {
            let (x, y) = (i % self.width / TILE, i / self.width / TILE);
            for row in y.saturating_sub(1)..(y + 2).min(down) {
                for column in x.saturating_sub(1)..(x + 2).min(across) {
                    let [near, far] = &mut tiles[row * across + column];
                    (*near, *far) = (near.min(z), far.max(z));
                }
            }
        }
        tiles
    }
}

/// The measurement of each pixel. Its evidence is the cosine of the incidence, because on a slope the camera's lateral
/// noise becomes depth noise. Beside an edge it is low, because the pixel shows a mixture or the neighbour.
fn pixels(camera: &RgbdCamera, map: &Map, normals: &[Vector3<f32>]) -> Vec<Pixel> {
    /// Evidence where no normal can be computed: that of 75°.
    const UNKNOWN_SLOPE: f32 = 0.25;
    /// Evidence beside an edge: it counts only without other measurements. With more, arms and crown grow by the
    /// lateral noise (0.6 mm to truth without, 0.8 mm with 0.1); without any, shoulders and crown become holes.
    const BESIDE_EDGE: f32 = 0.05;
    let (w, h) = (map.width, map.height);
    let mut pixels = Vec::with_capacity(w * h + 1);
    for y in 0..h {
        for x in 0..w {
            let i = y * w + x;
            let z = map.depth[i];
            if !is_depth(z) {
                let evidence = if z == BEYOND { CLEARING } else { 0.0 };
                pixels.push(Pixel { depth: z, evidence });
                continue;
            }
            let beside_edge = (y.saturating_sub(1)..(y + 2).min(h)).any(|row| {
                (x.saturating_sub(1)..(x + 2).min(w)).any(|column| {
                    let other = map.depth[row * w + column];
                    other != 0.0 && (other - z).abs() > JUMP
                })
            });
            let ray = camera.point(x as f64, y as f64, 1.0).coords.cast::<f32>();
            let cosine = -normals[i].dot(&ray) / ray.norm();
            let straight = if cosine > 0.0 { cosine } else { UNKNOWN_SLOPE };
            pixels.push(Pixel { depth: z, evidence: if beside_edge { BESIDE_EDGE * straight } else { straight } });
        }
    }
    pixels.push(Pixel { depth: 0.0, evidence: 0.0 });
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(width: usize, height: usize) -> RgbdCamera {
        let (cx, cy) = (0.5 * width as f64 - 0.5, 0.5 * height as f64 - 0.5);
        RgbdCamera { width, height, fx: 366.0, fy: 366.0, cx, cy, distortion: [0.0; 5] }
    }

    #[test]
    fn a_slanted_wall_keeps_its_place_and_normal_at_each_size_and_its_edge_says_little() {
        let camera = camera(120, 80);
        // z = 2 + 0.5 x: the normal is (0.5, 0, −1), normalised.
        let depth: Vec<f32> = (0..120 * 80)
            .map(|i| {
                let slope = ((i % 120) as f64 - camera.cx) / camera.fx;
                let z = 2.0 / (1.0 - 0.5 * slope);
                if i % 120 < 60 { z as f32 } else { BEYOND }
            })
            .collect();
        let view = PersonFrame::prepare(camera, depth, Vec::new());
        let normal = Vector3::new(0.5f32, 0.0, -1.0).normalize();
        for level in &view.levels {
            assert!(level.points.len() > 100);
            let right = level.points.iter().zip(&level.normals);
            let right = right.filter(|(p, n)| (*n - normal).norm() < 0.05 && (p.z - 2.0 - 0.5 * p.x).abs() < 2e-3);
            // Beside the edge, smoothing has one side only.
            assert!(right.count() as f64 > 0.85 * level.points.len() as f64);
        }
        let evidence = |column: usize| view.pixels[40 * 120 + column].evidence;
        assert!(evidence(59) < 0.1);
        assert_eq!(evidence(70), CLEARING);
        // The cosine to (0.447, 0, −0.894) along the ray (−0.08, 0, 1).
        assert!((evidence(30) - 0.927).abs() < 0.01, "{}", evidence(30));
    }
}
