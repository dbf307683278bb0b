//! The part of a layer that remains when its covered parts are removed.

use super::arguments::check_mask;
use super::error::ExportError;
use crate::geometry::{Adjacency, PerFace, PerVertex, TriMesh, VertexId, geodesic_distances};

/// Width in metres of the rim of a covered region that stays: a pose beyond those of the mask moves a hem by that much.
const MARGIN: f64 = 0.02;

/// The faces of a layer that remain without its covered parts.
#[derive(Clone, Debug, PartialEq)]
pub struct VisiblePart {
    /// Which faces remain.
    ///
    /// **Shapes** one entry per face.
    pub faces: PerFace<bool>,
    /// Surface of the whole layer, in m².
    pub area: f64,
    /// Surface that is removed, in m².
    pub removed_area: f64,
    /// Whether all of the layer is covered. It then stays whole: it has no border along which to cut it, and a file
    /// without one of its layers would be a surprise.
    pub is_all_covered: bool,
}

/// Decides which faces of a layer remain: all but those whose corners are covered and lie more than 20 mm along the
/// surface from the border of the covered region.
///
/// **Shapes** `covered`: one entry per vertex.
///
/// **Errors** a mask of another length.
pub fn visible_part(layer: &str, mesh: &TriMesh, covered: &PerVertex<bool>) -> Result<VisiblePart, ExportError> {
    check_mask(layer, mesh, covered.as_slice())?;
    let border: Vec<(VertexId, f64)> = covered.enumerate().filter(|(_, c)| !**c).map(|(v, _)| (v, 0.0)).collect();
    let distances = geodesic_distances(mesh, &Adjacency::prepare(mesh), &border, MARGIN);
    let is_near = |face: &[VertexId; 3]| face.iter().any(|&v| distances[v].is_finite());
    let mut faces: PerFace<bool> = mesh.faces().iter().map(is_near).collect();
    let is_all_covered = !faces.iter().any(|&kept| kept);
    if is_all_covered {
        faces = PerFace::filled(true, mesh.face_count());
    }
    let removed_area = mesh.face_ids().filter(|&f| !faces[f]).map(|f| mesh.face_area(f)).sum();
    Ok(VisiblePart { faces, area: mesh.area(), removed_area, is_all_covered })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// A strip of `length` squares of 8 mm.
    fn strip(length: u32) -> TriMesh {
        let points = (0..2 * (length + 1)).map(|i| Point::new(f64::from(i / 2) * 0.008, f64::from(i % 2) * 0.008, 0.0));
        let faces: Vec<[u32; 3]> =
            (0..length).flat_map(|k| [[2 * k, 2 * k + 2, 2 * k + 1], [2 * k + 1, 2 * k + 2, 2 * k + 3]]).collect();
        TriMesh::try_from_indices(points.collect(), &faces).unwrap()
    }

    #[test]
    fn a_rim_of_two_centimetres_stays_and_the_end_of_the_cloth_has_none() {
        let mesh = strip(20);
        // Covered from 7.6 cm on, to the end.
        let covered = mesh.points().iter().map(|p| p.x > 0.076).collect();
        let part = visible_part("strip", &mesh, &covered).unwrap();
        let kept: Vec<usize> = (0..40).filter(|&f| part.faces.0[f]).collect();
        // The last uncovered vertices are at 7.2 cm; those at 8.8 cm are within 2 cm, and every face at them stays.
        assert_eq!(kept, (0..24).collect::<Vec<_>>());
        assert!((part.removed_area - 8.0 * 0.008 * 0.008).abs() < 1e-12 && !part.is_all_covered);
        assert!((part.area - 20.0 * 0.008 * 0.008).abs() < 1e-12);
        let (rest, _) = mesh.part(&part.faces);
        assert_eq!(rest.vertex_count(), 26, "no vertex without faces stays");
    }

    #[test]
    fn a_layer_that_is_covered_everywhere_or_nowhere_stays_whole() {
        let mesh = strip(20);
        for (value, is_all_covered) in [(true, true), (false, false)] {
            let part = visible_part("strip", &mesh, &PerVertex::filled(value, mesh.vertex_count())).unwrap();
            assert!(part.faces.iter().all(|&kept| kept) && part.removed_area == 0.0);
            assert_eq!(part.is_all_covered, is_all_covered);
        }
        let error = visible_part("strip", &mesh, &PerVertex::filled(true, 3)).unwrap_err();
        assert_eq!(error.to_string(), "layer 'strip' has 3 cover values, but 42 vertices");
    }
}
