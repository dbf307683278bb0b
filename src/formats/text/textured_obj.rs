//! Writes OBJ with materials.

use crate::formats::error::{Format, FormatError};
use crate::formats::raw_mesh::RawMesh;
use crate::formats::srgb::byte_of_linear;
use crate::formats::texture::{RawMaterial, RawTexture, Wrap};
use std::io::{BufWriter, Write};

/// Writes a mesh with its texture: the OBJ, and its materials, which the OBJ calls `mtl_name`. The pictures are the caller's
/// to write, beside the materials under the names that they have. A mesh without a texture has no materials.
///
/// **Guarantees** coordinates are read back with every bit. Mirrored repetition becomes plain repetition, which is all that
/// the format knows.
pub fn write_textured_obj(mesh: &RawMesh, mtl_name: &str, obj: impl Write, mtl: impl Write) -> Result<(), FormatError> {
    let texture = mesh.texture.clone().unwrap_or_default();
    let (mut obj, mut mtl) = (BufWriter::new(obj), BufWriter::new(mtl));
    write_lines(mesh, &texture, mtl_name, &mut obj)
        .and_then(|()| texture.materials.iter().try_for_each(|m| write_material(m, &texture, &mut mtl)))
        .and_then(|()| mtl.flush())
        .map_err(|source| FormatError::Io { format: Format::Obj, source })
}

fn write_lines(mesh: &RawMesh, texture: &RawTexture, mtl_name: &str, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "mtllib {mtl_name}")?;
    for [x, y, z] in &mesh.points {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [u, v] in &texture.coords {
        writeln!(out, "vt {u} {v}")?;
    }
    let mut current = None;
    for (f, &face) in mesh.faces.iter().enumerate() {
        let material = texture.material_of(f).map(|(place, _)| place);
        if let Some(place) = material.filter(|_| material != current) {
            writeln!(out, "usemtl {}", texture.materials[place].name)?;
            current = material;
        }
        let coords = texture.corners.as_ref().map_or(Some(&face), |corners| corners.get(f));
        write!(out, "f")?;
        for k in 0..3 {
            let v = u64::from(face[k]) + 1;
            match coords.map(|coords| coords[k]).filter(|&at| (at as usize) < texture.coords.len()) {
                Some(at) => write!(out, " {v}/{}", u64::from(at) + 1)?,
                None => write!(out, " {v}")?,
            }
        }
        writeln!(out)?;
    }
    out.flush()
}

fn write_material(material: &RawMaterial, texture: &RawTexture, out: &mut impl Write) -> std::io::Result<()> {
    let [r, g, b] = material.color.map(|c| f64::from(byte_of_linear(c)) / 255.0);
    writeln!(out, "newmtl {}\nKd {r} {g} {b}", material.name)?;
    let Some(picture) = material.picture.and_then(|place| texture.pictures.get(place)) else { return Ok(()) };
    write!(out, "map_Kd")?;
    for (option, values, usual) in [("-s", material.scale, 1.0), ("-o", material.offset, 0.0)] {
        if values != [usual; 2] {
            write!(out, " {option} {} {}", values[0], values[1])?;
        }
    }
    if material.wrap == [Wrap::Clamp; 2] {
        write!(out, " -clamp on")?;
    }
    writeln!(out, " {}", picture.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::text::obj::read_obj_with;
    use crate::formats::texture::EncodedPicture;

    #[test]
    fn a_written_texture_is_read_back_exactly() {
        let skin = RawMaterial {
            name: "my skin".into(),
            picture: Some(0),
            scale: [2.0, 0.5],
            offset: [0.0, -0.25],
            wrap: [Wrap::Clamp; 2],
            ..RawMaterial::default()
        };
        let cloth = RawMaterial { name: "cloth".into(), color: [1.0, 0.0, 0.0], ..RawMaterial::default() };
        let texture = RawTexture {
            coords: vec![[0.1, 0.2], [0.3, 1.4], [-0.5, 0.6]],
            corners: Some(vec![[0, 1, 2], [2, 1, RawTexture::NONE]]),
            face_materials: vec![0, 1],
            materials: vec![skin, cloth],
            pictures: vec![EncodedPicture { name: "a b.png".into(), bytes: b"picture".to_vec() }],
        };
        let mesh = RawMesh {
            points: vec![[0.1, 0.2, 0.3], [1.0, 0.0, 0.0], [0.0, 1.0, 1e-9]],
            faces: vec![[0, 1, 2], [2, 1, 0]],
            texture: Some(texture),
            ..RawMesh::default()
        };
        let (mut obj, mut mtl) = (Vec::new(), Vec::new());
        write_textured_obj(&mesh, "my scan.mtl", &mut obj, &mut mtl).unwrap();
        let read = read_obj_with(obj.as_slice(), &mut |name| match name {
            "my scan.mtl" => Some(mtl.clone()),
            "a b.png" => Some(b"picture".to_vec()),
            _ => None,
        })
        .unwrap();
        assert_eq!(read.texture, mesh.texture);
        assert_eq!((read.points, read.faces), (mesh.points, mesh.faces));
    }
}
