//! How far a garment extends, where that differs from its template.

use super::error::SegmentError;
use super::template::{GarmentTemplate, Limit, LimitBone, TrunkCover};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Limits given for one garment; they override its template's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Its lower end (for socks and shoes: its upper end).
    pub until: Option<Until>,
    /// The length of the sleeves.
    pub sleeve: Option<Sleeve>,
}

impl Extent {
    /// Refuses limits of parts that the kind of garment does not have: sleeves of a hat, legs of gloves.
    pub fn check(&self, template: &GarmentTemplate) -> Result<(), SegmentError> {
        let (takes_until, takes_sleeve) = (takes_until(template), takes_sleeve(template));
        let given = [("--until", self.until.is_some()), ("--sleeve", self.sleeve.is_some())];
        if let Some((option, _)) = given.into_iter().find(|option| option.1).filter(|_| template.is_painted()) {
            let (template, part) = (template.name.clone(), "limits because its region is painted");
            return Err(SegmentError::NoSuchPart { template, option, part, takes: Vec::new() });
        }
        let refused = |option, part| {
            let takes = [("--until", takes_until), ("--sleeve", takes_sleeve)].into_iter().filter(|o| o.1);
            let takes = takes.map(|o| o.0).collect();
            Err(SegmentError::NoSuchPart { template: template.name.clone(), option, part, takes })
        };
        match (&self.until, &self.sleeve) {
            (Some(_), _) if !takes_until => refused("--until", "end on the trunk or the legs"),
            (_, Some(_)) if !takes_sleeve => refused("--sleeve", "sleeves and no shoulders"),
            _ => Ok(()),
        }
    }
}

/// Whether a kind of garment has an end on the trunk or the legs.
fn takes_until(template: &GarmentTemplate) -> bool {
    const NECK: f64 = 1.0;
    template.trunk.as_ref().is_some_and(|trunk| trunk.from.level() < NECK)
}

/// Whether a kind of garment has sleeves, or shoulders on which some could be.
fn takes_sleeve(template: &GarmentTemplate) -> bool {
    // A place on the upper trunk: a vest covers it, a skirt and a scarf do not.
    const BELOW_THE_SHOULDERS: f64 = 0.55;
    let covers =
        |trunk: &TrunkCover| trunk.from.level() < BELOW_THE_SHOULDERS && trunk.to.level() > BELOW_THE_SHOULDERS;
    template.arms.is_some() || template.trunk.as_ref().is_some_and(covers)
}

/// A height of the body: a word, or a share of stature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Until(Given<Limit>);

/// A length of sleeve: a word, or a share of the arm from shoulder to wrist.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Sleeve(Given<Option<Limit>>);

#[derive(Clone, Debug, PartialEq)]
enum Given<L> {
    /// A word and the limit that it names.
    Word(&'static str, L),
    Share(f64),
}

/// The named heights, from the floor up.
const HEIGHTS: [(&str, Limit); 11] = [
    ("floor", Limit { bone: LimitBone::Foot, at: 1.0 }),
    ("ankle", Limit { bone: LimitBone::LowerLeg, at: 1.0 }),
    ("calf", Limit { bone: LimitBone::LowerLeg, at: 0.5 }),
    ("knee", Limit { bone: LimitBone::UpperLeg, at: 1.0 }),
    ("mid-thigh", Limit { bone: LimitBone::UpperLeg, at: 0.5 }),
    ("crotch", Limit { bone: LimitBone::UpperLeg, at: 0.2 }),
    ("hip", Limit { bone: LimitBone::Torso, at: 0.0 }),
    ("waist", Limit { bone: LimitBone::Torso, at: 0.33 }),
    ("ribs", Limit { bone: LimitBone::Torso, at: 0.5 }),
    ("chest", Limit { bone: LimitBone::Torso, at: 0.7 }),
    ("neck", Limit { bone: LimitBone::Neck, at: 0.0 }),
];

/// The named sleeve lengths, shortest first; `none` ends at the shoulder seam.
const SLEEVES: [(&str, Option<Limit>); 7] = [
    ("none", None),
    ("cap", Some(Limit { bone: LimitBone::UpperArm, at: 0.2 })),
    ("short", Some(Limit { bone: LimitBone::UpperArm, at: 0.5 })),
    ("elbow", Some(Limit { bone: LimitBone::UpperArm, at: 1.0 })),
    ("three-quarter", Some(Limit { bone: LimitBone::LowerArm, at: 0.5 })),
    ("wrist", Some(Limit { bone: LimitBone::LowerArm, at: 1.0 })),
    ("long", Some(Limit { bone: LimitBone::LowerArm, at: 1.0 })),
];

/// The meaning of an [`Until`] on a body.
pub(super) enum Height {
    /// A limit like those of a template.
    At(Limit),
    /// A share of stature, from the floor.
    OfStature(f64),
}

impl Until {
    pub(super) fn height(&self) -> Height {
        match self.0 {
            Given::Word(_, limit) => Height::At(limit),
            Given::Share(share) => Height::OfStature(share),
        }
    }
}

impl Sleeve {
    /// The end of the sleeve; `None` without sleeves. A share treats upper and lower arm as equally long.
    pub(super) fn limit(&self) -> Option<Limit> {
        match self.0 {
            Given::Word(_, limit) => limit,
            Given::Share(share) if share <= 0.0 => None,
            Given::Share(share) if share <= 0.5 => Some(Limit { bone: LimitBone::UpperArm, at: 2.0 * share }),
            Given::Share(share) => Some(Limit { bone: LimitBone::LowerArm, at: 2.0 * share - 1.0 }),
        }
    }
}

fn parse<L: Copy>(
    given: &str,
    words: &[(&'static str, L)],
    what: &'static str,
    scale: &'static str,
) -> Result<Given<L>, SegmentError> {
    let plain = given.trim().to_lowercase().replace(['_', ' '], "-");
    if let Some(&(word, limit)) = words.iter().find(|w| w.0 == plain || w.0.replace('-', "") == plain) {
        return Ok(Given::Word(word, limit));
    }
    match plain.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(Given::Share(share)),
        _ => {
            let known = words.iter().map(|w| w.0).collect();
            Err(SegmentError::BadExtent { given: given.into(), what, known, scale })
        }
    }
}

impl FromStr for Until {
    type Err = SegmentError;
    fn from_str(given: &str) -> Result<Self, SegmentError> {
        parse(given, &HEIGHTS, "garment limit", "share of stature, 0 the floor").map(Self)
    }
}

impl FromStr for Sleeve {
    type Err = SegmentError;
    fn from_str(given: &str) -> Result<Self, SegmentError> {
        parse(given, &SLEEVES, "sleeve length", "share of the arm, 0 the shoulder, 1 the wrist").map(Self)
    }
}

impl<L> fmt::Display for Given<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Word(word, _) => f.write_str(word),
            Self::Share(share) => write!(f, "{share}"),
        }
    }
}

macro_rules! as_text {
    ($kind:ident) => {
        impl fmt::Display for $kind {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
        impl From<$kind> for String {
            fn from(value: $kind) -> Self {
                value.to_string()
            }
        }
        impl TryFrom<String> for $kind {
            type Error = SegmentError;
            fn try_from(given: String) -> Result<Self, SegmentError> {
                given.parse()
            }
        }
    };
}
as_text!(Until);
as_text!(Sleeve);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_shares_are_read_back_as_written() {
        for text in ["knee", "mid-thigh", "0.25", "waist"] {
            assert_eq!(text.parse::<Until>().unwrap().to_string(), text);
        }
        assert_eq!("Mid Thigh".parse::<Until>().unwrap(), "mid-thigh".parse().unwrap());
        assert_eq!("elbow".parse::<Sleeve>().unwrap().limit(), "0.5".parse::<Sleeve>().unwrap().limit());
        assert_eq!("none".parse::<Sleeve>().unwrap().limit(), None);
    }

    #[test]
    fn anything_else_is_answered_with_the_words_there_are() {
        for text in ["nee", "1.2", "-0.1", "NaN", "inf", ""] {
            let message = text.parse::<Until>().unwrap_err().to_string();
            assert!(message.contains("knee") && message.contains("share of stature"), "{message}");
        }
        assert!("arm".parse::<Sleeve>().unwrap_err().to_string().contains("three-quarter"));
    }

    #[test]
    fn only_garments_with_shoulders_take_sleeves_and_only_those_of_the_body_an_end() {
        let of = |name: &str| GarmentTemplate::built_in(name).unwrap();
        let sleeved: Vec<&str> = GarmentTemplate::names().filter(|name| takes_sleeve(&of(name))).collect();
        assert_eq!(
            sleeved,
            [
                "blouse", "bra", "coat", "dress", "gloves", "hoodie", "jacket", "overalls", "pullover", "shirt",
                "tanktop", "tshirt", "vest"
            ]
        );
        let endless: Vec<&str> = GarmentTemplate::names().filter(|name| !takes_until(&of(name))).collect();
        assert_eq!(endless, ["gloves", "hair", "hat"]);
        let short = Extent { sleeve: Some("short".parse().unwrap()), ..Extent::default() };
        assert!(short.check(&of("vest")).is_ok());
        let hat = short.check(&of("hat")).unwrap_err();
        assert!(hat.to_string().starts_with("--sleeve does not apply to the garment kind 'hat'"), "{hat}");
        assert_eq!(hat.hint().unwrap(), "it takes neither --until nor --sleeve");
        assert_eq!(short.check(&of("skirt")).unwrap_err().hint().unwrap(), "it takes --until");
    }

    #[test]
    fn heights_rise() {
        for pair in HEIGHTS.windows(2) {
            assert!(pair[0].1.level() < pair[1].1.level(), "{} is below {}", pair[0].0, pair[1].0);
        }
    }
}
