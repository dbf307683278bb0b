//! What was found in the pictures of a scan, and what is in doubt about them.

use crate::formats::{FormatError, RawTexture, UnreadPart};
use std::fmt::Write;

/// Greatest side of a pixel on the person, in millimetres of an adult: twice the edges of a cleaned scan. A preview of
/// 64 × 64 pixels has 20 to 40 mm, the smallest real textures (512 × 512) 4 mm.
const COARSEST_MM: f64 = 10.0;
/// The height by which that is stated, in millimetres.
const ADULT_MM: f64 = 1700.0;
/// Greatest share of the surface without coordinates that is no doubt: filled holes have none.
const MOST_UNMAPPED: f64 = 0.05;

/// The pictures of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureReport {
    /// Columns and rows of each picture that was used.
    pub pictures: Vec<[usize; 2]>,
    /// Assumptions and repairs, one sentence each.
    pub findings: Vec<String>,
    /// What is in doubt.
    pub doubts: Vec<UnreadPart>,
}

/// Which part of a surface its pictures cover.
pub(super) struct Coverage<'a> {
    texture: &'a RawTexture,
    /// The longest side of the box around the mesh, in the file's unit.
    longest: f64,
    pictures: Vec<[usize; 2]>,
    unreadable: Vec<(usize, UnreadPart)>,
    area: f64,
    pixels: f64,
    unmapped: f64,
}

impl<'a> Coverage<'a> {
    pub fn new(texture: &'a RawTexture, points: &[[f64; 3]]) -> Self {
        let side = |k: usize| {
            let fold = |start: f64, f: fn(f64, f64) -> f64| points.iter().map(|p| p[k]).fold(start, f);
            fold(f64::NEG_INFINITY, f64::max) - fold(f64::INFINITY, f64::min)
        };
        let longest = side(0).max(side(1)).max(side(2));
        let (pictures, unreadable) = (Vec::new(), Vec::new());
        Self { texture, longest, pictures, unreadable, area: 0.0, pixels: 0.0, unmapped: 0.0 }
    }

    pub fn picture(&mut self, size: [usize; 2]) {
        self.pictures.push(size);
    }

    pub fn has_pictures(&self) -> bool {
        !self.pictures.is_empty()
    }

    pub fn unreadable(&mut self, place: usize, error: &FormatError) {
        let name = &self.texture.pictures[place].name;
        let what = match error {
            FormatError::NotThisFormat { .. } => format!("the picture '{name}' is neither PNG, JPEG nor WebP"),
            other => format!("the picture '{name}' cannot be read: {other}"),
        };
        let remedy = "save it as PNG, JPEG or WebP under the name that the materials give, and scan again".into();
        self.unreadable.push((place, UnreadPart { what, remedy }));
    }

    pub fn is_unreadable(&self, place: usize) -> bool {
        self.unreadable.iter().any(|(unreadable, _)| *unreadable == place)
    }

    /// A face with coordinates: its area, and that in its picture in pixels.
    pub fn mapped(&mut self, area: f64, pixels: f64) {
        self.area += area;
        self.pixels += pixels;
    }

    /// A face whose material has a picture, without coordinates in it.
    pub fn unmapped(&mut self, area: f64) {
        self.unmapped += area;
    }

    pub fn report(self, joined: usize) -> TextureReport {
        let mut findings = Vec::new();
        if !self.pictures.is_empty() {
            findings.push(sentence(&self.pictures, self.texture.materials.len()));
        }
        if joined > 0 {
            let s = if joined == 1 { "" } else { "s" };
            findings.push(format!("joined {joined} point{s} at the same place, as along seams of the texture"));
        }
        let mut doubts: Vec<UnreadPart> = self.unreadable.iter().map(|(_, part)| part.clone()).collect();
        let unmapped = self.unmapped / (self.area + self.unmapped);
        if unmapped > MOST_UNMAPPED {
            doubts.push(UnreadPart {
                what: format!("{:.0} % of the surface has no valid texture coordinates", 100.0 * unmapped),
                remedy: "its colours are unknown; export the scan again".into(),
            });
        }
        let pixel_mm = ADULT_MM * (self.area / self.pixels).sqrt() / self.longest;
        if self.area > 0.0 && self.pixels == 0.0 {
            doubts.push(UnreadPart {
                what: "all texture coordinates are in one place of the picture".into(),
                remedy: "export the scan again with its texture coordinates".into(),
            });
        } else if pixel_mm > COARSEST_MM {
            doubts.push(UnreadPart {
                what: format!("a pixel of the texture covers {pixel_mm:.0} mm of an adult"),
                remedy: "if the picture is a preview, put the full one in its place and scan again".into(),
            });
        }
        TextureReport { pictures: self.pictures, findings, doubts }
    }
}

/// `texture 4096 × 4096, 2 materials`.
fn sentence(pictures: &[[usize; 2]], materials: usize) -> String {
    let mut text = match pictures {
        [[width, height]] => format!("texture {width} × {height}"),
        _ => {
            let mut kinds: Vec<([usize; 2], usize)> = Vec::new();
            for size in pictures {
                match kinds.iter_mut().find(|(known, _)| known == size) {
                    Some((_, count)) => *count += 1,
                    None => kinds.push((*size, 1)),
                }
            }
            let kinds: Vec<String> =
                kinds.iter().map(|([width, height], count)| format!("{count} of {width} × {height}")).collect();
            format!("{} textures, {}", pictures.len(), kinds.join(", "))
        }
    };
    let s = if materials == 1 { "" } else { "s" };
    // A string takes any text.
    let _ = write!(text, ", {materials} material{s}");
    text
}
