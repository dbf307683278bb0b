//! A picture with transparency, read from and written to PNG.

use super::error::{Format, FormatError, beginning};
use super::picture::write_png;
use super::raw_mesh::read_all;
use image::ExtendedColorType;
use std::io::{Read, Write};

/// sRGB with opacity, 8 bits per channel, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbaPicture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 4]>,
}

impl RgbaPicture {
    /// A picture of these pixels.
    ///
    /// **Shapes** `pixels` height × width × 4, row by row from the top.
    ///
    /// **Errors** when their number is another.
    pub fn try_new(width: usize, height: usize, pixels: Vec<[u8; 4]>) -> Result<Self, FormatError> {
        if width.checked_mul(height) != Some(pixels.len()) {
            let expected = format!("{width} × {height} pixels");
            return Err(FormatError::ArrayShape { name: "pixels".into(), expected, found: vec![pixels.len()] });
        }
        Ok(Self { width, height, pixels })
    }

    /// A picture of one colour.
    pub fn blank(width: usize, height: usize, color: [u8; 4]) -> Self {
        Self { width, height, pixels: vec![color; width * height] }
    }

    /// The pixel at `x` and `y`, fractions of width and height from the upper left, clamped; `None` in an empty picture or
    /// where a fraction is not finite.
    pub fn nearest(&self, x: f64, y: f64) -> Option<[u8; 4]> {
        if !(x.is_finite() && y.is_finite()) {
            return None;
        }
        self.pixels.get(self.index(x, y)).copied()
    }

    /// Sets the pixel that [`RgbaPicture::nearest`] returns there.
    pub fn set_nearest(&mut self, x: f64, y: f64, color: [u8; 4]) {
        let index = self.index(x, y);
        if let Some(pixel) = self.pixels.get_mut(index) {
            *pixel = color;
        }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    fn index(&self, x: f64, y: f64) -> usize {
        // `as` saturates.
        let at = |share: f64, count: usize| ((share * count as f64) as usize).min(count.saturating_sub(1));
        at(y, self.height) * self.width + at(x, self.width)
    }

    /// Writes the picture as PNG.
    pub fn write_png(&self, mut to: impl Write) -> Result<(), FormatError> {
        let bytes = write_png(self.size(), self.pixels.as_flattened(), ExtendedColorType::Rgba8)?;
        to.write_all(&bytes).map_err(|source| FormatError::Io { format: Format::Png, source })
    }
}

/// Reads a PNG of any colour type.
///
/// **Errors** if it is not a PNG, or damaged.
pub fn read_rgba_png(input: impl Read) -> Result<RgbaPicture, FormatError> {
    let bytes = read_all(Format::Png, input)?;
    if !bytes.starts_with(b"\x89PNG") {
        return Err(FormatError::NotThisFormat { format: Format::Png, found: beginning(&bytes) });
    }
    let decoded = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png)
        .map_err(|e| FormatError::Container { format: Format::Png, reason: e.to_string() })?
        .to_rgba8();
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    RgbaPicture::try_new(width, height, decoded.pixels().map(|p| p.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_found_and_damage_is_named() {
        let mut bytes = Vec::new();
        let mut written = RgbaPicture::try_new(2, 1, vec![[255, 0, 0, 255], [7; 4]]).unwrap();
        written.set_nearest(0.6, 0.2, [0, 255, 0, 0]);
        written.write_png(&mut bytes).unwrap();
        let picture = read_rgba_png(bytes.as_slice()).unwrap();
        assert_eq!((&picture, picture.size()), (&written, [2, 1]));
        assert_eq!([0.0, 0.49, 0.5, 1.0].map(|x| picture.nearest(x, 0.7).unwrap()[0]), [255, 255, 0, 0]);
        assert_eq!(picture.nearest(f64::NAN, 0.0), None);
        assert!(read_rgba_png(&bytes[..40]).unwrap_err().to_string().contains("PNG container is damaged"));
        assert!(read_rgba_png(&b"ply"[..]).unwrap_err().to_string().contains("this is not PNG"));
    }
}
