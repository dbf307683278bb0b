//! Recognises the unit and the up axis of a stream by the person in it.

use super::error::StreamError;
use crate::body::Side;
use crate::drive::landmark::{Landmark, Places};
use crate::geometry::Vec3;
use crate::scan::{Unit, Up};

/// A landmark of either side.
type OfSide = fn(Side) -> Landmark;

/// Segments of arms and legs, as shares of the stature.
///
/// **Source** Drillis and Contini 1966, as in Winter, Biomechanics and Motor Control of Human Movement, Fig. 4.1.
const SEGMENTS: [(OfSide, OfSide, f64); 4] = [
    (Landmark::Shoulder, Landmark::Elbow, 0.186),
    (Landmark::Elbow, Landmark::Wrist, 0.146),
    (Landmark::Hip, Landmark::Knee, 0.245),
    (Landmark::Knee, Landmark::Ankle, 0.246),
];

/// How many segments make an estimate: with one, a landmark at the wrong place decides.
const LEAST_SEGMENTS: usize = 2;

/// Metres. Adults are 1.4 to 2.1 m tall; landmarks on the skin and noise change the estimate by a fifth, and a larger range
/// would confuse inches with centimetres.
const PLAUSIBLE_STATURE: std::ops::RangeInclusive<f64> = 0.6..=2.5;

/// Metres; of two plausible units that is taken whose person is nearer to this one.
const USUAL_STATURE: f64 = 1.6;

/// Cosine of 30°: trunk and legs of a person who stands are closer to the vertical, those of a person who sits are not.
const UPRIGHT_COSINE: f64 = 0.866;

/// The person's height in the stream's unit: the median of the estimates from arms and legs. `None` where too few are seen.
pub fn stature(places: &Places) -> Option<f64> {
    let mut estimates = Vec::new();
    for (from, to, share) in SEGMENTS {
        for side in Side::BOTH {
            if let (Some(a), Some(b)) = (places[from(side).index()], places[to(side).index()]) {
                estimates.push((b - a).norm() / share);
            }
        }
    }
    estimates.sort_by(f64::total_cmp);
    (estimates.len() >= LEAST_SEGMENTS).then(|| estimates[estimates.len() / 2])
}

/// The unit of a stream whose person has that height: the stated one where it is plausible, else the most plausible one.
pub fn unit_of(stature: f64, stated: Option<Unit>) -> Result<Unit, StreamError> {
    let is_plausible = |unit: &Unit| PLAUSIBLE_STATURE.contains(&(stature * unit.metres()));
    if let Some(unit) = stated.filter(is_plausible) {
        return Ok(unit);
    }
    let distance = |unit: &Unit| (stature * unit.metres() / USUAL_STATURE).ln().abs();
    // Nobody measures people in decimetres, and 17 of them are as many centimetres as a hand has.
    let candidates = Unit::ALL.into_iter().filter(|unit| *unit != Unit::Decimetre).filter(is_plausible);
    candidates.min_by(|a, b| distance(a).total_cmp(&distance(b))).ok_or(StreamError::UnknownUnit { stature })
}

/// The axis along which the person stands; `None` where this frame does not show it clearly.
pub fn up_of(places: &Places) -> Option<Up> {
    let middle = |landmark: OfSide| {
        let [left, right] = Side::BOTH.map(|side| places[landmark(side).index()]);
        Some(nalgebra::center(&left?, &right?))
    };
    let (shoulders, hips, ankles) = (middle(Landmark::Shoulder)?, middle(Landmark::Hip)?, middle(Landmark::Ankle)?);
    let trunk: Vec3 = (shoulders - hips).try_normalize(f64::EPSILON)?;
    let legs: Vec3 = (hips - ankles).try_normalize(f64::EPSILON)?;
    Up::ALL.into_iter().find(|up| [trunk, legs].iter().all(|part| part.dot(&up.direction()) >= UPRIGHT_COSINE))
}

/// Whether places between 0 and 1 are positions in an image: world landmarks have their origin at the hips.
pub fn are_image_coordinates(places: &Places) -> bool {
    /// Shares of the image; points may be slightly outside of it.
    const IMAGE: std::ops::RangeInclusive<f64> = -0.1..=1.1;
    /// Metres, or shares of the image: a tracker's origin is at the hips to a millimetre.
    const FAR_FROM_ORIGIN: f64 = 0.2;
    let Some(pelvis) = places[Landmark::Pelvis.index()] else { return false };
    pelvis.coords.norm() > FAR_FROM_ORIGIN
        && places.iter().flatten().all(|place| IMAGE.contains(&place.x) && IMAGE.contains(&place.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_follow_from_the_height() {
        for (stature, unit) in [(1.7, "m"), (170.0, "cm"), (1700.0, "mm"), (67.0, "in"), (1.4, "m"), (55.0, "in")] {
            assert_eq!(unit_of(stature, None).unwrap().to_string(), unit, "{stature}");
        }
        assert_eq!(unit_of(90.0, Some(Unit::Centimetre)).unwrap(), Unit::Centimetre);
        assert_eq!(unit_of(1700.0, Some(Unit::Metre)).unwrap(), Unit::Millimetre);
        for stature in [0.0, 0.1, 17.0, 1e5, f64::MAX, f64::INFINITY] {
            assert!(unit_of(stature, Some(Unit::Metre)).is_err(), "{stature}");
        }
    }
}
