//! Samples a picture at texture coordinates, in linear light.

use crate::formats::{ColorPicture, Wrap, linear_of_byte};

/// A picture, prepared for sampling.
pub struct PictureSampler {
    picture: ColorPicture,
    linear: [f32; 256],
}

impl PictureSampler {
    /// Of a decoded picture.
    pub fn new(picture: ColorPicture) -> Self {
        Self { picture, linear: std::array::from_fn(|byte| linear_of_byte(byte as u8) as f32) }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.picture.width, self.picture.height]
    }

    /// The colour at a coordinate from the lower left, between the four nearest pixels, in linear light as on graphics cards.
    ///
    /// **Requires** a finite coordinate.
    pub fn at(&self, [u, v]: [f64; 2], wrap: [Wrap; 2]) -> [f32; 3] {
        let [width, height] = self.size();
        let (x, right) = split(u * width as f64);
        let (y, down) = split((1.0 - v) * height as f64);
        let columns = [x, x.saturating_add(1)].map(|x| wrapped(x, width, wrap[0]));
        let rows = [y, y.saturating_add(1)].map(|y| wrapped(y, height, wrap[1]));
        let mut sum = [0.0; 3];
        for (row, share_of_row) in rows.into_iter().zip([1.0 - down, down]) {
            for (column, share) in columns.into_iter().zip([1.0 - right, right]) {
                let pixel = self.picture.pixels[row * width + column];
                for (sum, byte) in sum.iter_mut().zip(pixel) {
                    *sum += share_of_row * share * self.linear[usize::from(byte)];
                }
            }
        }
        sum
    }
}

/// The pixel whose centre precedes a place, and how far behind it the place is, in pixels.
fn split(place: f64) -> (i64, f32) {
    let from_centre = place - 0.5;
    let whole = from_centre.floor();
    // `as` saturates.
    (whole as i64, (from_centre - whole) as f32)
}

fn wrapped(at: i64, count: usize, wrap: Wrap) -> usize {
    let count = count as i64;
    let inside = match wrap {
        Wrap::Repeat => at.rem_euclid(count),
        Wrap::Clamp => at.clamp(0, count - 1),
        Wrap::Mirror => {
            let at = at.rem_euclid(2 * count);
            if at < count { at } else { 2 * count - 1 - at }
        }
    };
    inside as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::byte_of_linear;

    /// Red grows to the right by 10 per pixel, green downwards by 100.
    fn sampler() -> PictureSampler {
        let pixels = (0..8).map(|k| [10 * (k % 4) as u8, 100 * (k / 4) as u8, 7]).collect();
        PictureSampler::new(ColorPicture { width: 4, height: 2, pixels })
    }

    fn byte(at: [f64; 2], wrap: Wrap) -> [u8; 3] {
        sampler().at(at, [wrap; 2]).map(|c| byte_of_linear(f64::from(c)))
    }

    #[test]
    fn the_centre_of_a_pixel_has_its_colour_and_v_runs_upwards() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            assert_eq!(byte([0.125, 0.25], wrap), [0, 100, 7]);
            assert_eq!(byte([0.875, 0.75], wrap), [30, 0, 7]);
        }
    }

    #[test]
    fn between_pixels_light_is_averaged() {
        let between = byte([0.25, 0.25], Wrap::Clamp);
        let light = (linear_of_byte(0) + linear_of_byte(10)) / 2.0;
        assert_eq!(between, [byte_of_linear(light), 100, 7]);
    }

    #[test]
    fn outside_the_picture_repeats_mirrors_or_ends() {
        assert_eq!(byte([1.125, 2.25], Wrap::Repeat), [0, 100, 7]);
        assert_eq!(byte([-0.125, 0.25], Wrap::Repeat), [30, 100, 7]);
        assert_eq!(byte([1.125, 0.25], Wrap::Mirror), [30, 100, 7]);
        assert_eq!(byte([-0.375, -0.25], Wrap::Mirror), [10, 100, 7]);
        assert_eq!(byte([9.0, 0.75], Wrap::Clamp), [30, 0, 7]);
        assert_eq!(byte([-1e300, 1e300], Wrap::Clamp), [0, 0, 7]);
        // Only that it answers.
        byte([1e300, -1e300], Wrap::Repeat);
        byte([1e300, -1e300], Wrap::Mirror);
    }
}
