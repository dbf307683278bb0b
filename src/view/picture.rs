//! The finished picture.

use super::Error;
use crate::formats::write_color_png;
use std::io::Write;

/// An sRGB picture, 8 bits per channel, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of one colour. A side of 0 becomes 1.
    pub fn filled(color: [u8; 3], width: usize, height: usize) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Self { width, height, pixels: vec![color; width * height] }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }
    /// All pixels, height × width × 3, row by row from the top.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }
    /// The pixels of one row, from the top.
    pub(super) fn rows_mut(&mut self) -> std::slice::ChunksExactMut<'_, [u8; 3]> {
        self.pixels.chunks_exact_mut(self.width)
    }
    /// The pixels alone.
    pub fn into_pixels(self) -> Vec<[u8; 3]> {
        self.pixels
    }
    /// All pixels, to be changed.
    pub(super) fn pixels_mut(&mut self) -> &mut [[u8; 3]] {
        &mut self.pixels
    }

    /// Copies `other` onto this picture with its upper left corner at `(left, top)`, clipped at the edges.
    pub fn paste(&mut self, other: &Picture, left: usize, top: usize) {
        let columns = other.width.min(self.width.saturating_sub(left));
        let from_row = other.pixels.chunks_exact(other.width);
        for (row, source) in self.rows_mut().skip(top).zip(from_row) {
            if columns > 0 {
                row[left..left + columns].copy_from_slice(&source[..columns]);
            }
        }
    }

    /// Writes PNG.
    ///
    /// **Errors** when `to` cannot be written.
    pub fn write_png(&self, mut to: impl Write) -> Result<(), Error> {
        to.write_all(&write_color_png([self.width, self.height], &self.pixels)?)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_color_picture;

    #[test]
    fn a_pasted_picture_is_cut_at_the_edge() {
        let mut sheet = Picture::filled([0; 3], 4, 3);
        sheet.paste(&Picture::filled([9; 3], 3, 3), 2, 1);
        let painted: Vec<_> = (0..12).filter(|&i| sheet.pixels()[i] == [9; 3]).collect();
        assert_eq!(painted, [6, 7, 10, 11]);
        sheet.paste(&Picture::filled([7; 3], 3, 3), 9, 9);
        assert!(!sheet.pixels().contains(&[7; 3]));
    }

    #[test]
    fn a_png_is_read_back_exactly() {
        let mut picture = Picture::filled([200, 30, 7], 5, 4);
        picture.pixels_mut()[6] = [1, 2, 3];
        let mut bytes = Vec::new();
        picture.write_png(&mut bytes).unwrap();
        let back = read_color_picture(&bytes).unwrap();
        assert_eq!((back.width, back.height, back.pixels.as_slice()), (5, 4, picture.pixels()));
    }
}
