//! A simulated scanner: its images of the surfaces on the turntable, fused into one mesh.

use super::fusion::fuse;
use super::render::DepthImage;
use super::turntable::{SceneSurface, TurntableParams, axis_of, merged, record};
use crate::geometry::{Aabb, PerVertex, TriMesh};
use crate::studio::error::StudioError;
use rayon::prelude::*;

/// The resolution of a simulated scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct ScannerParams {
    /// Metres between voxels: scanners of this class use 4.5 mm; gaps between fingers close, as they do there.
    pub voxel: f64,
    /// Triangles after decimation; 60 000 give edges of 8 mm on a person.
    pub faces: usize,
}

impl Default for ScannerParams {
    fn default() -> Self {
        Self { voxel: 4.5e-3, faces: 70_000 }
    }
}

impl ScannerParams {
    /// Whether a scan can be fused with these parameters.
    ///
    /// **Errors** voxels or a number of faces outside their range.
    pub fn check(&self) -> Result<(), StudioError> {
        /// With fewer triangles no garment is recognised; more are finer than the voxels of any scanner.
        const FACES: [usize; 2] = [1_000, 2_000_000];
        /// Metres: finer voxels do not fit in memory, coarser ones close the armpits.
        const VOXELS: [f64; 2] = [1e-3, 0.05];
        if !(FACES[0]..=FACES[1]).contains(&self.faces) {
            return Err(StudioError::BadFaceCount { faces: self.faces, range: FACES });
        }
        if !(VOXELS[0]..=VOXELS[1]).contains(&self.voxel) {
            let range_mm = VOXELS.map(|metres| 1e3 * metres);
            return Err(StudioError::BadVoxel { voxel_mm: 1e3 * self.voxel, range_mm });
        }
        Ok(())
    }
}

/// The scan of coloured surfaces (several layers, any of which may hide others) by a Kinect-like scanner: with noise,
/// holes and blurred colours.
///
/// **Shapes** `surfaces` are meshes with one sRGB colour per vertex; so is the result.
///
/// **Frame and units** metres, Y up.
///
/// **Errors** see [`TurntableParams::check`] and [`ScannerParams::check`]; surfaces without vertices, or without one colour per vertex.
///
/// **Guarantees** a seed gives the same bytes with any number of threads.
pub fn simulate_scan(
    surfaces: &[(&TriMesh, &PerVertex<[u8; 3]>)],
    turntable: &TurntableParams,
    params: &ScannerParams,
    seed: u64,
) -> Result<(TriMesh, PerVertex<[u8; 3]>), StudioError> {
    turntable.check()?;
    params.check()?;
    let labelled: Vec<SceneSurface<'_>> =
        (1u8..).zip(surfaces).map(|(label, &(mesh, colors))| SceneSurface { mesh, colors, label }).collect();
    let scene = merged(&labelled)?;
    let bounds = scene.mesh.bounds().ok_or(StudioError::EmptyScene)?;
    let axis = axis_of(turntable, &bounds.center(), bounds.min.y);
    let images = record(turntable, &axis, seed, &|_| Ok(scene.clone()))?;
    Ok(scan_from_images(images, &bounds, params))
}

/// The mesh that a scanner's software makes from its images, given their poses and the pixels that show the room.
pub fn scan_from_images(
    mut images: Vec<DepthImage>,
    bounds: &Aabb,
    params: &ScannerParams,
) -> (TriMesh, PerVertex<[u8; 3]>) {
    images.par_iter_mut().for_each(remove_edges_and_room);
    fuse(&images, bounds, params.voxel, params.faces)
}

/// Removes the room, and pixels beside a depth edge: they may be flying pixels.
fn remove_edges_and_room(image: &mut DepthImage) {
    /// Metres between neighbouring pixels: more than on any surface that is measured well.
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
    use crate::studio::level_set::LevelSet;

    #[test]
    fn a_pillar_is_scanned_near_its_truth_open_at_its_ends_and_the_same_with_one_thread() {
        let bounds = Aabb { min: Point::new(-0.2, 0.0, -0.2), max: Point::new(0.2, 1.4, 0.2) };
        let mut field = LevelSet::covering(&bounds, 0.1, 0.04);
        field.fill(|p| ((p.x.hypot(p.z) - 0.2).max(-p.y).max(p.y - 1.4)) as f32);
        let pillar = field.zero_surface();
        let paint = pillar.points().iter().map(|p| if p.y > 0.7 { [220, 40, 40] } else { [40, 40, 220] }).collect();
        let params = ScannerParams { voxel: 0.012, faces: 6_000 };
        let turntable = TurntableParams { views: 16, ..TurntableParams::default() };
        let (scan, colors) = simulate_scan(&[(&pillar, &paint)], &turntable, &params, 5).unwrap();
        assert!(scan.face_count() <= 6_000 && scan.face_count() > 3_000);
        let index = SurfaceIndex::prepare(&pillar);
        let off = scan.points().iter().map(|p| index.closest(p).distance).sum::<f64>() / scan.vertex_count() as f64;
        assert!((2e-4..4e-3).contains(&off), "noisy, but near: {off}");
        assert!(!Adjacency::prepare(&scan).boundary_loops().is_empty(), "the camera never sees the ends");
        let red = scan.points().iter().zip(colors.iter()).filter(|(p, c)| (p.y > 0.7) == (c[0] > c[2])).count();
        assert!(red as f64 > 0.97 * scan.vertex_count() as f64);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(
            (scan, colors),
            alone.install(|| simulate_scan(&[(&pillar, &paint)], &turntable, &params, 5).unwrap())
        );
    }
}
