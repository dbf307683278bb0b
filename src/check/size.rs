//! Whether a garment has the size of the person.

use crate::tryon::EaseGirth;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Share of its length by which cloth may be stretched around a body before it is too tight: knits are worn so, weaves hardly give.
///
/// **Source** negative ease of knits is 5 to 15 % of the girth (pattern designers); denim and shirting are stiff.
const KNIT: f64 = 0.10;
const WEAVE: f64 = 0.02;
/// Cloth that resists stretch by less is a knit, N/m: between knits (at most 250) and silk (774) of `templates/fabrics.toml`.
const STRETCHY: f64 = 400.0;

/// Whether a garment has the size of the person who wears it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SizeVerdict {
    /// It would have to be longer around some place.
    TooTight {
        /// The tape line: `hip`.
        at: String,
        /// By how much, metres.
        by: f64,
    },
    /// It does not stay where it is worn.
    SlidesDown {
        /// How far it falls on average, metres.
        by: f64,
    },
    /// It fits.
    Fits,
}

impl SizeVerdict {
    /// Of a garment that was simulated until it rests: its rings as they are then, how far it fell, in metres, and what resists its
    /// stretch, in N/m. `slides`: how far is too far, metres.
    pub fn of(girths: &[EaseGirth], fell: f64, slides: f64, stretch_resistance: f64) -> Self {
        let allowed = if stretch_resistance < STRETCHY { KNIT } else { WEAVE };
        let too_short = |girth: &EaseGirth| girth.own * (girth.strain() - allowed);
        let tightest = girths.iter().max_by(|a, b| too_short(a).total_cmp(&too_short(b)));
        match tightest.filter(|girth| too_short(girth) > 0.0) {
            Some(girth) => Self::TooTight { at: girth.name.clone(), by: girth.own * girth.strain() },
            None if fell > slides => Self::SlidesDown { by: fell },
            None => Self::Fits,
        }
    }
}

impl fmt::Display for SizeVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooTight { at, by } => write!(f, "{:.0} cm too tight at the {at}", (100.0 * by).max(1.0)),
            Self::SlidesDown { by } => write!(f, "slides down by {:.0} cm", 100.0 * by),
            Self::Fits => write!(f, "fits"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(name: &str, own: f64, worn: f64, gap: f64) -> EaseGirth {
        EaseGirth { name: name.into(), body: worn, worn, own, gap }
    }

    #[test]
    fn the_tightest_ring_decides_and_knits_may_stretch() {
        let rings = [ring("waist", 0.80, 0.80, 0.01), ring("hip", 0.95, 0.98, 0.0)];
        let weave = SizeVerdict::of(&rings, 0.0, 0.1, 3000.0);
        assert_eq!(weave.to_string(), "3 cm too tight at the hip");
        assert_eq!(SizeVerdict::of(&rings, 0.0, 0.1, 100.0), SizeVerdict::Fits);
        // Skin that gives way hides how tight it is.
        let pressed = [ring("thigh", 0.50, 0.50, -0.01)];
        assert_eq!(SizeVerdict::of(&pressed, 0.0, 0.1, 3000.0).to_string(), "6 cm too tight at the thigh");
        assert_eq!(SizeVerdict::of(&rings[..1], 0.23, 0.1, 3000.0).to_string(), "slides down by 23 cm");
    }
}
