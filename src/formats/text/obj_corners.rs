//! The corners of an OBJ's faces: vertex, texture coordinate and normal are numbered separately.

use super::lines::line_error;
use crate::formats::error::{Format, FormatError};
use crate::formats::texture::RawTexture;

/// In place of an index.
const NONE: u32 = RawTexture::NONE;

/// A corner of a face.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub vertex: u32,
    uv: u32,
    normal: u32,
}

impl Corner {
    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`; indices count from 1, or backwards from the last of the `counts` so far.
    pub fn parse(token: &str, counts: [usize; 3], line: usize) -> Result<Self, FormatError> {
        let mut indices = [NONE; 3];
        for ((index, field), (count, what)) in indices.iter_mut().zip(token.split('/')).zip(counts.into_iter().zip([
            "vertex",
            "texture coordinate",
            "normal",
        ])) {
            if field.is_empty() {
                continue;
            }
            let from_zero = match field.parse::<i64>() {
                Ok(stated) if stated < 0 => (count as i64).checked_add(stated),
                Ok(stated) if stated > 0 => Some(stated - 1),
                _ => None,
            };
            *index = from_zero
                .and_then(|index| u32::try_from(index).ok())
                .filter(|&index| index != NONE)
                .ok_or_else(|| line_error(Format::Obj, line, format!("the index of a {what}"), token))?;
        }
        let [vertex, uv, normal] = indices;
        if vertex == NONE {
            return Err(line_error(Format::Obj, line, "the index of a vertex", token));
        }
        Ok(Self { vertex, uv, normal })
    }
}

/// The texture coordinates of all corners, and the first normal of each vertex.
#[derive(Default)]
pub(super) struct PerCorner {
    /// One per triangle; shorter if the last triangles have none.
    uvs: Vec<[u32; 3]>,
    triangles: usize,
    /// By vertex; shorter if the last vertices have none.
    normals: Vec<u32>,
    /// The vertices, with their normals, that follow the face that names them.
    early_normals: Vec<(u32, u32)>,
    /// The greatest index of a normal, and the corner that has it.
    greatest_normal: Option<(u32, usize)>,
    corners: usize,
}

impl PerCorner {
    /// Adds the corners of a polygon, as a fan like its faces.
    pub fn push_polygon(&mut self, polygon: &[Corner], vertex_count: usize) {
        if polygon.iter().any(|corner| corner.uv != NONE) {
            self.uvs.resize(self.triangles, [NONE; 3]);
            self.uvs.extend((2..polygon.len()).map(|k| [polygon[0], polygon[k - 1], polygon[k]].map(|c| c.uv)));
        }
        self.triangles += polygon.len().saturating_sub(2);
        for (k, corner) in polygon.iter().enumerate().filter(|(_, corner)| corner.normal != NONE) {
            if self.greatest_normal.is_none_or(|(greatest, _)| corner.normal > greatest) {
                self.greatest_normal = Some((corner.normal, self.corners + k));
            }
            let vertex = corner.vertex as usize;
            if vertex >= vertex_count {
                self.early_normals.push((corner.vertex, corner.normal));
                continue;
            }
            if vertex >= self.normals.len() {
                self.normals.resize(vertex_count, NONE);
            }
            if self.normals[vertex] == NONE {
                self.normals[vertex] = corner.normal;
            }
        }
        self.corners += polygon.len();
    }

    /// Whether all indices are in range.
    pub fn check(&self, uv_count: usize, normal_count: usize) -> Result<(), FormatError> {
        let bad = |corner: usize, what: &str, count: usize, found: u32| FormatError::Element {
            format: Format::Obj,
            element: "corner".into(),
            index: corner,
            expected: format!("a {what} below {count}"),
            found: found.to_string(),
        };
        let out_of_range = |&(_, &uv): &(usize, &u32)| uv != NONE && uv as usize >= uv_count;
        if let Some((corner, &uv)) = self.uvs.as_flattened().iter().enumerate().find(out_of_range) {
            return Err(bad(corner, "texture coordinate", uv_count, uv));
        }
        match self.greatest_normal.filter(|&(normal, _)| normal as usize >= normal_count) {
            Some((normal, corner)) => Err(bad(corner, "normal", normal_count, normal)),
            None => Ok(()),
        }
    }

    /// The first texture coordinate of each vertex, zero for vertices without one; `None` if no corner has one.
    pub fn uvs(&self, faces: &[[u32; 3]], vertex_count: usize, values: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        if self.uvs.is_empty() {
            return None;
        }
        let mut first = vec![NONE; vertex_count];
        for (&vertex, &uv) in faces.as_flattened().iter().zip(self.uvs.as_flattened()) {
            if first[vertex as usize] == NONE {
                first[vertex as usize] = uv;
            }
        }
        Some(taken(&first, values))
    }

    /// The first normal of each vertex, zero for vertices without one; `None` if no corner has one.
    pub fn normals(&mut self, vertex_count: usize, values: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
        self.greatest_normal?;
        let mut first = std::mem::take(&mut self.normals);
        first.resize(vertex_count, NONE);
        for &(vertex, normal) in self.early_normals.iter().rev() {
            if let Some(slot) = first.get_mut(vertex as usize) {
                *slot = normal;
            }
        }
        Some(taken(&first, values))
    }

    /// **Shapes** F × 3, `NONE` for corners without a texture coordinate.
    pub fn into_uv_corners(mut self, face_count: usize) -> Vec<[u32; 3]> {
        self.uvs.resize(face_count, [NONE; 3]);
        self.uvs
    }
}

/// The values of vertices by index, zero for none.
fn taken<const N: usize>(of_vertices: &[u32], values: &[[f64; N]]) -> Vec<[f64; N]> {
    of_vertices.iter().map(|&at| values.get(at as usize).copied().unwrap_or([0.0; N])).collect()
}
