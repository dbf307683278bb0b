//! Writes the figure as a `.glb`: one skin, one node and mesh per layer.
//!
//! Joints are nodes by their VRM names. Attributes of every mesh: `POSITION`, `NORMAL`, `JOINTS_0`, `WEIGHTS_0`,
//! `COLOR_0` and `TEXCOORD_0` where the layer has them, `TANGENT` with a normal map, `_PHYSW` (share of cloth physics, 0 where nothing is
//! simulated), `_LAYER` (rank, 0 for the body) and, where cover masks are given, `_COVERED` (1 where layers further out hide
//! the vertex in all evaluated poses, else 0); of garments also `_SEEN` (1 where the scan showed the cloth, 0 where it was
//! filled, or continues under another garment or below hair), `_MAXDIST` (metres that a vertex may leave its skinned place) and `_EASE`
//! (metres of air below it). As attributes, these survive programs that drop extras or merge meshes.

use crate::bake::tangents;
use crate::body::{Figure, INFLUENCES, Pose, Skeleton, Split};
use crate::export::arguments::check_character;
use crate::export::attributes::{attributes_of, ease_of};
use crate::export::bones::BoneFrames;
use crate::export::encoded::{Companion, Encoded};
use crate::export::engines::{companions, masks};
use crate::export::error::ExportError;
use crate::export::format::{CharacterAnimation, CharacterOptions, Engine, Format, FormatOption};
use crate::export::influences::{Influences, influences_of};
use crate::export::lint::{lint_glb, lint_gltf};
use crate::export::morphs::add_morphs;
use crate::export::palette::{color_of_rank, roughness_of};
use crate::export::pictures::pictures_of;
use crate::formats::{
    GlbAttribute, GlbChannel, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, GltfFiles, NodeId, SkinId, usd_names,
};
use crate::geometry::PerVertex;
use nalgebra::UnitQuaternion;
use serde_json::{Map, Value, json};
use std::io::Write;

/// glTF 2.0 as one binary file.
pub struct Glb;

impl Format for Glb {
    fn extension(&self) -> &'static str {
        "glb"
    }

    fn options(&self) -> &'static [FormatOption] {
        &[
            FormatOption::EightInfluences,
            FormatOption::Cloth,
            FormatOption::NormalMap,
            FormatOption::Engine,
            FormatOption::Pose,
            FormatOption::Bones,
            FormatOption::Rest,
        ]
    }

    fn encode(&self, figure: &Figure, options: &CharacterOptions) -> Result<Encoded, ExportError> {
        let built = build(GlbWriter::new(), figure, options)?;
        let companions = companions(figure, options, &built.ease);
        let mut bytes = Vec::new();
        built.write(options, Map::new(), &mut bytes)?;
        let checks = lint_glb(&bytes, options.stands());
        Ok(Encoded { bytes, companions, checks })
    }
}

/// glTF 2.0 as text, with a file of arrays and a folder of pictures beside it.
pub struct Gltf;

impl Format for Gltf {
    fn extension(&self) -> &'static str {
        "gltf"
    }

    fn options(&self) -> &'static [FormatOption] {
        &[
            FormatOption::EightInfluences,
            FormatOption::Cloth,
            FormatOption::NormalMap,
            FormatOption::Pose,
            FormatOption::Bones,
            FormatOption::Rest,
        ]
    }

    fn encode(&self, figure: &Figure, options: &CharacterOptions) -> Result<Encoded, ExportError> {
        // Neither name needs to be quoted in a URI then.
        let stem = usd_names([options.stem.as_deref().unwrap_or("figure")]).concat();
        let glb = GlbWriter::with_pictures_in(&format!("{stem}_gltf_textures"));
        let built = build(glb, figure, options)?;
        let bin_name = format!("{stem}.bin");
        let roots = built.roots();
        let scene = scene_of(options, &roots, provenance_of(options), Map::new());
        let GltfFiles { json, bin, pictures } = built.glb.into_files(&scene, &bin_name)?;
        let pictures = pictures.into_iter().map(|(path, bytes)| Companion { path, bytes });
        let companions: Vec<Companion> = pictures.chain([Companion { path: bin_name, bytes: bin }]).collect();
        let checks = lint_gltf(&json, &companions, options.stands());
        Ok(Encoded { bytes: json, companions, checks })
    }
}

/// Writes the figure.
///
/// **Frame and units** glTF's, which are ours: metres, Y up, facing +Z in the bind pose.
///
/// **Errors** if the figure or the pose contradicts itself, or holds a number that is not finite; nothing is written then.
///
/// **Guarantees** equal figures give equal bytes; the Khronos validator reports no error and no warning.
pub fn write_glb(figure: &Figure, options: &CharacterOptions, out: impl Write) -> Result<(), ExportError> {
    build(GlbWriter::new(), figure, options)?.write(options, Map::new(), out)
}

/// A file that is complete but for what a further standard adds to it.
pub(super) struct Built {
    glb: GlbWriter,
    /// The nodes of the skeleton's joints.
    pub joints: Vec<NodeId>,
    /// The nodes of the layers.
    pub layers: Vec<NodeId>,
    /// The air below each garment.
    ease: Vec<Option<PerVertex<f32>>>,
}

pub(super) fn build(mut glb: GlbWriter, figure: &Figure, options: &CharacterOptions) -> Result<Built, ExportError> {
    check_character(figure, options)?;
    let frames = BoneFrames::of(&figure.skeleton, options.bones, options.axes);
    let (joints, skin) = add_skeleton(&mut glb, &figure.skeleton, &frames, options.pose.as_ref())?;
    let mut layers = Vec::with_capacity(figure.layers.len());
    let pictures = pictures_of(figure, options)?;
    let ease = ease_of(figure);
    for rank in (0..figure.layers.len()).filter(|&rank| options.has_layer(&figure.layers[rank].name)) {
        let picture = pictures[rank].as_deref();
        layers.push(add_layer(&mut glb, figure, picture, rank, skin, options, ease[rank].as_ref())?);
    }
    for animation in &options.animations {
        let morphed = if animation.cloth.is_some() { &layers[..] } else { &[] };
        add_animation(&mut glb, &figure.skeleton, &frames, &joints, animation, morphed)?;
    }
    Ok(Built { glb, joints, layers, ease })
}

impl Built {
    /// Writes the file, with the objects of further standards by their names.
    pub fn write(
        self,
        options: &CharacterOptions,
        extensions: Map<String, Value>,
        out: impl Write,
    ) -> Result<(), ExportError> {
        let roots = self.roots();
        Ok(self.glb.write(&scene_of(options, &roots, provenance_of(options), extensions), out)?)
    }

    fn roots(&self) -> Vec<NodeId> {
        self.joints.first().into_iter().chain(&self.layers).copied().collect()
    }
}

fn provenance_of(options: &CharacterOptions) -> Value {
    let provenance: Map<String, Value> = options.provenance.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    if provenance.is_empty() { Value::Null } else { json!(provenance) }
}

fn scene_of<'a>(
    options: &'a CharacterOptions,
    roots: &'a [NodeId],
    extras: Value,
    extensions: Map<String, Value>,
) -> GlbScene<'a> {
    let generator = concat!("Overcoat ", env!("CARGO_PKG_VERSION"));
    GlbScene { generator, name: options.name.as_deref().unwrap_or("figure"), roots, extras, extensions }
}

/// Joints as nodes, children before parents, and the skin over them in the skeleton's own order.
fn add_skeleton(
    glb: &mut GlbWriter,
    skeleton: &Skeleton,
    frames: &BoneFrames,
    pose: Option<&Pose>,
) -> Result<(Vec<NodeId>, SkinId), ExportError> {
    let mut nodes: Vec<Option<NodeId>> = vec![None; skeleton.len()];
    for j in skeleton.ids().collect::<Vec<_>>().into_iter().rev() {
        let children: Option<Vec<NodeId>> =
            skeleton.ids().filter(|c| skeleton.parents[c.index()] == Some(j)).map(|c| nodes[c.index()]).collect();
        let children = children.ok_or(ExportError::JointOrder { parent: j.index() })?;
        let about_joint = pose.map_or_else(UnitQuaternion::identity, |pose| pose.rotations[j.index()]);
        // Upright nodes in the bind pose need no rotation.
        let is_turned = pose.is_some() || !frames.is_upright();
        let rotation = is_turned.then(|| frames.local(skeleton, j, &about_joint).coords.map(|c| c as f32).into());
        let offset = frames.offset(skeleton, j, pose);
        nodes[j.index()] = Some(glb.node(&GlbNode {
            name: &skeleton.names[j.index()],
            translation: Some(offset.map(|c| c as f32).into()),
            rotation,
            children: &children,
            ..GlbNode::default()
        }));
    }
    let joints: Vec<NodeId> = nodes.into_iter().flatten().collect();
    let inverse_bind: Vec<[f32; 16]> = skeleton.ids().map(|j| frames.inverse_bind(skeleton, j)).collect();
    let root = joints[0];
    let matrices = glb.matrices("inverse bind matrices", &inverse_bind)?;
    let skin = glb.skin("skeleton", root, &joints, matrices);
    Ok((joints, skin))
}

/// A rotation per joint and frame, and the root's translation. Joints that keep the bind pose have no channel. The layers in
/// `morphed` have a morph target per frame.
fn add_animation(
    glb: &mut GlbWriter,
    skeleton: &Skeleton,
    frames: &BoneFrames,
    joints: &[NodeId],
    animation: &CharacterAnimation,
    morphed: &[NodeId],
) -> Result<(), ExportError> {
    let track = &animation.track;
    let times: Vec<f32> = (0..track.poses.len()).map(|frame| track.secs(frame) as f32).collect();
    let mut channels = Vec::new();
    for (j, &node) in skeleton.ids().zip(joints) {
        let of_node = |pose: &Pose| frames.local(skeleton, j, &pose.rotations[j.index()]).coords;
        let mut before = track.poses.first().map_or_else(Default::default, of_node);
        let mut rotation = |pose: &Pose| -> [f32; 4] {
            let coords = of_node(pose);
            // A quaternion and its negative are one rotation; players that blend without a check need the nearer one.
            before = if coords.dot(&before) < 0.0 { -coords } else { coords };
            before.map(|c| c as f32).into()
        };
        let rotations: Vec<[f32; 4]> = track.poses.iter().map(&mut rotation).collect();
        let is_still = |pose: &Pose| pose.rotations[j.index()].coords.xyz().amax() < 1e-7;
        let still = track.poses.iter().all(is_still);
        let here = skeleton.joints_in_bind[j.index()];
        let place = |pose: &Pose| (here.coords + pose.translation).map(|c| c as f32).into();
        let translations = if j.index() == 0 { track.poses.iter().map(place).collect() } else { Vec::new() };
        let rotations = if still { Vec::new() } else { rotations };
        channels.push(GlbChannel { node, translations, rotations });
    }
    Ok(glb.animation(&animation.name, &times, &channels, morphed)?)
}

fn add_layer(
    glb: &mut GlbWriter,
    figure: &Figure,
    picture: Option<&[u8]>,
    rank: usize,
    skin: SkinId,
    options: &CharacterOptions,
    ease: Option<&PerVertex<f32>>,
) -> Result<NodeId, ExportError> {
    let layer = &figure.layers[rank];
    let mesh = &layer.mesh;
    let split = Split::along_seams(&layer.mesh, layer.uvs.as_ref());
    let points: Vec<[f32; 3]> = split.spread(mesh.points()).map(|p| p.coords.map(|c| c as f32).into()).collect();
    // A vertex without faces has no normal, but glTF requires unit length.
    let normals: Vec<[f32; 3]> = split
        .spread(&mesh.vertex_normals())
        .map(|n| if n.norm_squared() > 0.5 { n.map(|c| c as f32).into() } else { [0.0, 1.0, 0.0] })
        .collect();
    let weights = if options.eight_influences { layer.weights.clone() } else { layer.weights.with_four_influences() };
    let influences: Vec<Influences> =
        split.spread(weights.rows()).map(|row| influences_of(&row.map(|(j, w)| (j.0, w)))).collect();
    let sets = if weights.needs_more_than_four() { INFLUENCES / 4 } else { 1 };

    let indices = glb.indices(&split.faces);
    let mut attributes = vec![
        (GlbAttribute::Positions, glb.positions(&points)?),
        (GlbAttribute::Normals, glb.floats("normals", &normals)?),
    ];
    for set in 0..sets {
        let joints: Vec<[u16; 4]> = influences.iter().map(|(joints, _)| joints[set]).collect();
        let weights: Vec<[f32; 4]> = influences.iter().map(|(_, weights)| weights[set]).collect();
        attributes.push((GlbAttribute::Joints(set as u32), glb.joints(&joints)));
        attributes.push((GlbAttribute::Weights(set as u32), glb.floats("skin weights", &weights)?));
    }
    for (name, values) in attributes_of(layer, rank, options, ease) {
        let values: Vec<[f32; 1]> = split.spread(&values).map(|&value| [value]).collect();
        attributes.push((GlbAttribute::Extras(name.into()), glb.floats(name, &values)?));
    }
    if !split.uvs.is_empty() {
        attributes.push((GlbAttribute::TexCoords(0), glb.floats("texture coordinates", &split.uvs)?));
    }
    let texture = picture.map(|png| glb.texture(&layer.name, png));
    let normal_map = options.normal_maps.get(rank).and_then(Option::as_ref).zip(layer.uvs.as_ref());
    let normal_map = match normal_map {
        Some((map, uvs)) => {
            let tangents = split.of_corners(&tangents(mesh, uvs));
            attributes.push((GlbAttribute::Tangents, glb.floats("tangents", &tangents)?));
            Some(glb.texture(&format!("{} normals", layer.name), &map.to_png()?))
        }
        None => None,
    };
    // Programs multiply vertex colours by the texture, which already contains them.
    let colors = layer.colors.as_ref().filter(|_| texture.is_none() && options.engine != Some(Engine::Unreal));
    if options.engine == Some(Engine::Unreal) && rank > 0 {
        let masks = masks(layer, options.loose.get(rank), ease);
        let masks: Vec<[f32; 3]> = split.spread(&masks).copied().collect();
        attributes.push((GlbAttribute::Colors(0), glb.floats("cloth masks", &masks)?));
    } else if let Some(colors) = colors {
        attributes.push((GlbAttribute::Colors(0), glb.colors(&split.spread(colors).copied().collect::<Vec<_>>())));
    }
    let material = glb.material(&GlbMaterial {
        name: &layer.name,
        // Vertex colours and the texture are multiplied by the material's.
        color: if colors.is_some() || texture.is_some() { [255; 3] } else { color_of_rank(rank) },
        texture,
        normal_map,
        roughness: roughness_of(layer),
        double_sided: rank > 0,
    });
    let mut extras = json!({ "rank": rank });
    for (key, value) in [("template", &layer.template), ("fabric", &layer.fabric)] {
        if let Some(value) = value {
            extras[key] = json!(value);
        }
    }
    let name = &layer.name;
    let mesh = glb.mesh(&GlbMesh { name, indices, attributes: &attributes, material: Some(material), extras })?;
    let simulated = options.animations.iter().find_map(|animation| Some((&animation.track, animation.cloth.as_ref()?)));
    if let Some((track, cloth)) = simulated {
        let morphs = add_morphs(glb, layer, &split, &weights, &figure.skeleton, (track, &cloth[rank]))?;
        glb.morph(mesh, &morphs);
    }
    Ok(glb.node(&GlbNode { name: &layer.name, mesh: Some(mesh), skin: Some(skin), ..GlbNode::default() }))
}
