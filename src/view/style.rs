//! The style of every page: paper, ink, letters, rules.

use super::lettering::{Pen, Weight};
use super::picture::Picture;

/// Pixels between two pictures.
pub(super) const GUTTER: usize = 10;
/// Pixels around all pictures.
pub(super) const BORDER: usize = 36;
/// Height of a page's head, in pixels.
pub(super) const HEAD: usize = 92;
/// Length of the scale bar, in metres.
const SCALE_BAR: f64 = 0.5;

pub(super) const PAPER: [u8; 3] = [252, 252, 253];
const INK: [u8; 3] = [38, 42, 50];
const GREY_INK: [u8; 3] = [112, 118, 128];
const RULE: [u8; 3] = [222, 225, 230];

pub(super) const TITLE: Pen = Pen { size: 22.0, weight: Weight::SemiBold, color: INK };
pub(super) const SUBTITLE: Pen = Pen { size: 12.0, weight: Weight::Regular, color: GREY_INK };
pub(super) const ROW_TITLE: Pen = Pen { size: 15.0, weight: Weight::SemiBold, color: INK };
pub(super) const NOTE: Pen = Pen { size: 10.5, weight: Weight::Regular, color: INK };
pub(super) const NOTE_NAME: Pen = Pen { size: 10.5, weight: Weight::Regular, color: GREY_INK };
pub(super) const CAPTION: Pen = Pen { size: 10.0, weight: Weight::Regular, color: GREY_INK };

/// A line one pixel high.
pub(super) fn rule(page: &mut Picture, [left, right]: [usize; 2], y: usize) {
    page.paste(&Picture::filled(RULE, right.saturating_sub(left), 1), left, y);
}

pub(super) fn draw_scale_bar(picture: &mut Picture, metres_per_pixel: f64) {
    let length = (SCALE_BAR / metres_per_pixel).round() as usize;
    let (left, y) = (14, picture.height().saturating_sub(18));
    for (x, y, width, height) in [
        (left, y, length, 2),
        (left, y.saturating_sub(5), 2, 5),
        ((left + length).saturating_sub(2), y.saturating_sub(5), 2, 5),
    ] {
        picture.paste(&Picture::filled(GREY_INK, width, height), x, y);
    }
    let label = format!("{:.0} cm", SCALE_BAR * 100.0);
    let middle = left as f32 + 0.5 * length as f32;
    CAPTION.write(picture, &label, middle - 0.5 * CAPTION.width_of(&label), y as f32 - 6.0);
}
