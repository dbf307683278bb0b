//! The triangle mesh and its typed indices.

use serde::{Deserialize, Serialize};
use std::ops::{Index, IndexMut};

/// A position in metres. The variable's name contains the frame unless it is the world.
pub type Point = nalgebra::Point3<f64>;
/// A direction or displacement.
pub type Vec3 = nalgebra::Vector3<f64>;

/// A vertex of one particular mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct VertexId(pub u32);

/// A face of one particular mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FaceId(pub u32);

impl VertexId {
    /// The position of this vertex in a plain array.
    pub fn index(self) -> usize {
        self.0 as usize
    }
    /// The id of the vertex at `index` of a plain array.
    pub fn from_index(index: usize) -> Self {
        Self(index as u32)
    }
}

impl FaceId {
    /// The position of this face in a plain array.
    pub fn index(self) -> usize {
        self.0 as usize
    }
    /// The id of the face at `index` of a plain array.
    pub fn from_index(index: usize) -> Self {
        Self(index as u32)
    }
}

macro_rules! per_element {
    ($(#[$doc:meta])* $name:ident, $id:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name<T>(pub Vec<T>);

        impl<T> $name<T> {
            /// The number of elements.
            pub fn len(&self) -> usize {
                self.0.len()
            }
            /// Whether there are no elements.
            pub fn is_empty(&self) -> bool {
                self.0.is_empty()
            }
            /// The values in index order.
            pub fn iter(&self) -> std::slice::Iter<'_, T> {
                self.0.iter()
            }
            /// The values with their ids, in index order.
            pub fn enumerate(&self) -> impl Iterator<Item = ($id, &T)> {
                self.0.iter().enumerate().map(|(i, v)| ($id::from_index(i), v))
            }
            /// The plain array.
            pub fn as_slice(&self) -> &[T] {
                &self.0
            }
        }
        impl<T: Clone> $name<T> {
            /// `count` copies of `value`.
            pub fn filled(value: T, count: usize) -> Self {
                Self(vec![value; count])
            }
        }
        impl<T> From<Vec<T>> for $name<T> {
            fn from(values: Vec<T>) -> Self {
                Self(values)
            }
        }
        impl<T> FromIterator<T> for $name<T> {
            fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
                Self(values.into_iter().collect())
            }
        }
        impl<T> Index<$id> for $name<T> {
            type Output = T;
            fn index(&self, id: $id) -> &T {
                &self.0[id.index()]
            }
        }
        impl<T> IndexMut<$id> for $name<T> {
            fn index_mut(&mut self, id: $id) -> &mut T {
                &mut self.0[id.index()]
            }
        }
    };
}
per_element!(
    /// One value per vertex.
    PerVertex,
    VertexId
);
per_element!(
    /// One value per face.
    PerFace,
    FaceId
);

/// Why arrays are not a valid mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A face refers to a vertex that does not exist.
    #[error("face {face} refers to vertex {vertex}, but there are only {vertex_count} vertices")]
    VertexOutOfRange {
        /// The face.
        face: u32,
        /// The vertex it refers to.
        vertex: u32,
        /// The number of vertices.
        vertex_count: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a number ({x}, {y}, {z})")]
    NotFinite {
        /// The first such vertex.
        vertex: u32,
        /// Its x.
        x: f64,
        /// Its y.
        y: f64,
        /// Its z.
        z: f64,
    },
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Point,
    /// Greatest corner.
    pub max: Point,
}

impl Aabb {
    /// The box around `points`; `None` for none.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Point>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = *points.next()?;
        Some(points.fold(Self { min: first, max: first }, |b, p| Self { min: b.min.inf(p), max: b.max.sup(p) }))
    }
    /// Edge lengths.
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }
    /// Middle.
    pub fn center(&self) -> Point {
        nalgebra::center(&self.min, &self.max)
    }
}

/// A triangle mesh, open or closed, possibly non-manifold.
///
/// **Shapes** points `V × 3`, faces `F × 3`, counter-clockwise seen from outside.
///
/// **Guarantees** every index is in range and every coordinate finite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriMesh {
    points: PerVertex<Point>,
    faces: PerFace<[VertexId; 3]>,
}

impl TriMesh {
    /// A mesh without vertices and faces.
    pub fn empty() -> Self {
        Self { points: Vec::new().into(), faces: Vec::new().into() }
    }

    /// Checks indices and coordinates.
    ///
    /// **Shapes** `points` V × 3, `faces` F × 3.
    pub fn try_new(
        points: impl Into<PerVertex<Point>>,
        faces: impl Into<PerFace<[VertexId; 3]>>,
    ) -> Result<Self, MeshError> {
        let (points, faces) = (points.into(), faces.into());
        for (id, p) in points.enumerate() {
            if !p.iter().all(|c| c.is_finite()) {
                return Err(MeshError::NotFinite { vertex: id.0, x: p.x, y: p.y, z: p.z });
            }
        }
        for (id, face) in faces.enumerate() {
            for v in face {
                if v.index() >= points.len() {
                    return Err(MeshError::VertexOutOfRange { face: id.0, vertex: v.0, vertex_count: points.len() });
                }
            }
        }
        Ok(Self { points, faces })
    }

    /// From plain index triples.
    ///
    /// **Shapes** points `V × 3`, faces `F × 3`.
    pub fn try_from_indices(points: Vec<Point>, faces: &[[u32; 3]]) -> Result<Self, MeshError> {
        Self::try_new(points, faces.iter().map(|f| f.map(VertexId)).collect::<PerFace<_>>())
    }

    /// Positions, `V × 3`.
    pub fn points(&self) -> &PerVertex<Point> {
        &self.points
    }
    /// Corner ids, `F × 3`.
    pub fn faces(&self) -> &PerFace<[VertexId; 3]> {
        &self.faces
    }
    /// The number of vertices, `V`.
    pub fn vertex_count(&self) -> usize {
        self.points.len()
    }
    /// The number of faces, `F`.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }
    /// The corners' positions.
    pub fn triangle(&self, face: FaceId) -> [Point; 3] {
        self.faces[face].map(|v| self.points[v])
    }

    /// Moves the vertices.
    ///
    /// **Shapes** `points`: `V × 3`.
    ///
    /// # Panics
    /// If the number of points differs. Coordinates are not checked again; callers keep them finite.
    pub fn with_points(&self, points: impl Into<PerVertex<Point>>) -> Self {
        let points = points.into();
        assert_eq!(points.len(), self.points.len(), "a moved mesh keeps its vertices");
        Self { points, faces: self.faces.clone() }
    }

    /// Other faces over the same vertices.
    ///
    /// **Shapes** `faces` F × 3, for any F.
    ///
    /// # Panics
    /// If a face refers to a vertex that is not there.
    pub fn with_faces(&self, faces: impl Into<PerFace<[VertexId; 3]>>) -> Self {
        let faces = faces.into();
        let count = self.points.len();
        assert!(faces.iter().flatten().all(|v| v.index() < count), "a face refers to a vertex that is not there");
        Self { points: self.points.clone(), faces }
    }

    /// Maps every point.
    pub fn map_points(&self, f: impl Fn(&Point) -> Point) -> Self {
        Self { points: self.points.iter().map(f).collect(), faces: self.faces.clone() }
    }

    /// Flips all faces.
    pub fn flipped(&self) -> Self {
        Self { points: self.points.clone(), faces: self.faces.iter().map(|&[a, b, c]| [a, c, b]).collect() }
    }

    /// Twice the area vector: the cross product of two edges.
    pub fn area_vector(&self, face: FaceId) -> Vec3 {
        let [a, b, c] = self.triangle(face);
        (b - a).cross(&(c - a))
    }

    /// Unit normal, or zero for a face without area.
    pub fn face_normal(&self, face: FaceId) -> Vec3 {
        self.area_vector(face).try_normalize(1e-30).unwrap_or_else(Vec3::zeros)
    }

    /// Area of one face.
    pub fn face_area(&self, face: FaceId) -> f64 {
        0.5 * self.area_vector(face).norm()
    }

    /// All face ids in order.
    pub fn face_ids(&self) -> impl Iterator<Item = FaceId> + use<> {
        (0..self.faces.len()).map(FaceId::from_index)
    }

    /// All vertex ids in order.
    pub fn vertex_ids(&self) -> impl Iterator<Item = VertexId> + use<> {
        (0..self.points.len()).map(VertexId::from_index)
    }

    /// Surface area.
    pub fn area(&self) -> f64 {
        self.face_ids().map(|f| self.face_area(f)).sum()
    }

    /// A third of the area of the faces around each vertex, in m².
    ///
    /// **Shapes** one entry per vertex.
    pub fn vertex_areas(&self) -> PerVertex<f64> {
        let mut areas = PerVertex::filled(0.0, self.vertex_count());
        for f in self.face_ids() {
            let third = self.face_area(f) / 3.0;
            for v in self.faces[f] {
                areas[v] += third;
            }
        }
        areas
    }

    /// Signed volume; positive for a closed mesh oriented outward.
    pub fn signed_volume(&self) -> f64 {
        self.face_ids()
            .map(|f| {
                let [a, b, c] = self.triangle(f).map(|p| p.coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// Unit vertex normals, weighted by corner angle (Thürmer & Wüthrich 1998; Bærentzen & Aanæs 2005: the sign of
    /// the distance to a mesh follows from them). Zero for a vertex without faces of positive area. `V × 3`.
    pub fn vertex_normals(&self) -> PerVertex<Vec3> {
        let mut normals = PerVertex::filled(Vec3::zeros(), self.vertex_count());
        for f in self.face_ids() {
            let n = self.face_normal(f);
            let corners = self.faces[f];
            for k in 0..3 {
                let p = self.points[corners[k]];
                let (u, v) = (self.points[corners[(k + 1) % 3]] - p, self.points[corners[(k + 2) % 3]] - p);
                normals[corners[k]] += n * u.angle(&v);
            }
        }
        for n in &mut normals.0 {
            *n = n.try_normalize(1e-12).unwrap_or_else(Vec3::zeros);
        }
        normals
    }

    /// Unit vertex normals, weighted by area: a third of the work of angle weights, for meshes with faces of similar size, such as
    /// bodies and scans. Zero for a vertex without faces of positive area. `V × 3`.
    pub fn vertex_normals_by_area(&self) -> PerVertex<Vec3> {
        let mut normals = PerVertex::filled(Vec3::zeros(), self.vertex_count());
        for (f, corners) in self.faces.enumerate() {
            let area = self.area_vector(f);
            corners.iter().for_each(|&v| normals[v] += area);
        }
        normals.0.iter_mut().for_each(|n| *n = n.try_normalize(1e-12).unwrap_or_else(Vec3::zeros));
        normals
    }

    /// The box around all points; `None` without points.
    pub fn bounds(&self) -> Option<Aabb> {
        Aabb::around(self.points.iter())
    }

    /// Mean edge length; 0 without faces.
    pub fn mean_edge_length(&self) -> f64 {
        let sum: f64 = self
            .face_ids()
            .map(|f| {
                let [a, b, c] = self.triangle(f);
                (b - a).norm() + (c - b).norm() + (a - c).norm()
            })
            .sum();
        if self.faces.is_empty() { 0.0 } else { sum / (3 * self.faces.len()) as f64 }
    }

    /// The faces marked in `keep`, with only the vertices that they use.
    ///
    /// Returns the part and, for each of its vertices, the vertex of `self` that it was. Order is kept.
    ///
    /// **Shapes** `keep` F; the result's map has one entry per vertex of the part.
    ///
    /// # Panics
    /// If there is not one flag per face.
    pub fn part(&self, keep: &PerFace<bool>) -> (Self, PerVertex<VertexId>) {
        assert_eq!(keep.len(), self.face_count(), "one flag per face");
        let mut part_from_whole = vec![u32::MAX; self.vertex_count()];
        let mut whole_from_part = Vec::new();
        for (f, _) in keep.enumerate().filter(|&(_, &k)| k) {
            for v in self.faces[f] {
                if part_from_whole[v.index()] == u32::MAX {
                    part_from_whole[v.index()] = 0;
                }
            }
        }
        for (v, slot) in part_from_whole.iter_mut().enumerate() {
            if *slot == 0 {
                *slot = whole_from_part.len() as u32;
                whole_from_part.push(VertexId::from_index(v));
            }
        }
        let faces = keep
            .enumerate()
            .filter(|&(_, &k)| k)
            .map(|(f, _)| self.faces[f].map(|v| VertexId(part_from_whole[v.index()])))
            .collect();
        let points = whole_from_part.iter().map(|&v| self.points[v]).collect();
        (Self { points, faces }, whole_from_part.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriMesh {
        TriMesh::try_from_indices(
            vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(0.0, 1.0, 0.0), Point::new(0.0, 0.0, 1.0)],
            &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        )
        .unwrap()
    }

    #[test]
    fn volume_is_positive_seen_from_outside() {
        assert!((tetrahedron().signed_volume() - 1.0 / 6.0).abs() < 1e-12);
        assert!((tetrahedron().flipped().signed_volume() + 1.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn index_out_of_range_is_named() {
        let err = TriMesh::try_from_indices(vec![Point::origin()], &[[0, 0, 7]]).unwrap_err();
        assert_eq!(err, MeshError::VertexOutOfRange { face: 0, vertex: 7, vertex_count: 1 });
    }

    #[test]
    fn a_part_keeps_positions_and_order() {
        let mesh = tetrahedron();
        let (part, whole_from_part) = mesh.part(&PerFace(vec![false, false, false, true]));
        assert_eq!(part.face_count(), 1);
        assert_eq!(whole_from_part.0, vec![VertexId(1), VertexId(2), VertexId(3)]);
        assert_eq!(part.points()[VertexId(0)], mesh.points()[VertexId(1)]);
    }
}
