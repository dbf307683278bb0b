//! Whether a garment has the size of the person.

use super::doubts::Doubt;
use crate::segment::Fabric;
use crate::tryon::{BAND, EaseGirth};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Share of its length by which cloth may be stretched around a body before it is too tight: knits are worn so, weaves hardly give.
///
/// **Source** negative ease of knits is 5 to 15 % of the girth (pattern designers); denim and shirting are stiff.
const KNIT: f64 = 0.10;
const WEAVE: f64 = 0.02;
/// Cloth that resists stretch by less is a knit, N/m: between knits (at most 152) and silk (774) of `templates/fabrics.toml`.
const STRETCHY: f64 = 400.0;

/// Relative length of edges, 95th percentile, above which a garment is too small. Of five garments on a man and a woman, those that
/// fit have 1.06 to 1.12; a T-shirt of a smaller man has 1.32.
const STRETCHED: f64 = 1.15;

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
    /// Its cloth is stretched, but around no place that is measured.
    Stretched {
        /// By which share of its length.
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
    /// Of a garment that was simulated until it rests: its rings as they are then, the 95th percentile of the relative lengths of its
    /// edges where it is known, how far it fell, in metres, if it did not stay where it is worn, and its fabric.
    pub fn of(girths: &[EaseGirth], edges_p95: Option<f64>, slid: Option<f64>, fabric: &Fabric) -> Self {
        let allowed = if fabric.stretch[0] < STRETCHY { KNIT } else { WEAVE };
        let too_short = |girth: &EaseGirth| girth.own * (girth.strain() - allowed);
        // A band that has slid over the seat is around the thighs, of which it says nothing.
        let counts = |girth: &&EaseGirth| slid.is_none() || girth.name != BAND;
        let tightest = girths.iter().filter(counts).max_by(|a, b| too_short(a).total_cmp(&too_short(b)));
        match tightest.filter(|girth| too_short(girth) > 0.0) {
            Some(girth) => Self::TooTight { at: girth.name.clone(), by: girth.own * girth.strain() },
            None => match edges_p95.filter(|length| *length > STRETCHED) {
                Some(length) => Self::Stretched { by: length - 1.0 },
                None => Self::of_slide(slid),
            },
        }
    }

    /// Of a garment of which only is known how far it fell, in metres, if it did not stay where it is worn.
    pub fn of_slide(slid: Option<f64>) -> Self {
        slid.map_or(Self::Fits, |by| Self::SlidesDown { by })
    }
}

impl SizeVerdict {
    /// What is in doubt of a layer of this size.
    pub fn doubt(&self) -> Option<Doubt> {
        let (what, remedy) = match self {
            Self::Fits => return None,
            Self::TooTight { .. } | Self::Stretched { .. } => ("small", "larger"),
            Self::SlidesDown { .. } => ("large", "smaller"),
        };
        Some(Doubt {
            what: format!("the garment is too {what} for this person: {self}"),
            remedy: format!("try on a {remedy} size"),
        })
    }
}

impl fmt::Display for SizeVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooTight { at, by } => write!(f, "it is {:.0} cm too tight at the {at}", (100.0 * by).max(1.0)),
            Self::Stretched { by } => write!(f, "its cloth is stretched by {:.0} %", 100.0 * by),
            Self::SlidesDown { by } => write!(f, "it slides down by {:.0} cm", 100.0 * by),
            Self::Fits => write!(f, "it fits"),
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
        let [denim, jersey] = ["denim", "jersey"].map(|name| Fabric::named(name).unwrap());
        let rings = [ring("waist", 0.80, 0.80, 0.01), ring("hip", 0.95, 0.98, 0.0)];
        let tight = SizeVerdict::of(&rings, None, None, denim);
        assert_eq!(tight.to_string(), "it is 3 cm too tight at the hip");
        assert!(tight.doubt().unwrap().remedy.contains("larger"));
        assert_eq!(SizeVerdict::of(&rings, Some(1.1), None, jersey), SizeVerdict::Fits);
        assert_eq!(SizeVerdict::Fits.doubt(), None);
        // Skin that gives way hides how tight it is.
        let pressed = [EaseGirth { body: 0.57, ..ring("thigh", 0.50, 0.50, -0.01) }];
        assert_eq!(SizeVerdict::of(&pressed, None, None, denim).to_string(), "it is 6 cm too tight at the thigh");
        assert_eq!(SizeVerdict::of(&rings[..1], None, Some(0.23), denim).to_string(), "it slides down by 23 cm");
        let band = [ring("band", 1.03, 1.06, 0.0)];
        assert_eq!(SizeVerdict::of(&band, None, Some(0.2), denim).to_string(), "it slides down by 20 cm");
        assert_eq!(SizeVerdict::of(&band, None, None, denim).to_string(), "it is 3 cm too tight at the band");
        let stretched = SizeVerdict::of(&[], Some(1.3), Some(0.23), jersey);
        assert_eq!(stretched.to_string(), "its cloth is stretched by 30 %");
    }
}
