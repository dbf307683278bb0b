//! The template's labels taken from the body to the scan.

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
}
