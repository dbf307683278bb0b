//! The noise model of a depth camera.

use crate::numerics::Rng;

/// The noise of a depth camera.
///
/// **Source** Nguyen, Izadi & Lovell 2012, for the axial and lateral terms. They are those of a first-generation Kinect,
/// whose noise is larger than that of a second-generation one beyond 1.5 m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthNoise {
    /// `[a, b, c]` of the standard deviation along the ray, `a + b (z − c)²`: millimetres, millimetres per square metre,
    /// metres.
    pub axial_mm: [f64; 3],
    /// Factor of the term added beyond 60° of incidence, `z^−½ θ² / (π/2 − θ)²`, millimetres.
    pub axial_grazing_mm: f64,
    /// Standard deviation across the ray, pixels: half of the value of Nguyen et al. at edges, because inside a surface
    /// neighbouring pixels do not swap; with 0.8 fused scans are 1.6 times as noisy as foreign recordings.
    pub lateral_px: f64,
    /// Pixels drop out from this angle of incidence: radians (75°, as for time of flight on cloth).
    pub grazing: f64,
    /// Share of pixels lost anywhere: dark hair and multipath.
    pub lost: f64,
    /// Share of flying pixels along a depth edge: their depth is between that of its two sides.
    pub flying: f64,
    /// Depths are multiples of this, metres: whole millimetres in a 16-bit image.
    pub quantum: f64,
}

impl Default for DepthNoise {
    fn default() -> Self {
        Self {
            axial_mm: [1.2, 1.9, 0.4],
            axial_grazing_mm: 0.1,
            lateral_px: 0.4,
            grazing: 1.309,
            lost: 0.01,
            flying: 0.15,
            quantum: 1e-3,
        }
    }
}

/// Incidence adds to the axial noise from this angle: radians (60°).
const OBLIQUE: f64 = std::f64::consts::FRAC_PI_3;
/// The angular term is limited at this distance from a right angle, radians: its pole is not measured.
const NEAR_RIGHT_ANGLE: f64 = 0.06;

impl DepthNoise {
    /// No noise; depths are still rounded to millimetres.
    pub fn none() -> Self {
        Self {
            axial_mm: [0.0; 3],
            axial_grazing_mm: 0.0,
            lateral_px: 0.0,
            grazing: std::f64::consts::FRAC_PI_2,
            lost: 0.0,
            flying: 0.0,
            quantum: 1e-3,
        }
    }

    /// The standard deviation along the ray, metres, at depth `z` metres and incidence `angle` radians.
    pub fn axial(&self, z: f64, angle: f64) -> f64 {
        let [a, b, c] = self.axial_mm;
        let oblique = if angle > OBLIQUE {
            let from_right = (std::f64::consts::FRAC_PI_2 - angle).max(NEAR_RIGHT_ANGLE);
            self.axial_grazing_mm * (angle / from_right).powi(2) / z.max(0.1).sqrt()
        } else {
            0.0
        };
        1e-3 * (a + b * (z - c).powi(2) + oblique)
    }

    /// The measured depth where the true depth is `z`, metres; 0 where nothing is measured. `across` are the least and
    /// the greatest true depth of the pixel and its neighbours.
    pub(super) fn measured(&self, z: f64, cosine: f64, across: [f64; 2], rng: &mut Rng) -> f64 {
        let (noise, lost, flies) = (rng.normal(), rng.unit(), rng.unit());
        if z <= 0.0 || lost < self.lost || cosine < self.grazing.cos() * (0.6 + 0.8 * lost) {
            return 0.0;
        }
        /// Difference in depth from which neighbouring pixels belong to two surfaces, metres.
        const EDGE: f64 = 0.05;
        let z = if across[1] - across[0] > EDGE && flies < self.flying {
            // Given that the pixel flies, the draw over the share is uniform in 0..1.
            across[0] + (across[1] - across[0]) * flies / self.flying
        } else {
            z
        };
        let far = z + self.axial(z, cosine.clamp(0.0, 1.0).acos()) * noise;
        (far / self.quantum).round().max(0.0) * self.quantum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axial_deviation_is_nguyens_and_grows_at_a_graze() {
        let noise = DepthNoise::default();
        for (z, mm) in [(1.0, 1.884), (2.0, 6.064), (3.0, 14.044)] {
            assert!((1e3 * noise.axial(z, 0.3) - mm).abs() < 1e-9, "{z} m");
        }
        assert!(noise.axial(2.0, 1.35) > noise.axial(2.0, 1.0) + 1e-3);
    }

    #[test]
    fn flying_pixels_lie_between_the_two_sides_of_an_edge_and_nowhere_else() {
        let noise = DepthNoise { flying: 0.5, ..DepthNoise::none() };
        let mut rng = Rng::new(3);
        let at_edge: Vec<f64> = (0..2_000).map(|_| noise.measured(2.0, 1.0, [2.0, 3.5], &mut rng)).collect();
        let flying = at_edge.iter().filter(|&&z| (z - 2.0).abs() > 2e-3).count();
        assert!((850..1_150).contains(&flying), "{flying}");
        assert!(at_edge.iter().all(|z| (2.0..=3.5).contains(z)));
        assert!((0..500).all(|_| (noise.measured(2.0, 1.0, [1.99, 2.01], &mut rng) - 2.0).abs() < 1e-9));
    }
}
