//! Writes labels on pictures, in Inter (Rasmus Andersson, SIL Open Font License: `fonts/OFL.txt`).
//!
//! The two font files hold Latin, Greek and Cyrillic letters and the signs that labels use; `fonts/README.md` has the
//! command that made them. A character that they lack is drawn as a box.

use super::picture::Picture;
use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use std::sync::LazyLock;

/// Height of a capital in the units of both font files.
const CAPITAL_UNITS: f32 = 2048.0;

static REGULAR: LazyLock<FontRef<'static>> = LazyLock::new(|| embedded(include_bytes!("fonts/Inter-Regular.otf")));
static SEMI_BOLD: LazyLock<FontRef<'static>> = LazyLock::new(|| embedded(include_bytes!("fonts/Inter-SemiBold.otf")));

/// # Panics
/// If the file that was compiled in is not a font; the tests below read both.
fn embedded(file: &'static [u8]) -> FontRef<'static> {
    FontRef::try_from_slice(file).expect("the embedded font can be read")
}

/// The thickness of letters.
#[derive(Clone, Copy, Debug)]
pub(super) enum Weight {
    Regular,
    SemiBold,
}

/// A pen for labels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pen {
    /// Pixels from the base line to the top of a capital.
    pub(super) size: f32,
    pub(super) weight: Weight,
    pub(super) color: [u8; 3],
}

impl Pen {
    fn font(&self) -> &'static FontRef<'static> {
        match self.weight {
            Weight::Regular => &REGULAR,
            Weight::SemiBold => &SEMI_BOLD,
        }
    }

    /// The scale at which a capital is `size` pixels high; `ab_glyph` measures from descent to ascent.
    fn scale(&self) -> PxScale {
        PxScale::from(self.size * self.font().height_unscaled() / CAPITAL_UNITS)
    }

    /// Pixels from the beginning of a text to its end.
    pub(super) fn width_of(&self, text: &str) -> f32 {
        let font = self.font().as_scaled(self.scale());
        text.chars().map(|c| font.h_advance(font.glyph_id(c))).sum()
    }

    /// Writes one line that begins at `left` with its base line at `base`, in pixels from the upper left corner.
    pub(super) fn write(&self, on: &mut Picture, text: &str, left: f32, base: f32) {
        let font = self.font().as_scaled(self.scale());
        let mut at = left;
        for c in text.chars() {
            let id = font.glyph_id(c);
            self.draw(on, id.with_scale_and_position(font.scale(), point(at, base)));
            at += font.h_advance(id);
        }
    }

    /// Blends the ink of one letter into the picture; what juts out is cut off.
    fn draw(&self, on: &mut Picture, glyph: Glyph) {
        let Some(outline) = self.font().outline_glyph(glyph) else { return };
        let (width, height) = (on.width() as i64, on.height() as i64);
        let corner = outline.px_bounds().min;
        outline.draw(|column, row, ink| {
            let (x, y) = (corner.x as i64 + i64::from(column), corner.y as i64 + i64::from(row));
            if (0..width).contains(&x) && (0..height).contains(&y) {
                let ink = ink.clamp(0.0, 1.0);
                let pixel = &mut on.pixels_mut()[(y * width + x) as usize];
                for (channel, &own) in pixel.iter_mut().zip(&self.color) {
                    *channel = (f32::from(*channel) * (1.0 - ink) + f32::from(own) * ink).round() as u8;
                }
            }
        });
    }

    /// Breaks a text between words so that no line is wider than `width` pixels, unless a word is.
    pub(super) fn lines_of(&self, text: &str, width: f32) -> Vec<String> {
        let mut lines = vec![String::new()];
        for word in text.split_whitespace() {
            let line = lines.last().cloned().unwrap_or_default();
            let longer = if line.is_empty() { word.to_string() } else { format!("{line} {word}") };
            if line.is_empty() || self.width_of(&longer) <= width {
                lines.pop();
                lines.push(longer);
            } else {
                lines.push(word.into());
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PEN: Pen = Pen { size: 14.0, weight: Weight::Regular, color: [0; 3] };

    #[test]
    fn both_fonts_have_every_letter_of_our_labels() {
        let signs = "°±·×²³µ–—−…’→≤≥äöüßéñçøåżłЖяΩλ";
        for weight in [Weight::Regular, Weight::SemiBold] {
            let font = Pen { weight, ..PEN }.font();
            let missing: String = (' '..='~').chain(signs.chars()).filter(|&c| font.glyph_id(c).0 == 0).collect();
            assert_eq!(missing, "");
        }
    }

    #[test]
    fn a_capital_is_as_high_as_the_pen_says() {
        for weight in [Weight::Regular, Weight::SemiBold] {
            for size in [10.0, 14.0, 22.0] {
                let pen = Pen { size, weight, ..PEN };
                let glyph = pen.font().glyph_id('H').with_scale_and_position(pen.scale(), point(5.0, 40.0));
                let bounds = pen.font().outline_glyph(glyph).unwrap().px_bounds();
                assert_eq!([bounds.min.y, bounds.max.y], [40.0 - size, 40.0], "{weight:?} {size}");
            }
        }
    }

    #[test]
    fn lines_keep_all_words_and_the_width() {
        let text = "hips 0.4 mm, waist 1.2 mm, chest 0.9 mm";
        let lines = PEN.lines_of(text, 160.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| PEN.width_of(line) <= 160.0));
        assert_eq!(lines.join(" "), text);
    }

    #[test]
    fn ink_falls_where_the_letter_is_and_none_outside() {
        let mut picture = Picture::filled([255; 3], 40, 30);
        PEN.write(&mut picture, "L", 10.0, 20.0);
        let at = |x: usize, y: usize| picture.pixels()[y * 40 + x][0];
        assert!(at(12, 10) < 120 && at(16, 19) < 120 && at(20, 8) == 255 && at(5, 19) == 255);
        PEN.write(&mut picture, "beyond all edges", -30.0, 3.0);
        PEN.write(&mut picture, "beyond all edges", 20.0, 34.0);
    }
}
