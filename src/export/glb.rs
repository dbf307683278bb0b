//! Writes the figure as a `.glb`: one skin, one node and mesh per layer.
//!
//! Joints are nodes by their VRM names. Attributes of every mesh: `POSITION`, `NORMAL`, `JOINTS_0`, `WEIGHTS_0`,
//! `COLOR_0` and `TEXCOORD_0` where the layer has them, `_PHYSW` (share of cloth physics, 0 where nothing is
//! simulated), `_LAYER` (rank, 0 for the body) and, where cover masks are given, `_COVERED` (1 where layers further out hide
//! the vertex in all evaluated poses, else 0); of garments also `_SEEN` (1 where the scan showed the cloth, 0 where it was
//! filled, or continues under another garment or below hair). As attributes, these survive programs that drop extras or merge meshes.

use super::arguments::{check_figure, check_masks, check_pose};
use super::bones::BoneFrames;
use super::error::ExportError;
use super::format::{CharacterAnimation, CharacterOptions, Format, FormatOption};
use super::palette::color_of_rank;
use super::split::Split;
use crate::body::{Figure, INFLUENCES, Layer, Pose, Skeleton};
use crate::formats::{GlbAttribute, GlbChannel, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, NodeId, SkinId};
use crate::geometry::PerVertex;
use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use std::io::Write;

/// glTF 2.0 as one binary file.
pub struct Glb;

impl Format for Glb {
    fn extension(&self) -> &'static str {
        "glb"
    }

    fn options(&self) -> &'static [FormatOption] {
        &[FormatOption::EightInfluences]
    }

    fn write(&self, figure: &Figure, options: &CharacterOptions, out: &mut dyn Write) -> Result<(), ExportError> {
        write_glb(figure, options, out)
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
    check_figure(figure)?;
    if let Some(pose) = &options.pose {
        check_pose(pose, &figure.skeleton)?;
    }
    if let Some(masks) = &options.covered {
        check_masks(masks, figure)?;
    }
    for animation in &options.animations {
        animation.track.poses.iter().try_for_each(|pose| check_pose(pose, &figure.skeleton))?;
    }
    let mut glb = GlbWriter::new();
    let frames = BoneFrames::of(&figure.skeleton, options.bones);
    let (joints, skin) = add_skeleton(&mut glb, &figure.skeleton, &frames, options.pose.as_ref())?;
    let mut roots = vec![joints[0]];
    let pictures = figure.layers.par_iter().map(picture_of).collect::<Result<Vec<_>, _>>()?;
    for (rank, layer) in figure.layers.iter().enumerate() {
        let covered = options.covered.as_ref().map(|masks| &masks[rank]);
        let picture = pictures[rank].as_deref();
        roots.push(add_layer(&mut glb, layer, picture, covered, rank, skin, options.eight_influences)?);
    }
    for animation in &options.animations {
        add_animation(&mut glb, &figure.skeleton, &frames, &joints, animation)?;
    }
    let provenance: Map<String, Value> = options.provenance.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    let scene = GlbScene {
        generator: concat!("Overcoat ", env!("CARGO_PKG_VERSION")),
        name: options.name.as_deref().unwrap_or("figure"),
        roots: &roots,
        extras: if provenance.is_empty() { Value::Null } else { json!(provenance) },
    };
    Ok(glb.write(&scene, out)?)
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

/// A rotation per joint and frame, and the root's translation. Joints that keep the bind pose have no channel.
fn add_animation(
    glb: &mut GlbWriter,
    skeleton: &Skeleton,
    frames: &BoneFrames,
    joints: &[NodeId],
    animation: &CharacterAnimation,
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
    Ok(glb.animation(&animation.name, &times, &channels)?)
}

/// The texture as a PNG file; slow, so for all layers at once.
fn picture_of(layer: &Layer) -> Result<Option<Vec<u8>>, ExportError> {
    let texture = layer.uvs.as_ref().and_then(|uvs| uvs.texture.as_ref());
    Ok(texture.map(|texture| texture.to_png()).transpose()?)
}

fn add_layer(
    glb: &mut GlbWriter,
    layer: &Layer,
    picture: Option<&[u8]>,
    covered: Option<&PerVertex<bool>>,
    rank: usize,
    skin: SkinId,
    eight_influences: bool,
) -> Result<NodeId, ExportError> {
    let mesh = &layer.mesh;
    let split = Split::along_seams(layer);
    let count = split.vertices.len();
    let points: Vec<[f32; 3]> = split.spread(mesh.points()).map(|p| p.coords.map(|c| c as f32).into()).collect();
    // A vertex without faces has no normal, but glTF requires unit length.
    let normals: Vec<[f32; 3]> = split
        .spread(&mesh.vertex_normals())
        .map(|n| if n.norm_squared() > 0.5 { n.map(|c| c as f32).into() } else { [0.0, 1.0, 0.0] })
        .collect();
    let weights = if eight_influences { layer.weights.clone() } else { layer.weights.with_four_influences() };
    let influences: Vec<Influences> =
        split.spread(weights.rows()).map(|row| gltf_influences(&row.map(|(j, w)| (j.0, w)))).collect();
    let sets = if weights.needs_more_than_four() { INFLUENCES / 4 } else { 1 };
    let physics: Vec<[f32; 1]> = match &layer.physics {
        Some(physics) => split.spread(physics).map(|&w| [w as f32]).collect(),
        None => vec![[0.0]; count],
    };

    let indices = glb.indices(&split.faces);
    let mut attributes = vec![
        (GlbAttribute::Positions, glb.positions(&points)?),
        (GlbAttribute::Normals, glb.floats("normals", &normals)?),
        (GlbAttribute::Extras("PHYSW".into()), glb.floats("physics weights", &physics)?),
        (GlbAttribute::Extras("LAYER".into()), glb.floats("layer ranks", &vec![[rank as f32]; count])?),
    ];
    for set in 0..sets {
        let joints: Vec<[u16; 4]> = influences.iter().map(|(joints, _)| joints[set]).collect();
        let weights: Vec<[f32; 4]> = influences.iter().map(|(_, weights)| weights[set]).collect();
        attributes.push((GlbAttribute::Joints(set as u32), glb.joints(&joints)));
        attributes.push((GlbAttribute::Weights(set as u32), glb.floats("skin weights", &weights)?));
    }
    if let Some(covered) = covered {
        let values: Vec<[f32; 1]> = split.spread(covered).map(|&c| [f32::from(u8::from(c))]).collect();
        attributes.push((GlbAttribute::Extras("COVERED".into()), glb.floats("cover values", &values)?));
    }
    if rank > 0 {
        let values: Vec<[f32; 1]> = match &layer.is_seen {
            Some(is_seen) => split.spread(is_seen).map(|&is| [f32::from(u8::from(is))]).collect(),
            None => vec![[1.0]; count],
        };
        attributes.push((GlbAttribute::Extras("SEEN".into()), glb.floats("seen values", &values)?));
    }
    if !split.uvs.is_empty() {
        attributes.push((GlbAttribute::TexCoords(0), glb.floats("texture coordinates", &split.uvs)?));
    }
    let texture = picture.map(|png| glb.texture(&layer.name, png));
    // Programs multiply vertex colours by the texture, which already contains them.
    let colors = layer.colors.as_ref().filter(|_| texture.is_none());
    if let Some(colors) = colors {
        attributes.push((GlbAttribute::Colors(0), glb.colors(&split.spread(colors).copied().collect::<Vec<_>>())));
    }
    let material = glb.material(&GlbMaterial {
        name: &layer.name,
        // Vertex colours and the texture are multiplied by the material's.
        color: if colors.is_some() || texture.is_some() { [255; 3] } else { color_of_rank(rank) },
        texture,
        roughness: ROUGHNESS,
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
    Ok(glb.node(&GlbNode { name: &layer.name, mesh: Some(mesh), skin: Some(skin), ..GlbNode::default() }))
}

/// Roughness of skin and cloth, 0–1: neither shines, and scanned colours contain shading.
const ROUGHNESS: f32 = 0.9;

/// Joints and weights of a vertex, in glTF's sets of four.
type Influences = ([[u16; 4]; INFLUENCES / 4], [[f32; 4]; INFLUENCES / 4]);

/// Influences in glTF's form: no joint twice, in falling order, unused slots joint 0 with weight 0, and a sum of 1 in `f32`
/// (the validator allows 2e-7 per weight).
fn gltf_influences(row: &[(u16, f64); INFLUENCES]) -> Influences {
    let mut merged: Vec<(u16, f64)> = Vec::with_capacity(INFLUENCES);
    for &(joint, weight) in row.iter().filter(|(_, w)| (*w as f32) > 0.0) {
        match merged.iter_mut().find(|(j, _)| *j == joint) {
            Some((_, sum)) => *sum += weight,
            None => merged.push((joint, weight)),
        }
    }
    merged.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let sum: f64 = merged.iter().map(|(_, w)| w).sum();
    let (mut joints, mut weights) = ([0; INFLUENCES], [0.0; INFLUENCES]);
    for (k, (joint, weight)) in merged.into_iter().enumerate() {
        joints[k] = joint;
        weights[k] = (weight / sum) as f32;
    }
    // The rounding error goes to the strongest; a vertex without weights follows the root.
    weights[0] = (1.0 - weights[1..].iter().map(|&w| f64::from(w)).sum::<f64>()) as f32;
    // The division may have rounded a weight to zero.
    for k in 1..INFLUENCES {
        if weights[k] == 0.0 {
            joints[k] = 0;
        }
    }
    (bytemuck::cast(joints), bytemuck::cast(weights))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn influences_sum_to_one_and_name_no_joint_twice(
            row in prop::array::uniform8((0u16..10, prop_oneof![Just(0.0), 0.0f64..1.0, 1e-45f64..1e-37])),
        ) {
            let (joints, weights) = gltf_influences(&row);
            let (joints, weights) = (joints.concat(), weights.concat());
            let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
            prop_assert!((sum - 1.0).abs() < 2e-7, "{weights:?}");
            for k in 0..INFLUENCES {
                prop_assert!(weights[k] >= 0.0);
                prop_assert!(weights[k] > 0.0 || joints[k] == 0);
                prop_assert!(weights[k] == 0.0 || !(0..k).any(|i| weights[i] > 0.0 && joints[i] == joints[k]));
            }
        }
    }
}
