//! The places of a face at which its picture is sampled.

use super::sampler::PictureSampler;
use crate::formats::RawMaterial;

/// Side of the part of a face that colours a corner, as a share of the face's: the parts of the three corners do not
/// overlap, and an edge between two fabrics is blurred by a third of an edge.
const PART: f64 = 1.0 / 3.0;
/// Distance of samples in pixels: linear interpolation covers two.
const SPACING: f64 = 2.0;
/// Most samples along a side of a part: 36 per corner average a fabric of any weave.
const MOST: usize = 6;

/// Barycentric coordinates of samples within a part, by the number along its side.
pub(super) struct CornerSamples {
    of_count: Vec<Vec<[f64; 2]>>,
}

impl CornerSamples {
    pub fn prepare() -> Self {
        Self { of_count: (1..=MOST).map(centres).collect() }
    }

    /// The colours of a face's corners in linear light, and the area of the face in the picture, in pixels.
    pub fn of(&self, sampler: &PictureSampler, coords: [[f64; 2]; 3], material: &RawMaterial) -> ([[f32; 3]; 3], f64) {
        let [width, height] = sampler.size().map(|n| n as f64);
        let side = |k: usize, l: usize| [(coords[l][0] - coords[k][0]) * width, (coords[l][1] - coords[k][1]) * height];
        let (to_b, to_c) = (side(0, 1), side(0, 2));
        let pixels = 0.5 * (to_b[0] * to_c[1] - to_b[1] * to_c[0]).abs();
        let longest = [to_b, to_c, side(1, 2)].into_iter().map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
        // `as` saturates.
        let count = ((PART * longest / SPACING).ceil() as usize).clamp(1, MOST);
        let places = &self.of_count[count - 1];
        let factor = material.color.map(|c| c as f32);
        let corner = |k: usize| {
            let (here, one, other) = (coords[k], coords[(k + 1) % 3], coords[(k + 2) % 3]);
            let mut sum = [0.0; 3];
            for [a, b] in places {
                let at = [0, 1].map(|i| here[i] + PART * (a * (one[i] - here[i]) + b * (other[i] - here[i])));
                let color = sampler.at(at, material.wrap);
                sum.iter_mut().zip(color).for_each(|(sum, c)| *sum += c);
            }
            std::array::from_fn(|i| sum[i] / places.len() as f32 * factor[i])
        };
        ([corner(0), corner(1), corner(2)], pixels)
    }
}

/// The centres of the n² triangles into which a triangle is divided.
fn centres(n: usize) -> Vec<[f64; 2]> {
    let mut centres = Vec::with_capacity(n * n);
    let at =
        |i: usize, j: usize, third: f64| [(i as f64 + third / 3.0) / n as f64, (j as f64 + third / 3.0) / n as f64];
    for i in 0..n {
        for j in 0..n - i {
            centres.push(at(i, j, 1.0));
            if i + j + 1 < n {
                centres.push(at(i, j, 2.0));
            }
        }
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_fill_the_part_evenly() {
        for n in 1..=MOST {
            let centres = centres(n);
            assert_eq!(centres.len(), n * n);
            for k in 0..2 {
                let mean: f64 = centres.iter().map(|c| c[k]).sum::<f64>() / centres.len() as f64;
                assert!((mean - 1.0 / 3.0).abs() < 1e-12, "{n}: {mean}");
            }
            assert!(centres.iter().all(|c| c[0] > 0.0 && c[1] > 0.0 && c[0] + c[1] < 1.0));
        }
    }
}
