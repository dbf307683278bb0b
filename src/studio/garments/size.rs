//! Sizes: one pattern graded from size to size.

use crate::body::{HumanJoint, Limb};
use crate::studio::error::StudioError;
use std::f64::consts::TAU;

/// Girth that a size adds at chest, waist and hip, in metres: the interval of EN 13402-3.
const GIRTH: f64 = 0.04;
/// Girth that a size adds at a thigh or a knee, in metres: 6/10 of that at the hip, as in grading tables of trousers.
const LEG_GIRTH: f64 = 0.024;
/// Girth that a size adds to a sleeve, in metres: between 1.2 and 1.5 cm in grading tables of shirts.
const SLEEVE_GIRTH: f64 = 0.014;
/// Lengths that a size adds, in metres, as in grading tables of tops, sleeves and trousers.
const TRUNK_LENGTH: f64 = 0.01;
const SLEEVE_LENGTH: f64 = 0.006;
const LEG_LENGTH: f64 = 0.008;

/// How many sizes a garment is larger than the one that is cut for the subject; negative if smaller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grade(f64);

impl Grade {
    /// What is added to the gap between skin and sewn cloth.
    pub(super) fn gap(self, part: HumanJoint) -> f64 {
        let girth = match (part, part.limb()) {
            (HumanJoint::UpperLeg(_) | HumanJoint::LowerLeg(_), _) => LEG_GIRTH,
            (_, Limb::Arm(_)) => SLEEVE_GIRTH,
            (HumanJoint::Foot(_) | HumanJoint::Toes(_) | HumanJoint::Neck | HumanJoint::Head, _) => 0.0,
            _ => GIRTH,
        };
        self.0 * girth / TAU
    }

    pub(super) fn trunk_length(self) -> f64 {
        self.0 * TRUNK_LENGTH
    }

    pub(super) fn sleeve_length(self) -> f64 {
        self.0 * SLEEVE_LENGTH
    }

    pub(super) fn leg_length(self) -> f64 {
        self.0 * LEG_LENGTH
    }
}

/// A size by its letters: M is cut for the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GarmentSize(usize);

impl GarmentSize {
    const NAMES: [&'static str; 7] = ["XXS", "XS", "S", "M", "L", "XL", "XXL"];
    const OWN: usize = 3;

    /// The sizes with these names, separated by commas, each once.
    pub fn list(names: &str) -> Result<Vec<Self>, StudioError> {
        let sizes: Vec<Self> = names.split(',').map(|name| Self::from_name(name.trim())).collect::<Result<_, _>>()?;
        let twice = (1..sizes.len()).find(|&k| sizes[..k].contains(&sizes[k]));
        twice.map_or(Ok(()), |k| Err(StudioError::SizeTwice { name: sizes[k].name() }))?;
        Ok(sizes)
    }

    fn from_name(name: &str) -> Result<Self, StudioError> {
        let found = Self::NAMES.iter().position(|known| known.eq_ignore_ascii_case(name));
        found.map(Self).ok_or_else(|| StudioError::UnknownSize { name: name.into(), known: Self::NAMES.to_vec() })
    }

    /// Its letters.
    pub fn name(self) -> &'static str {
        Self::NAMES[self.0]
    }

    /// How it is graded.
    pub fn grade(self) -> Grade {
        Grade(self.0 as f64 - Self::OWN as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_adds_its_girth_to_the_circumference_and_m_adds_nothing() {
        let sizes = GarmentSize::list("m, L,xs").unwrap();
        assert_eq!(sizes.iter().map(|size| size.name()).collect::<Vec<_>>(), ["M", "L", "XS"]);
        let girth = |k: usize| sizes[k].grade().gap(HumanJoint::Chest) * TAU;
        assert_eq!(girth(0), 0.0);
        assert!((girth(1) - 0.04).abs() < 1e-12 && (girth(2) + 0.08).abs() < 1e-12);
        assert!(matches!(GarmentSize::list("S,L,s"), Err(StudioError::SizeTwice { name: "S" })));
        assert!(matches!(GarmentSize::list("S,36"), Err(StudioError::UnknownSize { name, .. }) if name == "36"));
    }
}
