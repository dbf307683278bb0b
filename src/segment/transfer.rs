//! Label transfer from the template's body to the scan.

use super::error::{SegmentError, check_length};
use crate::geometry::{NearestVertex, PerVertex, TriMesh};
use crate::scan::Scan;
use rayon::prelude::*;

/// Which vertices of a scan belong to the new garment.
///
/// **Shapes** one entry per vertex.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Labels(pub PerVertex<bool>);

impl Labels {
    /// The number of vertices that belong to the garment.
    pub fn garment_vertex_count(&self) -> usize {
        self.0.iter().filter(|&&l| l).count()
    }
}

/// Each vertex of the scan takes the label of the nearest vertex of the body.
///
/// **Shapes** `prior`: one entry per vertex of `posed_body`. The result: one label per vertex of the scan.
///
/// **Requires** `posed_body` in the scan's pose and frame.
///
/// **Errors** if `prior` has another length.
///
/// **Source** Hu 2017, §6.2: "the vertices of the scanned surfaces are labeled according to the nearest vertex of the body
/// model". Where the paper is silent we chose: "nearest" is the Euclidean distance, whatever the normals; of vertices
/// equally near the search's first one decides; the body is the naked body with the offsets fitted to this scan; the
/// vertices are those of the cleaned triangle mesh, not of a quad mesh made for painting. The stage `cut`
/// smooths the rough boundary as it does any other; in the paper a person redraws it.
pub fn transfer(scan: &Scan, posed_body: &TriMesh, prior: &PerVertex<bool>) -> Result<Labels, SegmentError> {
    check_length("labels of the body", prior.len(), posed_body.vertex_count())?;
    let nearest = NearestVertex::prepare(posed_body.points().as_slice());
    let labels: Vec<bool> =
        scan.mesh.points().0.par_iter().map(|p| nearest.nearest(p).is_some_and(|(v, _)| prior[v])).collect();
    Ok(Labels(labels.into()))
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
        let labels = transfer(&scan(), &body, &PerVertex(vec![true, false, true])).unwrap();
        assert_eq!(labels.0.0, vec![true, false, true]);
        let shifted = body.map_points(|p| p + crate::geometry::Vec3::new(0.2, 0.0, 0.0));
        assert_eq!(
            transfer(&scan(), &shifted, &PerVertex(vec![true, false, true])).unwrap().0.0,
            vec![true, true, false]
        );
        assert!(transfer(&scan(), &body, &PerVertex(vec![true])).is_err());
    }
}
