//! Distances and colours of scan and layers.

use crate::geometry::{NearestVertex, PerVertex, Point, SurfaceIndex, SurfacePoint};
use crate::segment::{Inner, Lab, color_difference, lab_of};

/// One surface of the figure so far, ready to be asked for its closest point.
pub(super) struct IndexedLayer<'a> {
    pub(super) index: SurfaceIndex,
    vertices: NearestVertex,
    pub(super) colors: Option<&'a PerVertex<[u8; 3]>>,
}

impl<'a> IndexedLayer<'a> {
    pub(super) fn of(layer: &Inner<'a>) -> Self {
        let vertices = NearestVertex::prepare(layer.mesh.points().as_slice());
        Self { index: SurfaceIndex::prepare(layer.mesh), vertices, colors: layer.colors }
    }

    /// Whether a vertex within `radius`, in metres, has a colour at most `most` spreads from the given one.
    pub(super) fn has_color_near(&self, p: &Point, radius: f64, color: &Lab, most: f64) -> bool {
        let has = |colors: &PerVertex<[u8; 3]>| {
            self.vertices.within(p, radius).into_iter().any(|v| color_difference(&lab_of(colors[v]), color) <= most)
        };
        self.colors.is_some_and(has)
    }

    /// The colour at a point of the surface.
    pub(super) fn color_at(&self, at: &SurfacePoint) -> Option<Lab> {
        let corner = at.nearest_corner(self.index.mesh());
        self.colors.map(|colors| lab_of(colors[corner]))
    }
}

/// How differently two places are coloured, in spreads of one cloth between two views.
pub(super) fn difference(a: Option<Lab>, b: Option<Lab>) -> Option<f64> {
    Some(color_difference(&a?, &b?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;

    #[test]
    fn a_striped_cloth_has_both_its_colours_near_every_place() {
        const WHITE: [u8; 3] = [240; 3];
        const BLUE: [u8; 3] = [30, 50, 140];
        let points: Vec<Point> =
            (0..31).flat_map(|i| [0.0, 0.01].map(|x| Point::new(x, 0.01 * f64::from(i), 0.0))).collect();
        let faces: Vec<[u32; 3]> =
            (0..30).flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 2], [2 * i + 1, 2 * i + 3, 2 * i + 2]]).collect();
        let colors = (0..62).map(|v| if v / 8 % 2 == 0 { WHITE } else { BLUE }).collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let layer = IndexedLayer::of(&Inner { mesh: &mesh, colors: Some(&colors) });
        let p = Point::new(0.0, 0.15, 0.003);
        let has = |color: [u8; 3]| layer.has_color_near(&p, 0.05, &lab_of(color), 2.0);
        assert!(has(WHITE) && has(BLUE) && !has([200, 40, 40]));
        assert!(!IndexedLayer::of(&Inner { mesh: &mesh, colors: None }).has_color_near(&p, 0.05, &lab_of(WHITE), 2.0));
    }
}
