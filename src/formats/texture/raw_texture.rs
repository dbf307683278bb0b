//! The pictures of a mesh file, and how its faces use them.

/// The materials of a mesh's faces, with their pictures still encoded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawTexture {
    /// U × 2, from the lower left of the picture; [`RawMaterial::wrap`] says what is outside 0–1.
    pub coords: Vec<[f32; 2]>,
    /// F × 3, the coordinate of each corner, [`RawTexture::NONE`] for none; `None` where each vertex has its own, so U = V.
    pub corners: Option<Vec<[u32; 3]>>,
    /// F, the material of each face, [`RawTexture::NO_MATERIAL`] for none.
    pub face_materials: Vec<u16>,
    /// The materials that faces use.
    pub materials: Vec<RawMaterial>,
    /// The pictures of the materials.
    pub pictures: Vec<EncodedPicture>,
}

/// How a face is coloured.
#[derive(Clone, Debug, PartialEq)]
pub struct RawMaterial {
    /// Its name in the file.
    pub name: String,
    /// Linear light, 0–1: the colour of its faces, or what its picture is multiplied by.
    pub color: [f64; 3],
    /// Its picture, by place in [`RawTexture::pictures`].
    pub picture: Option<usize>,
    /// What the coordinates are multiplied by.
    pub scale: [f64; 2],
    /// What is then added to them.
    pub offset: [f64; 2],
    /// What is seen outside 0–1, by axis.
    pub wrap: [Wrap; 2],
}

impl Default for RawMaterial {
    /// White, without a picture.
    fn default() -> Self {
        let (name, color, picture) = (String::new(), [1.0; 3], None);
        Self { name, color, picture, scale: [1.0; 2], offset: [0.0; 2], wrap: [Wrap::Repeat; 2] }
    }
}

/// What a picture shows outside 0–1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Itself again.
    Repeat,
    /// Itself and its mirror image in turn.
    Mirror,
    /// The pixels of its border.
    Clamp,
}

/// The bytes of a picture's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedPicture {
    /// Its name in the mesh file.
    pub name: String,
    /// As found.
    pub bytes: Vec<u8>,
}

/// A part of a mesh file that could not be read, although the rest could.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadPart {
    /// What it is, and why: a sentence without its full stop.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
}

impl UnreadPart {
    /// For colours that the reader cannot follow; `what` is a sentence without its full stop.
    pub(in crate::formats) fn colors(what: String) -> Self {
        Self { what, remedy: "export the scan again with a colour per vertex, or as GLB with its textures".into() }
    }

    /// For texture coordinates without a picture.
    pub(in crate::formats) fn no_picture() -> Self {
        Self {
            what: "the scan has texture coordinates, but the file names no picture".into(),
            remedy: "export it again with its material and picture; without them it has no colours".into(),
        }
    }

    /// For a picture that is not beside the mesh.
    pub(in crate::formats) fn missing_picture(picture: &str, material: &str) -> Self {
        Self {
            what: format!("the picture '{picture}' of the material '{material}' is missing"),
            remedy: "put it beside the scan and scan again".into(),
        }
    }
}

impl RawTexture {
    /// In place of a coordinate.
    pub const NONE: u32 = u32::MAX;
    /// In place of a material.
    pub const NO_MATERIAL: u16 = u16::MAX;

    /// The material of a face, and its place in the list.
    pub fn material_of(&self, face: usize) -> Option<(usize, &RawMaterial)> {
        let at = usize::from(*self.face_materials.get(face)?);
        self.materials.get(at).map(|material| (at, material))
    }

    /// The coordinates of a face's corners after the material's scale and offset; `None` unless all three exist and are
    /// finite.
    pub fn coords_of(&self, face: usize, vertices: [u32; 3]) -> Option<[[f64; 2]; 3]> {
        let (_, material) = self.material_of(face)?;
        let at = match &self.corners {
            Some(corners) => *corners.get(face)?,
            None => vertices,
        };
        let mut coords = [[0.0; 2]; 3];
        for (coord, at) in coords.iter_mut().zip(at) {
            let found = self.coords.get(at as usize)?;
            *coord = [0, 1].map(|k| f64::from(found[k]) * material.scale[k] + material.offset[k]);
            if !coord.iter().all(|c| c.is_finite()) {
                return None;
            }
        }
        Some(coords)
    }
}
