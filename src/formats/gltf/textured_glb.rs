//! Writes a mesh with its pictures as `.glb`.

use super::write::{GlbAttribute, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, NodeId, TextureId};
use crate::formats::error::FormatError;
use crate::formats::raw_mesh::RawMesh;
use crate::formats::srgb::byte_of_linear;
use crate::formats::texture::RawTexture;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::io::Write;

/// Writes a mesh with its texture, one part per material. Vertices are doubled where corners have different texture
/// coordinates, as the format requires. Pictures must be PNG; scale and offset of materials are applied to the coordinates.
///
/// **Errors** when a coordinate is not finite, or `out` cannot be written.
pub fn write_textured_glb(mesh: &RawMesh, generator: &str, out: impl Write) -> Result<(), FormatError> {
    let none = RawTexture::default();
    let texture = mesh.texture.as_ref().unwrap_or(&none);
    let mut glb = GlbWriter::new();
    let pictures: Vec<TextureId> = texture.pictures.iter().map(|p| glb.texture(&p.name, &p.bytes)).collect();
    let mut nodes: Vec<NodeId> = Vec::new();
    for place in std::iter::once(None).chain((0..texture.materials.len()).map(Some)) {
        let of_part = |f: usize| texture.material_of(f).map(|(place, _)| place) == place;
        let part = Part::of(mesh, texture, (0..mesh.faces.len()).filter(|&f| of_part(f)));
        if part.faces.is_empty() {
            continue;
        }
        let material = place.map(|place| &texture.materials[place]);
        let name = material.map_or("mesh", |material| material.name.as_str());
        let indices = glb.indices(&part.faces);
        let mut attributes = vec![(GlbAttribute::Positions, glb.positions(&part.points)?)];
        if let Some(coords) = &part.coords {
            attributes.push((GlbAttribute::TexCoords(0), glb.floats("texture coordinates", coords)?));
        }
        let material = material.map(|material| {
            glb.material(&GlbMaterial {
                name,
                color: material.color.map(byte_of_linear),
                texture: material.picture.and_then(|at| pictures.get(at).copied()),
                normal_map: None,
                roughness: 1.0,
                double_sided: false,
            })
        });
        let of_glb = GlbMesh { name, indices, attributes: &attributes, material, extras: Value::Null };
        let of_glb = glb.mesh(&of_glb)?;
        nodes.push(glb.node(&GlbNode { name, mesh: Some(of_glb), ..GlbNode::default() }));
    }
    glb.write(&GlbScene { generator, name: "scan", roots: &nodes, extras: Value::Null, extensions: Map::new() }, out)
}

/// The faces of one material, with vertices of their own.
struct Part {
    points: Vec<[f32; 3]>,
    /// From the upper left, as glTF counts; `None` if a corner has none.
    coords: Option<Vec<[f32; 2]>>,
    faces: Vec<[u32; 3]>,
}

impl Part {
    fn of(mesh: &RawMesh, texture: &RawTexture, faces: impl Iterator<Item = usize>) -> Self {
        let mut part = Self { points: Vec::new(), coords: Some(Vec::new()), faces: Vec::new() };
        let mut known: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
        for f in faces {
            let face = mesh.faces[f];
            let coords = texture.coords_of(f, face);
            if coords.is_none() {
                part.coords = None;
            }
            let corner = |k: usize| {
                let [u, v] = coords.map_or([0.0; 2], |coords| coords[k]);
                let at = [u as f32, (1.0 - v) as f32];
                *known.entry((face[k], at.map(f32::to_bits))).or_insert_with(|| {
                    part.points.push(mesh.points[face[k] as usize].map(|c| c as f32));
                    part.coords.iter_mut().for_each(|coords| coords.push(at));
                    part.points.len() as u32 - 1
                })
            };
            part.faces.push([0, 1, 2].map(corner));
        }
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::gltf::read_gltf;
    use crate::formats::texture::{EncodedPicture, RawMaterial};

    #[test]
    fn a_written_texture_is_read_back() {
        let skin = RawMaterial { name: "skin".into(), picture: Some(0), offset: [0.25, 0.0], ..RawMaterial::default() };
        let cloth = RawMaterial { name: "cloth".into(), color: [1.0, 0.0, 0.0], ..RawMaterial::default() };
        let texture = RawTexture {
            coords: vec![[0.0, 0.25], [0.5, 1.0], [-0.5, 0.5], [0.75, 0.75]],
            corners: Some(vec![[0, 1, 2], [2, 3, 0], [RawTexture::NONE; 3]]),
            face_materials: vec![0, 0, 1],
            materials: vec![skin, cloth],
            pictures: vec![EncodedPicture { name: "a.png".into(), bytes: b"picture".to_vec() }],
        };
        let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]];
        let faces = vec![[0, 1, 2], [2, 1, 3], [0, 3, 1]];
        let mesh = RawMesh { points, faces, texture: Some(texture), ..RawMesh::default() };
        let mut bytes = Vec::new();
        write_textured_glb(&mesh, "test", &mut bytes).unwrap();
        let read = read_gltf(bytes.as_slice()).unwrap();
        let (before, after) = (mesh.texture.as_ref().unwrap(), read.texture.as_ref().unwrap());
        for f in 0..3 {
            let places = |mesh: &RawMesh| mesh.faces[f].map(|v| mesh.points[v as usize]);
            assert_eq!(places(&read), places(&mesh));
            assert_eq!(after.coords_of(f, read.faces[f]), before.coords_of(f, mesh.faces[f]));
            assert_eq!(after.material_of(f).unwrap().1.color, before.material_of(f).unwrap().1.color);
        }
        assert_eq!(after.pictures, before.pictures);
        assert_eq!(
            read.points.len(),
            5 + 3,
            "one end of the seam has two coordinates, and the other material has its own points"
        );
    }
}
