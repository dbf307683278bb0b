//! The materials of glTF: base colours and their pictures.

use super::accessor::{content_of, name_of, unsupported};
use crate::formats::error::FormatError;
use crate::formats::texture::{EncodedPicture, RawMaterial, RawTexture, Siblings, UnreadPart, Wrap};
use gltf::image::Source;
use gltf::texture::{Info, Texture, WrappingMode};
use gltf::{Image, Material};
use std::collections::BTreeMap;

/// How the texture coordinates of a primitive become places in its picture.
#[derive(Clone, Copy)]
pub(super) struct Mapping {
    /// The set of coordinates, `TEXCOORD_set`.
    pub set: u32,
    offset: [f64; 2],
    /// Sine and cosine.
    rotation: [f64; 2],
    scale: [f64; 2],
}

impl Mapping {
    fn of(info: &Info) -> Self {
        let Some(transform) = info.texture_transform() else {
            return Self { set: info.tex_coord(), offset: [0.0; 2], rotation: [0.0, 1.0], scale: [1.0; 2] };
        };
        let (sin, cos) = f64::from(transform.rotation()).sin_cos();
        Self {
            set: transform.tex_coord().unwrap_or_else(|| info.tex_coord()),
            offset: transform.offset().map(f64::from),
            rotation: [sin, cos],
            scale: transform.scale().map(f64::from),
        }
    }

    /// The place of a coordinate, from the lower left.
    ///
    /// **Source** KHR_texture_transform: scaled, turned, moved, all from the upper left. The rotation has the sense of its
    /// example of the lower left quadrant (and of three.js and Cesium), not that of its GLSL.
    pub fn placed(&self, [u, v]: [f64; 2]) -> [f32; 2] {
        let ([sin, cos], u, v) = (self.rotation, u * self.scale[0], v * self.scale[1]);
        [(u * cos + v * sin + self.offset[0]) as f32, (1.0 - (v * cos - u * sin + self.offset[1])) as f32]
    }
}

/// The materials that primitives have used so far.
pub(super) struct GltfMaterials<'s, 'f> {
    siblings: &'s mut Siblings<'f>,
    /// By index in the file: the place in the list, and the mapping of those with a picture.
    known: BTreeMap<usize, (u16, Option<Mapping>)>,
    /// The places of pictures by index in the file; `None` for those that cannot be read.
    pictures: BTreeMap<usize, Option<usize>>,
    found: FoundMaterials,
}

/// The materials of a file that were found.
#[derive(Default)]
pub(super) struct FoundMaterials {
    pub materials: Vec<RawMaterial>,
    pub pictures: Vec<EncodedPicture>,
    pub unread: Vec<UnreadPart>,
}

impl<'s, 'f> GltfMaterials<'s, 'f> {
    pub fn new(siblings: &'s mut Siblings<'f>) -> Self {
        Self { siblings, known: BTreeMap::new(), pictures: BTreeMap::new(), found: FoundMaterials::default() }
    }

    /// The place of a material, and its mapping if it has a picture. glTF's default material has no place.
    pub fn of(&mut self, material: &Material, buffers: &[Vec<u8>]) -> Result<(u16, Option<Mapping>), FormatError> {
        let Some(index) = material.index() else { return Ok((RawTexture::NO_MATERIAL, None)) };
        if let Some(&known) = self.known.get(&index) {
            return Ok(known);
        }
        let place = u16::try_from(self.found.materials.len()).ok().filter(|&place| place != RawTexture::NO_MATERIAL);
        let place = place.ok_or_else(|| unsupported("a file of more than 65 534 materials"))?;
        let name = material.name().map_or_else(|| format!("material {index}"), String::from);
        let metallic = material.pbr_metallic_roughness();
        let (factor, info) = match material.pbr_specular_glossiness() {
            Some(old) if metallic.base_color_texture().is_none() => (old.diffuse_factor(), old.diffuse_texture()),
            _ => (metallic.base_color_factor(), metallic.base_color_texture()),
        };
        // Programs make scans that ignore light by emission alone.
        let info = info.or_else(|| material.emissive_texture().filter(|_| material.emissive_factor() != [0.0; 3]));
        let color = [factor[0], factor[1], factor[2]].map(f64::from);
        let mut raw = RawMaterial { name, color, ..RawMaterial::default() };
        if let Some(info) = &info {
            raw.picture = self.picture(&info.texture(), &raw.name, buffers);
            let sampler = info.texture().sampler();
            raw.wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
                WrappingMode::ClampToEdge => Wrap::Clamp,
                WrappingMode::MirroredRepeat => Wrap::Mirror,
                WrappingMode::Repeat => Wrap::Repeat,
            });
        }
        let mapping = info.as_ref().filter(|_| raw.picture.is_some()).map(Mapping::of);
        self.found.materials.push(raw);
        self.known.insert(index, (place, mapping));
        Ok((place, mapping))
    }

    fn picture(&mut self, texture: &Texture, material: &str, buffers: &[Vec<u8>]) -> Option<usize> {
        let image = texture.source();
        if let Some(&known) = self.pictures.get(&image.index()) {
            return known;
        }
        let name = picture_name(&image);
        let bytes = match image.source() {
            Source::View { view, .. } => {
                let end = view.offset().checked_add(view.length());
                let buffer = buffers.get(view.buffer().index());
                buffer.zip(end).and_then(|(buffer, end)| buffer.get(view.offset()..end)).map(<[u8]>::to_vec)
            }
            Source::Uri { uri, .. } => content_of(uri, self.siblings).and_then(Result::ok),
        };
        let place = match bytes {
            Some(bytes) => {
                self.found.pictures.push(EncodedPicture { name, bytes });
                Some(self.found.pictures.len() - 1)
            }
            None => {
                self.found.unread.push(UnreadPart::missing_picture(&name, material));
                None
            }
        };
        self.pictures.insert(image.index(), place);
        place
    }

    /// All that was found.
    pub fn finish(self) -> FoundMaterials {
        self.found
    }
}

fn picture_name(image: &Image) -> String {
    match (image.source(), image.name()) {
        (Source::Uri { uri, .. }, _) if !uri.starts_with("data:") => name_of(uri),
        (_, Some(name)) => name.into(),
        _ => format!("image {}", image.index()),
    }
}
