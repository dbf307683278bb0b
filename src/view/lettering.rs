//! Writes labels on pictures.

use super::picture::Picture;
use super::strokes::{LETTERS, UNKNOWN};

/// Height of a capital in the units of the table of strokes.
const CAPITAL: f32 = 14.0;
/// Room between two letters, in the same units.
const SPACING: f32 = 3.6;
/// Degrees of an arc to one straight piece: at a capital of 40 pixels still within a tenth of a pixel.
const ARC_STEP_DEG: f32 = 12.0;
/// Straight pieces between two points of a smooth curve.
const CURVE_STEPS: usize = 6;

/// A pen for labels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pen {
    /// Pixels from the base line to the top of a capital.
    pub(super) size: f32,
    /// Width of a stroke as a share of `size`.
    pub(super) weight: f32,
    pub(super) color: [u8; 3],
}

impl Pen {
    /// Pixels that a text takes from its first to its last stroke.
    pub(super) fn width_of(&self, text: &str) -> f32 {
        let units: f32 = text.chars().map(|c| letter(c).0 + SPACING).sum();
        (units - SPACING).max(0.0) * self.size / CAPITAL
    }

    /// Writes one line that begins at `left` and stands on `base`, pixels from the upper left corner.
    pub(super) fn write(&self, on: &mut Picture, text: &str, left: f32, base: f32) {
        let scale = self.size / CAPITAL;
        let mut at = left;
        for c in text.chars() {
            let (width, strokes) = letter(c);
            for stroke in strokes.split(';').filter(|s| !s.is_empty()) {
                let points: Vec<_> =
                    points_of(stroke).iter().map(|p| [at + p[0] * scale, base - p[1] * scale]).collect();
                self.draw(on, &points);
            }
            at += (width + SPACING) * scale;
        }
    }

    /// Lays a line of ink with round ends through `points`; each pixel takes the ink of the nearest piece, once.
    pub(super) fn draw(&self, on: &mut Picture, points: &[[f32; 2]]) {
        let radius = 0.5 * self.weight * self.size;
        let span = |k: usize, limit: usize| {
            let (low, high) = points.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
            let first = (low - radius - 1.0).max(0.0) as usize;
            first..((high + radius + 2.0).max(0.0) as usize).min(limit)
        };
        let (columns, rows) = (span(0, on.width()), span(1, on.height()));
        let width = on.width();
        for row in rows {
            for column in columns.clone() {
                let middle = [column as f32 + 0.5, row as f32 + 0.5];
                let distance = points.windows(2).fold(f32::MAX, |d, ends| d.min(distance_to(middle, ends)));
                let ink = (radius + 0.5 - distance).clamp(0.0, 1.0);
                if ink > 0.0 {
                    let pixel = &mut on.pixels_mut()[row * width + column];
                    for (channel, &own) in pixel.iter_mut().zip(&self.color) {
                        *channel = (f32::from(*channel) * (1.0 - ink) + f32::from(own) * ink).round() as u8;
                    }
                }
            }
        }
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

fn letter(c: char) -> (f32, &'static str) {
    LETTERS.iter().find(|(known, ..)| *known == c).map_or(UNKNOWN, |&(_, width, strokes)| (width, strokes))
}

fn distance_to(p: [f32; 2], ends: &[[f32; 2]]) -> f32 {
    let (a, b) = (ends[0], ends[1]);
    let (along, offset) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length2 = along[0] * along[0] + along[1] * along[1];
    let t = if length2 > 0.0 { ((offset[0] * along[0] + offset[1] * along[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (offset[0] - t * along[0]).hypot(offset[1] - t * along[1])
}

/// The corners of one stroke of the table.
fn points_of(stroke: &str) -> Vec<[f32; 2]> {
    let (is_smooth, stroke) = stroke.strip_prefix('~').map_or((false, stroke), |rest| (true, rest));
    let mut points = Vec::new();
    for piece in stroke.split(' ') {
        let numbers: Vec<f32> = piece.trim_start_matches('@').split(',').filter_map(|n| n.parse().ok()).collect();
        match numbers[..] {
            [x, y] => points.push([x, y]),
            [cx, cy, rx, ry, from, to] => {
                let steps = ((to - from).abs() / ARC_STEP_DEG).ceil();
                points.extend((0..=steps as usize).map(|k| {
                    let angle = (from + (to - from) * k as f32 / steps).to_radians();
                    [cx + rx * angle.cos(), cy + ry * angle.sin()]
                }));
            }
            _ => {}
        }
    }
    if is_smooth { smooth(&points) } else { points }
}

/// A curve through points (Catmull & Rom 1974).
fn smooth(points: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let at = |k: isize| points[k.clamp(0, points.len() as isize - 1) as usize];
    let mut curve = Vec::new();
    for k in 0..points.len() as isize - 1 {
        let [before, from, to, after] = [at(k - 1), at(k), at(k + 1), at(k + 2)];
        for step in 0..CURVE_STEPS {
            let t = step as f32 / CURVE_STEPS as f32;
            curve.push(std::array::from_fn(|c| {
                let (p, q) = (to[c] - before[c], after[c] - from[c]);
                let (d, t2) = (to[c] - from[c], t * t);
                from[c] + 0.5 * p * t + (3.0 * d - p - 0.5 * q) * t2 + (0.5 * (p + q) - 2.0 * d) * t2 * t
            }));
        }
    }
    curve.extend(points.last());
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    const PEN: Pen = Pen { size: 14.0, weight: 0.12, color: [0; 3] };

    #[test]
    fn every_letter_is_well_formed_and_within_its_width() {
        for &(c, width, strokes) in LETTERS {
            for stroke in strokes.split(';').filter(|s| !s.is_empty()) {
                let pieces = stroke.trim_start_matches('~').split(' ').map(|p| {
                    (
                        p.starts_with('@'),
                        p.trim_start_matches('@').split(',').map(|n| n.parse::<f32>().is_ok()).collect(),
                    )
                });
                for (is_arc, numbers) in pieces {
                    let numbers: Vec<bool> = numbers;
                    assert_eq!((numbers.len(), numbers.contains(&false)), (if is_arc { 6 } else { 2 }, false), "{c}");
                }
                for [x, y] in points_of(stroke) {
                    assert!(x > -2.7 && x < width + 1.1 && y > -4.9 && y < 16.5, "{c} at {x}, {y}");
                }
            }
        }
        assert!((' '..='~').all(|c| LETTERS.iter().filter(|l| l.0 == c).count() == 1));
    }

    #[test]
    fn a_smooth_curve_goes_through_its_points() {
        let points = [[0.0, 0.0], [3.0, 1.0], [4.0, 5.0], [1.0, 6.0]];
        let curve = smooth(&points);
        assert!(points.iter().enumerate().all(|(k, p)| curve[k * CURVE_STEPS] == *p));
        let longest = curve.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).fold(0.0, f32::max);
        assert!(longest < 1.2, "{longest}");
    }

    #[test]
    fn lines_keep_all_words_and_the_width() {
        let text = "hips 0.4 mm, waist 1.2 mm, chest 0.9 mm";
        let lines = PEN.lines_of(text, 160.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| PEN.width_of(line) <= 160.0));
        assert_eq!(lines.join(" "), text);
    }

    #[test]
    fn ink_falls_where_the_letter_is() {
        let mut picture = Picture::filled([255; 3], 40, 30);
        PEN.write(&mut picture, "L", 10.0, 20.0);
        let at = |x: usize, y: usize| picture.pixels()[y * 40 + x][0];
        assert!(at(10, 10) < 120 && at(14, 19) < 200 && at(20, 8) == 255 && at(5, 19) == 255);
    }
}
