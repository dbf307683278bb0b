//! Garment templates: what a kind of garment covers, where it is tight and where loose.

use super::error::SegmentError;
use super::fabric::Fabric;
use super::region::PaintedRegion;
use serde::{Deserialize, Serialize};

/// The bones along which limits are given. Both sides at once, so without `left` and `right`; `torso` runs from the
/// height of the hip joints (0) to the neck joint (1), `foot` from the ankle (0) to the floor (1), `head` from the head
/// joint (0) to the crown (1), `hand` from the wrist (0) to the fingertips (1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum LimitBone {
    /// Ankle to floor.
    Foot,
    /// Knee to ankle.
    LowerLeg,
    /// Hip joint to knee.
    UpperLeg,
    /// Hip joints to neck joint, by height.
    Torso,
    /// Neck joint to head joint.
    Neck,
    /// Head joint to crown.
    Head,
    /// Shoulder joint to elbow.
    UpperArm,
    /// Elbow to wrist.
    LowerArm,
    /// Wrist to fingertips.
    Hand,
}

/// A position along a bone: 0 at its start, 1 at its end; values outside are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// The bone.
    pub bone: LimitBone,
    /// The position along it.
    pub at: f64,
}

impl Limit {
    /// One number along the chain: −3 the floor, −2 ankle, −1 knee, 0 hip joint, 1 neck joint, 2 head joint, 3 crown;
    /// for arms 0 the shoulder, 1 elbow, 2 wrist, 3 fingertips.
    pub(super) fn level(&self) -> f64 {
        match self.bone {
            LimitBone::Foot => -2.0 - self.at,
            LimitBone::LowerLeg => -1.0 - self.at,
            LimitBone::UpperLeg => -self.at,
            LimitBone::Torso | LimitBone::UpperArm => self.at,
            LimitBone::Neck | LimitBone::LowerArm => 1.0 + self.at,
            LimitBone::Head | LimitBone::Hand => 2.0 + self.at,
        }
    }

    fn is_on_arm(&self) -> bool {
        matches!(self.bone, LimitBone::UpperArm | LimitBone::LowerArm | LimitBone::Hand)
    }
}

/// The range between two limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Span {
    pub(super) from: Limit,
    pub(super) to: Limit,
}

/// Coverage of head, trunk and legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrunkCover {
    pub(super) from: Limit,
    pub(super) to: Limit,
    /// Where cloth is tight; elsewhere it may stand off.
    #[serde(default)]
    pub(super) tight: Vec<Span>,
}

/// Coverage of the arms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ArmCover {
    #[serde(default = "shoulder")]
    pub(super) from: Limit,
    pub(super) to: Limit,
    /// Whether cloth is tight there.
    #[serde(default)]
    pub(super) tight: bool,
}

/// Default start of a sleeve. No arm vertex is before it: the seam is where the arm's weights begin.
fn shoulder() -> Limit {
    Limit { bone: LimitBone::UpperArm, at: -1.0 }
}

/// Which end of the trunk's span `--until` moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum MovedEnd {
    #[default]
    From,
    To,
}

fn one() -> usize {
    1
}

/// A kind of garment.
///
/// **Source** Hu 2017, §6.2: segmentation templates on the body, per type of dress. The limits along bones, the loose part
/// and the hems are ours.
///
/// Its fields are those of a template's file, except for the name. Its serialized form is an input of stages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GarmentTemplate {
    /// File stem, `tshirt`; not in the file.
    #[serde(skip_deserializing, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Description in one line; not serialized, because no result depends on it.
    #[serde(skip_serializing)]
    pub about: String,
    /// Its usual fabric, one of [`Fabric::all`].
    pub fabric: String,
    /// Usual place in the stack, small inside: 10 underwear, 20 shirts, 30 pullovers, 50 jackets, 60 coats.
    pub rank: u32,
    /// Names of its boundary loops.
    pub hems: Vec<String>,
    /// Whether neck, front edges and lower hem may form one loop.
    #[serde(default)]
    pub opens_in_front: bool,
    /// Whether it hangs across both legs.
    #[serde(default)]
    pub bridges_legs: bool,
    /// The number of separate parts.
    #[serde(default = "one")]
    pub pieces: usize,
    /// Whether it grows on the body, as hair does: the fit of the bare scan finds it, and its limits only say where it is usual.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub grows: bool,
    /// Whether it surrounds the head and leaves the face free, as a hood does.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub leaves_face_free: bool,
    #[serde(default)]
    pub(super) until: MovedEnd,
    pub(super) trunk: Option<TrunkCover>,
    pub(super) arms: Option<ArmCover>,
    pub(super) loose: Option<Span>,
    /// The covered part of the body as painted. It replaces the limits of trunk and arms, which then only say where cloth is
    /// tight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) region: Option<PaintedRegion>,
}

macro_rules! garments {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../templates/garments/", $name, ".toml")))),*]
    };
}

/// The built-in templates, by name.
const BUILT_IN: &[(&str, &str)] = garments![
    "blouse",
    "boots",
    "bra",
    "coat",
    "dress",
    "gloves",
    "hair",
    "hat",
    "hoodie",
    "jacket",
    "leggings",
    "overalls",
    "pullover",
    "scarf",
    "shirt",
    "shoes",
    "shorts",
    "skirt",
    "socks",
    "tanktop",
    "tights",
    "trousers",
    "tshirt",
    "underpants",
    "vest",
];

impl GarmentTemplate {
    /// The names of the built-in templates, in alphabetical order.
    pub fn names() -> impl Iterator<Item = &'static str> {
        BUILT_IN.iter().map(|t| t.0)
    }

    /// The built-in template with this name; spaces, hyphens and capitals are ignored (`T-shirt`).
    pub fn built_in(name: &str) -> Result<Self, SegmentError> {
        let plain: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
        match BUILT_IN.iter().find(|t| t.0 == plain) {
            Some((stem, text)) => Self::parse(stem, text),
            None => Err(SegmentError::UnknownTemplate {
                name: name.into(),
                known: Self::names().map(String::from).collect(),
                nearest: nearest_name(&plain).map(String::from),
            }),
        }
    }

    /// Reads a template's text; `name` is its file stem.
    pub fn parse(name: &str, text: &str) -> Result<Self, SegmentError> {
        let bad = |reason: String| SegmentError::BadTemplate { name: name.into(), reason };
        let template: Self = toml::from_str(text).map_err(|e| bad(e.to_string().trim_end().into()))?;
        template.check().map_err(bad)?;
        Fabric::named(&template.fabric).map_err(|e| bad(e.to_string()))?;
        Ok(Self { name: name.into(), ..template })
    }

    /// The text of a template's file, which [`Self::parse`] reads.
    pub fn to_text(&self) -> Result<String, SegmentError> {
        let bad = |e: toml::ser::Error| SegmentError::BadTemplate { name: self.name.clone(), reason: e.to_string() };
        let rest = toml::to_string(&Self { name: String::new(), ..self.clone() }).map_err(bad)?;
        Ok(format!("about = {}\n{rest}", toml::Value::from(self.about.as_str())))
    }

    /// Whether its region was painted, so that no limits apply.
    pub fn is_painted(&self) -> bool {
        self.region.is_some()
    }

    /// Whether it is worn on the head, over hair.
    pub fn covers_head(&self) -> bool {
        /// Above the head's joint: collars and scarfs end below.
        const BROW: f64 = 2.3;
        !self.grows && self.trunk.as_ref().is_some_and(|trunk| trunk.to.level() > BROW)
    }

    /// The expected number of boundary loops, least and greatest. An open front joins neck and lower hem into one.
    pub fn expected_loops(&self) -> std::ops::RangeInclusive<usize> {
        let most = self.hems.len();
        let least = if self.opens_in_front { most.saturating_sub(1) } else { most };
        least..=most
    }

    /// Whether it goes between the legs, as trousers do: it ends below the crotch and does not hang across both legs.
    pub fn goes_between_legs(&self) -> bool {
        const CROTCH: f64 = -0.2;
        let covers_crotch = self.trunk.as_ref().is_some_and(|t| t.from.level() <= CROTCH && t.to.level() > 0.0);
        covers_crotch && !self.bridges_legs
    }

    /// Its usual place among the garments of one scan, small inside. It is its rank, but shirts are worn over the waistbands of
    /// trousers and skirts.
    pub fn order_in_outfit(&self) -> (u32, u32) {
        /// The rank of shirts.
        const SHIRTS: u32 = 20;
        /// Knee and a place between hip and neck: what ends between them has a waistband.
        const WAISTBAND: std::ops::Range<f64> = -1.0..0.5;
        let has_waistband =
            self.arms.is_none() && self.trunk.as_ref().is_some_and(|trunk| WAISTBAND.contains(&trunk.to.level()));
        (if has_waistband { self.rank.min(SHIRTS - 1) } else { self.rank }, self.rank)
    }

    fn check(&self) -> Result<(), String> {
        if self.trunk.is_none() && self.arms.is_none() && self.region.is_none() {
            return Err("it covers nothing: there is neither [trunk] nor [arms] nor [region]".into());
        }
        if self.grows && self.region.is_some() {
            return Err("'grows' and 'region' exclude each other: what grows on the body is found, not painted".into());
        }
        if self.pieces == 0 {
            return Err("'pieces' is 0".into());
        }
        let mut spans: Vec<(&str, bool, Span)> = Vec::new();
        if let Some(trunk) = &self.trunk {
            spans.push(("trunk", false, Span { from: trunk.from, to: trunk.to }));
            spans.extend(trunk.tight.iter().map(|&s| ("trunk.tight", false, s)));
        }
        if let Some(arms) = &self.arms {
            spans.push(("arms", true, Span { from: arms.from, to: arms.to }));
        }
        spans.extend(self.loose.map(|s| ("loose", false, s)));
        for (what, on_arm, Span { from, to }) in spans {
            if [from, to].iter().any(|l| l.is_on_arm() != on_arm) {
                let bones =
                    if on_arm { "upperArm, lowerArm, hand" } else { "foot, lowerLeg, upperLeg, torso, neck, head" };
                return Err(format!("'{what}' has a limit on the wrong bone; it takes {bones}"));
            }
            // Two bone lengths away a limit is on another bone.
            if [from, to].iter().any(|l| !(-2.0..=3.0).contains(&l.at)) {
                return Err(format!("'{what}' has a limit whose 'at' is not between -2 and 3"));
            }
            if from.level() >= to.level() {
                return Err(format!("'{what}' ends at or before its beginning"));
            }
        }
        Ok(())
    }
}

/// The name with the least edit distance, if at most half of the letters differ.
fn nearest_name(plain: &str) -> Option<&'static str> {
    let (distance, name) = GarmentTemplate::names().map(|n| (edit_distance(plain, n), n)).min()?;
    (2 * distance <= plain.chars().count().max(name.len())).then_some(name)
}

/// Levenshtein's distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_template_is_sound_and_the_list_is_sorted() {
        let names: Vec<&str> = GarmentTemplate::names().collect();
        assert!(names.is_sorted());
        for name in &names {
            let template = GarmentTemplate::built_in(name).unwrap();
            assert!(!template.hems.is_empty() && template.rank > 0, "{name}");
        }
        for needed in [
            "tshirt", "shirt", "pullover", "vest", "jacket", "coat", "trousers", "shorts", "skirt", "dress", "socks",
            "hat",
        ] {
            assert!(names.contains(&needed), "{needed}");
        }
        assert_eq!(GarmentTemplate::built_in("T-Shirt").unwrap().expected_loops(), 4..=4);
        assert_eq!(GarmentTemplate::built_in("coat").unwrap().expected_loops(), 3..=4);
    }

    #[test]
    fn shirts_are_worn_over_waistbands_and_all_else_in_the_order_of_ranks() {
        let place = |kind: &str| GarmentTemplate::built_in(kind).unwrap().order_in_outfit();
        for inside_out in [
            ["socks", "trousers", "shirt"],
            ["trousers", "tshirt", "shoes"],
            ["shorts", "skirt", "blouse"],
            ["tanktop", "trousers", "tshirt"],
            ["leggings", "dress", "coat"],
            ["skirt", "jacket", "hat"],
        ] {
            assert!(inside_out.is_sorted_by_key(|kind| place(kind)), "{inside_out:?}");
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_all_names_and_the_nearest() {
        let error = GarmentTemplate::built_in("trouser").unwrap_err();
        assert!(error.to_string().contains("pullover") && error.to_string().contains("socks"));
        assert_eq!(error.hint().unwrap(), "did you mean 'trousers'?");
        assert!(GarmentTemplate::built_in("xylophone").unwrap_err().hint().unwrap().contains("--until"));
    }

    #[test]
    fn a_broken_template_is_named_with_its_fault() {
        let sound = "about='x'\nfabric='wool'\nrank=1\nhems=['a']\n[trunk]\nfrom={bone='torso',at=0.1}\nto={bone='neck',at=0}\n";
        assert!(GarmentTemplate::parse("mine", sound).is_ok());
        for (from, to, expected) in [
            ("rank=1", "rank='x'", "line 3"),
            ("rank=1", "rank=1\ncolour=2", "colour"),
            ("'torso'", "'elbow'", "elbow"),
            ("'torso'", "'upperArm'", "wrong bone"),
            ("at=0.1", "at=2.5", "before its beginning"),
            ("at=0.1", "at=nan", "between -2 and 3"),
            ("[trunk]", "[loose]", "covers nothing"),
        ] {
            let message = GarmentTemplate::parse("mine", &sound.replace(from, to)).unwrap_err().to_string();
            assert!(message.contains("'mine'") && message.contains(expected), "{message}");
        }
    }

    #[test]
    fn the_serialized_form_is_that_of_finished_sessions() {
        let hat = GarmentTemplate { about: "another text".into(), ..GarmentTemplate::built_in("hat").unwrap() };
        let expected = r#"{"arms":null,"bridges_legs":false,"fabric":"knit","hems":["brim"],"loose":null,"name":"hat",
            "opens_in_front":false,"pieces":1,"rank":70,"until":"from",
            "trunk":{"from":{"at":0.55,"bone":"head"},"tight":[],"to":{"at":1.5,"bone":"head"}}}"#;
        assert_eq!(serde_json::to_value(hat).unwrap(), serde_json::from_str::<serde_json::Value>(expected).unwrap());
    }

    #[test]
    fn a_description_of_any_characters_is_written_and_a_name_in_the_file_is_refused() {
        let mut template = GarmentTemplate::built_in("hat").unwrap();
        template.about = "a \"hat\"\nwith '''quotes''' and \\".into();
        let text = template.to_text().unwrap();
        assert_eq!(GarmentTemplate::parse("hat", &text).unwrap(), template);
        let named = GarmentTemplate::parse("hat", &format!("name = 'cap'\n{text}")).unwrap_err().to_string();
        assert!(named.contains("unknown field `name`"), "{named}");
    }

    #[test]
    fn every_template_is_written_as_it_is_read() {
        for name in GarmentTemplate::names() {
            let template = GarmentTemplate::built_in(name).unwrap();
            assert_eq!(GarmentTemplate::parse(name, &template.to_text().unwrap()).unwrap(), template, "{name}");
        }
    }

    #[test]
    fn edit_distance_counts_changes() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("coat", "coat"), 0);
    }
}
