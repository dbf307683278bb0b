//! Screen-space ambient occlusion: the fraction of the surrounding light that reaches a point, estimated from the depths
//! in the picture (Mittring 2007; directions in the half sphere after Filion & McNaughton 2008).

use super::raster::{NOTHING, Visibility};
use super::surface::Triple;

/// Distance in metres within which surfaces occlude each other: an arm next to the chest does, a hand in front of the
/// belly does not.
const REACH: f32 = 0.14;
/// Depth difference in metres that does not occlude: scan noise, and triangles seen edge-on.
const BIAS: f32 = 0.004;
/// Strength of the effect; 1 made the folds of scans too dark.
const STRENGTH: f32 = 0.85;

/// The probes of one pixel, distributed over its samples, whose results are averaged.
pub(super) struct Probes {
    /// One list per sample of a pixel; offsets in metres over a surface that faces +z.
    of_sample: Vec<Vec<Triple>>,
}

impl Probes {
    /// `each` probes for each of `samples` samples.
    pub(super) fn prepare(samples: usize, each: usize) -> Self {
        let count = samples * each;
        let mut of_sample = vec![Vec::with_capacity(each); samples];
        for i in 0..count {
            // Cosine-weighted directions on a golden spiral. Distances are denser near the point and decorrelated from the
            // directions by the van der Corput sequence, so that near and far probes cover all directions.
            let u = (i as f32 + 0.5) / count as f32;
            let turn = i as f32 * 2.399_963;
            let distance = 0.006 + (REACH - 0.006) * radical_inverse(i as u32).powi(2);
            let (across, up) = (u.sqrt(), (1.0 - u).sqrt());
            let direction = Triple::new(across * turn.cos(), across * turn.sin(), up);
            of_sample[i % samples].push(direction * distance);
        }
        Self { of_sample }
    }

    /// Fraction of the surrounding light at a point with a unit normal, 1 where nothing occludes it; `sample` counts
    /// within the pixel.
    pub(super) fn openness(&self, seen: &Visibility, point: &Triple, normal: &Triple, sample: usize) -> f32 {
        let [tangent, cotangent] = frame_around(normal);
        let probes = &self.of_sample[sample];
        let mut hidden = 0.0;
        for probe in probes {
            let at = point + tangent * probe.x + cotangent * probe.y + normal * (probe.z + BIAS);
            let Some(hit) = seen.under(at.x, at.y) else { continue };
            let over = hit.nearness - at.z;
            if hit.face != NOTHING && over > BIAS {
                // An occluder far in front is another object: its effect falls off.
                hidden += 1.0 - ((over - REACH) / (2.0 * REACH)).clamp(0.0, 1.0);
            }
        }
        1.0 - STRENGTH * hidden / probes.len() as f32
    }
}

/// The van der Corput sequence in base 2: 0, 1/2, 1/4, 3/4, 1/8 …
pub(super) fn radical_inverse(i: u32) -> f32 {
    i.reverse_bits() as f32 / 4_294_967_296.0
}

/// Two unit vectors orthogonal to a unit vector and each other (Duff et al. 2017).
fn frame_around(n: &Triple) -> [Triple; 2] {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [Triple::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Triple::new(b, sign + n.y * n.y * a, -n.y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::raster::Grid;

    #[test]
    fn the_frame_is_orthonormal_all_around() {
        for i in 0..50 {
            let turn = i as f32;
            let n = Triple::new(turn.cos(), (turn * 0.37).sin(), turn.sin()).normalize();
            let [t, c] = frame_around(&n);
            assert!(t.dot(&c).abs() < 1e-5 && t.dot(&n).abs() < 1e-5 && c.dot(&n).abs() < 1e-5);
            assert!((t.norm() - 1.0).abs() < 1e-5 && (t.cross(&c) - n).norm() < 1e-4);
        }
    }

    #[test]
    fn a_corner_is_darker_than_a_plain() {
        // A floor seen from above, and a block on it to the right.
        let grid = Grid { columns: 200, rows: 200, step: 0.005 };
        let corner = |x: f32, y: f32, z: f32| Triple::new(x, y, z);
        let positions = [
            corner(-1.0, -1.0, 0.0),
            corner(1.0, -1.0, 0.0),
            corner(1.0, 1.0, 0.0),
            corner(-1.0, 1.0, 0.0),
            corner(0.2, -1.0, 0.2),
            corner(1.0, -1.0, 0.2),
            corner(1.0, 1.0, 0.2),
            corner(0.2, 1.0, 0.2),
        ];
        let seen = Visibility::draw(&positions, &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], grid);
        let probes = Probes::prepare(9, 4);
        let openness =
            |x: f32| (0..9).map(|s| probes.openness(&seen, &corner(x, 0.0, 0.0), &Triple::z(), s)).sum::<f32>() / 9.0;
        assert_eq!(openness(-0.3), 1.0);
        assert!(openness(0.19) < 0.8 && openness(0.19) < openness(0.12), "{} {}", openness(0.19), openness(0.12));
    }
}
