//! Re-meshes a surface with quads that follow it.
//!
//! **Source** Jakob, Tarini, Panozzo & Sorkine-Hornung 2015, Instant field-aligned meshes: a smooth field of crosses and a
//! lattice along them, both from coarse to fine, bound to the borders. We extract at twice the edge length, by collapsing
//! triangles instead of searching faces in a graph, and split every polygon into quads; so no hole or handle is lost.

mod borders;
mod contraction;
mod error;
mod flat_quads;
mod handles;
mod hierarchy;
mod mirrored;
mod orientation_field;
mod pairing;
mod position_field;
mod quality;
mod relaxation;
mod spacing;
mod subdivision;
mod surface;
#[cfg(test)]
mod tests;

use crate::geometry::{PerVertex, Point, TriMesh, VertexId};
use contraction::Contraction;
pub use error::QuadError;
use hierarchy::hierarchy;
pub use mirrored::mirrored_quad_mesh;
use orientation_field::orientation_field;
use pairing::paired;
use position_field::position_field;
use relaxation::relaxed;
use spacing::spacings;
use subdivision::{Quads, subdivided};
use surface::Surface;

/// An angle below which a quad counts as poor, in degrees.
const POOR_DEG: f64 = 20.0;

/// Quads greater in number than this are refused; they take minutes and gigabytes.
const MOST_QUADS: f64 = 4e6;

/// A mesh of quads.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadMesh {
    /// V × 3.
    pub points: PerVertex<Point>,
    /// Q × 4, counter-clockwise seen from outside.
    pub quads: Vec<[VertexId; 4]>,
    figures: QuadFigures,
}

/// Counts and angles of quads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadFigures {
    /// The number of quads.
    pub quads: usize,
    /// Vertices with more or fewer than four quads around them; on borders, two; corners of borders do not count.
    pub singular_vertices: usize,
    /// The smallest angle of all quads, in degrees.
    pub smallest_angle_deg: f64,
    /// Quads with an angle below 20°: in crumples that the quads are too large for.
    pub poor_quads: usize,
    /// The requested length of edges, in metres.
    pub edge_length: f64,
}

/// Re-meshes a surface with quads with edges of about `edge_length` metres.
///
/// All vertices lie on the surface, and those on borders on its borders.
///
/// **Errors** a surface that is not manifold or has no area.
///
/// **Guarantees** a manifold mesh of quads alone, with a border for each border; handles smaller than two quads are closed;
/// independent of the number of threads.
pub fn quad_mesh(mesh: &TriMesh, edge_length: f64) -> Result<QuadMesh, QuadError> {
    check_size(mesh, edge_length)?;
    Ok(QuadMesh::of(quads_of_surface(mesh, edge_length, false)?, edge_length))
}

fn check_size(mesh: &TriMesh, edge_length: f64) -> Result<(), QuadError> {
    let area = mesh.area();
    if area > MOST_QUADS * edge_length * edge_length {
        return Err(QuadError::TooFine { edge_length, area });
    }
    Ok(())
}

/// The quads of a surface; one without borders, or the half of one, is a solid, on whose thin parts they are smaller.
fn quads_of_surface(mesh: &TriMesh, edge_length: f64, is_half: bool) -> Result<Quads, QuadError> {
    // Each polygon becomes quads with sides of half its length.
    let spacing = 2.0 * edge_length;
    let mut surface = Surface::prepare(mesh, 0.5 * spacing)?;
    surface.is_solid |= is_half;
    let spacings = spacings(&surface, spacing);
    let levels = hierarchy(&surface, &spacings);
    let crosses = orientation_field(&levels);
    let lattice = position_field(&levels, &crosses);
    let coarse = Contraction::of(&surface, &lattice, &spacings);
    let (quads, triangles) = paired(&coarse.points, &coarse.normals, &coarse.triangles());
    Ok(relaxed(&surface, subdivided(&coarse, &surface.borders, &quads, &triangles), edge_length))
}

impl QuadMesh {
    fn of(quads: Quads, edge_length: f64) -> Self {
        let mut around = vec![0; quads.points.len()];
        quads.quads.iter().flatten().for_each(|&v| around[v as usize] += 1);
        let is_singular = |v: &usize| match quads.on_border[*v] {
            None => around[*v] != 4,
            Some(place) => around[*v] != 2 && !place.is_corner,
        };
        let smallest = |quad: &[u32; 4]| {
            let corners = quad.map(|v| quads.points[v as usize]);
            quality::angles_deg(&corners, &nalgebra::Vector3::zeros()).into_iter().fold(180.0, f64::min)
        };
        let smallest_angles: Vec<f64> = quads.quads.iter().map(smallest).collect();
        let figures = QuadFigures {
            quads: quads.quads.len(),
            singular_vertices: (0..around.len()).filter(is_singular).count(),
            smallest_angle_deg: smallest_angles.iter().copied().fold(180.0, f64::min),
            poor_quads: smallest_angles.iter().filter(|angle| **angle < POOR_DEG).count(),
            edge_length,
        };
        let corners = quads.quads.iter().map(|quad| quad.map(VertexId)).collect();
        Self { points: quads.points.into(), quads: corners, figures }
    }

    /// Counts and angles.
    pub fn figures(&self) -> QuadFigures {
        self.figures
    }

    /// The mesh with two triangles per quad, one after the other, along the shorter diagonal.
    pub fn triangles(&self) -> TriMesh {
        let faces: Vec<[VertexId; 3]> = self.quads.iter().flat_map(|quad| self.pair(quad)).collect();
        let empty = Vec::<[VertexId; 3]>::new();
        TriMesh::try_new(self.points.clone(), empty).map_or_else(|_| TriMesh::empty(), |mesh| mesh.with_faces(faces))
    }

    fn pair(&self, &[a, b, c, d]: &[VertexId; 4]) -> [[VertexId; 3]; 2] {
        let length = |v: VertexId, w: VertexId| (self.points[v] - self.points[w]).norm_squared();
        if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    }
}

/// The quads of a mesh whose faces are pairs of triangles, as [`QuadMesh::triangles`] gives them.
///
/// **Shapes** one entry per two faces; pairs without a common side are left out.
pub fn quads_of_pairs(mesh: &TriMesh) -> Vec<[VertexId; 4]> {
    let quad = |pair: &[[VertexId; 3]]| {
        let &[first, second] = pair else { return None };
        let opposite = second.into_iter().find(|v| !first.contains(v))?;
        let k = (0..3).find(|&k| second.contains(&first[k]) && second.contains(&first[(k + 1) % 3]))?;
        Some([first[k], opposite, first[(k + 1) % 3], first[(k + 2) % 3]])
    };
    mesh.faces().as_slice().chunks(2).filter_map(quad).collect()
}
