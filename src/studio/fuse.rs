//! Depth images into one coloured mesh, as a scanner's own software would.

use super::camera::DepthImage;
use super::volume::Volume;
use crate::geometry::{Aabb, PerVertex, Point, TriMesh};
use nalgebra::Point3;
use rayon::prelude::*;

/// Metres between voxels: what handheld scanners of this class use; finger gaps close, as they do there.
const VOXEL: f64 = 4.5e-3;
/// Truncation of the signed distance, metres: three standard deviations of the noise at 2 m.
const TRUNCATION: f64 = 0.02;
/// Voxels seen by fewer views are unknown.
const LEAST_VIEWS: f32 = 3.0;
/// A vertex takes its colour from views that saw a surface within this depth of it, metres.
const SAME_SURFACE: f64 = 0.015;

/// Weighted average of projective signed distances (Curless & Levoy 1996), its zero surface, and colours from the
/// images.
pub(super) fn fuse(images: &[DepthImage], bounds: &Aabb, face_count: usize) -> (TriMesh, PerVertex<[u8; 3]>) {
    let mut volume = Volume::covering(bounds, 0.03, VOXEL);
    integrate(&mut volume, images);
    let mesh = without_crumbs(&volume.zero_surface());
    let mesh = decimated(&mesh, face_count);
    let colors = mesh.points().0.par_iter().map(|p| color_at(p, images)).collect::<Vec<_>>();
    (mesh, colors.into())
}

fn integrate(volume: &mut Volume, images: &[DepthImage]) {
    let [nx, ny, _] = volume.size;
    let origin = volume.node(0, 0, 0);
    let spacing = volume.spacing;
    volume.distance.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slab)| {
        let mut weight = vec![0.0f32; slab.len()];
        let mut sum = vec![0.0f32; slab.len()];
        for image in images {
            let step = (image.view.camera_from_world.rotation * crate::geometry::Vec3::x()) * spacing;
            for y in 0..ny {
                let row = origin + crate::geometry::Vec3::new(0.0, y as f64, z as f64) * spacing;
                let mut at = image.view.camera_from_world * row;
                for x in 0..nx {
                    if let Some((distance, w)) = observed(image, &at) {
                        let i = y * nx + x;
                        sum[i] += w * distance;
                        weight[i] += w;
                    }
                    at += step;
                }
            }
        }
        for (i, value) in slab.iter_mut().enumerate() {
            *value = if weight[i] >= LEAST_VIEWS { sum[i] / weight[i] } else { f32::NAN };
        }
    });
}

/// Truncated distance along the view, and its weight; `None` behind what the view saw.
fn observed(image: &DepthImage, at: &Point3<f64>) -> Option<(f32, f32)> {
    let pixel = image.view.pixel(at);
    let (x, y) = (pixel.x.round(), pixel.y.round());
    if x < 0.0 || y < 0.0 || x >= image.view.width as f64 || y >= image.view.height as f64 {
        return None;
    }
    let i = y as usize * image.view.width + x as usize;
    let depth = f64::from(image.depth[i]);
    if depth <= 0.0 {
        return None;
    }
    let distance = depth - at.z;
    (distance > -TRUNCATION).then(|| (distance.min(TRUNCATION) as f32, 1.0))
}

/// The pieces with at least a hundredth of all faces: flying pixels make crumbs.
fn without_crumbs(mesh: &TriMesh) -> TriMesh {
    let (component, count) = crate::geometry::Adjacency::prepare(mesh).face_components();
    let mut sizes = vec![0usize; count];
    for &c in component.iter() {
        sizes[c as usize] += 1;
    }
    let keep = component.iter().map(|&c| sizes[c as usize] * 100 >= mesh.face_count()).collect();
    mesh.part(&keep).0
}

fn decimated(mesh: &TriMesh, face_count: usize) -> TriMesh {
    let points: Vec<[f32; 3]> = mesh.points().iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect();
    let indices: Vec<u32> = mesh.faces().iter().flat_map(|f| f.map(|v| v.0)).collect();
    let kept = meshopt::simplify_decoder(&indices, &points, 3 * face_count, 1.0, meshopt::SimplifyOptions::None, None);
    let faces: Vec<[u32; 3]> = kept.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    match TriMesh::try_from_indices(mesh.points().0.clone(), &faces) {
        Ok(fewer) => fewer.part(&crate::geometry::PerFace::filled(true, fewer.face_count())).0,
        Err(_) => mesh.clone(),
    }
}

fn color_at(p: &Point, images: &[DepthImage]) -> [u8; 3] {
    let (mut sum, mut total) = ([0.0f64; 3], 0.0);
    for image in images {
        let at = image.view.camera_from_world * p;
        let pixel = image.view.pixel(&at);
        let (x, y) = (pixel.x.round(), pixel.y.round());
        if x < 0.0 || y < 0.0 || x >= image.view.width as f64 || y >= image.view.height as f64 {
            continue;
        }
        let i = y as usize * image.view.width + x as usize;
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
