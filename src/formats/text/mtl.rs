//! Reads Wavefront MTL, the materials of an OBJ.
//!
//! Only the colour and its picture: `newmtl`, `Kd`, `map_Kd`, or where a program writes it elsewhere one of [`COLOR_MAPS`]. Other
//! lines, and colours that are not three numbers (`Kd spectral FILE`), are skipped.

use super::lines::whole_lines;
use crate::formats::srgb::linear_of_srgb;

/// A material of an MTL file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    pub name: String,
    /// Linear light.
    pub color: Option<[f64; 3]>,
    pub picture: Option<MtlPicture>,
    /// How well the picture's keyword says that it is the colour: its place in [`COLOR_MAPS`].
    rank: usize,
    /// A picture that is not read, with its keyword.
    pub other: Option<String>,
}

/// The keywords of pictures that show a colour, the best first: programs of unlit scans write `map_Ka` or `map_Ke`, those of
/// physical materials names of their own.
const COLOR_MAPS: [&str; 9] =
    ["map_kd", "map_basecolor", "map_albedo", "map_diffuse", "map_pkd", "map_color", "map_col", "map_ke", "map_ka"];

/// The picture of a material, and how texture coordinates lie in it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MtlPicture {
    pub file: String,
    pub scale: [f64; 2],
    pub offset: [f64; 2],
    pub clamp: bool,
}

/// Reads all materials, in the order of the file.
pub(super) fn read_mtl(bytes: &[u8]) -> Vec<MtlMaterial> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    for line in whole_lines(bytes) {
        let (word, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((&line, ""));
        let rest = rest.trim();
        if word == "newmtl" {
            materials.push(MtlMaterial { name: rest.into(), ..MtlMaterial::default() });
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        match word.to_ascii_lowercase().as_str() {
            "kd" => material.color = color(rest).or(material.color),
            keyword => match COLOR_MAPS.iter().position(|map| *map == keyword) {
                Some(rank) if material.picture.is_none() || rank <= material.rank => {
                    if let Some(found) = picture(rest) {
                        (material.picture, material.rank) = (Some(found), rank);
                    }
                }
                None if keyword.starts_with("map_") => material.other = Some(line.trim().into()),
                _ => {}
            },
        }
    }
    materials
}

/// `r g b` or `r`, displayed values as every program writes them, as linear light.
fn color(text: &str) -> Option<[f64; 3]> {
    let values: Option<Vec<f64>> = text.split_ascii_whitespace().map(|t| t.parse().ok()).collect();
    let rgb = match values?[..] {
        [grey] => [grey; 3],
        [r, g, b] => [r, g, b],
        _ => return None,
    };
    rgb.iter().all(|c| c.is_finite()).then(|| rgb.map(|c| linear_of_srgb(c.clamp(0.0, 1.0))))
}

/// `[options] FILE`; the name may contain spaces.
fn picture(text: &str) -> Option<MtlPicture> {
    let mut picture = MtlPicture { file: String::new(), scale: [1.0; 2], offset: [0.0; 2], clamp: false };
    let mut rest = text.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, mut after) = split_word(option);
        // `-o`, `-s` and `-t` take one to three numbers; a name of a file that begins with `-` is no option.
        match name {
            "o" | "s" | "t" => {
                let mut numbers = Vec::new();
                while numbers.len() < 3 {
                    let (word, behind) = split_word(after);
                    let Ok(number) = word.parse::<f64>() else { break };
                    (numbers, after) = ([numbers, vec![number]].concat(), behind);
                }
                let into = match name {
                    "o" => Some(&mut picture.offset),
                    "s" => Some(&mut picture.scale),
                    _ => None,
                };
                if let Some(into) = into {
                    into.iter_mut().zip(numbers).for_each(|(value, number)| *value = number);
                }
            }
            "clamp" => {
                let (word, behind) = split_word(after);
                (picture.clamp, after) = (word == "on", behind);
            }
            "mm" => after = split_word(split_word(after).1).1,
            "blendu" | "blendv" | "boost" | "texres" | "bm" | "imfchan" | "cc" | "type" => after = split_word(after).1,
            _ => break,
        }
        rest = after;
    }
    picture.file = rest.trim().into();
    (!picture.file.is_empty()).then_some(picture)
}

/// The first word, and what follows it.
fn split_word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let (word, rest) = text.split_at(text.find(|c: char| c.is_ascii_whitespace()).unwrap_or(text.len()));
    (word, rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_spaces_options_and_colours() {
        let text = "# made by hand\nKd 1 1 1\nnewmtl Material #25\n\tKd 1 0 0.5\r\nmap_Kd -s 2 3 1 -o 0.5 -clamp on -bm 0.3 -mm 0 1 my skin #1.png\n\
            newmtl two\nKd spectral a.rfl\nKd 0.25\nmap_kd 1.png\nnewmtl three\nmap_Kd -blendu on\n";
        let read = read_mtl(text.as_bytes());
        assert_eq!(read.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["Material #25", "two", "three"]);
        let map = read[0].picture.as_ref().unwrap();
        assert_eq!(
            (map.file.as_str(), map.scale, map.offset, map.clamp),
            ("my skin #1.png", [2.0, 3.0], [0.5, 0.0], true)
        );
        let color = read[0].color.unwrap();
        assert!(color[0] == 1.0 && color[1] == 0.0 && (color[2] - 0.214).abs() < 1e-3, "{color:?}");
        assert_eq!(read[1].picture.as_ref().unwrap().file, "1.png");
        assert_eq!(read[1].color, Some([linear_of_srgb(0.25); 3]));
        assert_eq!(read[2], MtlMaterial { name: "three".into(), ..MtlMaterial::default() });
    }

    #[test]
    fn a_name_that_begins_with_a_dash_is_a_name() {
        assert_eq!(picture("-skin.png").unwrap().file, "-skin.png");
        assert_eq!(picture("-s 1 -skin 2.png").unwrap().file, "-skin 2.png");
        assert_eq!(picture(""), None);
    }

    #[test]
    fn bytes_that_are_no_text_give_no_materials() {
        assert!(read_mtl(&[0xff, 0xfe, 0, 10, 7, 200]).is_empty());
    }
}
