//! The template's labels taken from the body to the scan.

use super::SegmentError;
use crate::geometry::{NearestVertex, PerVertex, TriMesh};
use crate::scan::Scan;
use rayon::prelude::*;

/// For each vertex of a scan, whether it belongs to the new garment.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Labels(pub PerVertex<bool>);

impl Labels {
    /// How many vertices belong to the garment.
    pub fn garment_vertex_count(&self) -> usize {
        self.0.iter().filter(|&&l| l).count()
    }

    /// From a label file: one number a vertex, 1 (or 255) the garment, 0 not.
    ///
    /// There are either as many as the cleaned scan has vertices or, where `file_vertex_count` is known, as many as the
    /// scan's file has.
    pub fn from_numbers(numbers: &[f64], scan: &Scan, file_vertex_count: Option<usize>) -> Result<Self, SegmentError> {
        let vertices = scan.mesh.vertex_count();
        if let Some((index, &value)) = numbers.iter().enumerate().find(|(_, n)| ![0.0, 1.0, 255.0].contains(*n)) {
            return Err(SegmentError::BadLabel { index, value });
        }
        let of_file = file_vertex_count == Some(numbers.len()) && numbers.len() != vertices;
        if numbers.len() != vertices && !of_file {
            return Err(SegmentError::LabelCount { labels: numbers.len(), vertices, file_vertices: file_vertex_count });
        }
        let at = |i: usize| {
            let i = if of_file { scan.file_vertices.0.get(i).map_or(usize::MAX, |&f| f as usize) } else { i };
            numbers.get(i).is_some_and(|&n| n > 0.0)
        };
        Ok(Self((0..vertices).map(at).collect()))
    }
}

/// Each vertex of the scan takes the label of the nearest vertex of the body.
///
/// **Shapes** `prior` has one entry a vertex of `posed_body`.
///
/// **Source** Hu 2017, §6.2.
pub fn transfer(scan: &Scan, posed_body: &TriMesh, prior: &PerVertex<bool>) -> Labels {
    let nearest = NearestVertex::prepare(posed_body.points().as_slice());
    let labels: Vec<bool> =
        scan.mesh.points().0.par_iter().map(|p| nearest.nearest(p).is_some_and(|(v, _)| prior[v])).collect();
    Labels(labels.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn scan() -> Scan {
        let points = (0..3).map(|i| Point::new(f64::from(i), 0.0, 0.0)).collect();
        Scan::from_clean_mesh(TriMesh::try_from_indices(points, &[[0, 1, 2]]).unwrap(), None)
    }

    #[test]
    fn each_vertex_takes_the_label_of_the_nearest_of_the_body() {
        let body = scan().mesh.map_points(|p| p + crate::geometry::Vec3::new(0.4, 3.0, 0.0));
        let labels = transfer(&scan(), &body, &PerVertex(vec![true, false, true]));
        assert_eq!(labels.0.0, vec![true, false, true]);
        let shifted = body.map_points(|p| p + crate::geometry::Vec3::new(0.2, 0.0, 0.0));
        assert_eq!(transfer(&scan(), &shifted, &PerVertex(vec![true, false, true])).0.0, vec![true, true, false]);
    }

    #[test]
    fn label_files_must_fit_the_scan_or_its_file() {
        let mut scan = scan();
        scan.file_vertices = PerVertex(vec![4, 0, 2]);
        assert_eq!(Labels::from_numbers(&[1.0, 0.0, 1.0], &scan, Some(5)).unwrap().0.0, vec![true, false, true]);
        let of_file = Labels::from_numbers(&[0.0, 0.0, 1.0, 1.0, 1.0], &scan, Some(5)).unwrap();
        assert_eq!(of_file.0.0, vec![true, false, true]);
        let error = Labels::from_numbers(&[0.0; 4], &scan, Some(5)).unwrap_err().to_string();
        assert!(error.contains('4') && error.contains('3') && error.contains('5'), "{error}");
        assert!(Labels::from_numbers(&[0.0, 2.0, 0.0], &scan, None).unwrap_err().to_string().contains("label 1 is 2"));
    }
}
