//! Nearest of many points.

use super::{Point, VertexId};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// Points in a k-d tree, prepared once.
pub struct NearestVertex {
    /// `None` without points: an empty tree would return a point that does not exist.
    tree: Option<ImmutableKdTree<f64, 3>>,
}

impl NearestVertex {
    /// Builds the tree.
    ///
    /// **Shapes** `points` V × 3.
    ///
    /// **Requires** finite coordinates, which a [`TriMesh`](super::TriMesh) has.
    pub fn prepare(points: &[Point]) -> Self {
        let coordinates: Vec<[f64; 3]> = points.iter().map(|p| [p.x, p.y, p.z]).collect();
        let built =
            || ImmutableKdTree::new_from_slice(&coordinates).expect("fewer than 2³² points: vertex ids are u32");
        let tree = (!points.is_empty()).then(built);
        Self { tree }
    }

    /// The nearest point and its distance; `None` when there are no points. Of coincident points it
    /// returns an arbitrary one, but always the same.
    pub fn nearest(&self, p: &Point) -> Option<(VertexId, f64)> {
        let found = self.tree.as_ref()?.query(&[p.x, p.y, p.z]).nearest_one::<SquaredEuclidean<f64>>().execute();
        found.distance.is_finite().then(|| (VertexId(found.item), found.distance.sqrt()))
    }

    /// All points no farther than `radius`, in ascending order.
    ///
    /// **Shapes** one id per point found.
    pub fn within(&self, p: &Point, radius: f64) -> Vec<VertexId> {
        let Some(tree) = &self.tree else { return Vec::new() };
        if radius.is_nan() || radius < 0.0 {
            return Vec::new();
        }
        let found = tree.query(&[p.x, p.y, p.z]).within::<SquaredEuclidean<f64>>(radius * radius).unsorted().execute();
        let mut ids: Vec<VertexId> = found.into_iter().map(|item| VertexId(item.item)).collect();
        ids.sort_unstable();
        ids
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes_for_tests::noise;

    #[test]
    fn equals_the_naive_search() {
        let mut next = noise(1);
        let points: Vec<Point> = (0..500).map(|_| Point::new(next(), next(), next())).collect();
        let index = NearestVertex::prepare(&points);
        for _ in 0..200 {
            let q = Point::new(2.0 * next(), 2.0 * next(), next());
            let naive = points.iter().map(|p| (p - q).norm()).fold(f64::INFINITY, f64::min);
            let (id, distance) = index.nearest(&q).unwrap();
            assert!((distance - naive).abs() < 1e-12);
            assert_eq!((points[id.index()] - q).norm(), distance);
            let near: Vec<VertexId> =
                (0..500).filter(|&i| (points[i] - q).norm() <= 0.5).map(VertexId::from_index).collect();
            assert_eq!(index.within(&q, 0.5), near);
        }
    }

    #[test]
    fn no_points_have_no_nearest_and_many_in_one_place_do_no_harm() {
        assert_eq!(NearestVertex::prepare(&[]).nearest(&Point::origin()), None);
        assert!(NearestVertex::prepare(&[]).within(&Point::origin(), 1.0).is_empty());
        let index = NearestVertex::prepare(&vec![Point::new(0.0, 1.0, 0.0); 4000]);
        assert_eq!(index.nearest(&Point::origin()).unwrap().1, 1.0);
        assert_eq!(index.within(&Point::origin(), 1.0).len(), 4000);
    }
}
