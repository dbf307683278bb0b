//! The verdict on a step: whether its result can be used as it is.

use super::limits::{Attained, Judged, judge};
use crate::segment::GarmentTemplate;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;

/// The measure of the body's fit that says that the scan shows hair which is no part of the body: its area.
pub const HAIR_AREA: &str = "hair_cm2";
/// The measure of the body's check that says how much of the scanned head is not of the skin's colour.
pub const ON_HEAD_AREA: &str = "on_head_cm2";
/// Area in cm² from which that is noted: hairless heads have up to 18, a jacket's collar at the chin 65 (man), hair, a beard or a hat
/// from 400 (outfits a to d, seeds 911 and 912).
const ON_HEAD_FROM: f64 = 80.0;

/// Whether the result of a step can be used as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is in doubt.
    Good,
    /// The result exists, and something is in doubt: the gravest doubt.
    Check(String),
    /// There is no result, or layers cross in it: why, and what to do.
    Failed(String),
}

impl Verdict {
    /// Whether nothing is in doubt.
    pub fn is_good(&self) -> bool {
        *self == Self::Good
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Good => f.pad("good"),
            Self::Check(doubt) => write!(f, "check it: {doubt}"),
            Self::Failed(why) => write!(f, "failed: {why}"),
        }
    }
}

impl Serialize for Verdict {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A step with its verdict.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StepVerdict {
    /// The step.
    pub step: String,
    /// The verdict; in JSON its sentence.
    pub verdict: Verdict,
    /// Every doubt, the gravest first: one sentence each.
    pub warnings: Vec<String>,
    /// What was done that the scan does not tell by itself and that is no doubt: one sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// What a stage of a step found.
#[derive(Clone, Debug)]
pub struct StageFindings<'a> {
    /// The stage.
    pub stage: &'static str,
    /// What it measured.
    pub measures: &'a BTreeMap<String, f64>,
    /// What it holds in doubt: one sentence each.
    pub warnings: Vec<String>,
}

/// The verdict on a step of which all stages are up to date. `garment` is the kind of its garment, `None` for the body; a garment
/// of a file is not `scanned`; `found` has the step's stages in order.
pub fn verdict_on(
    step: &str,
    garment: Option<&GarmentTemplate>,
    scanned: bool,
    found: &[StageFindings],
) -> StepVerdict {
    // What is implausible as a whole explains the rest; then the earlier stage explains the later one.
    let (checks, others): (Vec<_>, Vec<_>) = found.iter().partition(|of| of.stage == "check");
    let (mut in_conflict, mut doubts) = (Vec::new(), Vec::new());
    for of in checks.into_iter().chain(others) {
        let missed = judge(garment, of.stage, of.measures).into_iter();
        let missed = missed
            .filter(|judged| judged.attained == Attained::Missed)
            .map(|judged| warning_of(step, scanned, &judged));
        let warned = of.warnings.iter().cloned();
        // Layers that cross are no doubt but a fault, whatever else is plausible.
        match of.stage {
            "stack" => in_conflict.extend(missed.chain(warned)),
            _ => doubts.extend(warned.chain(missed)),
        }
    }
    let verdict = match (in_conflict.first(), doubts.first()) {
        (Some(fault), _) => Verdict::Failed(fault.clone()),
        (None, Some(gravest)) => Verdict::Check(gravest.clone()),
        (None, None) => Verdict::Good,
    };
    let warnings: Vec<String> = in_conflict.into_iter().chain(doubts).collect();
    let hair = found.iter().filter_map(|of| of.measures.get(HAIR_AREA)).find(|area| **area > 0.0);
    let notes = hair.map(|area| format!("hair: {area:.0} cm², not part of the body; head from the model there"));
    let of_estimate = found.iter().find(|of| of.measures.contains_key("estimated_chest_cm"));
    let on_head = found.iter().filter_map(|of| of.measures.get(ON_HEAD_AREA)).find(|area| **area >= ON_HEAD_FROM);
    let on_head = on_head.map(|area| {
        let then = match of_estimate {
            Some(_) => "not part of the body; head from the model there",
            None => "part of the body; `scan body FILE --hair layer` makes hair a layer, `--hair drop` leaves it out",
        };
        format!("hair, a beard or a hat: {area:.0} cm² in another colour than the hands, {then}")
    });
    let estimated = of_estimate.map(|of| {
        let value = |name: &str| of.measures.get(name).copied().unwrap_or(f64::NAN);
        let part = |name: &str| {
            let half = value(&format!("estimated_{name}_half_interval_cm"));
            format!("{name} {:.0} ± {:.0} cm", value(&format!("estimated_{name}_cm")), half.max(1.0))
        };
        format!("estimated under clothes: {}", ["stature", "chest", "waist", "hip"].map(part).join(", "))
    });
    let was_cut = found.iter().any(|of| of.stage == "cut" && of.measures.contains_key("vertices"));
    let is_hair = garment.is_some_and(|template| template.grows);
    let no_hair = (is_hair && !was_cut).then(|| "the bare scan shows none: no layer".to_string());
    StepVerdict {
        step: step.into(),
        verdict,
        warnings,
        notes: notes.into_iter().chain(on_head).chain(estimated).chain(no_hair).collect(),
    }
}

impl StepVerdict {
    /// The verdict on a step of which a stage failed.
    pub fn failed(step: &str, what: &str, remedy: Option<&str>) -> Self {
        let why = match remedy {
            Some(remedy) => format!("{what}; {remedy}"),
            None => what.to_string(),
        };
        Self { step: step.into(), verdict: Verdict::Failed(why.clone()), warnings: vec![why], notes: Vec::new() }
    }
}

/// The doubt about a garment whose figure lacks that of a step before, which failed.
pub fn on_the_figure_before(failed: &str) -> String {
    format!(
        "it lies on the figure without '{failed}', which failed, and whose cloth may be taken for it; correct '{failed}' first"
    )
}

/// What a measure beyond its limits means, and what to do.
fn warning_of(step: &str, scanned: bool, judged: &Judged) -> String {
    let take_away = match scanned {
        true => format!("look at the places (`view --sheet sheet.png`), and take cloth away there (`paint {step}`)"),
        false => "look at the places (`view --sheet sheet.png`), and correct the garment's file there".into(),
    };
    let (value, limit) = (judged.value, judged.greatest_acceptable());
    let (what, remedy) = match judged.measure.as_str() {
        "hem_loops" => (
            format!("{value:.0} hem {}, {} expected", plural(value, "loop"), judged.expected()),
            match scanned {
                true => format!("look at the edges of the {step}, and correct them (`paint {step}`)"),
                false => "close slits, or choose another kind with --template".into(),
            },
        ),
        "intersecting_pairs" => {
            (format!("{value:.0} triangle {} intersect after the {step} was put on", plural(value, "pair")), take_away)
        }
        "inside_after" => (
            match value {
                1.0 => format!("1 vertex is inside an inner layer after the {step} was put on"),
                _ => format!("{value:.0} vertices are inside an inner layer after the {step} was put on"),
            },
            take_away,
        ),
        "outside_percent" => (
            format!("skin pokes through the scan on {value:.2} % of its covered area"),
            "check that this is the same person in a similar pose, and that no scan between was left out".into(),
        ),
        _ if judged.stage == "register" => (
            format!("the body is {value:.1} mm from the scan on average, over the limit of {limit:.0} mm"),
            "look at the body in `view`; scan again without clothes if parts are missing".into(),
        ),
        _ => (
            format!("the fit is {value:.1} mm from the scan on average, over the limit of {limit:.0} mm"),
            "check that the scan shows one person without clothes, standing in an A-pose".to_string(),
        ),
    };
    format!("{what}; {remedy}")
}

fn plural(count: f64, word: &str) -> String {
    if count == 1.0 { word.to_string() } else { format!("{word}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stage with its measures and warnings.
    type Found<'a> = (&'static str, &'a [(&'a str, f64)], &'a [&'a str]);

    fn verdict(template: &str, found: &[Found]) -> StepVerdict {
        let measures: Vec<BTreeMap<String, f64>> = found
            .iter()
            .map(|(_, measures, _)| measures.iter().map(|(name, value)| (name.to_string(), *value)).collect())
            .collect();
        let findings = found.iter().zip(&measures).map(|((stage, _, warnings), measures)| StageFindings {
            stage,
            measures,
            warnings: warnings.iter().map(|text| text.to_string()).collect(),
        });
        let template = GarmentTemplate::built_in(template).unwrap();
        verdict_on("shirt", Some(&template), true, &findings.collect::<Vec<_>>())
    }

    #[test]
    fn hair_that_the_scan_does_not_show_is_noted_and_no_doubt() {
        let none = verdict("hair", &[("cut", &[], &[])]);
        assert_eq!((none.verdict, none.notes), (Verdict::Good, vec!["the bare scan shows none: no layer".to_string()]));
        let some = verdict("hair", &[("cut", &[("vertices", 900.0), ("hem_loops", 7.0)], &[])]);
        assert_eq!((some.verdict, some.notes), (Verdict::Good, vec![]));
    }

    #[test]
    fn hair_that_was_left_out_is_noted_and_no_doubt() {
        let found = verdict("tshirt", &[("fit", &[("hair_cm2", 412.4)], &[])]);
        assert!(found.verdict.is_good());
        assert_eq!(found.notes, ["hair: 412 cm², not part of the body; head from the model there"]);
        assert!(verdict("tshirt", &[("fit", &[], &[])]).notes.is_empty());
    }

    #[test]
    fn what_is_on_the_head_is_noted_and_said_to_be_part_of_the_body_or_not() {
        let of = |area: f64, fit: &[(&str, f64)]| {
            verdict("tshirt", &[("fit", fit, &[]), ("check", &[("on_head_cm2", area)], &[])])
        };
        assert!(of(60.0, &[]).notes.is_empty());
        let (bare, estimated) = (of(412.4, &[]), of(412.4, &[("estimated_chest_cm", 98.0)]));
        assert!(bare.verdict.is_good() && bare.notes.len() == 1, "{:?}", bare.notes);
        assert!(bare.notes[0].contains("412 cm² in another colour") && bare.notes[0].contains("--hair drop"));
        assert!(
            estimated.notes[0].contains("412 cm² in another colour")
                && estimated.notes[0].contains("not part of the body")
        );
    }

    #[test]
    fn a_step_within_its_limits_is_good() {
        let found = verdict("tshirt", &[("cut", &[("hem_loops", 4.0)], &[])]);
        assert_eq!((found.verdict.to_string(), found.warnings.len()), ("good".into(), 0));
    }

    #[test]
    fn layers_that_cross_are_a_failure_whatever_else_is_plausible() {
        let crossing: Found = ("stack", &[("intersecting_pairs", 2.0), ("inside_after", 0.0)], &[]);
        let found = verdict("tshirt", &[("cut", &[("hem_loops", 55.0)], &[]), crossing]);
        assert!(found.verdict.to_string().starts_with("failed: 2 triangle pairs intersect"), "{:?}", found.verdict);
        assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
    }

    #[test]
    fn the_gravest_doubt_is_the_verdict_and_all_are_listed() {
        let absent: Found = ("check", &[], &["the scan shows no tshirt; scan again"]);
        let found = verdict("tshirt", &[("cut", &[("hem_loops", 55.0)], &[]), absent]);
        assert_eq!(found.verdict.to_string(), "check it: the scan shows no tshirt; scan again");
        assert!(found.warnings[1].starts_with("55 hem loops, 4 expected"), "{:?}", found.warnings);
        assert_eq!(serde_json::to_value(&found).unwrap()["verdict"], found.verdict.to_string());
    }
}
