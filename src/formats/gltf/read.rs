//! Reads glTF: all meshes of the scene, transformed by their nodes, as one mesh.

use super::accessor::{container, each_row, read_buffers, unsupported};
use super::extensions::{self, Extensions};
use super::materials::GltfMaterials;
use crate::formats::error::{Format, FormatError, beginning};
use crate::formats::plain_text::plain_text;
use crate::formats::raw_mesh::{RawMesh, read_all};
use crate::formats::srgb::byte_of_linear;
use crate::formats::texture::{RawTexture, Siblings, no_siblings};
use gltf::binary::Glb;
use gltf::json::extensions::ENABLED_EXTENSIONS;
use gltf::json::image::MimeType;
use gltf::json::{Root, deserialize};
use gltf::mesh::{Mode, Semantic};
use gltf::{Document, Node, Primitive};
use nalgebra::{Matrix3, Matrix4, Point3, Vector3};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::io::Read;

/// Reads a `.glb`, or a `.gltf` with its buffers embedded.
pub fn read_gltf(input: impl Read) -> Result<RawMesh, FormatError> {
    read_gltf_with(input, &mut no_siblings)
}

/// Reads a `.glb` or a `.gltf`, with the buffers and pictures beside it.
///
/// All primitives of triangles or points in the default scene become one mesh, transformed by their nodes. A skinned
/// mesh is in its bind pose, and its node's transform is ignored, as the standard requires. Colours (`COLOR_0`,
/// linear in the file) become sRGB; where only some primitives have them, the others are white. Float attributes
/// of one number (`_NAME`) become scalars. Of materials, the base colour and its picture are read.
///
/// Quantized numbers and buffers compressed by meshopt are read too.
///
/// **Errors** also for meshes compressed with Draco and for buffers in files that are not there.
pub(in crate::formats) fn read_gltf_with(input: impl Read, siblings: &mut Siblings) -> Result<RawMesh, FormatError> {
    let mut parsed = parse(read_bytes(input)?)?;
    let buffers = parsed.buffers(siblings)?;
    let GltfFile { document: file, ignored, .. } = parsed;
    let mut parts = GltfMeshBuilder::new(buffers, siblings);
    if !ignored.is_empty() {
        parts.mesh.notes.push(format!("ignored what {} says about materials", ignored.join(", ")));
    }

    let scene = file.default_scene().or_else(|| file.scenes().next());
    let mut seen = BTreeSet::new();
    let mut open: Vec<(Node, Matrix4<f64>)> = match &scene {
        Some(scene) => scene.nodes().map(|node| (node, Matrix4::identity())).collect(),
        None => file.nodes().map(|node| (node, Matrix4::identity())).collect(),
    };
    open.reverse();
    while let Some((node, world_from_parent)) = open.pop() {
        if !seen.insert(node.index()) {
            if scene.is_none() {
                continue;
            }
            return Err(container(&format!("node {} is reached twice", node.index())));
        }
        let matrix = Matrix4::from_fn(|r, c| f64::from(node.transform().matrix()[c][r]));
        let world_from_node = world_from_parent * matrix;
        if let Some(mesh) = node.mesh() {
            let placed = if node.skin().is_some() { Matrix4::identity() } else { world_from_node };
            for primitive in mesh.primitives() {
                parts.push(&primitive, &placed)?;
            }
        }
        if scene.is_some() {
            let children: Vec<_> = node.children().map(|child| (child, world_from_node)).collect();
            open.extend(children.into_iter().rev());
        }
    }
    parts.into_mesh()
}

/// The bytes of a file that is glTF and not shorter than it states.
pub(super) fn read_bytes(input: impl Read) -> Result<Vec<u8>, FormatError> {
    let mut bytes = read_all(Format::Gltf, input)?;
    let mark = bytes.len() - plain_text(Format::Gltf, &bytes)?.len();
    bytes.drain(..mark);
    check_length(&bytes)?;
    Ok(bytes)
}

/// A file, before its buffers are read.
pub(super) struct GltfFile {
    /// The JSON, validated.
    pub document: Document,
    /// The binary chunk.
    pub blob: Option<Vec<u8>>,
    pub extensions: Extensions,
    /// Extensions that the file requires for its looks, and that are not read.
    pub ignored: Vec<String>,
}

impl GltfFile {
    /// The buffers of the file, and behind them those that its compressed views have become.
    pub fn buffers(&mut self, siblings: &mut Siblings) -> Result<Vec<Vec<u8>>, FormatError> {
        let compressed = &self.extensions.compressed;
        let own = self.document.buffers().len().saturating_sub(compressed.len());
        let mut buffers = read_buffers(&self.document, own, !compressed.is_empty(), self.blob.take(), siblings)?;
        for view in compressed {
            let bytes = view.decoded(&buffers)?;
            buffers.push(bytes);
        }
        Ok(buffers)
    }
}

/// The JSON as the crate has it, and what its extensions add.
fn root_of(json: &[u8]) -> Result<(Root, Extensions), FormatError> {
    let bad = |e: serde_json::Error| container(&e.to_string());
    if !extensions::are_in(json) {
        return Ok((deserialize::from_slice(json).map_err(bad)?, Extensions::default()));
    }
    let mut value = serde_json::from_slice(json).map_err(bad)?;
    let found = extensions::resolve(&mut value)?;
    Ok((serde_json::from_value(value).map_err(bad)?, found))
}

/// The JSON and the binary chunk.
pub(super) fn parse(mut bytes: Vec<u8>) -> Result<GltfFile, FormatError> {
    check_version(&bytes)?;
    let ((mut root, extensions), chunk) = if bytes.starts_with(b"glTF") {
        let glb = Glb::from_slice(&bytes).map_err(|e| container(&e.to_string()))?;
        // Header, the JSON with its own header, the header of the binary chunk.
        (root_of(&glb.json)?, glb.bin.as_ref().map(|bin| (12 + 8 + glb.json.len() + 8, bin.len())))
    } else {
        (root_of(&bytes)?, None)
    };
    let blob = chunk.map(|(start, length)| {
        // In place: the chunk is nearly the whole file.
        bytes.drain(..start.min(bytes.len()));
        bytes.truncate(length);
        bytes
    });
    let ignored = extensions::take_known(&mut root.extensions_required);
    if let Some(extension) = root.extensions_required.iter().find(|name| !ENABLED_EXTENSIONS.contains(&name.as_str())) {
        return Err(unsupported(&match extension.as_str() {
            "KHR_draco_mesh_compression" => format!("a mesh compressed with Draco ({extension})"),
            _ => format!("the extension {extension}, which the file requires,"),
        }));
    }
    // The crate's validation indexes by these unchecked (gltf-json 1.4.1).
    let accessor_count = root.accessors.len();
    for (index, mesh) in root.meshes.iter().enumerate() {
        for primitive in &mesh.primitives {
            if let Some(bad) = primitive.attributes.values().find(|a| a.value() >= accessor_count) {
                return Err(FormatError::Element {
                    format: Format::Gltf,
                    element: "mesh".into(),
                    index,
                    expected: format!("accessors below {accessor_count}"),
                    found: format!("accessor {bad}"),
                });
            }
        }
    }
    // Nor does it check these (gltf-json 1.4.1).
    let node_count = root.nodes.len();
    for (index, animation) in root.animations.iter().enumerate() {
        if let Some(bad) = animation.channels.iter().find(|c| c.target.node.value() >= node_count) {
            return Err(FormatError::Element {
                format: Format::Gltf,
                element: "animation".into(),
                index,
                expected: format!("nodes below {node_count}"),
                found: format!("node {}", bad.target.node),
            });
        }
    }
    for (index, image) in root.images.iter_mut().enumerate() {
        if image.buffer_view.is_none() && image.uri.is_none() {
            return Err(FormatError::Element {
                format: Format::Gltf,
                element: "image".into(),
                index,
                expected: "a buffer view or a URI".into(),
                found: "neither".into(),
            });
        }
        // A picture is recognised by its content, but the crate needs a type of one in a buffer.
        image.mime_type.get_or_insert_with(|| MimeType("image/png".into()));
    }
    let document = Document::from_json(root).map_err(|e| match e {
        gltf::Error::Validation(all) => {
            let first = all.first().map_or_else(String::new, |(path, error)| format!("{path}: {error}"));
            container(&first)
        }
        other => container(&other.to_string()),
    })?;
    Ok(GltfFile { document, blob, extensions, ignored })
}

/// Refuses other versions than 2, whose JSON means something else.
fn check_version(bytes: &[u8]) -> Result<(), FormatError> {
    if let Some(rest) = bytes.strip_prefix(b"glTF") {
        let version = rest.get(..4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        return match version {
            Some(2) | None => Ok(()),
            Some(other) => Err(unsupported(&format!("a binary of version {other}, not 2,"))),
        };
    }
    #[derive(Deserialize)]
    struct Root {
        asset: Asset,
    }
    #[derive(Deserialize)]
    struct Asset {
        version: String,
    }
    // The glTF reader reports JSON without a version.
    let stated = serde_json::from_slice::<Root>(bytes).ok().map(|root| root.asset.version);
    match stated.as_deref() {
        Some(version) if version != "2" && !version.starts_with("2.") => {
            Err(unsupported(&format!("version {version}, not 2,")))
        }
        _ => Ok(()),
    }
}

/// Refuses bytes that are not glTF, or shorter than the header states.
fn check_length(bytes: &[u8]) -> Result<(), FormatError> {
    if let Some(rest) = bytes.strip_prefix(b"glTF") {
        let stated =
            rest.get(4..8).and_then(|b| b.try_into().ok()).map_or(usize::MAX, |b| u32::from_le_bytes(b) as usize);
        if stated > bytes.len() {
            let count = if stated == usize::MAX { 12 } else { stated };
            let element = "byte".to_string();
            return Err(FormatError::Truncated { format: Format::Gltf, element, index: bytes.len(), count });
        }
        // The crate subtracts the header's 12 bytes unchecked.
        return if stated < 12 { Err(container("its header gives a length below its own")) } else { Ok(()) };
    }
    if bytes.trim_ascii_start().starts_with(b"{") {
        return Ok(());
    }
    Err(FormatError::NotThisFormat { format: Format::Gltf, found: beginning(bytes) })
}

/// The meshes read so far. Attributes that a primitive does not have are padded, so that lengths agree.
struct GltfMeshBuilder<'s, 'f> {
    buffers: Vec<Vec<u8>>,
    mesh: RawMesh,
    misses_normals: bool,
    materials: GltfMaterials<'s, 'f>,
    texture: RawTexture,
}

impl<'s, 'f> GltfMeshBuilder<'s, 'f> {
    fn new(buffers: Vec<Vec<u8>>, siblings: &'s mut Siblings<'f>) -> Self {
        Self {
            buffers,
            mesh: RawMesh::default(),
            misses_normals: false,
            materials: GltfMaterials::new(siblings),
            texture: RawTexture::default(),
        }
    }

    fn push(&mut self, primitive: &Primitive, placed: &Matrix4<f64>) -> Result<(), FormatError> {
        if matches!(primitive.mode(), Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            return Ok(());
        }
        let Some(accessor) = primitive.get(&Semantic::Positions) else {
            return Err(unsupported("a primitive without positions (compressed?)"));
        };
        let (buffers, mesh) = (&self.buffers, &mut self.mesh);
        let points = each_row::<3>(&accessor, buffers, "positions")?;
        let first = mesh.points.len();
        let end = first + points.len();
        mesh.points.extend(points.map(|p| <[f64; 3]>::from(placed.transform_point(&Point3::from(p)).coords)));

        let linear: Matrix3<f64> = placed.fixed_view::<3, 3>(0, 0).into();
        match (primitive.get(&Semantic::Normals), linear.try_inverse()) {
            (Some(accessor), Some(inverse)) => {
                let turn = inverse.transpose();
                let normals = each_row::<3>(&accessor, buffers, "normals")?;
                let turned = normals.map(|n| (turn * Vector3::from(n)).try_normalize(1e-30).unwrap_or_default());
                mesh.normals.get_or_insert_default().extend(turned.map(<[f64; 3]>::from));
                self.misses_normals |= mesh.normals.as_ref().is_some_and(|n| n.len() != end);
            }
            _ => self.misses_normals = true,
        }
        if let Some(accessor) = primitive.get(&Semantic::Colors(0)) {
            let into = mesh.colors.get_or_insert_default();
            into.resize(first, [255; 3]);
            match accessor.dimensions().multiplicity() {
                4 => {
                    let colors = each_row::<4>(&accessor, buffers, "colours")?;
                    into.extend(colors.map(|[r, g, b, _]| [r, g, b].map(byte_of_linear)));
                }
                _ => into.extend(each_row::<3>(&accessor, buffers, "colours")?.map(|c| c.map(byte_of_linear))),
            }
        }
        if let Some(accessor) = primitive.get(&Semantic::TexCoords(0)) {
            let into = mesh.uvs.get_or_insert_default();
            into.resize(first, [0.0; 2]);
            // glTF counts from the upper left.
            into.extend(each_row::<2>(&accessor, buffers, "texture coordinates")?.map(|[u, v]| [u, 1.0 - v]));
        }
        for (semantic, accessor) in primitive.attributes() {
            if let (Semantic::Extras(name), 1) = (semantic, accessor.dimensions().multiplicity()) {
                let into = mesh.scalars.entry(format!("_{name}")).or_default();
                into.resize(first, 0.0);
                into.extend(each_row::<1>(&accessor, buffers, "an attribute")?.map(|v| v[0] as f32));
            }
        }
        let (material, mapping) = self.materials.of(&primitive.material(), buffers)?;
        if let Some(mapping) = mapping
            && let Some(accessor) = primitive.get(&Semantic::TexCoords(mapping.set))
        {
            let into = &mut self.texture.coords;
            into.resize(first, [f32::NAN; 2]);
            into.extend(each_row::<2>(&accessor, buffers, "texture coordinates")?.map(|uv| mapping.placed(uv)));
        }
        // An attribute of another length than the positions is cut or padded like a missing one.
        self.fill(end);
        self.push_faces(primitive, end - first, first as u32, linear.determinant() < 0.0)?;
        self.texture.face_materials.resize(self.mesh.faces.len(), material);
        Ok(())
    }

    fn fill(&mut self, end: usize) {
        let mesh = &mut self.mesh;
        if let Some(colors) = &mut mesh.colors {
            colors.resize(end, [255; 3]);
        }
        if let Some(uvs) = &mut mesh.uvs {
            uvs.resize(end, [0.0; 2]);
        }
        for values in mesh.scalars.values_mut() {
            values.resize(end, 0.0);
        }
        if !self.texture.coords.is_empty() {
            self.texture.coords.resize(end, [f32::NAN; 2]);
        }
    }

    fn push_faces(
        &mut self,
        primitive: &Primitive,
        vertex_count: usize,
        first: u32,
        mirrored: bool,
    ) -> Result<(), FormatError> {
        let mut index = 0;
        let mut checked = |v: u32| {
            index += 1;
            if (v as usize) < vertex_count {
                return Ok(v + first);
            }
            Err(FormatError::Element {
                format: Format::Gltf,
                element: "index".into(),
                index: index - 1,
                expected: format!("vertices below {vertex_count}"),
                found: format!("vertex {v}"),
            })
        };
        let before = self.mesh.faces.len();
        let faces = &mut self.mesh.faces;
        match (primitive.mode(), primitive.indices()) {
            // Most of a large file, so without a copy.
            (Mode::Triangles, Some(accessor)) => {
                let mut corners = each_row::<1>(&accessor, &self.buffers, "indices")?.map(|v| v[0] as u32);
                faces.reserve(accessor.count() / 3);
                while let (Some(a), Some(b), Some(c)) = (corners.next(), corners.next(), corners.next()) {
                    faces.push([checked(a)?, checked(b)?, checked(c)?]);
                }
            }
            (mode, accessor) => {
                let corners: Result<Vec<u32>, FormatError> = match accessor {
                    Some(accessor) => {
                        each_row::<1>(&accessor, &self.buffers, "indices")?.map(|v| checked(v[0] as u32)).collect()
                    }
                    None => (0..vertex_count as u32).map(checked).collect(),
                };
                let corners = corners?;
                match mode {
                    Mode::Triangles => faces.extend(corners.as_chunks::<3>().0),
                    // Every other triangle of a strip has the opposite orientation.
                    Mode::TriangleStrip => faces.extend(
                        (corners.windows(3).enumerate())
                            .map(|(k, w)| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] }),
                    ),
                    Mode::TriangleFan => faces.extend(corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]])),
                    Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {}
                }
            }
        }
        if mirrored {
            faces[before..].iter_mut().for_each(|face| face.swap(1, 2));
        }
        Ok(())
    }

    fn into_mesh(mut self) -> Result<RawMesh, FormatError> {
        if self.misses_normals {
            self.mesh.normals = None;
        }
        let has_colors = self.mesh.colors.is_some();
        let found = self.materials.finish();
        if !has_colors {
            self.mesh.unread = found.unread;
        }
        let differ = || found.materials.windows(2).any(|pair| pair[0].color != pair[1].color);
        if !found.pictures.is_empty() || (!has_colors && differ()) {
            let (materials, pictures) = (found.materials, found.pictures);
            self.mesh.texture = Some(RawTexture { materials, pictures, ..self.texture });
        }
        self.mesh.with_indices_checked(Format::Gltf)
    }
}
