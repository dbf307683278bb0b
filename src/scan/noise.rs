//! Refuses a surface that noise has crumpled: the shape of a person is then no longer in it.

use super::ScanError;
use crate::geometry::{Adjacency, FaceId, TriMesh, Vec3, VertexId};

/// Greatest mean angle between neighbouring faces, in degrees. Scans of depth cameras have 22 to 27. With noise of 3 mm per
/// coordinate and edges of 9 mm it is 67, and the fit still succeeds; with 5 mm it is 86, and cross-sections fall apart.
const GREATEST_ANGLE_DEG: f64 = 75.0;
/// The height by which the noise is stated in millimetres.
const ADULT_MM: f64 = 1700.0;

/// Refuses a surface whose neighbouring faces point anywhere.
pub(super) fn refuse_noise(mesh: &TriMesh, adjacency: &Adjacency) -> Result<(), ScanError> {
    let angle_deg = mean_angle(mesh, adjacency).to_degrees();
    if angle_deg <= GREATEST_ANGLE_DEG {
        return Ok(());
    }
    let longest = mesh.bounds().map_or(0.0, |b| b.extent().amax());
    let noise_mm = ADULT_MM * scatter(mesh, adjacency) / longest.max(f64::MIN_POSITIVE);
    Err(ScanError::Noisy { angle_deg, noise_mm })
}

/// Mean angle between the normals of faces with a common edge, radians; whichever way the faces are turned.
fn mean_angle(mesh: &TriMesh, adjacency: &Adjacency) -> f64 {
    let normal = |f: FaceId| {
        let [a, b, c] = mesh.triangle(f);
        (b - a).cross(&(c - a)).try_normalize(0.0)
    };
    // The direction in which a face runs along an edge.
    let runs = |f: FaceId, [a, b]: [VertexId; 2]| {
        let corners = mesh.faces()[f];
        (0..3).any(|k| corners[k] == a && corners[(k + 1) % 3] == b)
    };
    let (mut sum, mut count) = (0.0, 0_usize);
    for &(edge, faces) in adjacency.edges() {
        let [Some(f), Some(g)] = faces else { continue };
        let (Some(one), Some(other)) = (normal(f), normal(g)) else { continue };
        let turned = if runs(f, edge) == runs(g, edge) { -1.0 } else { 1.0 };
        sum += (turned * one.dot(&other)).clamp(-1.0, 1.0).acos();
        count += 1;
    }
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// Root mean square noise per coordinate, if the distance of each vertex from the mean of its neighbours is noise.
fn scatter(mesh: &TriMesh, adjacency: &Adjacency) -> f64 {
    // Six neighbours carry noise, too: three coordinates, times 1 + 1/6.
    const VARIANCES: f64 = 3.5;
    let points = mesh.points();
    let (mut sum, mut count) = (0.0, 0_usize);
    for (v, p) in points.enumerate() {
        let around = adjacency.neighbours_of(v);
        if around.is_empty() {
            continue;
        }
        let mean: Vec3 = around.iter().map(|&w| points[w].coords).sum::<Vec3>() / around.len() as f64;
        sum += (p.coords - mean).norm_squared();
        count += 1;
    }
    if count == 0 { 0.0 } else { (sum / count as f64 / VARIANCES).sqrt() }
}
