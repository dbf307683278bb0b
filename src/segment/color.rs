//! Perceptually uniform colours, and mixtures of them.

/// CIE L*a*b* under D65.
pub type Lab = [f64; 3];

/// Standard deviations of L*, a*, b* between two views of the same cloth. Lightness varies with the light and the
/// fold, hue hardly: 12 and 5 are what fused scans of one garment show a step apart.
pub(super) const SPREAD: Lab = [12.0, 5.0, 5.0];
/// Components of a mixture: a striped garment's colours, its buttons and its shadows.
const COMPONENTS: usize = 6;
/// Greatest number of colours used to build a mixture; more add nothing.
const GREATEST_SAMPLE: usize = 4000;
const ROUNDS: usize = 12;

/// Converts 8-bit sRGB to CIE L*a*b*.
pub fn lab_of(rgb: [u8; 3]) -> Lab {
    let [r, g, b] = rgb.map(|c| {
        let c = f64::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    });
    let xyz = [
        (0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047,
        0.2126729 * r + 0.7151522 * g + 0.0721750 * b,
        (0.0193339 * r + 0.119192 * g + 0.9503041 * b) / 1.08883,
    ];
    let [x, y, z] = xyz.map(|t| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Squared distance of two colours, in units of `SPREAD`.
pub(super) fn squared_difference(a: &Lab, b: &Lab, spread: &Lab) -> f64 {
    (0..3).map(|k| ((a[k] - b[k]) / spread[k]).powi(2)).sum()
}

/// Distance of two colours, in standard deviations of one cloth between two views.
pub fn color_difference(a: &Lab, b: &Lab) -> f64 {
    squared_difference(a, b, &SPREAD).sqrt()
}

/// Density of a normal distribution, without the common factor (2π)^(−3/2).
pub(super) fn density(color: &Lab, mean: &Lab, spread: &Lab) -> f64 {
    (-0.5 * squared_difference(color, mean, spread)).exp() / (spread[0] * spread[1] * spread[2])
}

/// A mixture of colours, each with its own spread.
pub(super) struct Mixture(Vec<(f64, Lab, Lab)>);

impl Mixture {
    /// A mixture of these colours; `None` if there are too few.
    pub(super) fn of(colors: &[Lab]) -> Option<Self> {
        if colors.len() < 4 * COMPONENTS {
            return None;
        }
        let stride = colors.len().div_ceil(GREATEST_SAMPLE);
        let colors: Vec<Lab> = colors.iter().step_by(stride).copied().collect();
        let mut means = spread_out(&colors);
        let mut owner = vec![0; colors.len()];
        for _ in 0..ROUNDS {
            for (o, color) in owner.iter_mut().zip(&colors) {
                *o = nearest(color, &means);
            }
            for (k, mean) in means.iter_mut().enumerate() {
                if let Some(new) = mean_of(colors.iter().zip(&owner).filter(|(_, o)| **o == k).map(|(c, _)| c)) {
                    *mean = new;
                }
            }
        }
        let parts = means.iter().enumerate().filter_map(|(k, mean)| {
            let own: Vec<&Lab> = colors.iter().zip(&owner).filter(|(_, o)| **o == k).map(|(c, _)| c).collect();
            let share = own.len() as f64 / colors.len() as f64;
            let spread = std::array::from_fn(|axis| {
                let variance =
                    own.iter().map(|c| (c[axis] - mean[axis]).powi(2)).sum::<f64>() / own.len().max(1) as f64;
                // At least half of the spread within one cloth.
                variance.sqrt().max(0.5 * SPREAD[axis])
            });
            (!own.is_empty()).then_some((share, *mean, spread))
        });
        Some(Self(parts.collect()))
    }

    /// Density of a colour.
    pub(super) fn density(&self, color: &Lab) -> f64 {
        self.0.iter().map(|(share, mean, spread)| share * density(color, mean, spread)).sum()
    }
}

/// Initial centres as far apart as possible, the first at the mean.
fn spread_out(colors: &[Lab]) -> Vec<Lab> {
    let mut means: Vec<Lab> = mean_of(colors.iter()).into_iter().collect();
    let mut gap: Vec<f64> = colors.iter().map(|c| squared_difference(c, &means[0], &SPREAD)).collect();
    while means.len() < COMPONENTS {
        let farthest = (0..colors.len()).fold(0, |best, i| if gap[i] > gap[best] { i } else { best });
        means.push(colors[farthest]);
        for (g, c) in gap.iter_mut().zip(colors) {
            *g = g.min(squared_difference(c, &colors[farthest], &SPREAD));
        }
    }
    means
}

fn nearest(color: &Lab, means: &[Lab]) -> usize {
    let gap = |k: usize| squared_difference(color, &means[k], &SPREAD);
    (1..means.len()).fold(0, |best, k| if gap(k) < gap(best) { k } else { best })
}

fn mean_of<'a>(colors: impl Iterator<Item = &'a Lab>) -> Option<Lab> {
    let (mut sum, mut count) = ([0.0; 3], 0usize);
    for color in colors {
        for (s, c) in sum.iter_mut().zip(color) {
            *s += c;
        }
        count += 1;
    }
    (count > 0).then(|| sum.map(|s| s / count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours() {
        let near = |a: Lab, b: Lab| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 0.1);
        assert!(near(lab_of([255, 255, 255]), [100.0, 0.0, 0.0]));
        assert!(near(lab_of([255, 0, 0]), [53.24, 80.09, 67.20]));
        assert!(near(lab_of([0, 0, 0]), [0.0, 0.0, 0.0]));
    }

    #[test]
    fn a_mixture_knows_its_own_stripes_from_a_third_colour() {
        let (navy, white, skin) = (lab_of([30, 40, 90]), lab_of([240, 240, 235]), lab_of([200, 150, 125]));
        let stripes: Vec<Lab> = (0..600).map(|i| if i % 3 == 0 { white } else { navy }).collect();
        let mixture = Mixture::of(&stripes).unwrap();
        assert!(mixture.density(&navy) > 1e3 * mixture.density(&skin));
        assert!(mixture.density(&white) > 1e3 * mixture.density(&skin));
        assert!(Mixture::of(&stripes[..10]).is_none());
    }
}
