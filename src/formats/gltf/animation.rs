//! Writes animations of nodes: keys at shared times, linear between them.

use super::write::{AccessorId, GlbWriter, NodeId, check_finite};
use crate::formats::error::FormatError;
use gltf::json::Index;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Animation, Channel, Interpolation, Property, Sampler, Target};
use gltf::json::validation::Checked;
use serde_json::json;

/// How a node moves.
///
/// **Shapes** each list has one entry per time; an empty list moves nothing.
#[derive(Clone, Debug)]
pub struct GlbChannel {
    /// The node.
    pub node: NodeId,
    /// Relative to the parent, in metres.
    pub translations: Vec<[f32; 3]>,
    /// Relative to the parent, quaternions x, y, z, w.
    pub rotations: Vec<[f32; 4]>,
}

impl GlbWriter {
    /// Adds an animation. At each time the nodes in `morphed` have the morph target of that number, and between two times a
    /// blend of both.
    ///
    /// **Shapes** `times_secs` K, increasing; each list of a channel K or empty; the meshes of `morphed` have K targets.
    ///
    /// **Errors** when a number is not finite.
    pub fn animation(
        &mut self,
        name: &str,
        times_secs: &[f32],
        channels: &[GlbChannel],
        morphed: &[NodeId],
    ) -> Result<(), FormatError> {
        let rows: Vec<[f32; 1]> = times_secs.iter().map(|&t| [t]).collect();
        let input = self.keys("times of an animation", Type::Scalar, &rows)?;
        let fold = |f: fn(f32, f32) -> f32| times_secs.iter().copied().reduce(f).unwrap_or(0.0);
        self.root.accessors[input.value()].min = Some(json!([fold(f32::min)]));
        self.root.accessors[input.value()].max = Some(json!([fold(f32::max)]));
        let (mut samplers, mut written) = (Vec::new(), Vec::new());
        let mut add = |output, node, property| {
            let interpolation = Checked::Valid(Interpolation::Linear);
            samplers.push(Sampler { extensions: None, extras: None, input, interpolation, output });
            let target = Target { extensions: None, extras: None, node, path: Checked::Valid(property) };
            let sampler = Index::new(samplers.len() as u32 - 1);
            written.push(Channel { sampler, target, extensions: None, extras: None });
        };
        for channel in channels {
            if !channel.translations.is_empty() {
                let output = self.keys("translations of an animation", Type::Vec3, &channel.translations)?;
                add(output, channel.node, Property::Translation);
            }
            if !channel.rotations.is_empty() {
                let output = self.keys("rotations of an animation", Type::Vec4, &channel.rotations)?;
                add(output, channel.node, Property::Rotation);
            }
        }
        if !morphed.is_empty() {
            let count = times_secs.len();
            let weights: Vec<[f32; 1]> =
                (0..count * count).map(|k| [if k / count == k % count { 1.0 } else { 0.0 }]).collect();
            let output = self.keys("weights of an animation", Type::Scalar, &weights)?;
            morphed.iter().for_each(|node| add(output, *node, Property::MorphTargetWeights));
        }
        let name = Some(name.into());
        self.root.push(Animation { extensions: None, extras: None, channels: written, name, samplers });
        Ok(())
    }

    fn keys<const N: usize>(&mut self, what: &str, kind: Type, rows: &[[f32; N]]) -> Result<AccessorId, FormatError> {
        check_finite(what, rows)?;
        Ok(self.accessor(rows.len(), kind, ComponentType::F32, None, bytemuck::cast_slice(rows.as_flattened())))
    }
}
