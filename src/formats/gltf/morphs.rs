//! Writes morph targets: other places of a mesh's vertices, which an animation blends in.

use super::write::{AccessorId, GlbWriter, MeshId, check_finite};
use crate::formats::error::FormatError;
use gltf::json::accessor::sparse::{Indices, Sparse, Values};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, IndexComponentType, Type};
use gltf::json::buffer::Target;
use gltf::json::mesh::MorphTarget;
use gltf::json::validation::Checked;
use serde_json::json;

/// Bytes of an offset and of its place in a list without the offsets that are zero.
const SPARSE_BYTES: usize = 12 + 4;

/// The offsets of a mesh's vertices in a morph target.
#[derive(Clone, Copy, Debug)]
pub struct GlbMorph {
    /// From [`GlbWriter::offsets`].
    pub positions: AccessorId,
    /// From [`GlbWriter::offsets`].
    pub normals: AccessorId,
}

impl GlbWriter {
    /// Offsets of positions or normals; where many are zero, the file holds the others only.
    ///
    /// **Shapes** `rows` V × 3.
    ///
    /// **Errors** when one is not finite.
    pub fn offsets(&mut self, what: &str, rows: &[[f32; 3]]) -> Result<AccessorId, FormatError> {
        check_finite(what, rows)?;
        let mut moved: Vec<u32> = (0u32..).zip(rows).filter(|(_, row)| **row != [0.0; 3]).map(|(v, _)| v).collect();
        if moved.is_empty() {
            // A list has at least one entry.
            moved.push(0);
        }
        let id = if moved.len() * SPARSE_BYTES < rows.len() * 12 {
            self.sparse(rows, &moved)
        } else {
            self.accessor(
                rows.len(),
                Type::Vec3,
                ComponentType::F32,
                Some(Target::ArrayBuffer),
                bytemuck::cast_slice(rows.as_flattened()),
            )
        };
        let first = rows.first().copied().unwrap_or_default();
        let bound = |f: fn(f32, f32) -> f32| rows.iter().fold(first, |m, p| [0, 1, 2].map(|k| f(m[k], p[k])));
        let accessor = &mut self.root.accessors[id.value()];
        accessor.min = Some(json!(bound(f32::min)));
        accessor.max = Some(json!(bound(f32::max)));
        Ok(id)
    }

    fn sparse(&mut self, rows: &[[f32; 3]], moved: &[u32]) -> AccessorId {
        let indices = self.view(None, bytemuck::cast_slice(moved));
        let offsets: Vec<[f32; 3]> = moved.iter().map(|&v| rows[v as usize]).collect();
        let values = self.view(None, bytemuck::cast_slice(offsets.as_flattened()));
        let sparse = Sparse {
            count: moved.len().into(),
            indices: Indices {
                buffer_view: indices,
                byte_offset: 0usize.into(),
                component_type: Checked::Valid(IndexComponentType(ComponentType::U32)),
                extensions: None,
                extras: None,
            },
            values: Values { buffer_view: values, byte_offset: 0usize.into(), extensions: None, extras: None },
            extensions: None,
            extras: None,
        };
        self.root.push(Accessor {
            buffer_view: None,
            byte_offset: None,
            count: rows.len().into(),
            component_type: Checked::Valid(GenericComponentType(ComponentType::F32)),
            extensions: None,
            extras: None,
            type_: Checked::Valid(Type::Vec3),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: Some(sparse),
        })
    }

    /// Gives a mesh its morph targets; they count nothing until an animation blends them in.
    pub fn morph(&mut self, mesh: MeshId, morphs: &[GlbMorph]) {
        let target = |morph: &GlbMorph| MorphTarget {
            positions: Some(morph.positions),
            normals: Some(morph.normals),
            tangents: None,
        };
        for primitive in &mut self.root.meshes[mesh.value()].primitives {
            primitive.targets = Some(morphs.iter().map(target).collect());
        }
    }
}
