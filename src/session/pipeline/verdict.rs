//! The verdict on a step: whether its result can be used as it is.

use super::hair::HAIR_AREA;
use super::limits::{Attained, Judged, judge};
use super::report::StageReport;
use crate::session::recipe::StepRecipe;
use crate::session::stage::Stage;
use crate::session::store::{Failure, Warning};
use serde::{Serialize, Serializer};
use std::fmt;

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

/// The verdict on a step of which all stages are up to date.
pub(in crate::session) fn verdict_on(step: &StepRecipe, reports: &[StageReport]) -> StepVerdict {
    let of_step = || reports.iter().filter(|report| report.step == step.name);
    // What is implausible as a whole explains the rest; then the earlier stage explains the later one.
    let order = |report: &&StageReport| (report.stage != Stage::Check, report.stage);
    let mut sorted: Vec<&StageReport> = of_step().collect();
    sorted.sort_by_key(order);
    let (mut in_conflict, mut doubts) = (Vec::new(), Vec::new());
    for report in sorted {
        let missed = judge(step, report).into_iter().filter(|judged| judged.attained == Attained::Missed);
        let missed = missed.map(|judged| warning_of(&step.name, &judged).to_string());
        let warned = report.warnings.iter().map(Warning::to_string);
        // Layers that cross are no doubt but a fault, whatever else is plausible.
        match report.stage {
            Stage::Stack => in_conflict.extend(missed.chain(warned)),
            _ => doubts.extend(warned.chain(missed)),
        }
    }
    let verdict = match (in_conflict.first(), doubts.first()) {
        (Some(fault), _) => Verdict::Failed(fault.clone()),
        (None, Some(gravest)) => Verdict::Check(gravest.clone()),
        (None, None) => Verdict::Good,
    };
    let warnings: Vec<String> = in_conflict.into_iter().chain(doubts).collect();
    let hair = of_step().filter_map(|report| report.measures.get(HAIR_AREA)).find(|area| **area > 0.0);
    let notes = hair.map(|area| format!("hair: {area:.0} cm², not part of the body; head from the model there"));
    let was_cut = of_step().any(|report| report.stage == Stage::Cut && report.measures.contains_key("vertices"));
    let no_hair = (step.is_hair() && !was_cut).then(|| "the bare scan shows none: no layer".to_string());
    StepVerdict { step: step.name.clone(), verdict, warnings, notes: notes.into_iter().chain(no_hair).collect() }
}

/// The verdict on a step of which a stage failed.
pub(in crate::session) fn failed(step: &str, failure: &Failure) -> StepVerdict {
    let why = match &failure.remedy {
        Some(remedy) => format!("{}; {remedy}", failure.what),
        None => failure.what.clone(),
    };
    StepVerdict { step: step.into(), verdict: Verdict::Failed(why.clone()), warnings: vec![why], notes: Vec::new() }
}

/// What a measure beyond its limits means, and what to do.
fn warning_of(step: &str, judged: &Judged) -> Warning {
    let (value, limit) = (judged.value, judged.greatest_acceptable());
    match judged.measure.as_str() {
        "hem_loops" => Warning::new(
            format!("{value:.0} hem {}, {} expected", plural(value, "loop"), judged.expected()),
            format!("look at the edges of the {step}, and correct them with `mask {step} STROKES.jsonl`"),
        ),
        "intersecting_pairs" => Warning::new(
            format!("{value:.0} triangle {} intersect after the {step} was put on", plural(value, "pair")),
            "`view --sheet sheet.png` shows the places; `mask` can take cloth away there",
        ),
        "inside_after" => Warning::new(
            match value {
                1.0 => format!("1 vertex is inside an inner layer after the {step} was put on"),
                _ => format!("{value:.0} vertices are inside an inner layer after the {step} was put on"),
            },
            "`view --sheet sheet.png` shows the places; `mask` can take cloth away there",
        ),
        "outside_percent" => Warning::new(
            format!("skin pokes through the scan on {value:.2} % of its covered area"),
            "check that this is the same person in a similar pose, and that no scan between was left out",
        ),
        _ if judged.stage == Stage::Register => Warning::new(
            format!("the body is {value:.1} mm from the scan on average, over the limit of {limit:.0} mm"),
            "look at the body in `view`; scan again without clothes if parts are missing",
        ),
        _ => Warning::new(
            format!("the fit is {value:.1} mm from the scan on average, over the limit of {limit:.0} mm"),
            "check that the scan shows one person without clothes, standing in an A-pose",
        ),
    }
}

fn plural(count: f64, word: &str) -> String {
    if count == 1.0 { word.to_string() } else { format!("{word}s") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::store::Measures;

    fn report(stage: Stage, measures: &[(&str, f64)], warnings: Vec<Warning>) -> StageReport {
        let measures: Measures = measures.iter().map(|(name, value)| (name.to_string(), *value)).collect();
        let (step, why, findings) = ("shirt".to_string(), Vec::new(), Vec::new());
        StageReport { step, stage, ran: false, why, secs: None, measures, findings, warnings }
    }

    fn shirt() -> StepRecipe {
        StepRecipe { name: "shirt".into(), template: Some("tshirt".into()), ..StepRecipe::default() }
    }

    #[test]
    fn hair_that_the_scan_does_not_show_is_noted_and_no_doubt() {
        let hair = StepRecipe { name: "hair".into(), template: Some("hair".into()), ..StepRecipe::default() };
        let reports = |measures: &[(&str, f64)]| {
            let of = StageReport { step: "hair".into(), ..report(Stage::Cut, measures, vec![]) };
            [of]
        };
        let none = verdict_on(&hair, &reports(&[]));
        assert_eq!((none.verdict, none.notes), (Verdict::Good, vec!["the bare scan shows none: no layer".to_string()]));
        let some = verdict_on(&hair, &reports(&[("vertices", 900.0), ("hem_loops", 7.0)]));
        assert_eq!((some.verdict, some.notes), (Verdict::Good, vec![]));
    }

    #[test]
    fn hair_that_was_left_out_is_noted_and_no_doubt() {
        let found = verdict_on(&shirt(), &[report(Stage::Fit, &[("hair_cm2", 412.4)], vec![])]);
        assert!(found.verdict.is_good());
        assert_eq!(found.notes, ["hair: 412 cm², not part of the body; head from the model there"]);
        assert!(verdict_on(&shirt(), &[report(Stage::Fit, &[], vec![])]).notes.is_empty());
    }

    #[test]
    fn a_step_within_its_limits_is_good() {
        let reports = [report(Stage::Cut, &[("hem_loops", 4.0)], vec![])];
        let found = verdict_on(&shirt(), &reports);
        assert_eq!((found.verdict.to_string(), found.warnings.len()), ("good".into(), 0));
    }

    #[test]
    fn layers_that_cross_are_a_failure_whatever_else_is_plausible() {
        let reports = [
            report(Stage::Cut, &[("hem_loops", 55.0)], vec![]),
            report(Stage::Stack, &[("intersecting_pairs", 2.0), ("inside_after", 0.0)], vec![]),
        ];
        let found = verdict_on(&shirt(), &reports);
        assert!(found.verdict.to_string().starts_with("failed: 2 triangle pairs intersect"), "{:?}", found.verdict);
        assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
    }

    #[test]
    fn the_gravest_doubt_is_the_verdict_and_all_are_listed() {
        let absent = Warning::new("the scan shows no tshirt", "scan again");
        let reports = [report(Stage::Cut, &[("hem_loops", 55.0)], vec![]), report(Stage::Check, &[], vec![absent])];
        let found = verdict_on(&shirt(), &reports);
        assert_eq!(found.verdict.to_string(), "check it: the scan shows no tshirt; scan again");
        assert!(found.warnings[1].starts_with("55 hem loops, 4 expected"), "{:?}", found.warnings);
        assert_eq!(serde_json::to_value(&found).unwrap()["verdict"], found.verdict.to_string());
    }
}
