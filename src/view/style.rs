//! One style for all that is laid out on a page: paper, ink, letters, rules.

use super::lettering::Pen;
use super::picture::Picture;

/// Pixels between two pictures, and around all.
pub(super) const GUTTER: usize = 10;
/// See [`GUTTER`].
pub(super) const BORDER: usize = 36;
/// Pixels of a page's head.
pub(super) const HEAD: usize = 92;
/// Metres that the scale bar stands for.
const SCALE_BAR: f64 = 0.5;

pub(super) const PAPER: [u8; 3] = [252, 252, 253];
const INK: [u8; 3] = [38, 42, 50];
const GREY_INK: [u8; 3] = [112, 118, 128];
const RULE: [u8; 3] = [222, 225, 230];

pub(super) const TITLE: Pen = Pen { size: 22.0, weight: 0.13, color: INK };
pub(super) const SUBTITLE: Pen = Pen { size: 12.0, weight: 0.11, color: GREY_INK };
pub(super) const ROW_TITLE: Pen = Pen { size: 15.0, weight: 0.15, color: INK };
pub(super) const NOTE: Pen = Pen { size: 10.5, weight: 0.12, color: INK };
pub(super) const NOTE_NAME: Pen = Pen { size: 10.5, weight: 0.115, color: GREY_INK };
pub(super) const CAPTION: Pen = Pen { size: 10.0, weight: 0.12, color: GREY_INK };

pub(super) fn rule(page: &mut Picture, [left, right]: [f32; 2], y: f32) {
    Pen { size: 1.0, weight: 1.0, color: RULE }.draw(page, &[[left, y], [right, y]]);
}

pub(super) fn draw_scale_bar(picture: &mut Picture, metres_per_pixel: f64) {
    let length = (SCALE_BAR / metres_per_pixel) as f32;
    let (left, y) = (14.0, picture.height() as f32 - 16.5);
    let pen = Pen { size: 1.0, weight: 1.6, color: GREY_INK };
    pen.draw(picture, &[[left, y - 5.0], [left, y], [left + length, y], [left + length, y - 5.0]]);
    let label = format!("{:.0} cm", SCALE_BAR * 100.0);
    CAPTION.write(picture, &label, left + 0.5 * (length - CAPTION.width_of(&label)), y - 7.0);
}
