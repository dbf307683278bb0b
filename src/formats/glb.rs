//! A `.glb` built piece by piece: arrays become accessors, accessors meshes, meshes nodes.
//!
//! One buffer view an accessor, all aligned to 4 bytes; bounds on positions; JSON keys sorted. What it means (layers,
//! joints, weights) its caller knows.

use super::error::{Format, FormatError};
use super::srgb::linear_of_byte;
use serde_json::{Map, Value, json};
use std::io::Write;

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name(usize);
    )*};
}
ids!(
    /// An array in the file.
    AccessorId,
    /// A material.
    MaterialId,
    /// A mesh.
    MeshId,
    /// A node.
    NodeId,
    /// A skin.
    SkinId,
    /// A picture for a material.
    TextureId
);

/// A node before it is one. Rotation is a quaternion x, y, z, w.
#[derive(Clone, Debug, Default)]
pub struct GlbNode<'a> {
    /// Shown in every program's outline.
    pub name: &'a str,
    /// Relative to the parent; `None` for none.
    pub translation: Option<[f32; 3]>,
    /// Relative to the parent; `None` for none.
    pub rotation: Option<[f32; 4]>,
    /// Nodes made earlier.
    pub children: &'a [NodeId],
    /// What is drawn here.
    pub mesh: Option<MeshId>,
    /// What moves it.
    pub skin: Option<SkinId>,
    /// Application data, an object or null.
    pub extras: Value,
}

/// A material of glTF's metallic-roughness model.
#[derive(Clone, Debug)]
pub struct GlbMaterial<'a> {
    /// Shown in every program's outline.
    pub name: &'a str,
    /// sRGB; multiplies vertex colours and the texture.
    pub color: [u8; 3],
    /// The picture that `TEXCOORD_0` maps.
    pub texture: Option<TextureId>,
    /// 0 mirror, 1 chalk.
    pub roughness: f32,
    /// Whether the back is drawn: cloth is a sheet.
    pub double_sided: bool,
}

/// One mesh of one primitive of triangles.
#[derive(Clone, Debug)]
pub struct GlbMesh<'a> {
    /// Shown in every program's outline.
    pub name: &'a str,
    /// From [`GlbWriter::indices`].
    pub indices: AccessorId,
    /// By glTF name: `POSITION`, `NORMAL`, `COLOR_0`, `JOINTS_0`, `_ANYTHING`, …
    pub attributes: &'a [(&'a str, AccessorId)],
    /// How it looks.
    pub material: Option<MaterialId>,
    /// Application data, an object or null.
    pub extras: Value,
}

/// What is shown when the file is opened, and who made it.
#[derive(Clone, Debug)]
pub struct GlbScene<'a> {
    /// Program and version.
    pub generator: &'a str,
    /// Shown in every program's outline.
    pub name: &'a str,
    /// Nodes without parents.
    pub roots: &'a [NodeId],
    /// Application data for the whole file, an object or null.
    pub extras: Value,
}

/// A `.glb` in the making.
#[derive(Debug, Default)]
pub struct GlbWriter {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    images: Vec<Value>,
    textures: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    skins: Vec<Value>,
}

/// glTF's numbers for component types.
#[derive(Clone, Copy)]
enum Component {
    U8 = 5121,
    U16 = 5123,
    U32 = 5125,
    F32 = 5126,
}

/// glTF's numbers for what a buffer view is for.
#[derive(Clone, Copy)]
enum Target {
    Vertices = 34962,
    Indices = 34963,
}

impl GlbWriter {
    /// An empty file.
    pub fn new() -> Self {
        Self::default()
    }

    fn accessor(
        &mut self,
        count: usize,
        kind: &str,
        component: Component,
        target: Option<Target>,
        bytes: &[u8],
    ) -> AccessorId {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target as u32);
        }
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component as u32, "count": count, "type": kind,
        }));
        AccessorId(self.accessors.len() - 1)
    }

    /// The corners of triangles, in 16 bits where they fit.
    pub fn indices(&mut self, faces: &[[u32; 3]]) -> AccessorId {
        let corners = faces.as_flattened();
        // The greatest value of a type restarts a primitive, so it is no index.
        let narrow = corners.iter().all(|&v| v < u32::from(u16::MAX));
        let bytes: Vec<u8> = if narrow {
            corners.iter().flat_map(|&v| (v as u16).to_le_bytes()).collect()
        } else {
            corners.iter().flat_map(|v| v.to_le_bytes()).collect()
        };
        let component = if narrow { Component::U16 } else { Component::U32 };
        self.accessor(corners.len(), "SCALAR", component, Some(Target::Indices), &bytes)
    }

    /// Positions, with the bounds that the standard wants of them.
    ///
    /// **Errors** when one is not finite, as in [`GlbWriter::floats`].
    pub fn positions(&mut self, points: &[[f32; 3]]) -> Result<AccessorId, FormatError> {
        let id = self.floats("positions", points)?;
        let fold = |start: f32, f: fn(f32, f32) -> f32| {
            points.iter().fold([start; 3], |m, p| [f(m[0], p[0]), f(m[1], p[1]), f(m[2], p[2])])
        };
        if !points.is_empty() {
            self.accessors[id.0]["min"] = json!(fold(f32::INFINITY, f32::min));
            self.accessors[id.0]["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        Ok(id)
    }

    /// Any attribute of 1 to 4 floats a vertex.
    ///
    /// **Errors** when one is not finite: `what` and the first such row are named.
    pub fn floats<const N: usize>(&mut self, what: &str, rows: &[[f32; N]]) -> Result<AccessorId, FormatError> {
        let kind = const {
            match N {
                1 => "SCALAR",
                2 => "VEC2",
                3 => "VEC3",
                4 => "VEC4",
                _ => panic!("glTF has vectors of 2, 3 and 4"),
            }
        };
        check_finite(what, rows)?;
        Ok(self.accessor(
            rows.len(),
            kind,
            Component::F32,
            Some(Target::Vertices),
            bytemuck::cast_slice(rows.as_flattened()),
        ))
    }

    /// 4 × 4 matrices by column, for a skin.
    pub fn matrices(&mut self, what: &str, matrices: &[[f32; 16]]) -> Result<AccessorId, FormatError> {
        check_finite(what, matrices)?;
        Ok(self.accessor(matrices.len(), "MAT4", Component::F32, None, bytemuck::cast_slice(matrices.as_flattened())))
    }

    /// Four joints a vertex, by their place in the skin; in 8 bits where they fit.
    pub fn joints(&mut self, joints: &[[u16; 4]]) -> AccessorId {
        let narrow = joints.as_flattened().iter().all(|&j| j <= u16::from(u8::MAX));
        let bytes: Vec<u8> = if narrow {
            joints.as_flattened().iter().map(|&j| j as u8).collect()
        } else {
            joints.as_flattened().iter().flat_map(|j| j.to_le_bytes()).collect()
        };
        let component = if narrow { Component::U8 } else { Component::U16 };
        self.accessor(joints.len(), "VEC4", component, Some(Target::Vertices), &bytes)
    }

    /// Opaque colours, given as sRGB, stored as linear light in 16 bits.
    pub fn colors(&mut self, srgb: &[[u8; 3]]) -> AccessorId {
        let bytes: Vec<u8> = srgb
            .iter()
            .flat_map(|c| {
                let [r, g, b] = c.map(|byte| (linear_of_byte(byte) * f64::from(u16::MAX)).round() as u16);
                [r, g, b, u16::MAX]
            })
            .flat_map(u16::to_le_bytes)
            .collect();
        let id = self.accessor(srgb.len(), "VEC4", Component::U16, Some(Target::Vertices), &bytes);
        self.accessors[id.0]["normalized"] = json!(true);
        id
    }

    /// Adds a picture, the bytes of a PNG file, as a texture.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> TextureId {
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": png.len() }));
        self.bin.extend_from_slice(png);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.images.push(json!({ "name": name, "mimeType": "image/png", "bufferView": self.views.len() - 1 }));
        self.textures.push(json!({ "source": self.images.len() - 1 }));
        TextureId(self.textures.len() - 1)
    }

    /// Adds a material.
    pub fn material(&mut self, material: &GlbMaterial) -> MaterialId {
        let [r, g, b] = material.color.map(linear_of_byte);
        let mut surface = json!({
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": material.roughness,
        });
        if let Some(texture) = material.texture {
            surface["baseColorTexture"] = json!({ "index": texture.0 });
        }
        self.materials.push(json!({
            "name": material.name,
            "pbrMetallicRoughness": surface,
            "doubleSided": material.double_sided,
        }));
        MaterialId(self.materials.len() - 1)
    }

    /// Adds a mesh.
    pub fn mesh(&mut self, mesh: &GlbMesh) -> MeshId {
        let attributes: Map<String, Value> =
            mesh.attributes.iter().map(|&(name, id)| (name.to_string(), json!(id.0))).collect();
        let mut primitive = json!({ "attributes": attributes, "indices": mesh.indices.0 });
        if let Some(material) = mesh.material {
            primitive["material"] = json!(material.0);
        }
        let mut value = json!({ "name": mesh.name, "primitives": [primitive] });
        set_extras(&mut value, &mesh.extras);
        self.meshes.push(value);
        MeshId(self.meshes.len() - 1)
    }

    /// Adds a node; its children come first.
    pub fn node(&mut self, node: &GlbNode) -> NodeId {
        let mut value = json!({ "name": node.name });
        if let Some(translation) = node.translation {
            value["translation"] = json!(translation);
        }
        if let Some(rotation) = node.rotation {
            value["rotation"] = json!(rotation);
        }
        if !node.children.is_empty() {
            value["children"] = node.children.iter().map(|c| json!(c.0)).collect();
        }
        if let Some(mesh) = node.mesh {
            value["mesh"] = json!(mesh.0);
        }
        if let Some(skin) = node.skin {
            value["skin"] = json!(skin.0);
        }
        set_extras(&mut value, &node.extras);
        self.nodes.push(value);
        NodeId(self.nodes.len() - 1)
    }

    /// Adds a skin: joints, and the matrices that take bind-pose points into each joint's own frame.
    pub fn skin(&mut self, name: &str, root: NodeId, joints: &[NodeId], inverse_bind: AccessorId) -> SkinId {
        let joints: Vec<usize> = joints.iter().map(|j| j.0).collect();
        self.skins.push(json!({
            "name": name, "skeleton": root.0, "joints": joints, "inverseBindMatrices": inverse_bind.0,
        }));
        SkinId(self.skins.len() - 1)
    }

    /// Puts everything together.
    ///
    /// **Errors** when the file would be longer than glTF can say (4 GiB).
    pub fn write(mut self, scene: &GlbScene, mut out: impl Write) -> Result<(), FormatError> {
        let roots: Vec<usize> = scene.roots.iter().map(|r| r.0).collect();
        let mut root = json!({
            "asset": { "version": "2.0", "generator": scene.generator },
            "scene": 0,
            "scenes": [{ "name": scene.name, "nodes": roots }],
        });
        set_extras(&mut root["asset"], &scene.extras);
        if !self.bin.is_empty() {
            root["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let lists = [
            ("bufferViews", &mut self.views),
            ("accessors", &mut self.accessors),
            ("materials", &mut self.materials),
            ("images", &mut self.images),
            ("textures", &mut self.textures),
            ("meshes", &mut self.meshes),
            ("nodes", &mut self.nodes),
            ("skins", &mut self.skins),
        ];
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root[name] = Value::Array(std::mem::take(list));
        }
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');

        let mut bytes = Vec::with_capacity(28 + text.len() + self.bin.len());
        let bin_bytes = if self.bin.is_empty() { 0 } else { 8 + self.bin.len() };
        let length = u32::try_from(12 + 8 + text.len() + bin_bytes).map_err(|_| FormatError::Unsupported {
            format: Format::Gltf,
            what: format!("a file of {} bytes", text.len() + self.bin.len()),
        })?;
        bytes.extend(b"glTF");
        bytes.extend(2u32.to_le_bytes());
        bytes.extend(length.to_le_bytes());
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(b"JSON");
        bytes.extend(text);
        if !self.bin.is_empty() {
            bytes.extend((self.bin.len() as u32).to_le_bytes());
            bytes.extend(b"BIN\0");
            bytes.extend(&self.bin);
        }
        out.write_all(&bytes)
            .and_then(|()| out.flush())
            .map_err(|source| FormatError::Io { format: Format::Gltf, source })
    }
}

fn check_finite<const N: usize>(what: &str, rows: &[[f32; N]]) -> Result<(), FormatError> {
    match rows.iter().position(|row| row.iter().any(|x| !x.is_finite())) {
        Some(index) => Err(FormatError::Element {
            format: Format::Gltf,
            element: what.into(),
            index,
            expected: "finite numbers".into(),
            found: format!("{:?}", rows[index]),
        }),
        None => Ok(()),
    }
}

fn set_extras(value: &mut Value, extras: &Value) {
    if !extras.is_null() {
        value["extras"] = extras.clone();
    }
}
