//! Colours: distinct ones for layers and joints, a perceptual ramp for scalars, and conversion between sRGB and linear
//! light.

use crate::body::{JointId, SkinWeights};
use crate::geometry::PerVertex;

/// Viridis (van der Walt & Smith 2015) at nine even stops: even steps of the value look like even steps of colour,
/// also in grey and to the colour-blind.
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 45, 123],
    [59, 82, 139],
    [44, 114, 142],
    [33, 145, 140],
    [40, 174, 128],
    [94, 201, 98],
    [173, 220, 48],
    [253, 231, 37],
];

/// Muted cloth colours, neighbours far apart in hue, all of middle lightness so that shading stays readable.
const LAYERS: [[u8; 3]; 8] = [
    [226, 190, 168],
    [112, 142, 178],
    [204, 150, 110],
    [126, 158, 128],
    [184, 118, 122],
    [150, 132, 176],
    [202, 184, 128],
    [108, 162, 164],
];

/// Saturated colours for the 22 joints of a body, in the order of the embedded skeleton: a joint is far in colour from its
/// parent, its children and its other side. Based on the colour alphabet (Green-Armytage 2010) without black and grey.
const JOINTS: [[u8; 3]; 22] = [
    [240, 163, 255],
    [0, 117, 220],
    [255, 164, 5],
    [43, 206, 72],
    [194, 0, 136],
    [255, 225, 0],
    [255, 0, 16],
    [94, 241, 242],
    [165, 100, 40],
    [157, 204, 0],
    [0, 51, 128],
    [255, 130, 170],
    [0, 153, 143],
    [116, 10, 255],
    [240, 120, 60],
    [0, 92, 49],
    [255, 204, 153],
    [76, 0, 92],
    [148, 255, 181],
    [153, 0, 0],
    [110, 110, 0],
    [150, 170, 255],
];

/// The colour of a value that is not a number.
const NO_VALUE: [u8; 3] = [150, 150, 150];

/// The colour in which layer `index` is drawn; 0 is the body.
pub fn layer_color(index: usize) -> [u8; 3] {
    if index == 0 { LAYERS[0] } else { LAYERS[1 + (index - 1) % (LAYERS.len() - 1)] }
}

/// The colour of a joint; colours repeat after the 22nd joint.
pub fn joint_color(joint: JointId) -> [u8; 3] {
    JOINTS[joint.index() % JOINTS.len()]
}

/// The mean of the colours of each vertex's joints, weighted by its skin weights.
///
/// **Shapes** one sRGB colour per row of weights.
pub fn skin_weight_colors(weights: &SkinWeights) -> PerVertex<[u8; 3]> {
    let channel = |row: &[(JointId, f64)], c: usize| -> f64 {
        row.iter().map(|&(joint, weight)| weight * f64::from(joint_color(joint)[c])).sum()
    };
    weights.rows().iter().map(|row| std::array::from_fn(|c| channel(row, c).round() as u8)).collect()
}

/// The ramp's colour at `value` of `range`; values outside take the end colours, NaN is grey.
pub fn ramp_color(value: f64, range: [f64; 2]) -> [u8; 3] {
    let width = range[1] - range[0];
    let t = if width > 0.0 { ((value - range[0]) / width).clamp(0.0, 1.0) } else { 0.5 };
    if value.is_nan() || t.is_nan() {
        return NO_VALUE;
    }
    let at = t * (VIRIDIS.len() - 1) as f64;
    let low = (at as usize).min(VIRIDIS.len() - 2);
    let f = at - low as f64;
    std::array::from_fn(|c| (f64::from(VIRIDIS[low][c]) * (1.0 - f) + f64::from(VIRIDIS[low + 1][c]) * f).round() as u8)
}

/// Light from an sRGB byte (IEC 61966-2-1).
pub(super) fn linear_from_srgb(byte: u8) -> f32 {
    let s = f32::from(byte) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// sRGB byte of a light, rounded.
pub(super) fn srgb_from_linear(light: f32) -> u8 {
    let l = light.clamp(0.0, 1.0);
    let s = if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Skeleton;

    #[test]
    fn srgb_makes_the_round_trip() {
        for byte in 0..=255 {
            assert_eq!(srgb_from_linear(linear_from_srgb(byte)), byte);
        }
    }

    #[test]
    fn the_ramp_grows_lighter_all_the_way() {
        let lightness = |t: f64| {
            let [r, g, b] = ramp_color(t, [0.0, 1.0]).map(linear_from_srgb);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((0..40).all(|i| lightness(f64::from(i + 1) / 40.0) > lightness(f64::from(i) / 40.0)));
        assert_eq!(ramp_color(f64::NAN, [0.0, 1.0]), NO_VALUE);
    }

    #[test]
    fn joints_have_clearly_different_colours_and_neighbours_most_of_all() {
        let distance = |a: usize, b: usize| {
            let apart = |c: usize| f64::from(JOINTS[a][c]) - f64::from(JOINTS[b][c]);
            (0..3).map(|c| apart(c).powi(2)).sum::<f64>().sqrt()
        };
        assert!((0..JOINTS.len()).all(|a| (0..a).all(|b| distance(a, b) > 60.0)));
        let parents = Skeleton::body_parents();
        assert_eq!(parents.len(), JOINTS.len());
        for (joint, parent) in parents.iter().enumerate() {
            assert!(parent.is_none_or(|p| distance(joint, p.index()) > 100.0), "joint {joint}");
        }
    }

    #[test]
    fn skin_weights_blend_the_colours_of_their_joints() {
        let weights = SkinWeights::from_rows([vec![(JointId(1), 1.0)], vec![(JointId(0), 3.0), (JointId(4), 1.0)]]);
        assert_eq!(skin_weight_colors(&weights).0, [JOINTS[1], [229, 122, 225]]);
    }

    #[test]
    fn no_garment_looks_like_the_body() {
        assert!((1..30).all(|i| layer_color(i) != layer_color(0)));
    }
}
