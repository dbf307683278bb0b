//! Depth images with known poses fused into one coloured mesh, as by a scanner's software.
//!
//! This is a second TSDF beside that of `scan`, on purpose: scans fused by the code under evaluation could not reveal
//! its errors. Nor could that code take its place as it is: it finds the poses itself, weights views by angle and edge,
//! clears the space that rays pass, rounds distances to 16 bits, and closes small holes. Here the poses are known, all
//! views have equal weight, and holes stay open. A swap would change every synthetic scan. It would also make
//! them less accurate: on the same 72 frames this fusion is 0.53 mm from the truth on average and 1.34 mm at 95 %, that of `scan`
//! 1.29 and 2.46 mm (`just studio-fusion`).

use super::marching_tetrahedra::zero_surface;
use super::render::DepthImage;
use crate::geometry::{Aabb, Adjacency, PerVertex, Point, TriMesh, TriangleShapes, Vec3, simplified};
use crate::studio::level_set::LevelSet;
use rayon::prelude::*;

/// Truncation of the signed distance, metres: three standard deviations of the noise at 2 m.
const TRUNCATION: f64 = 0.02;
/// Voxels observed by fewer views are unknown.
const LEAST_VIEWS: f32 = 3.0;
/// Rounds of smoothing without shrinkage before decimation, as in a scanner's software: otherwise each remaining vertex
/// would have the full noise of its voxel.
const SMOOTHING: usize = 4;
/// A vertex takes its colour from views that measured a surface within this depth of it, metres.
const SAME_SURFACE: f64 = 0.015;

/// Average of projective signed distances (Curless & Levoy 1996), its zero surface, and colours from the
/// images.
pub(super) fn fuse(
    images: &[DepthImage],
    bounds: &Aabb,
    voxel: f64,
    face_count: usize,
) -> (TriMesh, PerVertex<[u8; 3]>) {
    let mut field = LevelSet::covering(bounds, 0.03, voxel);
    integrate(&mut field, images);
    let smooth = smoothed(&without_small_components(&zero_surface(&field)));
    let (mesh, _) = simplified(&smooth, &Point::origin(), face_count, TriangleShapes::Any);
    let colors = mesh.points().0.par_iter().map(|p| color_at(p, images)).collect::<Vec<_>>();
    (mesh, colors.into())
}

fn integrate(field: &mut LevelSet, images: &[DepthImage]) {
    let [nx, ny, _] = field.size;
    let (origin, spacing) = (field.node(0, 0, 0), field.spacing);
    let near = Blocks::near_surfaces(field, images);
    field.distance.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slab)| {
        let mut views = vec![0.0f32; slab.len()];
        let mut sum = vec![0.0f32; slab.len()];
        for image in images {
            let step = (image.view.camera_from_world.rotation * Vec3::x()) * spacing;
            for y in 0..ny {
                for block in (0..nx.div_ceil(BLOCK)).filter(|&bx| near.contains(bx, y / BLOCK, z / BLOCK)) {
                    let first = block * BLOCK;
                    let row = origin + Vec3::new(first as f64, y as f64, z as f64) * spacing;
                    let mut at = image.view.camera_from_world * row;
                    for x in first..(first + BLOCK).min(nx) {
                        if let Some(distance) = observed(image, &at) {
                            sum[y * nx + x] += distance;
                            views[y * nx + x] += 1.0;
                        }
                        at += step;
                    }
                }
            }
        }
        for (i, value) in slab.iter_mut().enumerate() {
            *value = if views[i] >= LEAST_VIEWS { sum[i] / views[i] } else { f32::NAN };
        }
    });
}

/// Voxels per block along each axis: at 4.5 mm a block is 36 mm, wider than the truncation.
const BLOCK: usize = 8;

/// Which blocks of voxels contain or touch a measured point: nine tenths of the volume are empty.
struct Blocks {
    size: [usize; 3],
    near: Vec<bool>,
}

impl Blocks {
    fn near_surfaces(field: &LevelSet, images: &[DepthImage]) -> Self {
        let size = field.size.map(|n| n.div_ceil(BLOCK));
        let mut blocks = Self { size, near: vec![false; size[0] * size[1] * size[2]] };
        let mut seen = blocks.near.clone();
        let origin = field.node(0, 0, 0);
        for image in images {
            let world_from_camera = image.view.camera_from_world.inverse();
            for (i, &depth) in image.depth.iter().enumerate().filter(|(_, d)| **d > 0.0) {
                let (x, y) = ((i % image.view.lens.width) as f64, (i / image.view.lens.width) as f64);
                let at = (world_from_camera * image.view.point(x, y, f64::from(depth)) - origin)
                    / (field.spacing * BLOCK as f64);
                if (0..3).all(|k| at[k] >= 0.0 && (at[k] as usize) < size[k]) {
                    seen[at.x as usize + size[0] * (at.y as usize + size[1] * at.z as usize)] = true;
                }
            }
        }
        for (i, _) in seen.iter().enumerate().filter(|(_, s)| **s) {
            let at = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            let around = |k: usize| at[k].saturating_sub(1)..(at[k] + 2).min(size[k]);
            for z in around(2) {
                for y in around(1) {
                    for x in around(0) {
                        blocks.near[x + size[0] * (y + size[1] * z)] = true;
                    }
                }
            }
        }
        blocks
    }

    fn contains(&self, x: usize, y: usize, z: usize) -> bool {
        self.near[x + self.size[0] * (y + self.size[1] * z)]
    }
}

/// Truncated distance along the view, metres. All views have equal weight: noise along a grazing ray moves the surface
/// least. `None` behind the measured surface.
fn observed(image: &DepthImage, at: &Point) -> Option<f32> {
    let pixel = image.view.pixel(at);
    let (x, y) = (pixel.x.round(), pixel.y.round());
    if x < 0.0 || y < 0.0 || x >= image.view.lens.width as f64 || y >= image.view.lens.height as f64 {
        return None;
    }
    let i = y as usize * image.view.lens.width + x as usize;
    let depth = f64::from(image.depth[i]);
    if depth <= 0.0 {
        return None;
    }
    let distance = depth - at.z;
    (distance > -TRUNCATION).then(|| distance.min(TRUNCATION) as f32)
}

/// The components with at least a hundredth of all faces: flying pixels form small ones.
fn without_small_components(mesh: &TriMesh) -> TriMesh {
    let (component, count) = Adjacency::prepare(mesh).face_components();
    let mut sizes = vec![0usize; count];
    for &c in component.iter() {
        sizes[c as usize] += 1;
    }
    let keep = component.iter().map(|&c| sizes[c as usize] * 100 >= mesh.face_count()).collect();
    mesh.part(&keep).0
}

/// Taubin's smoothing: a step inward, a slightly longer step outward (1995, λ 0.5, μ −0.53).
fn smoothed(mesh: &TriMesh) -> TriMesh {
    let adjacency = Adjacency::prepare(mesh);
    let mut points = mesh.points().clone();
    for factor in [0.5, -0.53].repeat(SMOOTHING) {
        points = mesh
            .vertex_ids()
            .map(|v| {
                let around = adjacency.neighbours_of(v);
                let sum: Vec3 = around.iter().map(|&n| points[n] - points[v]).sum();
                points[v] + sum * (factor / around.len().max(1) as f64)
            })
            .collect();
    }
    mesh.with_points(points)
}

fn color_at(p: &Point, images: &[DepthImage]) -> [u8; 3] {
    let (mut sum, mut total) = ([0.0f64; 3], 0.0);
    for image in images {
        let at = image.view.camera_from_world * p;
        let pixel = image.view.pixel(&at);
        let (x, y) = (pixel.x.round(), pixel.y.round());
        if x < 0.0 || y < 0.0 || x >= image.view.lens.width as f64 || y >= image.view.lens.height as f64 {
            continue;
        }
        let i = y as usize * image.view.lens.width + x as usize;
        if (f64::from(image.depth[i]) - at.z).abs() > SAME_SURFACE {
            continue;
        }
        let weight = f64::from(image.facing[i]).powi(2);
        for (s, &c) in sum.iter_mut().zip(&image.color[i]) {
            *s += weight * f64::from(c);
        }
        total += weight;
    }
    if total > 0.0 { sum.map(|s| (s / total) as u8) } else { [128; 3] }
}
