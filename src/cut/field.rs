//! A smooth signed field; the garment ends at its zero line.

use super::holes::fill_holes::FilledScan;
use crate::geometry::{Adjacency, PerVertex, VertexId, cotangent_laplacian, geodesic_distances};
use crate::numerics::{NumericsError, SparseCholesky};

/// Implicit steps of diffusion. Two: one alone keeps a kink at the old boundary.
const STEPS: usize = 2;
/// Half-width of the band around the label boundary in which the field is solved, in radii; e⁻⁵ of a label arrives there.
const BAND_PER_RADIUS: f64 = 5.0;
/// Mass of a vertex without faces, in m²: keeps the matrix definite.
const LEAST_MASS: f64 = 1e-12;

/// Labels as ±1, diffused over the surface by `radius` metres; positive on the garment. Labels given by the user stay ±1,
/// so that the zero line separates them.
///
/// **Shapes** one value per vertex.
pub(super) fn signed_field(
    whole: &FilledScan,
    adjacency: &Adjacency,
    radius: f64,
) -> Result<PerVertex<f64>, NumericsError> {
    let FilledScan { surface, labels, by_hand, .. } = whole;
    let mesh = &surface.mesh;
    let mut field: PerVertex<f64> = labels.0.iter().map(|&l| if l { 1.0 } else { -1.0 }).collect();
    let boundary: Vec<(VertexId, f64)> = mesh
        .vertex_ids()
        .filter(|&v| adjacency.neighbours_of(v).iter().any(|&w| labels.0[w] != labels.0[v]))
        .map(|v| (v, 0.0))
        .collect();
    if boundary.is_empty() || radius <= 0.0 {
        return Ok(field);
    }
    let near = geodesic_distances(mesh, adjacency, &boundary, BAND_PER_RADIUS * radius);
    let band: Vec<VertexId> = mesh.vertex_ids().filter(|&v| near[v].is_finite() && !by_hand[v]).collect();
    let mut unknown = vec![usize::MAX; mesh.vertex_count()];
    for (i, v) in band.iter().enumerate() {
        unknown[v.index()] = i;
    }
    // Every face at a vertex of the band is included, so the vertex has the same row as in the whole mesh.
    let in_band = mesh.faces().iter().map(|f| f.iter().any(|&v| unknown[v.index()] != usize::MAX)).collect();
    let (part, whole_from_part) = mesh.part(&in_band);
    let laplacian = cotangent_laplacian(&part);
    let mut mass = PerVertex::filled(0.0, mesh.vertex_count());
    for (v, &whole) in whole_from_part.enumerate() {
        mass[whole] = laplacian.mass[v];
    }
    // Each step spreads by the variance 2t, so all steps together spread by the radius.
    let t = radius * radius / (2.0 * STEPS as f64);
    let mut triplets = Vec::new();
    let mut from_outside = vec![0.0; band.len()];
    for &(row, column, value) in &laplacian.triplets {
        let (row, column) = (whole_from_part.0[row], whole_from_part.0[column]);
        let i = unknown[row.index()];
        if i == usize::MAX {
            continue;
        }
        match unknown[column.index()] {
            usize::MAX => from_outside[i] -= t * value * field[column],
            j => triplets.push((i, j, t * value)),
        }
    }
    let masses: Vec<f64> = band.iter().map(|&v| mass[v].max(LEAST_MASS)).collect();
    triplets.extend(masses.iter().enumerate().map(|(i, &m)| (i, i, m)));
    let system = SparseCholesky::prepare(band.len(), &triplets)?;
    for _ in 0..STEPS {
        let right: Vec<f64> =
            band.iter().zip(&masses).zip(&from_outside).map(|((&v, m), outside)| m * field[v] + outside).collect();
        for (&v, value) in band.iter().zip(system.solve(&right)) {
            field[v] = value;
        }
    }
    Ok(field)
}
