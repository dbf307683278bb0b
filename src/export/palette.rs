//! How layers look apart from their textures: colours for those without, and roughness.

use crate::body::Layer;
use crate::segment::Fabric;

/// Roughness of skin, and of cloth of an unknown fabric, 0–1: neither shines, and scanned colours contain shading.
const USUAL_ROUGHNESS: f32 = 0.9;

/// sRGB of the body: the beige of a tailor's mannequin.
const BODY: [u8; 3] = [205, 180, 160];

/// sRGB of garments by rank, distinguishable also with red-green blindness (Okabe & Ito 2008).
const GARMENTS: [[u8; 3]; 6] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

/// Roughness of a layer's material, from 0 (mirror) to 1 (matt): that of its fabric.
pub(super) fn roughness_of(layer: &Layer) -> f32 {
    let fabric = layer.fabric.as_deref().and_then(|name| Fabric::named(name).ok());
    fabric.map_or(USUAL_ROUGHNESS, |fabric| fabric.roughness)
}

/// The colour of the layer with this rank; 0 is the body.
pub(super) fn color_of_rank(rank: usize) -> [u8; 3] {
    match rank {
        0 => BODY,
        _ => GARMENTS[(rank - 1) % GARMENTS.len()],
    }
}
