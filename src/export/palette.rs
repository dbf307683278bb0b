//! Colours for layers without colours of their own.

/// Roughness of skin and cloth, 0–1: neither shines, and scanned colours contain shading.
pub(super) const ROUGHNESS: f32 = 0.9;

/// sRGB of the body: the beige of a tailor's mannequin.
const BODY: [u8; 3] = [205, 180, 160];

/// sRGB of garments by rank, distinguishable also with red-green blindness (Okabe & Ito 2008).
const GARMENTS: [[u8; 3]; 6] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0]];

/// The colour of the layer with this rank; 0 is the body.
pub(super) fn color_of_rank(rank: usize) -> [u8; 3] {
    match rank {
        0 => BODY,
        _ => GARMENTS[(rank - 1) % GARMENTS.len()],
    }
}
