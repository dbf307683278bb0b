//! Faces as formats with quads have them.

use crate::body::Layer;

/// A triangle or a quad: the vertex and the texture coordinate of each corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Polygon {
    corners: [(u32, u32); 4],
    count: usize,
}

impl Polygon {
    /// Vertex and texture coordinate of each; the coordinate is 0 for a layer that has none.
    pub fn corners(&self) -> &[(u32, u32)] {
        &self.corners[..self.count]
    }

    fn triangle([a, b, c]: [(u32, u32); 3]) -> Self {
        Self { corners: [a, b, c, c], count: 3 }
    }

    /// The quad of two triangles with a common side; `None` if they have none, or differ there in texture coordinates.
    fn of_pair(first: [(u32, u32); 3], second: [(u32, u32); 3]) -> Option<Self> {
        let opposite = second.into_iter().find(|corner| first.iter().all(|(v, _)| *v != corner.0))?;
        let k = (0..3).find(|&k| second.contains(&first[k]) && second.contains(&first[(k + 1) % 3]))?;
        Some(Self { corners: [first[k], opposite, first[(k + 1) % 3], first[(k + 2) % 3]], count: 4 })
    }
}

/// The faces of a layer; if it `is_quads`, its triangles are pairs.
pub(super) fn polygons(layer: &Layer, is_quads: bool) -> Vec<Polygon> {
    let faces = layer.mesh.faces().as_slice();
    let corners = |f: usize| -> [(u32, u32); 3] {
        let coords = layer.uvs.as_ref().map(|uvs| uvs.corners.as_slice()[f]);
        std::array::from_fn(|k| (faces[f][k].0, coords.map_or(0, |coords| coords[k])))
    };
    if !is_quads {
        return (0..faces.len()).map(|f| Polygon::triangle(corners(f))).collect();
    }
    let mut all = Vec::with_capacity(faces.len() / 2);
    for f in (0..faces.len()).step_by(2) {
        let first = corners(f);
        let second = (f + 1 < faces.len()).then(|| corners(f + 1));
        match second.and_then(|second| Polygon::of_pair(first, second)) {
            Some(quad) => all.push(quad),
            None => all.extend([Some(first), second].into_iter().flatten().map(Polygon::triangle)),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{JointId, SkinWeights, UvMap};
    use crate::geometry::{Point, TriMesh};

    #[test]
    fn pairs_become_quads_but_for_those_that_a_seam_of_the_texture_divides() {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0], [2.0, 1.0]];
        let points = points.iter().map(|[x, y]| Point::new(*x, *y, 0.0)).collect();
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]).unwrap();
        let weights = SkinWeights::from_rows((0..6).map(|_| vec![(JointId(0), 1.0)]));
        let mut layer = Layer::plain("cloth", mesh.clone(), weights);
        let corner_counts =
            |layer: &Layer, quads: bool| polygons(layer, quads).iter().map(|p| p.corners().len()).collect::<Vec<_>>();
        assert_eq!(corner_counts(&layer, true), [4, 4]);
        assert_eq!(corner_counts(&layer, false), [3; 4]);
        let order: Vec<u32> = polygons(&layer, true)[0].corners().iter().map(|(v, _)| *v).collect();
        let start = order.iter().position(|v| *v == 0).unwrap();
        assert_eq!([0, 1, 2, 3].map(|k| order[(start + k) % 4]), [0, 1, 2, 3], "in the order of the triangles");
        let mut uvs = UvMap::per_vertex(&mesh, vec![[0.0; 2]; 6].into());
        uvs.coords.push([0.5; 2]);
        // The diagonal of the second quad is a seam.
        uvs.corners.0[3] = [6, 5, 2];
        layer.uvs = Some(uvs);
        assert_eq!(corner_counts(&layer, true), [4, 3, 3]);
    }
}
