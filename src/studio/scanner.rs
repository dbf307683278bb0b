//! One scan: surfaces on a turntable before the camera, fused into the mesh that a scanner hands out.

use super::camera::{Stage, View};
use super::fuse::fuse;
use super::rng::Rng;
use crate::geometry::{PerVertex, Point, TriMesh, VertexId};
use rayon::prelude::*;

/// How finely a simulated scanner works.
#[derive(Clone, Debug, PartialEq)]
pub struct ScannerParams {
    /// Views a turn: 72 are one every 5°, as in the foreign recordings.
    pub views: usize,
    /// Metres between voxels: 4.5 mm is what scanners of this class use; finger gaps close, as they do there.
    pub voxel: f64,
    /// Triangles to decimate to; 60 000 leave a person edges of 8 mm.
    pub faces: usize,
}

impl Default for ScannerParams {
    fn default() -> Self {
        Self { views: 72, voxel: 4.5e-3, faces: 70_000 }
    }
}

/// Metres from the axis to the camera: the whole person fits into a portrait image.
const DISTANCE: f64 = 2.0;
/// Metres from the floor to the camera: table height, so crown, shoulders and crotch are seen at a graze or not at all.
const EYE_HEIGHT: f64 = 1.0;

/// What a Kinect-like scanner makes of coloured surfaces (several layers, any of which may hide others): noise, holes
/// and blurred colours included.
///
/// **Guarantees** the same seed gives the same bytes with any number of threads.
pub fn simulate_scan(
    surfaces: &[(&TriMesh, &PerVertex<[u8; 3]>)],
    params: &ScannerParams,
    seed: u64,
) -> (TriMesh, PerVertex<[u8; 3]>) {
    let stage = together(surfaces);
    let Some(bounds) = stage.mesh.bounds() else { return (stage.mesh, PerVertex::default()) };
    let middle = bounds.center();
    let axis = Point::new(middle.x, bounds.min.y + EYE_HEIGHT, middle.z);
    let images: Vec<_> = View::ring(&axis, DISTANCE, params.views)
        .par_iter()
        .enumerate()
        .map(|(i, view)| view.shoot(&stage, &mut Rng::new(seed.wrapping_mul(1009).wrapping_add(i as u64))))
        .collect();
    fuse(&images, &bounds, params.voxel, params.faces)
}

fn together(surfaces: &[(&TriMesh, &PerVertex<[u8; 3]>)]) -> Stage {
    let (mut points, mut faces, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for (mesh, paint) in surfaces {
        let offset = points.len() as u32;
        points.extend(mesh.points().iter().copied());
        faces.extend(mesh.faces().iter().map(|f| f.map(|v| VertexId(v.0 + offset))));
        colors.extend(paint.iter().copied());
    }
    colors.resize(points.len(), [128; 3]);
    let mesh = TriMesh::try_new(points, faces).expect("parts of valid meshes, indices shifted");
    Stage { mesh, colors }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, Adjacency, SurfaceIndex};
    use crate::studio::volume::Volume;

    #[test]
    fn a_pillar_is_scanned_near_its_truth_open_at_its_ends_and_the_same_with_one_thread() {
        let bounds = Aabb { min: Point::new(-0.2, 0.0, -0.2), max: Point::new(0.2, 1.4, 0.2) };
        let mut volume = Volume::covering(&bounds, 0.1, 0.04);
        volume.fill(|p| ((p.x.hypot(p.z) - 0.2).max(-p.y).max(p.y - 1.4)) as f32);
        let pillar = volume.zero_surface();
        let paint = pillar.points().iter().map(|p| if p.y > 0.7 { [220, 40, 40] } else { [40, 40, 220] }).collect();
        let params = ScannerParams { views: 16, voxel: 0.012, faces: 6_000 };
        let (scan, colors) = simulate_scan(&[(&pillar, &paint)], &params, 5);
        assert!(scan.face_count() <= 6_000 && scan.face_count() > 3_000);
        let index = SurfaceIndex::prepare(&pillar);
        let off = scan.points().iter().map(|p| index.closest(p).distance).sum::<f64>() / scan.vertex_count() as f64;
        assert!((2e-4..4e-3).contains(&off), "noisy, but near: {off}");
        assert!(!Adjacency::prepare(&scan).boundary_loops().is_empty(), "the camera never sees the ends");
        let red = scan.points().iter().zip(colors.iter()).filter(|(p, c)| (p.y > 0.7) == (c[0] > c[2])).count();
        assert!(red as f64 > 0.97 * scan.vertex_count() as f64);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!((scan, colors), alone.install(|| simulate_scan(&[(&pillar, &paint)], &params, 5)));
    }
}
