//! The arrays of a mesh file; the only check is that indices are in range.

use super::error::{Format, FormatError};
use super::texture::{RawTexture, UnreadPart};
use std::collections::BTreeMap;
use std::io::Read;

/// The arrays of a mesh file, in the file's own frame, unit and vertex order.
///
/// **Shapes** all arrays per vertex have the length V of `points`.
///
/// **Guarantees** (of every reader) face indices are in range; polygons are split into fans of triangles. A mesh
/// without faces or with NaN coordinates is returned unchanged: the caller decides whether it is an error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawMesh {
    /// V × 3.
    pub points: Vec<[f64; 3]>,
    /// F × 3; empty for a point cloud.
    pub faces: Vec<[u32; 3]>,
    /// Faces with four corners, besides `faces`; readers split them into triangles instead, and only PLY is written with them.
    pub quads: Vec<[u32; 4]>,
    /// sRGB, V × 3.
    pub colors: Option<Vec<[u8; 3]>>,
    /// V × 3, as in the file, not normalised.
    pub normals: Option<Vec<[f64; 3]>>,
    /// V × 2, texture coordinates from the lower left of the picture.
    pub uvs: Option<Vec<[f64; 2]>>,
    /// All other numbers per vertex (`label`, `quality`, …), by their names in the file; each V.
    pub scalars: BTreeMap<String, Vec<f32>>,
    /// The pictures that colour the faces; writers ignore them.
    pub texture: Option<RawTexture>,
    /// What of the file could not be read; writers ignore it.
    pub unread: Vec<UnreadPart>,
    /// What the reader ignored and that does not matter, one sentence each; writers ignore it.
    pub notes: Vec<String>,
}

impl RawMesh {
    /// The mesh, if every face refers to existing vertices.
    pub(super) fn with_indices_checked(self, format: Format) -> Result<Self, FormatError> {
        let vertex_count = self.points.len();
        for (index, face) in self.faces.iter().enumerate() {
            if let Some(v) = face.iter().find(|&&v| v as usize >= vertex_count) {
                return Err(FormatError::Element {
                    format,
                    element: "face".into(),
                    index,
                    expected: format!("vertices below {vertex_count}"),
                    found: format!("vertex {v}"),
                });
            }
        }
        Ok(self)
    }

    /// Gives vertices the mean colour of their faces; those of no face are white.
    ///
    /// **Shapes** `of_faces`: F.
    pub(super) fn color_from_faces(&mut self, of_faces: &[[u8; 3]]) {
        let mut sums = vec![[0u32; 4]; self.points.len()];
        for (face, color) in self.faces.iter().zip(of_faces) {
            for &v in face {
                // Indices are checked later.
                let Some(sum) = sums.get_mut(v as usize) else { continue };
                let [r, g, b] = color.map(u32::from);
                sum.iter_mut().zip([r, g, b, 1]).for_each(|(sum, part)| *sum += part);
            }
        }
        let mean = |sum: &[u32; 4]| match sum[3] {
            0 => [255; 3],
            count => [0, 1, 2].map(|k| ((sum[k] + count / 2) / count) as u8),
        };
        self.colors = Some(sums.iter().map(mean).collect());
    }

    /// Adds a polygon as a fan around its first corner; a polygon of fewer than three corners adds nothing.
    pub(super) fn push_polygon(&mut self, corners: &[u32]) {
        for k in 2..corners.len() {
            self.faces.push([corners[0], corners[k - 1], corners[k]]);
        }
    }
}

/// All bytes of `input`.
pub(super) fn read_all(format: Format, mut input: impl Read) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(|source| FormatError::Io { format, source })?;
    if bytes.is_empty() { Err(FormatError::NoBytes { format }) } else { Ok(bytes) }
}

/// Colours as bytes, from numbers of 0–1, or of 0–255 when any is clearly above 1: rounded and overexposed ones exceed it a
/// little.
pub(super) fn bytes_of_colors(colors: &[[f64; 3]]) -> Vec<[u8; 3]> {
    const CLEARLY_ABOVE: f64 = 2.0;
    let scale = if colors.iter().flatten().any(|&c| c > CLEARLY_ABOVE) { 1.0 } else { 255.0 };
    // `as u8` saturates, and makes 0 of NaN.
    colors.iter().map(|c| c.map(|v| (v * scale).round() as u8)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_faces_meet_at_their_vertices() {
        let mut mesh = RawMesh { points: vec![[0.0; 3]; 5], faces: vec![[0, 1, 2], [2, 1, 3]], ..RawMesh::default() };
        mesh.color_from_faces(&[[200, 0, 10], [100, 0, 20]]);
        assert_eq!(mesh.colors.unwrap(), [[200, 0, 10], [150, 0, 15], [150, 0, 15], [100, 0, 20], [255; 3]]);
    }

    #[test]
    fn a_colour_slightly_above_1_is_no_byte() {
        assert_eq!(bytes_of_colors(&[[1.000_000_1, 0.5, 0.0]]), [[255, 128, 0]]);
        assert_eq!(bytes_of_colors(&[[255.0, 1.0, 0.0]]), [[255, 1, 0]]);
    }

    #[test]
    fn a_polygon_becomes_a_fan() {
        let mut mesh = RawMesh::default();
        mesh.push_polygon(&[4, 5, 6, 7, 8]);
        assert_eq!(mesh.faces, [[4, 5, 6], [4, 6, 7], [4, 7, 8]]);
    }
}
