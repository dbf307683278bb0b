//! What extensions of glTF change in a file before it is read: compressed buffers, pictures of other formats, names of bones.

use super::accessor::{container, unsupported};
use crate::formats::error::FormatError;
use meshopt::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
    decode_index_sequence, decode_vertex_buffer,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Names of what the JSON is searched for; without any of them it is read as it is.
const CHANGING: [&str; 6] = [
    "meshopt_compression",
    "EXT_texture_webp",
    "KHR_texture_basisu",
    "EXT_texture_avif",
    "MSFT_texture_dds",
    "humanBones",
];
/// Required extensions that are read.
const READ: [&str; 8] = [
    "KHR_mesh_quantization",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_texture_webp",
    "KHR_texture_basisu",
    "EXT_texture_avif",
    "MSFT_texture_dds",
    "VRMC_vrm_animation",
];
/// Beginnings of required extensions without which places and base colours are the same.
const HARMLESS: [&str; 9] = [
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "KHR_lights_",
    "EXT_lights_",
    "VRMC_",
    "KHR_xmp",
    "KHR_node_visibility",
    "MSFT_lod",
];

/// What the JSON says besides what the crate reads.
#[derive(Default)]
pub(super) struct Extensions {
    /// Compressed buffer views, each of which has become a buffer of its own behind those of the file.
    pub compressed: Vec<CompressedView>,
    /// Names of human bones by node.
    pub bone_names: BTreeMap<usize, String>,
}

/// A buffer view compressed by meshopt.
///
/// **Source** EXT_meshopt_compression.
pub(super) struct CompressedView {
    buffer: usize,
    offset: usize,
    length: usize,
    stride: usize,
    count: usize,
    mode: Mode,
    filter: Filter,
}

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, PartialEq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Of the required extensions, those that stand in the way: neither read nor harmless. The others are taken out of the list,
/// and the names of those that are ignored are returned.
pub(super) fn take_known(required: &mut Vec<String>) -> Vec<String> {
    let is_harmless = |name: &String| HARMLESS.iter().any(|start| name.starts_with(start));
    let ignored = required.iter().filter(|name| is_harmless(name)).cloned().collect();
    required.retain(|name| !READ.contains(&name.as_str()) && !is_harmless(name));
    ignored
}

/// Whether extensions change what the JSON means.
pub(super) fn are_in(json: &[u8]) -> bool {
    CHANGING.iter().any(|name| json.windows(name.len()).any(|window| window == name.as_bytes()))
}

/// Writes the JSON as if there were no such extensions, and returns what is then missing in it.
pub(super) fn resolve(root: &mut Value) -> Result<Extensions, FormatError> {
    for texture in list_mut(root, "textures") {
        // A picture of a usual format is preferred to that of the extension.
        if texture.get("source").is_none()
            && let Some(source) = extension_source(texture)
        {
            texture["source"] = source;
        }
    }
    let bone_names = bone_names(root);
    let buffer_count = list_mut(root, "buffers").len();
    let mut compressed = Vec::new();
    for (index, view) in list_mut(root, "bufferViews").iter_mut().enumerate() {
        let extension = ["EXT_meshopt_compression", "KHR_meshopt_compression"]
            .iter()
            .find_map(|name| view.get("extensions")?.get(name));
        let Some(found) = extension.map(CompressedView::read) else { continue };
        let found =
            found.ok_or_else(|| container(&format!("the compression of buffer view {index} is not described")))?;
        let mut plain = json!({ "buffer": buffer_count + compressed.len(), "byteLength": found.size() });
        if found.mode == Mode::Attributes {
            plain["byteStride"] = json!(found.stride);
        }
        *view = plain;
        compressed.push(found);
    }
    if let Some(buffers) = root.get_mut("buffers").and_then(Value::as_array_mut) {
        buffers.extend(compressed.iter().map(|view| json!({ "byteLength": view.size() })));
    }
    Ok(Extensions { compressed, bone_names })
}

fn list_mut<'a>(root: &'a mut Value, key: &str) -> &'a mut [Value] {
    root.get_mut(key).and_then(Value::as_array_mut).map_or(&mut [], Vec::as_mut_slice)
}

/// The picture that an extension gives a texture.
pub(super) fn extension_source(texture: &Value) -> Option<Value> {
    let extensions = texture.get("extensions")?;
    let names = ["EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"];
    names.iter().find_map(|name| extensions.get(name)?.get("source").cloned())
}

/// The bones of a VRM 1.0 figure or animation.
fn bone_names(root: &Value) -> BTreeMap<usize, String> {
    let of = |extension: &str| root.pointer(&format!("/extensions/{extension}/humanoid/humanBones"))?.as_object();
    let bones = of("VRMC_vrm_animation").or_else(|| of("VRMC_vrm"));
    let named = bones
        .into_iter()
        .flatten()
        .filter_map(|(bone, of)| Some((usize::try_from(of.get("node")?.as_u64()?).ok()?, bone.clone())));
    named.collect()
}

impl CompressedView {
    fn read(extension: &Value) -> Option<Self> {
        let number = |key: &str| usize::try_from(extension.get(key)?.as_u64()?).ok();
        let word = |key: &str| extension.get(key).and_then(Value::as_str);
        let mode = match word("mode")? {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            _ => return None,
        };
        let filter = match word("filter") {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some("COLOR") => Filter::Color,
            Some(_) => return None,
        };
        let found = Self {
            buffer: number("buffer")?,
            offset: number("byteOffset").unwrap_or(0),
            length: number("byteLength")?,
            stride: number("byteStride")?,
            count: number("count")?,
            mode,
            filter,
        };
        // Sixteen equal bytes are packed into a quarter of one, so a larger promise is none.
        let most = found.length.checked_mul(64)?.checked_add(1 << 16)?;
        (found.stride > 0 && found.count.checked_mul(found.stride)? <= most).then_some(found)
    }

    fn size(&self) -> usize {
        self.count * self.stride
    }

    /// The bytes of the view, decoded from the buffers of the file.
    pub fn decoded(&self, buffers: &[Vec<u8>]) -> Result<Vec<u8>, FormatError> {
        let end = self.offset.checked_add(self.length);
        let encoded = buffers.get(self.buffer).zip(end).and_then(|(buffer, end)| buffer.get(self.offset..end));
        let encoded = encoded.ok_or_else(|| container("a compressed buffer view reaches beyond its buffer"))?;
        self.decode(encoded).ok_or_else(|| container("a buffer view compressed with meshopt is damaged"))?
    }

    /// `None` if the bytes are not what the mode says.
    fn decode(&self, encoded: &[u8]) -> Option<Result<Vec<u8>, FormatError>> {
        let indices = |bytes: Option<Vec<u8>>| bytes.map(Ok);
        match (self.mode, self.stride) {
            (Mode::Triangles, _) if !self.count.is_multiple_of(3) => None,
            (Mode::Triangles, 2) => indices(decode_index_buffer::<u16>(encoded, self.count).ok().map(as_bytes)),
            (Mode::Triangles, 4) => indices(decode_index_buffer::<u32>(encoded, self.count).ok().map(as_bytes)),
            (Mode::Indices, 2) => indices(decode_index_sequence::<u16>(encoded, self.count).ok().map(as_bytes)),
            (Mode::Indices, 4) => indices(decode_index_sequence::<u32>(encoded, self.count).ok().map(as_bytes)),
            (Mode::Attributes, _) => {
                let Some(decode) = decoder_of(self.stride) else {
                    return Some(Err(unsupported(&format!("a compressed buffer of {} bytes per row", self.stride))));
                };
                let mut bytes = decode(encoded, self.count)?;
                self.unfilter(&mut bytes)?;
                Some(Ok(bytes))
            }
            _ => None,
        }
    }

    /// Undoes the filter; `None` if it does not fit the rows.
    fn unfilter(&self, bytes: &mut Vec<u8>) -> Option<()> {
        let rows = bytes.as_mut_slice();
        match (self.filter, self.stride) {
            (Filter::None, _) => {}
            (Filter::Octahedral, 4) => decode_filter_oct::<i8>(bytemuck::try_cast_slice_mut(rows).ok()?),
            (Filter::Color, 4) => decode_filter_color::<u8>(rows.as_chunks_mut::<4>().0),
            (Filter::Octahedral, 8) => with_numbers::<i16>(bytes, |n| decode_filter_oct(n.as_chunks_mut::<4>().0)),
            (Filter::Color, 8) => with_numbers::<u16>(bytes, |n| decode_filter_color(n.as_chunks_mut::<4>().0)),
            (Filter::Quaternion, 8) => with_numbers::<i16>(bytes, |n| decode_filter_quat(n.as_chunks_mut::<4>().0)),
            (Filter::Exponential, stride) if stride % 4 == 0 => {
                with_numbers::<u32>(bytes, |n| decode_filter_exp(n.as_chunks_mut::<1>().0));
            }
            _ => return None,
        }
        Some(())
    }
}

/// Changes bytes as numbers, which need another alignment.
fn with_numbers<T: bytemuck::Pod>(bytes: &mut Vec<u8>, change: impl FnOnce(&mut [T])) {
    let mut numbers: Vec<T> = bytemuck::pod_collect_to_vec(bytes);
    change(&mut numbers);
    *bytes = as_bytes(numbers);
}

fn as_bytes<T: bytemuck::Pod>(values: Vec<T>) -> Vec<u8> {
    bytemuck::pod_collect_to_vec(&values)
}

type Decoder = fn(&[u8], usize) -> Option<Vec<u8>>;

/// The decoder of rows of so many bytes.
fn decoder_of(stride: usize) -> Option<Decoder> {
    fn rows<const N: usize>(encoded: &[u8], count: usize) -> Option<Vec<u8>>
    where
        [u8; N]: Default,
    {
        decode_vertex_buffer::<[u8; N]>(encoded, count).ok().map(|rows| rows.concat())
    }
    Some(match stride {
        4 => rows::<4>,
        8 => rows::<8>,
        12 => rows::<12>,
        16 => rows::<16>,
        20 => rows::<20>,
        24 => rows::<24>,
        28 => rows::<28>,
        32 => rows::<32>,
        _ => return None,
    })
}
