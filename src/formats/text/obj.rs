//! Reads and writes Wavefront OBJ.
//!
//! Vertices keep the file's order and number, which painted masks depend on. `tobj` would lose both: it drops vertices
//! that no face uses (of a point cloud all), duplicates those that two groups share, and names no line in its errors
//! (`position parse error`). It takes 1.73 of our time on 1 million vertices and 2 million faces
//! (`cargo bench --bench files`).

use super::lines::{line_error, lines, number, numbers};
use crate::formats::error::{Format, FormatError};
use crate::formats::raw_mesh::{RawMesh, bytes_of_colors, read_all, unread_texture};
use std::io::{BufWriter, Read, Write};

/// Reads an OBJ: all groups as one mesh, polygons as fans, `v x y z r g b` as colours.
///
/// Of several texture coordinates or normals at a vertex (a seam), the first that a face names is used. Lines,
/// materials, curves and surfaces are skipped.
///
/// **Errors** name the line. OBJ states no counts, so a file that is cut between two lines is only noticed if a face
/// misses its vertices.
pub fn read_obj(input: impl Read) -> Result<RawMesh, FormatError> {
    let bytes = read_all(Format::Obj, input)?;
    let mut parts = ObjMeshBuilder::default();
    for (line, text) in lines(&bytes) {
        let mut tokens = text.split_ascii_whitespace();
        match tokens.next() {
            Some("v") => {
                parts.mesh.points.push(numbers(Format::Obj, line, &mut tokens)?);
                let rest: Vec<&str> = tokens.collect();
                // A fourth number is a weight; three more are a colour, four more a colour with alpha.
                if let [r, g, b] | [r, g, b, _] = rest[..] {
                    let mut color = [0.0; 3];
                    for (value, token) in color.iter_mut().zip([r, g, b]) {
                        *value = number(Format::Obj, line, token)?;
                    }
                    parts.colors.push(color);
                }
            }
            Some("vt") => parts.uvs.push(numbers(Format::Obj, line, &mut tokens)?),
            Some("vn") => parts.normals.push(numbers(Format::Obj, line, &mut tokens)?),
            Some("mtllib") => parts.materials = Some(tokens.collect::<Vec<_>>().join(" ")),
            Some("f") => parts.push_face(line, tokens.collect::<Vec<_>>().as_slice())?,
            Some("v1" | "ply" | "OFF" | "solid" | "glTF") if line == 1 => {
                return Err(FormatError::NotThisFormat { format: Format::Obj, found: format!("'{text}'") });
            }
            _ => {}
        }
    }
    if parts.mesh.points.is_empty() && bytes.contains(&0) {
        return Err(FormatError::NotThisFormat { format: Format::Obj, found: "binary data".into() });
    }
    parts.into_mesh()
}

/// The arrays read so far.
#[derive(Default)]
struct ObjMeshBuilder {
    mesh: RawMesh,
    colors: Vec<[f64; 3]>,
    uvs: Vec<[f64; 2]>,
    normals: Vec<[f64; 3]>,
    /// The file of the materials.
    materials: Option<String>,
    /// (vertex, texture coordinate, normal) of each corner, the latter two if the file has them.
    corners: Vec<(u32, Option<u32>, Option<u32>)>,
}

impl ObjMeshBuilder {
    fn push_face(&mut self, line: usize, tokens: &[&str]) -> Result<(), FormatError> {
        if tokens.len() < 3 {
            return Err(line_error(Format::Obj, line, "a face of three or more corners", &tokens.join(" ")));
        }
        let mut polygon = Vec::with_capacity(tokens.len());
        for token in tokens {
            let mut fields = token.split('/');
            let mut index = |count: usize, what: &str| -> Result<Option<u32>, FormatError> {
                let field = fields.next().unwrap_or("");
                if field.is_empty() {
                    return Ok(None);
                }
                // Counted from 1, or backwards from the last one read.
                let index = match field.parse::<i64>() {
                    Ok(stated) if stated < 0 => Some(count as i64 + stated),
                    Ok(stated) if stated > 0 => Some(stated - 1),
                    _ => None,
                };
                match index.and_then(|index| u32::try_from(index).ok()) {
                    Some(index) => Ok(Some(index)),
                    None => Err(line_error(Format::Obj, line, format!("the index of a {what}"), token)),
                }
            };
            let vertex = index(self.mesh.points.len(), "vertex")?
                .ok_or_else(|| line_error(Format::Obj, line, "the index of a vertex", token))?;
            let uv = index(self.uvs.len(), "texture coordinate")?;
            let normal = index(self.normals.len(), "normal")?;
            polygon.push(vertex);
            self.corners.push((vertex, uv, normal));
        }
        self.mesh.push_polygon(&polygon);
        Ok(())
    }

    fn into_mesh(self) -> Result<RawMesh, FormatError> {
        let mut mesh = self.mesh.with_indices_checked(Format::Obj)?;
        let vertex_count = mesh.points.len();
        if vertex_count > 0 && self.colors.len() == vertex_count {
            mesh.colors = Some(bytes_of_colors(&self.colors));
        }
        mesh.uvs = gathered(vertex_count, &self.uvs, self.corners.iter().map(|c| (c.0, c.1)), "texture coordinate")?;
        // Without texture coordinates, the materials have no texture.
        if let (Some(materials), Some(_), None) = (&self.materials, &mesh.uvs, &mesh.colors) {
            mesh.unread.push(unread_texture(&format!("the texture of the file's materials ('{materials}')")));
        }
        mesh.normals = gathered(vertex_count, &self.normals, self.corners.iter().map(|c| (c.0, c.2)), "normal")?;
        Ok(mesh)
    }
}

/// The first value that a corner assigns to each vertex, zero for vertices without one; `None` if no corner has a value.
fn gathered<const N: usize>(
    vertex_count: usize,
    values: &[[f64; N]],
    corners: impl Iterator<Item = (u32, Option<u32>)>,
    what: &str,
) -> Result<Option<Vec<[f64; N]>>, FormatError> {
    let mut per_vertex: Vec<Option<[f64; N]>> = vec![None; vertex_count];
    let mut any = false;
    for (corner, (vertex, index)) in corners.enumerate() {
        let Some(index) = index else { continue };
        let value = values.get(index as usize).ok_or_else(|| FormatError::Element {
            format: Format::Obj,
            element: "corner".into(),
            index: corner,
            expected: format!("a {what} below {}", values.len()),
            found: index.to_string(),
        })?;
        any = true;
        per_vertex[vertex as usize].get_or_insert(*value);
    }
    Ok(any.then(|| per_vertex.into_iter().map(|v| v.unwrap_or([0.0; N])).collect()))
}

/// Writes an OBJ: colours after the coordinates, `vt`, `vn`; scalars are not written.
///
/// **Guarantees** coordinates are read back with every bit.
pub fn write_obj(mesh: &RawMesh, out: impl Write) -> Result<(), FormatError> {
    let mut out = BufWriter::new(out);
    write_lines(mesh, &mut out).map_err(|source| FormatError::Io { format: Format::Obj, source })
}

fn write_lines(mesh: &RawMesh, out: &mut impl Write) -> std::io::Result<()> {
    for (index, [x, y, z]) in mesh.points.iter().enumerate() {
        match mesh.colors.as_ref().and_then(|c| c.get(index)) {
            Some(color) => {
                let [r, g, b] = color.map(|c| f64::from(c) / 255.0);
                writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
            }
            None => writeln!(out, "v {x} {y} {z}")?,
        }
    }
    for [u, v] in mesh.uvs.iter().flatten() {
        writeln!(out, "vt {u} {v}")?;
    }
    for [x, y, z] in mesh.normals.iter().flatten() {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| u64::from(v) + 1);
        match (&mesh.uvs, &mesh.normals) {
            (None, None) => writeln!(out, "f {a} {b} {c}")?,
            (Some(_), None) => writeln!(out, "f {a}/{a} {b}/{b} {c}/{c}")?,
            (None, Some(_)) => writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?,
            (Some(_), Some(_)) => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?,
        }
    }
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: &str = "# a quad and a triangle, in two groups\nmtllib none.mtl\no first\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\n\
        v 1 1 0 0 0 1\nv 0 1 0 .5 .5 .5\nv 9 9 9 0 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nvn 0 0 1\n\
        g one\nusemtl skin\nf 1/1/1 2/2/1 3/3/1 4/4/1\ng two\ns off\nf -5/5 -4 3/3 # back from the last\n";

    #[test]
    fn order_and_unused_vertices_are_kept() {
        let mesh = read_obj(QUAD.as_bytes()).unwrap();
        assert_eq!(mesh.points.len(), 5);
        assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        assert_eq!(mesh.colors.unwrap()[3], [128; 3]);
        assert_eq!(mesh.uvs.unwrap()[..2], [[0.0, 0.0], [1.0, 0.0]]);
        assert_eq!(mesh.normals.unwrap()[2], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_written_mesh_is_read_back_exactly() {
        let mut mesh = read_obj(QUAD.as_bytes()).unwrap();
        mesh.points[4] = [0.1 + 0.2, -1e-7, 1e7 / 3.0];
        for drop in 0..4 {
            let mut mesh = mesh.clone();
            mesh.normals = mesh.normals.filter(|_| drop & 1 == 0);
            mesh.uvs = mesh.uvs.filter(|_| drop & 2 == 0);
            let mut bytes = Vec::new();
            write_obj(&mesh, &mut bytes).unwrap();
            assert_eq!(read_obj(bytes.as_slice()).unwrap(), mesh);
        }
    }

    #[test]
    fn damage_is_named_by_its_line() {
        for (text, says) in [
            ("v 0 0 0\nv 1 0\n", "line 2: expected 3 numbers, found '2'"),
            ("v 0 0 x\n", "line 1: expected a number, found 'x'"),
            ("v 0 0 0\nf 1 2\n", "line 2: expected a face of three"),
            ("v 0 0 0\nf 1 0 1\n", "line 2: expected the index of a vertex, found '0'"),
            ("v 0 0 0\nf 1 1 -2\n", "line 2: expected the index of a vertex, found '-2'"),
            ("v 0 0 0\nf 1 1 2\n", "face 0: expected vertices below 1, found vertex 1"),
            ("v 0 0 0\nf 1/1 1 1\n", "corner 0: expected a texture coordinate below 0"),
            ("ply\nformat ascii 1.0\n", "this is not OBJ"),
        ] {
            let err = read_obj(text.as_bytes()).unwrap_err();
            assert!(err.to_string().contains(says), "{err}\nshould say: {says}");
        }
    }
}
