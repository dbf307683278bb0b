//! The files that a glTF refers to.

use super::accessor::name_of;
use super::extensions::extension_source;
use crate::formats::error::{Format, FormatError};
use crate::formats::plain_text::without_mark;
use crate::formats::texture::{Fetched, Siblings};
use serde_json::Value;
use std::io::{Cursor, Read};

/// The files that a glTF refers to and that exist, relative to its folder: buffers, and pictures of base colours. Of a
/// `.glb`, only the JSON is read. Of a file that is no glTF, none: its reader says what is wrong.
pub(in crate::formats) fn gltf_siblings(
    mut input: impl Read,
    siblings: &mut Siblings,
) -> Result<Vec<String>, FormatError> {
    let io = |source| FormatError::Io { format: Format::Gltf, source };
    let mut head = Vec::new();
    input.by_ref().take(20).read_to_end(&mut head).map_err(io)?;
    let mut json = Vec::new();
    match head.as_slice() {
        [b'g', b'l', b'T', b'F', .., a, b, c, d, _, _, _, _] => {
            let length = u32::from_le_bytes([*a, *b, *c, *d]);
            input.take(u64::from(length)).read_to_end(&mut json).map_err(io)?;
        }
        _ => drop(Cursor::new(head).chain(input).read_to_end(&mut json).map_err(io)?),
    }
    let Ok(root) = serde_json::from_slice::<Value>(without_mark(&json)) else { return Ok(Vec::new()) };
    let uris = buffers(&root).into_iter().chain(pictures(&root)).filter(|uri| !uri.starts_with("data:"));
    Ok(uris.filter_map(|uri| Fetched::find(&name_of(uri), "", siblings)).map(|file| file.name).collect())
}

fn list<'a>(root: &'a Value, key: &str) -> &'a [Value] {
    root.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn buffers(root: &Value) -> Vec<&str> {
    list(root, "buffers").iter().filter_map(|buffer| buffer.get("uri")?.as_str()).collect()
}

fn pictures(root: &Value) -> Vec<&str> {
    let at = |key: &str, index: &Value| list(root, key).get(usize::try_from(index.as_u64()?).ok()?);
    let of_material = |material: &'_ Value| {
        ["/pbrMetallicRoughness/baseColorTexture", "/extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture"]
            .iter()
            .find_map(|place| material.pointer(place)?.get("index").cloned())
    };
    let images = list(root, "materials").iter().filter_map(|material| {
        let texture = at("textures", &of_material(material)?)?;
        let source = texture.get("source").cloned().or_else(|| extension_source(texture))?;
        at("images", &source)
    });
    images.filter_map(|image| image.get("uri")?.as_str()).collect()
}
