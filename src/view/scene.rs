//! The content of a picture: meshes and their colours.

use super::Error;
use super::palette::ramp_color;
use crate::body::{Texture, UvMap};
use crate::geometry::{Aabb, PerVertex, TriMesh};

/// The colour of a mesh.
#[derive(Clone, Copy, Debug)]
pub enum Paint<'a> {
    /// One sRGB colour.
    Solid([u8; 3]),
    /// An sRGB colour per vertex.
    PerVertex(&'a PerVertex<[u8; 3]>),
    /// A number per vertex on the perceptual ramp.
    Scalar {
        /// V numbers; NaN is drawn grey.
        values: &'a PerVertex<f64>,
        /// The values at the two ends of the ramp.
        range: [f64; 2],
    },
    /// A picture wrapped around the mesh.
    Textured {
        /// Where on the picture each corner of each face lies.
        uvs: &'a UvMap,
        /// The picture.
        texture: &'a Texture,
    },
}

/// A painted mesh.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    pub(super) mesh: &'a TriMesh,
    pub(super) paint: Paint<'a>,
    pub(super) opacity: f32,
}

impl<'a> Part<'a> {
    /// A mesh in one colour.
    pub fn solid(mesh: &'a TriMesh, color: [u8; 3]) -> Self {
        Self { mesh, paint: Paint::Solid(color), opacity: 1.0 }
    }

    /// A mesh in any paint.
    ///
    /// **Errors** when a paint per vertex has another number of values than the mesh has vertices, or a texture belongs to another mesh.
    pub fn try_new(mesh: &'a TriMesh, paint: Paint<'a>) -> Result<Self, Error> {
        let values = match paint {
            Paint::Textured { uvs, .. } if !uvs.fits(mesh) => {
                return Err(Error::TextureFaces { of_texture: uvs.corners.len(), faces: mesh.face_count() });
            }
            Paint::Solid(_) | Paint::Textured { .. } => mesh.vertex_count(),
            Paint::PerVertex(colors) => colors.len(),
            Paint::Scalar { values, .. } => values.len(),
        };
        if values != mesh.vertex_count() {
            return Err(Error::PaintCount { values, vertices: mesh.vertex_count() });
        }
        Ok(Self { mesh, paint, opacity: 1.0 })
    }

    /// The sRGB colour of each vertex; white under a texture.
    pub(super) fn colors(&self) -> Vec<[u8; 3]> {
        match self.paint {
            Paint::Solid(rgb) => vec![rgb; self.mesh.vertex_count()],
            Paint::Textured { .. } => vec![[255; 3]; self.mesh.vertex_count()],
            Paint::PerVertex(colors) => colors.0.clone(),
            Paint::Scalar { values, range } => values.iter().map(|&value| ramp_color(value, range)).collect(),
        }
    }

    /// Makes the part translucent: only its nearest surface is drawn, without shadows.
    pub fn with_opacity(self, opacity: f64) -> Self {
        Self { opacity: opacity.clamp(0.0, 1.0) as f32, ..self }
    }
}

/// Everything in one picture.
#[derive(Clone, Debug, Default)]
pub struct Scene<'a> {
    /// The parts, in any order.
    pub parts: Vec<Part<'a>>,
    /// Height of the floor with the shadow, in metres; `None` for the lowest point of all parts.
    pub floor: Option<f64>,
}

impl<'a> Scene<'a> {
    /// A scene of these parts.
    pub fn new(parts: impl IntoIterator<Item = Part<'a>>) -> Self {
        Self { parts: parts.into_iter().collect(), floor: None }
    }

    /// The box around all parts; `None` when there is no vertex.
    pub fn bounds(&self) -> Option<Aabb> {
        Aabb::around(self.parts.iter().flat_map(|part| part.mesh.points().iter()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn a_paint_for_another_mesh_is_refused() {
        let mesh = TriMesh::try_from_indices(vec![Point::origin(); 3], &[[0, 1, 2]]).unwrap();
        let values = PerVertex(vec![0.5; 4]);
        let refused = Part::try_new(&mesh, Paint::Scalar { values: &values, range: [0.0, 1.0] });
        assert!(matches!(refused, Err(Error::PaintCount { values: 4, vertices: 3 })));
    }
}
