//! Quads that follow the surface in place of a scan's triangles (Hu 2017, §6.2).

use super::counted::counted;
use crate::geometry::{Point, SurfaceIndex, TriMesh, VertexId, manifold_part, quad_mesh};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A vertex of the scan farther than this from the quads, in metres, has lost its part of the body: half a finger.
const LOST_FROM: f64 = 0.025;

/// Shares of the edge length that are tried, until nothing is lost.
const ATTEMPTS: [f64; 3] = [1.0, 0.8, 0.65];

/// The request for quads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Remesh {
    /// About how many; `None` for one per two faces of the cleaned scan.
    pub quads: Option<usize>,
}

impl fmt::Display for Remesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.quads {
            None => f.write_str("quads"),
            Some(count) => write!(f, "quads:{count}"),
        }
    }
}

impl FromStr for Remesh {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        /// Fewer lose hands and feet; more are finer than any scanner.
        const COUNTS: std::ops::RangeInclusive<usize> = 1_000..=1_000_000;
        let wrong = || format!("'{text}' is not quads or quads:COUNT, with a count from 1000 to 1000000");
        match text.split_once(':') {
            None if text == "quads" => Ok(Self { quads: None }),
            Some(("quads", count)) => {
                let quads = count.parse().ok().filter(|count| COUNTS.contains(count)).ok_or_else(wrong)?;
                Ok(Self { quads: Some(quads) })
            }
            _ => Err(wrong()),
        }
    }
}

impl TryFrom<String> for Remesh {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Remesh> for String {
    fn from(remesh: Remesh) -> Self {
        remesh.to_string()
    }
}

/// A scan of quads.
pub(super) struct Remeshed {
    /// Pairs of triangles, one pair per quad.
    pub mesh: TriMesh,
    /// Per vertex the nearest one of the scan.
    pub from: Vec<VertexId>,
    /// What was done, in one sentence.
    pub finding: String,
}

/// The scan with quads, at most as fine as `faces` allow.
///
/// **Errors** one sentence why its triangles stay.
pub(super) fn remeshed(whole: &TriMesh, remesh: Remesh, faces: usize) -> Result<Remeshed, String> {
    let count = remesh.quads.unwrap_or(whole.face_count().min(faces) / 2).max(1);
    let (mesh, vertices) = whole.part(&manifold_part(whole));
    let (left_out, mesh) = (whole.face_count() - mesh.face_count(), &mesh);
    let usual = (mesh.area() / count as f64).sqrt();
    let index = SurfaceIndex::prepare(mesh);
    for share in ATTEMPTS {
        let quads = quad_mesh(mesh, share * usual).map_err(|error| error.to_string())?;
        let of_quads = quads.triangles();
        let to_quads = SurfaceIndex::prepare(&of_quads);
        let distances: Vec<f64> = mesh.points().0.par_iter().map(|p| to_quads.closest(p).distance).collect();
        let farthest = distances.iter().copied().fold(0.0, f64::max);
        if farthest > LOST_FROM {
            continue;
        }
        let nearest = |p: &Point| {
            let corners = mesh.faces()[index.closest(p).face];
            let distance = |v: &VertexId| (mesh.points()[*v] - p).norm_squared();
            vertices[corners.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(corners[0])]
        };
        let from = of_quads.points().0.par_iter().map(nearest).collect();
        let (figures, mean) = (quads.figures(), distances.iter().sum::<f64>() / distances.len().max(1) as f64);
        let mut finding = format!(
            "re-meshed with {} quads, {} singular vertices; the scan is {:.1} mm from them on average, {:.0} mm at most",
            figures.quads,
            figures.singular_vertices,
            1e3 * mean,
            1e3 * farthest
        );
        if left_out > 0 {
            finding += &format!("; without {} at edges of more than two", counted(left_out, "face"));
        }
        return Ok(Remeshed { mesh: of_quads, from, finding });
    }
    Err("parts of it are too thin for quads of this size".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_comes_back_from_its_text() {
        for text in ["quads", "quads:20000"] {
            assert_eq!(text.parse::<Remesh>().unwrap().to_string(), text);
        }
        for text in ["", "quad", "quads:", "quads:12", "quads:2000000", "quads:-5", "tris:2000"] {
            assert!(text.parse::<Remesh>().is_err(), "{text}");
        }
    }

    #[test]
    fn faces_at_an_edge_of_three_are_left_out_and_the_rest_becomes_quads() {
        // A sheet of 20 × 20 cells with a fin on one of its edges.
        let points = (0..21 * 21).map(|k| Point::new(0.01 * f64::from(k % 21), 0.01 * f64::from(k / 21), 0.0));
        let points: Vec<Point> = points.chain([Point::new(0.1, 0.1, 0.05)]).collect();
        let cell = |k: u32| k % 20 + k / 20 * 21;
        let mut faces: Vec<[u32; 3]> =
            (0..400).map(cell).flat_map(|k| [[k, k + 1, k + 22], [k, k + 22, k + 21]]).collect();
        faces.push([10 * 21 + 10, 10 * 21 + 11, 441]);
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let done = remeshed(&mesh, Remesh { quads: Some(100) }, usize::MAX).ok().unwrap();
        assert!(done.finding.contains("without 1 face at"), "{}", done.finding);
        assert!((60..250).contains(&(done.mesh.face_count() / 2)), "{}", done.mesh.face_count());
        assert!(done.from.iter().all(|v| v.index() < 441));
        let off = |(v, p): (&VertexId, &Point)| (mesh.points()[*v] - p).norm();
        assert!(done.from.iter().zip(done.mesh.points().iter()).map(off).fold(0.0, f64::max) < 0.01);
    }
}
