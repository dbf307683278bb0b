//! Writes a `.glb` piece by piece: arrays become accessors, accessors meshes, meshes nodes.
//!
//! Every accessor has its own buffer view, aligned to 4 bytes; positions have bounds; JSON keys are sorted. The meaning
//! of the pieces (layers, joints, weights) is the caller's. Types and JSON come from `gltf-json`.

use crate::formats::error::{Format, FormatError};
use crate::formats::srgb::linear_of_byte;
use gltf::binary::{Glb, Header};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Buffer, Target, View};
use gltf::json::extras::RawValue;
use gltf::json::image::MimeType;
use gltf::json::material::{EmissiveFactor, NormalTexture, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Asset, Extras, Image, Index, Material, Mesh, Node, Root, Scene, Skin, Texture, serialize};
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::io::Write;

pub use gltf::Semantic as GlbAttribute;

/// An array in the file.
pub type AccessorId = Index<Accessor>;
/// A material.
pub type MaterialId = Index<Material>;
/// A mesh.
pub type MeshId = Index<Mesh>;
/// A node.
pub type NodeId = Index<Node>;
/// A skin.
pub type SkinId = Index<Skin>;
/// A picture for a material.
pub type TextureId = Index<Texture>;

/// What a node holds. Rotation is a quaternion x, y, z, w.
#[derive(Clone, Debug, Default)]
pub struct GlbNode<'a> {
    /// The name that other programs list.
    pub name: &'a str,
    /// Relative to the parent, in metres; `None` for none.
    pub translation: Option<[f32; 3]>,
    /// Relative to the parent; `None` for none.
    pub rotation: Option<[f32; 4]>,
    /// Nodes added earlier.
    pub children: &'a [NodeId],
    /// The mesh at this node.
    pub mesh: Option<MeshId>,
    /// The skin that deforms the mesh.
    pub skin: Option<SkinId>,
}

/// A material of glTF's metallic-roughness model.
#[derive(Clone, Debug)]
pub struct GlbMaterial<'a> {
    /// The name that other programs list.
    pub name: &'a str,
    /// sRGB; multiplies vertex colours and the texture.
    pub color: [u8; 3],
    /// The picture that `TEXCOORD_0` maps.
    pub texture: Option<TextureId>,
    /// The normal map, which `TEXCOORD_0` maps too.
    pub normal_map: Option<TextureId>,
    /// From 0 (mirror) to 1 (matt).
    pub roughness: f32,
    /// Whether the back is drawn, as for a sheet of cloth.
    pub double_sided: bool,
}

/// One mesh of one primitive of triangles.
#[derive(Clone, Debug)]
pub struct GlbMesh<'a> {
    /// The name that other programs list.
    pub name: &'a str,
    /// From [`GlbWriter::indices`].
    pub indices: AccessorId,
    /// All of one length; `GlbAttribute::Extras("NAME")` is `_NAME` in the file.
    pub attributes: &'a [(GlbAttribute, AccessorId)],
    /// `None` for glTF's default material.
    pub material: Option<MaterialId>,
    /// Application data, an object or null.
    pub extras: Value,
}

/// The scene that a program shows when it opens the file, and the file's origin.
#[derive(Clone, Debug)]
pub struct GlbScene<'a> {
    /// Program and version.
    pub generator: &'a str,
    /// The name that other programs list.
    pub name: &'a str,
    /// The nodes without parents.
    pub roots: &'a [NodeId],
    /// Application data for the whole file, an object or null.
    pub extras: Value,
    /// What other standards add to the file, by their names.
    pub extensions: Map<String, Value>,
}

/// A `.glb` that is being built, or a `.gltf` with its files.
#[derive(Debug, Default)]
pub struct GlbWriter {
    bin: Vec<u8>,
    pub(super) root: Root,
    /// The pictures of a `.gltf`; `None` for a `.glb`, which holds them itself.
    beside: Option<PicturesBeside>,
}

/// Pictures in a folder beside a `.gltf`.
#[derive(Debug)]
struct PicturesBeside {
    folder: String,
    /// By their paths relative to the `.gltf`.
    pictures: Vec<(String, Vec<u8>)>,
}

/// A `.gltf` and its files.
#[derive(Clone, Debug)]
pub struct GltfFiles {
    /// The `.gltf` itself.
    pub json: Vec<u8>,
    /// Its arrays.
    pub bin: Vec<u8>,
    /// Its pictures, by their paths relative to it.
    pub pictures: Vec<(String, Vec<u8>)>,
}

impl GlbWriter {
    /// An empty file.
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty file whose pictures are in a folder beside it.
    ///
    /// **Requires** a folder's name of letters, digits and underscores.
    pub fn with_pictures_in(folder: &str) -> Self {
        let beside = PicturesBeside { folder: folder.into(), pictures: Vec::new() };
        Self { beside: Some(beside), ..Self::default() }
    }

    /// Appends bytes to the binary chunk.
    pub(super) fn view(&mut self, target: Option<Target>, bytes: &[u8]) -> Index<View> {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(offset.into()),
            byte_stride: None,
            name: None,
            target: target.map(Checked::Valid),
            extensions: None,
            extras: None,
        })
    }

    pub(super) fn accessor(
        &mut self,
        count: usize,
        kind: Type,
        component: ComponentType,
        target: Option<Target>,
        bytes: &[u8],
    ) -> AccessorId {
        let view = self.view(target, bytes);
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: count.into(),
            component_type: Checked::Valid(GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Checked::Valid(kind),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        })
    }

    /// The corners of triangles, in 16 bits where they fit.
    ///
    /// **Shapes** `faces` F × 3.
    pub fn indices(&mut self, faces: &[[u32; 3]]) -> AccessorId {
        let corners = faces.as_flattened();
        // The greatest value of a type restarts a primitive, so it is not an index.
        let narrow = corners.iter().all(|&v| v < u32::from(u16::MAX));
        let bytes: Vec<u8> = if narrow {
            corners.iter().flat_map(|&v| (v as u16).to_le_bytes()).collect()
        } else {
            corners.iter().flat_map(|v| v.to_le_bytes()).collect()
        };
        let component = if narrow { ComponentType::U16 } else { ComponentType::U32 };
        self.accessor(corners.len(), Type::Scalar, component, Some(Target::ElementArrayBuffer), &bytes)
    }

    /// Positions, with the bounds that the standard requires.
    ///
    /// **Shapes** `points` V × 3.
    ///
    /// **Errors** when one is not finite, as in [`GlbWriter::floats`].
    pub fn positions(&mut self, points: &[[f32; 3]]) -> Result<AccessorId, FormatError> {
        let id = self.floats("positions", points)?;
        let fold = |start: f32, f: fn(f32, f32) -> f32| {
            points.iter().fold([start; 3], |m, p| [f(m[0], p[0]), f(m[1], p[1]), f(m[2], p[2])])
        };
        if !points.is_empty() {
            let accessor = &mut self.root.accessors[id.value()];
            accessor.min = Some(json!(fold(f32::INFINITY, f32::min)));
            accessor.max = Some(json!(fold(f32::NEG_INFINITY, f32::max)));
        }
        Ok(id)
    }

    /// Any attribute of 1 to 4 floats per vertex.
    ///
    /// **Shapes** `rows` V × N.
    ///
    /// **Errors** when one is not finite: names `what` and the first such row.
    pub fn floats<const N: usize>(&mut self, what: &str, rows: &[[f32; N]]) -> Result<AccessorId, FormatError> {
        let kind = const {
            match N {
                1 => Type::Scalar,
                2 => Type::Vec2,
                3 => Type::Vec3,
                4 => Type::Vec4,
                // At compile time: `floats::<5>` does not build.
                _ => panic!("glTF has vectors of 2, 3 and 4"),
            }
        };
        check_finite(what, rows)?;
        let bytes = bytemuck::cast_slice(rows.as_flattened());
        Ok(self.accessor(rows.len(), kind, ComponentType::F32, Some(Target::ArrayBuffer), bytes))
    }

    /// 4 × 4 matrices by column, for a skin.
    ///
    /// **Shapes** `matrices` J × 16.
    pub fn matrices(&mut self, what: &str, matrices: &[[f32; 16]]) -> Result<AccessorId, FormatError> {
        check_finite(what, matrices)?;
        let bytes = bytemuck::cast_slice(matrices.as_flattened());
        Ok(self.accessor(matrices.len(), Type::Mat4, ComponentType::F32, None, bytes))
    }

    /// Four joints per vertex, as places in the skin's list; in 8 bits where they fit.
    ///
    /// **Shapes** `joints` V × 4.
    pub fn joints(&mut self, joints: &[[u16; 4]]) -> AccessorId {
        let narrow = joints.as_flattened().iter().all(|&j| j <= u16::from(u8::MAX));
        let bytes: Vec<u8> = if narrow {
            joints.as_flattened().iter().map(|&j| j as u8).collect()
        } else {
            joints.as_flattened().iter().flat_map(|j| j.to_le_bytes()).collect()
        };
        let component = if narrow { ComponentType::U8 } else { ComponentType::U16 };
        self.accessor(joints.len(), Type::Vec4, component, Some(Target::ArrayBuffer), &bytes)
    }

    /// Opaque colours, given as sRGB, stored as linear light in 16 bits.
    ///
    /// **Shapes** `srgb` V × 3.
    pub fn colors(&mut self, srgb: &[[u8; 3]]) -> AccessorId {
        let bytes: Vec<u8> = srgb
            .iter()
            .flat_map(|c| {
                let [r, g, b] = c.map(|byte| (linear_of_byte(byte) * f64::from(u16::MAX)).round() as u16);
                [r, g, b, u16::MAX]
            })
            .flat_map(u16::to_le_bytes)
            .collect();
        let id = self.accessor(srgb.len(), Type::Vec4, ComponentType::U16, Some(Target::ArrayBuffer), &bytes);
        self.root.accessors[id.value()].normalized = true;
        id
    }

    /// Adds a picture, the bytes of a PNG file, as a texture.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> TextureId {
        let uri = self.beside.as_mut().map(|PicturesBeside { folder, pictures }| {
            // The number keeps names apart that are equal without their special letters.
            let plain = name.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
            let path = format!("{folder}/{}-{plain}.png", pictures.len());
            pictures.push((path.clone(), png.to_vec()));
            path
        });
        let view = uri.is_none().then(|| self.view(None, png));
        let source = self.root.push(Image {
            buffer_view: view,
            mime_type: Some(MimeType("image/png".into())),
            name: Some(name.into()),
            uri,
            extensions: None,
            extras: None,
        });
        self.root.push(Texture { name: None, sampler: None, source, extensions: None, extras: None })
    }

    /// Adds a material.
    pub fn material(&mut self, material: &GlbMaterial) -> MaterialId {
        let [r, g, b] = material.color.map(|byte| linear_of_byte(byte) as f32);
        let texture = material.texture.map(|index| gltf::json::texture::Info {
            index,
            tex_coord: 0,
            extensions: None,
            extras: None,
        });
        self.root.push(Material {
            name: Some(material.name.into()),
            double_sided: material.double_sided,
            normal_texture: material.normal_map.map(|index| NormalTexture {
                index,
                scale: 1.0,
                tex_coord: 0,
                extensions: None,
                extras: None,
            }),
            emissive_factor: EmissiveFactor([0.0; 3]),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor([r, g, b, 1.0]),
                base_color_texture: texture,
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(material.roughness),
                ..PbrMetallicRoughness::default()
            },
            ..Material::default()
        })
    }

    /// Adds a mesh.
    ///
    /// **Errors** if the extras are not JSON that glTF can hold.
    pub fn mesh(&mut self, mesh: &GlbMesh) -> Result<MeshId, FormatError> {
        let primitive = Primitive {
            attributes: mesh.attributes.iter().map(|(name, id)| (Checked::Valid(name.clone()), *id)).collect(),
            extensions: None,
            extras: None,
            indices: Some(mesh.indices),
            material: mesh.material,
            mode: Checked::Valid(Mode::Triangles),
            targets: None,
        };
        let (name, extras) = (Some(mesh.name.into()), raw_extras(&mesh.extras)?);
        Ok(self.root.push(Mesh { extensions: None, extras, name, primitives: vec![primitive], weights: None }))
    }

    /// Adds a node; its children come first.
    pub fn node(&mut self, node: &GlbNode) -> NodeId {
        self.root.push(Node {
            children: (!node.children.is_empty()).then(|| node.children.to_vec()),
            mesh: node.mesh,
            name: Some(node.name.into()),
            rotation: node.rotation.map(UnitQuaternion),
            translation: node.translation,
            skin: node.skin,
            ..Node::default()
        })
    }

    /// Adds a skin: joints, and the matrices that take bind-pose points into each joint's own frame.
    ///
    /// **Shapes** `joints` J; `inverse_bind` J matrices, in the order of `joints`.
    pub fn skin(&mut self, name: &str, root: NodeId, joints: &[NodeId], inverse_bind: AccessorId) -> SkinId {
        self.root.push(Skin {
            extensions: None,
            extras: None,
            inverse_bind_matrices: Some(inverse_bind),
            joints: joints.to_vec(),
            name: Some(name.into()),
            skeleton: Some(root),
        })
    }

    /// Writes the file.
    ///
    /// **Errors** when the file would be longer than a `.glb` can be (4 GiB), or `out` cannot be written.
    pub fn write(mut self, scene: &GlbScene, mut out: impl Write) -> Result<(), FormatError> {
        let json = self.complete(scene, None)?;
        let chunk = |bytes: usize| 8 + bytes.next_multiple_of(4);
        let total = 12 + chunk(json.len()) + if self.bin.is_empty() { 0 } else { chunk(self.bin.len()) };
        let length = u32::try_from(total)
            .map_err(|_| FormatError::Unsupported { format: Format::Gltf, what: format!("a file of {total} bytes") })?;
        let glb = Glb {
            header: Header { magic: *b"glTF", version: 2, length },
            json: Cow::Owned(json),
            bin: (!self.bin.is_empty()).then_some(Cow::Owned(self.bin)),
        };
        let io = |source| FormatError::Io { format: Format::Gltf, source };
        glb.to_writer(&mut out).map_err(|e| match e {
            gltf::Error::Io(source) => io(source),
            other => FormatError::Container { format: Format::Gltf, reason: other.to_string() },
        })?;
        out.flush().map_err(io)
    }

    /// The `.gltf`, with its arrays in a file of that name.
    pub fn into_files(mut self, scene: &GlbScene, bin_name: &str) -> Result<GltfFiles, FormatError> {
        let json = self.complete(scene, Some(bin_name))?;
        let pictures = self.beside.map(|beside| beside.pictures).unwrap_or_default();
        Ok(GltfFiles { json, bin: self.bin, pictures })
    }

    /// Adds what concerns the whole file; `bin_name` is the file of its arrays, `None` for the file itself.
    fn complete(&mut self, scene: &GlbScene, bin_name: Option<&str>) -> Result<Vec<u8>, FormatError> {
        self.root.asset =
            Asset { generator: Some(scene.generator.into()), extras: raw_extras(&scene.extras)?, ..Asset::default() };
        let (name, nodes) = (Some(scene.name.into()), scene.roots.to_vec());
        self.root.scene = Some(self.root.push(Scene { extensions: None, extras: None, name, nodes }));
        if !self.bin.is_empty() {
            let byte_length = USize64::from(self.bin.len());
            let uri = bin_name.map(String::from);
            self.root.push(Buffer { byte_length, name: None, uri, extensions: None, extras: None });
        }
        // Through a value, whose keys are sorted: the bytes do not depend on the order of the crate's fields.
        let mut json = serialize::to_value(&self.root).map_err(not_json)?;
        if !scene.extensions.is_empty() {
            json["extensionsUsed"] = scene.extensions.keys().cloned().collect();
            json["extensions"] = Value::Object(scene.extensions.clone());
        }
        Ok(json.to_string().into_bytes())
    }
}

pub(super) fn check_finite<const N: usize>(what: &str, rows: &[[f32; N]]) -> Result<(), FormatError> {
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

/// Application data as the JSON text that `gltf-json` keeps; null is no data.
fn raw_extras(extras: &Value) -> Result<Extras, FormatError> {
    if extras.is_null() {
        return Ok(None);
    }
    RawValue::from_string(extras.to_string()).map(Some).map_err(not_json)
}

fn not_json(error: gltf::json::Error) -> FormatError {
    FormatError::Container { format: Format::Gltf, reason: error.to_string() }
}
