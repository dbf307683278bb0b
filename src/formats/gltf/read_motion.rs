//! Reads an animation of a glTF file: the nodes as joints, sampled at an even rate.

use super::accessor::{container, rows};
use super::read::{GltfFile, parse, read_bytes};
use super::samplers::{Curve, Interpolated};
use crate::formats::error::{Format, FormatError};
use crate::formats::motion::{RawJoint, RawMotion, RawTransform};
use crate::formats::texture::no_siblings;
use gltf::animation::Property;
use gltf::{Animation, Document, Node, Skin};
use nalgebra::{Isometry3, Matrix3, Matrix4, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;

/// Frames per second at which programs bake animations.
const RATES: [f64; 9] = [24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0];
/// Frames per second where the keys show no rate.
const USUAL_RATE: f64 = 30.0;
/// Most frames of an animation, against times that are no times: 9 hours at 30 per second.
const MOST_FRAMES: f64 = 1e6;

/// Reads an animation of a `.glb`, `.vrma`, or `.gltf` with its buffers embedded: the one of the name `wanted`, or the first.
///
/// The joints are those of all skins with all nodes above them, or all nodes of a file without a skin; VRM's names of
/// human bones replace those of nodes. Their rest pose is that of the skins' inverse bind matrices where they have them, else
/// that of the nodes. All interpolations are
/// sampled at the rate of the keys, or at 30 frames per second where the keys are irregular. Scales multiply the
/// translations below; scales that change over time are not read.
///
/// **Errors** also for a file without an animation, or without the wanted one.
pub fn read_gltf_motion(input: impl Read, wanted: Option<&str>) -> Result<RawMotion, FormatError> {
    let mut parsed = parse(read_bytes(input)?)?;
    let buffers = parsed.buffers(&mut no_siblings)?;
    let GltfFile { document: file, extensions, .. } = parsed;
    let mut notes = Vec::new();
    let animation = chosen(&file, wanted, &mut notes)?;
    let name = animation.name().map(String::from);
    let nodes = Nodes::of(&file, extensions.bone_names)?;
    let curves = Curves::read(&animation, &buffers, &mut notes)?;
    let (joints, frames) = (nodes.joints(&buffers)?, curves.sampled(&nodes)?);
    Ok(RawMotion { name, joints, frame_secs: Some(1.0 / curves.rate), frames, notes })
}

/// The animation of a name, or the first; the others are noted.
fn chosen<'a>(file: &'a Document, wanted: Option<&str>, notes: &mut Vec<String>) -> Result<Animation<'a>, FormatError> {
    let Some(first) = file.animations().next() else {
        return Err(FormatError::Missing { format: Format::Gltf, what: "animation" });
    };
    let name_of =
        |animation: &Animation| animation.name().map_or_else(|| format!("{}", animation.index()), String::from);
    let names = || file.animations().map(|animation| name_of(&animation)).collect::<Vec<_>>();
    let Some(wanted) = wanted else {
        if file.animations().len() > 1 {
            let all = names();
            notes.push(format!(
                "the file has {} animations, '{}'; the first is used: --clip-name takes another",
                all.len(),
                all.join("', '")
            ));
        }
        return Ok(first);
    };
    let found = file.animations().find(|animation| name_of(animation) == wanted);
    found.ok_or_else(|| FormatError::NoSuchAnimation { wanted: wanted.into(), names: names() })
}

/// The nodes that are read as joints, parents first.
struct Nodes<'a> {
    list: Vec<Node<'a>>,
    parents: Vec<Option<usize>>,
    /// The scale that all nodes above apply to the translation of a node.
    scales: Vec<Vector3<f64>>,
    skins: Vec<Skin<'a>>,
    /// Names by node that replace those of the nodes.
    names: BTreeMap<usize, String>,
}

impl<'a> Nodes<'a> {
    fn of(file: &'a Document, names: BTreeMap<usize, String>) -> Result<Self, FormatError> {
        let skins: Vec<Skin> = file.skins().collect();
        let mut above: BTreeMap<usize, usize> = BTreeMap::new();
        for node in file.nodes() {
            for child in node.children() {
                if above.insert(child.index(), node.index()).is_some() {
                    return Err(container(&format!("node {} has two parents", child.index())));
                }
            }
        }
        // A cycle has no root, so its nodes are never reached.
        let mut open: Vec<(Node, Option<usize>, Vector3<f64>)> = file
            .nodes()
            .filter(|node| !above.contains_key(&node.index()))
            .map(|node| (node, None, Vector3::repeat(1.0)))
            .collect();
        open.reverse();
        // The joints of the skins and all nodes above them.
        let mut wanted: Option<BTreeSet<usize>> = None;
        for joint in skins.iter().flat_map(Skin::joints) {
            let wanted = wanted.get_or_insert_default();
            let mut at = Some(joint.index());
            while let Some(index) = at.filter(|&index| wanted.insert(index)) {
                at = above.get(&index).copied();
            }
        }
        let (mut list, mut parents, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        while let Some((node, parent, scale)) = open.pop() {
            if wanted.as_ref().is_some_and(|wanted| !wanted.contains(&node.index())) {
                continue;
            }
            let index = list.len();
            let own = Vector3::from(node.transform().decomposed().2.map(f64::from));
            let below = open.len();
            open.extend(node.children().map(|child| (child, Some(index), scale.component_mul(&own))));
            open[below..].reverse();
            list.push(node);
            parents.push(parent);
            scales.push(scale);
        }
        if list.is_empty() {
            return Err(FormatError::Missing { format: Format::Gltf, what: "node to animate" });
        }
        Ok(Self { list, parents, scales, skins, names })
    }

    fn own_transform(&self, n: usize) -> Result<RawTransform, FormatError> {
        let (translation, rotation, _) = self.list[n].transform().decomposed();
        let translation = Vector3::from(translation.map(f64::from)).component_mul(&self.scales[n]);
        let rotation = Quaternion::from(rotation.map(f64::from));
        let is_finite = translation.iter().chain(rotation.coords.iter()).all(|x| x.is_finite());
        match UnitQuaternion::try_new(rotation, 1e-9) {
            Some(rotation) if is_finite => {
                Ok(RawTransform { translation: translation.into(), rotation: rotation.into_inner().coords.into() })
            }
            _ => Err(FormatError::Element {
                format: Format::Gltf,
                element: "node".into(),
                index: self.list[n].index(),
                expected: "a finite translation and a rotation".into(),
                found: format!("{:?}", self.list[n].transform()),
            }),
        }
    }

    /// The joints in their rest pose.
    fn joints(&self, buffers: &[Vec<u8>]) -> Result<Vec<RawJoint>, FormatError> {
        let bound = self.bound(buffers)?;
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.list.len());
        let mut joints = Vec::with_capacity(self.list.len());
        for (n, node) in self.list.iter().enumerate() {
            let own = self.own_transform(n)?;
            let above = self.parents[n].map_or_else(Isometry3::identity, |parent| world[parent]);
            let here = bound.get(&node.index()).copied().unwrap_or_else(|| above * isometry(&own));
            let local = above.inv_mul(&here);
            world.push(here);
            joints.push(RawJoint {
                name: self.name_of(node),
                parent: self.parents[n],
                rest: RawTransform {
                    translation: local.translation.vector.into(),
                    rotation: local.rotation.into_inner().coords.into(),
                },
                end: None,
            });
        }
        Ok(joints)
    }

    fn name_of(&self, node: &Node) -> String {
        let named = self.names.get(&node.index()).map(String::as_str).or_else(|| node.name());
        named.map_or_else(|| format!("node {}", node.index()), String::from)
    }

    /// Where the skins were bound, by node: the inverses of their matrices, without their scales. Of a node of several skins,
    /// the first counts.
    fn bound(&self, buffers: &[Vec<u8>]) -> Result<BTreeMap<usize, Isometry3<f64>>, FormatError> {
        let placed = |m: &[f64; 16]| {
            let inverse = Matrix4::from_column_slice(m).try_inverse().filter(|m| m.iter().all(|x| x.is_finite()))?;
            let linear: Matrix3<f64> = inverse.fixed_view::<3, 3>(0, 0).into();
            let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&linear));
            let translation = Translation3::from(Vector3::new(inverse[(0, 3)], inverse[(1, 3)], inverse[(2, 3)]));
            Some(Isometry3::from_parts(translation, rotation))
        };
        let mut bound = BTreeMap::new();
        for skin in &self.skins {
            let Some(accessor) = skin.inverse_bind_matrices() else { continue };
            let matrices = rows::<16>(&accessor, buffers, "inverse bind matrices")?;
            for (node, matrix) in skin.joints().zip(&matrices) {
                if let Some(placed) = placed(matrix) {
                    bound.entry(node.index()).or_insert(placed);
                }
            }
        }
        Ok(bound)
    }
}

fn isometry(t: &RawTransform) -> Isometry3<f64> {
    let rotation = UnitQuaternion::new_unchecked(Quaternion::from(t.rotation));
    Isometry3::from_parts(Translation3::from(Vector3::from(t.translation)), rotation)
}

/// What moves which node, and the times to sample.
struct Curves {
    translations: BTreeMap<usize, Curve<3>>,
    rotations: BTreeMap<usize, Curve<4>>,
    start: f64,
    end: f64,
    rate: f64,
}

impl Curves {
    fn read(animation: &Animation, buffers: &[Vec<u8>], notes: &mut Vec<String>) -> Result<Self, FormatError> {
        let (mut translations, mut rotations) = (BTreeMap::new(), BTreeMap::new());
        let mut times: Vec<Vec<f64>> = Vec::new();
        let mut has_scales = false;
        for channel in animation.channels() {
            let (sampler, node) = (channel.sampler(), channel.target().node().index());
            match channel.target().property() {
                Property::Translation => {
                    let curve = Curve::read(&sampler, buffers, "translations")?;
                    times.push(curve.times().to_vec());
                    translations.insert(node, curve);
                }
                Property::Rotation => {
                    let curve = Curve::read(&sampler, buffers, "rotations")?;
                    times.push(curve.times().to_vec());
                    rotations.insert(node, curve);
                }
                Property::Scale => {
                    // Programs bake constant scales for every bone.
                    let curve: Curve<3> = Curve::read(&sampler, buffers, "scales")?;
                    has_scales |= !curve.is_constant();
                }
                Property::MorphTargetWeights => {}
            }
        }
        if has_scales {
            notes.push("bones change their scale in the animation, which is not read".into());
        }
        let ends = times.iter().filter_map(|t| Some((*t.first()?, *t.last()?)));
        let (start, end) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (c, d)| (a.min(c), b.max(d)));
        if start > end {
            return Err(FormatError::Missing { format: Format::Gltf, what: "animation of rotations or translations" });
        }
        let rate = rate_of(&times);
        if (end - start) * rate > MOST_FRAMES {
            let what = format!("an animation of {:.0} seconds", end - start);
            return Err(FormatError::Unsupported { format: Format::Gltf, what });
        }
        Ok(Self { translations, rotations, start, end, rate })
    }

    /// The transforms of all nodes, frame by frame.
    fn sampled(&self, nodes: &Nodes) -> Result<Vec<Vec<RawTransform>>, FormatError> {
        let own: Vec<RawTransform> = (0..nodes.list.len()).map(|n| nodes.own_transform(n)).collect::<Result<_, _>>()?;
        // The last key may be a little early by rounding to f32.
        let count = ((self.end - self.start) * self.rate + 1e-3).floor() as usize + 1;
        let frame = |k: usize| {
            let time = (self.start + k as f64 / self.rate).min(self.end);
            let of = |(n, node): (usize, &Node)| {
                let translation = self
                    .translations
                    .get(&node.index())
                    .map(|curve| Vector3::from(curve.at(time)).component_mul(&nodes.scales[n]).into());
                RawTransform {
                    translation: translation.unwrap_or(own[n].translation),
                    rotation: self.rotations.get(&node.index()).map_or(own[n].rotation, |curve| curve.at(time)),
                }
            };
            nodes.list.iter().enumerate().map(of).collect()
        };
        Ok((0..count).map(frame).collect())
    }
}

/// The rate of the keys: that of the curve with the most of them, if it is a usual one.
fn rate_of(times: &[Vec<f64>]) -> f64 {
    let Some(most) = times.iter().max_by_key(|t| t.len()) else { return USUAL_RATE };
    let mut gaps: Vec<f64> = most.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 0.0).collect();
    gaps.sort_by(f64::total_cmp);
    let Some(median) = gaps.get(gaps.len() / 2) else { return USUAL_RATE };
    // Times are f32: a key after a minute is off by 4 µs, 0.05 % of a frame at 120 per second.
    RATES.into_iter().find(|rate| (rate * median - 1.0).abs() < 5e-3).unwrap_or(USUAL_RATE)
}
