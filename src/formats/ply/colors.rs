//! Colours in PLY: their names and types differ between programs.

use crate::formats::raw_mesh::bytes_of_colors;
use ply_rs::ply::{PropertyType, ScalarType};

/// Beginnings of the names of colour channels, the most usual first: of files with several colours, the first counts.
const PREFIXES: [&str; 9] = ["", "diffuse_", "vertex_", "color_", "colour_", "col_", "albedo_", "scalar_", "ambient_"];
/// The channels behind such a beginning.
const CHANNELS: [[&str; 3]; 2] = [["red", "green", "blue"], ["r", "g", "b"]];

/// The properties that hold the colour of an element, by place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ColorColumns {
    /// Red, green, blue.
    Three([usize; 3]),
    /// All in the bits of one number, red in bits 16 to 23: `rgb` of the Point Cloud Library.
    Packed(usize),
}

impl ColorColumns {
    /// Looks for colours among the properties of an element.
    pub fn find(properties: &[(&str, &PropertyType)]) -> Option<Self> {
        let place = |wanted: &str| {
            let is_it = |(name, kind): &(&str, &PropertyType)| {
                matches!(kind, PropertyType::Scalar(_)) && name.eq_ignore_ascii_case(wanted)
            };
            properties.iter().position(is_it)
        };
        let three = PREFIXES.iter().flat_map(|prefix| CHANNELS.map(|channels| (*prefix, channels))).find_map(
            |(prefix, [r, g, b])| {
                let place = |channel| place(&format!("{prefix}{channel}"));
                Some(Self::Three([place(r)?, place(g)?, place(b)?]))
            },
        );
        three.or_else(|| place("rgb").or_else(|| place("rgba")).map(Self::Packed))
    }

    /// The colours as bytes.
    ///
    /// **Shapes** `numbers`: one row per element, red, green and blue; of packed ones the first counts.
    pub fn bytes(self, numbers: &[[f64; 3]], properties: &[(&str, &PropertyType)]) -> Vec<[u8; 3]> {
        let at = match self {
            Self::Three([at, ..]) | Self::Packed(at) => at,
        };
        let Some((_, PropertyType::Scalar(kind))) = properties.get(at) else { return Vec::new() };
        let is_real = matches!(kind, ScalarType::Float | ScalarType::Double);
        match (self, kind) {
            (Self::Packed(_), _) => {
                // A float holds the bits of the number.
                let bits = |n: f64| if is_real { (n as f32).to_bits() } else { n as i64 as u32 };
                numbers.iter().map(|[n, ..]| [16, 8, 0].map(|shift| (bits(*n) >> shift) as u8)).collect()
            }
            _ if is_real => bytes_of_colors(numbers),
            (_, ScalarType::UChar) => numbers.iter().map(|c| c.map(|v| v as u8)).collect(),
            // Bytes that a program took for signed ones.
            (_, ScalarType::Char) => numbers.iter().map(|c| c.map(|v| v as i8 as u8)).collect(),
            // Larger numbers have 16 bits, unless all fit into 8.
            _ => {
                let has_16_bits = numbers.iter().flatten().any(|&v| v > 255.0);
                let scale = if has_16_bits { 1.0 / 257.0 } else { 1.0 };
                numbers.iter().map(|c| c.map(|v| (v * scale).round() as u8)).collect()
            }
        }
    }
}

/// Whether a name says that a property holds colours.
pub(super) fn looks_like_color(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let words = ["red", "green", "blue", "rgb", "color", "colour", "albedo", "diffuse", "f_dc_"];
    // Such as `shared` and `infrared`, which are none.
    let is_part = |word: &&str| name.starts_with(*word) || name.ends_with(*word) && !name.ends_with("ared");
    words.iter().any(is_part)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTE: PropertyType = PropertyType::Scalar(ScalarType::UChar);

    #[test]
    fn colours_are_found_under_the_names_of_many_programs() {
        for [r, g, b] in [
            ["red", "green", "blue"],
            ["Red", "Green", "Blue"],
            ["R", "G", "B"],
            ["diffuse_red", "diffuse_green", "diffuse_blue"],
            ["ambient_red", "ambient_green", "ambient_blue"],
            ["color_r", "color_g", "color_b"],
            ["scalar_R", "scalar_G", "scalar_B"],
        ] {
            let found = ColorColumns::find(&[("x", &BYTE), (r, &BYTE), (g, &BYTE), (b, &BYTE)]);
            assert_eq!(found, Some(ColorColumns::Three([1, 2, 3])), "{r}");
        }
        let both = ["ambient_red", "ambient_green", "ambient_blue", "diffuse_red", "diffuse_green", "diffuse_blue"];
        assert_eq!(ColorColumns::find(&both.map(|name| (name, &BYTE))), Some(ColorColumns::Three([3, 4, 5])));
        assert_eq!(ColorColumns::find(&[("red", &BYTE), ("green", &BYTE)]), None);
        assert_eq!(ColorColumns::find(&[("rgb", &BYTE)]), Some(ColorColumns::Packed(0)));
    }

    #[test]
    fn colours_are_read_from_each_type() {
        let three = ColorColumns::Three([0, 1, 2]);
        let as_type = |kind: ScalarType, numbers: [f64; 3]| {
            let kind = PropertyType::Scalar(kind);
            three.bytes(&[numbers], &[("red", &kind), ("green", &kind), ("blue", &kind)])[0]
        };
        assert_eq!(as_type(ScalarType::UChar, [0.0, 128.0, 255.0]), [0, 128, 255]);
        assert_eq!(as_type(ScalarType::Char, [0.0, -128.0, -1.0]), [0, 128, 255]);
        assert_eq!(as_type(ScalarType::UShort, [0.0, 32896.0, 65535.0]), [0, 128, 255]);
        assert_eq!(as_type(ScalarType::UShort, [0.0, 128.0, 255.0]), [0, 128, 255]);
        assert_eq!(as_type(ScalarType::Int, [0.0, 128.0, 255.0]), [0, 128, 255]);
        assert_eq!(as_type(ScalarType::Float, [0.0, 0.5, 1.0]), [0, 128, 255]);
        let packed = |kind: ScalarType, number: f64| {
            ColorColumns::Packed(0).bytes(&[[number, 0.0, 0.0]], &[("rgb", &PropertyType::Scalar(kind))])[0]
        };
        assert_eq!(packed(ScalarType::UInt, f64::from(0xff01_80feu32)), [1, 128, 254]);
        assert_eq!(packed(ScalarType::Float, f64::from(f32::from_bits(0x0001_80fe))), [1, 128, 254]);
    }

    #[test]
    fn other_names_look_like_colours_or_not() {
        assert!(["f_dc_0", "vertex_color", "redness", "rgb_packed"].iter().all(|name| looks_like_color(name)));
        assert!(!["x", "quality", "infrared", "label", "s", "confidence"].iter().any(|name| looks_like_color(name)));
    }
}
