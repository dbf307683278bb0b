//! One scan: surfaces on a turntable before the camera, fused into the mesh that a scanner hands out.

use super::camera::DepthImage;
use super::fuse::fuse;
use super::turntable::{TurntableParams, Worn, axis_of, together, turn};
use crate::geometry::{Aabb, PerVertex, TriMesh};
use rayon::prelude::*;

/// How finely a simulated scanner works.
#[derive(Clone, Debug, PartialEq)]
pub struct ScannerParams {
    /// Metres between voxels: 4.5 mm is what scanners of this class use; finger gaps close, as they do there.
    pub voxel: f64,
    /// Triangles to decimate to; 60 000 leave a person edges of 8 mm.
    pub faces: usize,
}

impl Default for ScannerParams {
    fn default() -> Self {
        Self { voxel: 4.5e-3, faces: 70_000 }
    }
}

/// What a Kinect-like scanner makes of coloured surfaces (several layers, any of which may hide others): noise, holes
/// and blurred colours included.
///
/// **Guarantees** the same seed gives the same bytes with any number of threads.
pub fn simulate_scan(
    surfaces: &[(&TriMesh, &PerVertex<[u8; 3]>)],
    turntable: &TurntableParams,
    params: &ScannerParams,
    seed: u64,
) -> (TriMesh, PerVertex<[u8; 3]>) {
    let worn: Vec<Worn<'_>> =
        surfaces.iter().enumerate().map(|(k, &(mesh, colors))| Worn { mesh, colors, label: k as u8 + 1 }).collect();
    let stage = together(&worn);
    let Some(bounds) = stage.mesh.bounds() else { return (stage.mesh, PerVertex::default()) };
    let axis = axis_of(turntable, &bounds.center(), bounds.min.y);
    let images = turn(turntable, &axis, seed, &|_| stage.clone());
    scanned(images, &bounds, params)
}

/// The mesh that a scanner's software makes of its frames, given their poses and told what is the room.
pub(super) fn scanned(
    mut images: Vec<DepthImage>,
    bounds: &Aabb,
    params: &ScannerParams,
) -> (TriMesh, PerVertex<[u8; 3]>) {
    images.par_iter_mut().for_each(without_edges_and_room);
    fuse(&images, bounds, params.voxel, params.faces)
}

/// Drops the room, and pixels beside a jump of depth: they may show something between the two sides.
fn without_edges_and_room(image: &mut DepthImage) {
    /// Metres between neighbouring pixels: steeper than any surface that is measured well.
    const JUMP: f32 = 0.05;
    let (width, seen) = (image.view.lens.width, image.depth.clone());
    for (i, depth) in image.depth.iter_mut().enumerate() {
        let around = [i.checked_sub(1), i.checked_sub(width), Some(i + 1), Some(i + width)];
        let near = around.into_iter().flatten().filter_map(|k| seen.get(k)).filter(|z| **z > 0.0);
        if image.label[i] == 0 || near.into_iter().any(|z| (z - seen[i]).abs() > JUMP) {
            *depth = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Adjacency, Point, SurfaceIndex};
    use crate::studio::volume::Volume;

    #[test]
    fn a_pillar_is_scanned_near_its_truth_open_at_its_ends_and_the_same_with_one_thread() {
        let bounds = Aabb { min: Point::new(-0.2, 0.0, -0.2), max: Point::new(0.2, 1.4, 0.2) };
        let mut volume = Volume::covering(&bounds, 0.1, 0.04);
        volume.fill(|p| ((p.x.hypot(p.z) - 0.2).max(-p.y).max(p.y - 1.4)) as f32);
        let pillar = volume.zero_surface();
        let paint = pillar.points().iter().map(|p| if p.y > 0.7 { [220, 40, 40] } else { [40, 40, 220] }).collect();
        let params = ScannerParams { voxel: 0.012, faces: 6_000 };
        let turntable = TurntableParams { views: 16, ..TurntableParams::default() };
        let (scan, colors) = simulate_scan(&[(&pillar, &paint)], &turntable, &params, 5);
        assert!(scan.face_count() <= 6_000 && scan.face_count() > 3_000);
        let index = SurfaceIndex::prepare(&pillar);
        let off = scan.points().iter().map(|p| index.closest(p).distance).sum::<f64>() / scan.vertex_count() as f64;
        assert!((2e-4..4e-3).contains(&off), "noisy, but near: {off}");
        assert!(!Adjacency::prepare(&scan).boundary_loops().is_empty(), "the camera never sees the ends");
        let red = scan.points().iter().zip(colors.iter()).filter(|(p, c)| (p.y > 0.7) == (c[0] > c[2])).count();
        assert!(red as f64 > 0.97 * scan.vertex_count() as f64);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!((scan, colors), alone.install(|| simulate_scan(&[(&pillar, &paint)], &turntable, &params, 5)));
    }
}
