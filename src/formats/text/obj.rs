//! Reads and writes Wavefront OBJ.
//!
//! Vertices keep the file's order and number, which painted masks depend on. `tobj` would lose both: it drops vertices
//! that no face uses (of a point cloud all), duplicates those that two groups share, and names no line in its errors
//! (`position parse error`). It takes 1.73 of our time on 1 million vertices and 2 million faces
//! (`cargo bench --bench files`).

use super::lines::{LineStream, line_error, number, numbers, without_comment};
use super::obj_corners::{Corner, PerCorner};
use super::obj_materials::NamedMaterials;
use crate::formats::error::{Format, FormatError};
use crate::formats::raw_mesh::{RawMesh, bytes_of_colors};
use crate::formats::texture::{RawTexture, Siblings, UnreadPart, no_siblings};
use std::io::{BufWriter, Read, Write};

/// Reads an OBJ: all groups as one mesh, polygons as fans, `v x y z r g b` and ZBrush's `#MRGB` as colours.
///
/// Of several texture coordinates or normals at a vertex (a seam), the first that a face names is used. Lines,
/// materials, curves and surfaces are skipped.
///
/// **Errors** name the line. OBJ states no counts, so a file that is cut between two lines is only noticed if a face
/// misses its vertices.
pub fn read_obj(input: impl Read) -> Result<RawMesh, FormatError> {
    read_obj_with(input, &mut no_siblings)
}

/// Reads an OBJ like [`read_obj`], with the materials and pictures beside it.
pub(in crate::formats) fn read_obj_with(input: impl Read, siblings: &mut Siblings) -> Result<RawMesh, FormatError> {
    let mut parts = ObjMeshBuilder::default();
    let mut lines = LineStream::new(input);
    let (mut is_empty, mut has_zeros) = (true, false);
    while let Some((line, text)) = lines.next(Format::Obj)? {
        is_empty = false;
        has_zeros |= parts.mesh.points.is_empty() && text.contains(&0);
        parts.push_line(line, text)?;
    }
    if is_empty {
        return Err(FormatError::NoBytes { format: Format::Obj });
    }
    if parts.mesh.points.is_empty() && has_zeros {
        return Err(FormatError::NotThisFormat { format: Format::Obj, found: "binary data".into() });
    }
    parts.into_mesh(siblings)
}

/// The arrays read so far.
#[derive(Default)]
struct ObjMeshBuilder {
    mesh: RawMesh,
    colors: Vec<[f64; 3]>,
    uvs: Vec<[f64; 2]>,
    normals: Vec<[f64; 3]>,
    corners: PerCorner,
    names: NamedMaterials,
    material: Option<u16>,
    /// One per face, once a material was named.
    face_materials: Vec<u16>,
    polygon: Vec<Corner>,
    /// What ZBrush painted, one per vertex.
    painted: Vec<[u8; 3]>,
}

/// `MMRRGGBB` in hexadecimal digits: a mask and a colour.
fn painted_color(digits: &[u8; 8]) -> Option<[u8; 3]> {
    let number = u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    Some([16, 8, 0].map(|shift| (number >> shift) as u8))
}

impl ObjMeshBuilder {
    fn push_line(&mut self, line: usize, text: &[u8]) -> Result<(), FormatError> {
        if let Some(paint) = text.strip_prefix(b"#MRGB ") {
            self.painted.extend(paint.trim_ascii().as_chunks::<8>().0.iter().filter_map(painted_color));
            return Ok(());
        }
        if matches!(text.first(), Some(b'm' | b'u')) {
            self.material = self.names.follow(text).or(self.material);
            return Ok(());
        }
        let text = String::from_utf8_lossy(without_comment(text));
        let mut tokens = text.split_ascii_whitespace();
        match tokens.next() {
            Some("v") => {
                self.mesh.points.push(numbers(Format::Obj, line, &mut tokens)?);
                // A fourth number is a weight; three more are a colour, four more a colour with alpha.
                let rest: [Option<&str>; 5] = std::array::from_fn(|_| tokens.next());
                if let [Some(r), Some(g), Some(b), _, None] = rest {
                    let mut color = [0.0; 3];
                    for (value, token) in color.iter_mut().zip([r, g, b]) {
                        *value = number(Format::Obj, line, token)?;
                    }
                    self.colors.push(color);
                }
            }
            Some("vt") => self.uvs.push(numbers(Format::Obj, line, &mut tokens)?),
            Some("vn") => self.normals.push(numbers(Format::Obj, line, &mut tokens)?),
            Some("f") => {
                self.polygon.clear();
                for token in tokens {
                    let counts = [self.mesh.points.len(), self.uvs.len(), self.normals.len()];
                    self.polygon.push(Corner::parse(token, counts, line)?);
                }
                self.push_face(line, &text)?;
            }
            Some("v1" | "ply" | "OFF" | "solid" | "glTF") if line == 1 => {
                return Err(FormatError::NotThisFormat { format: Format::Obj, found: format!("'{text}'") });
            }
            _ => {}
        }
        Ok(())
    }

    fn push_face(&mut self, line: usize, text: &str) -> Result<(), FormatError> {
        let polygon = &self.polygon;
        if polygon.len() < 3 {
            let corners = text.trim_start_matches('f').trim();
            return Err(line_error(Format::Obj, line, "a face of three or more corners", corners));
        }
        self.corners.push_polygon(polygon, self.mesh.points.len());
        for k in 2..polygon.len() {
            self.mesh.faces.push([polygon[0], polygon[k - 1], polygon[k]].map(|corner| corner.vertex));
        }
        if self.material.is_some() || !self.face_materials.is_empty() {
            let before = self.mesh.faces.len() - (polygon.len() - 2);
            self.face_materials.resize(before, RawTexture::NO_MATERIAL);
            self.face_materials.resize(self.mesh.faces.len(), self.material.unwrap_or(RawTexture::NO_MATERIAL));
        }
        Ok(())
    }

    fn into_mesh(mut self, siblings: &mut Siblings) -> Result<RawMesh, FormatError> {
        let mut mesh = self.mesh.with_indices_checked(Format::Obj)?;
        let vertex_count = mesh.points.len();
        if vertex_count > 0 && self.colors.len() == vertex_count {
            mesh.colors = Some(bytes_of_colors(&self.colors));
        } else if vertex_count > 0 && self.painted.len() == vertex_count {
            mesh.colors = Some(self.painted);
        } else if !self.colors.is_empty() {
            let what = format!("only {} of {vertex_count} vertices have a colour", self.colors.len());
            mesh.unread.push(UnreadPart::colors(what));
        }
        drop(self.colors);
        self.corners.check(self.uvs.len(), self.normals.len())?;
        mesh.normals = self.corners.normals(vertex_count, &self.normals);
        drop(self.normals);
        mesh.uvs = self.corners.uvs(&mesh.faces, vertex_count, &self.uvs);
        if self.names.libraries.is_empty() {
            if mesh.uvs.is_some() && mesh.colors.is_none() && mesh.unread.is_empty() {
                mesh.unread.push(UnreadPart::no_picture());
            }
            return Ok(mesh);
        }
        let found = self.names.find(siblings);
        // A file's own colours of vertices are better than one per material.
        let has_colors = found.have_colors() && (mesh.colors.is_none() || !found.pictures.is_empty());
        if mesh.uvs.is_some() && mesh.colors.is_none() {
            mesh.unread.extend(found.unread);
        } else if mesh.uvs.is_none() && !found.pictures.is_empty() {
            mesh.unread.push(UnreadPart {
                what: format!("the faces have no coordinates in the picture '{}'", found.pictures[0].name),
                remedy: "export the scan again with texture coordinates".into(),
            });
        }
        if has_colors {
            let mut face_materials = self.face_materials;
            let first =
                if found.materials.len() == 1 && self.names.used.is_empty() { 0 } else { RawTexture::NO_MATERIAL };
            face_materials.resize(mesh.faces.len(), first);
            mesh.texture = Some(RawTexture {
                coords: self.uvs.iter().map(|uv| uv.map(|c| c as f32)).collect(),
                corners: Some(self.corners.into_uv_corners(mesh.faces.len())),
                face_materials,
                materials: found.materials,
                pictures: found.pictures,
            });
        }
        Ok(mesh)
    }
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
