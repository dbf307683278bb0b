//! A walk through the stages: made where they are stale, or only looked at.

use super::reason::{Cause, Reason, reasons};
use crate::fit;
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer};
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Health, Kept, Measures, SCHEMA, StageRecord};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::time::Instant;

/// What happens while stages run, for whoever shows it.
#[derive(Debug)]
pub enum Event<'a> {
    /// A stage begins.
    Started {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
    },
    /// A stage goes on.
    Progress {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
        /// How far, in its own words.
        text: &'a str,
    },
    /// A fit goes on.
    Iterated {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
        /// What is fitted to.
        scan: &'a Scan,
        /// How far.
        at: &'a fit::Step<'a>,
    },
    /// A stage has run, and its result is on disk.
    Ran(&'a StageReport),
    /// The result of a stage stood already.
    Stood(&'a StageReport),
}

/// A stage after a walk.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageReport {
    /// Its step.
    pub step: String,
    /// The stage.
    pub stage: Stage,
    /// Whether it ran now; else its result stood already.
    pub ran: bool,
    /// Why it ran now.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<Reason>,
    /// How long it took when it ran last.
    pub secs: Option<f64>,
    /// What it measured.
    pub measures: Measures,
    /// What it assumed or noticed.
    pub findings: Vec<String>,
}

/// A stage that is not up to date.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::session) struct StaleStage {
    pub step: String,
    pub stage: Stage,
    pub why: Vec<Reason>,
}

/// Which stages run although they are up to date.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Forced {
    /// None.
    #[default]
    Nothing,
    /// All.
    Everything,
    /// Those of the steps, or the single stages, named.
    Named(Vec<(String, Option<Stage>)>),
}

impl Forced {
    fn holds(&self, step: &str, stage: Stage) -> bool {
        match self {
            Self::Nothing => false,
            Self::Everything => true,
            Self::Named(named) => named.iter().any(|(s, only)| s == step && only.is_none_or(|o| o == stage)),
        }
    }
}

/// What a stage hands back to be kept.
pub(in crate::session) struct Outcome<T> {
    pub value: T,
    pub measures: Measures,
    pub findings: Vec<String>,
}

impl<T> Outcome<T> {
    pub fn of(value: T) -> Self {
        Self { value, measures: Measures::new(), findings: Vec::new() }
    }

    pub fn measured(mut self, name: &str, value: f64) -> Self {
        // JSON knows no infinity; what cannot be measured is left out.
        if value.is_finite() {
            self.measures.insert(name.into(), value);
        }
        self
    }

    pub fn found(mut self, findings: impl IntoIterator<Item = String>) -> Self {
        self.findings.extend(findings);
        self
    }
}

/// How far a stage is.
pub(in crate::session) enum Told<'a> {
    /// In words.
    Text(&'a str),
    /// An iteration of a fit to this scan.
    Iteration(&'a Scan, &'a fit::Step<'a>),
}

impl Told<'_> {
    fn show(&self, step: &str, stage: Stage, on_event: &mut dyn FnMut(&Event)) {
        match *self {
            Self::Text(text) => on_event(&Event::Progress { step, stage, text }),
            Self::Iteration(scan, at) => on_event(&Event::Iterated { step, stage, scan, at }),
        }
    }
}

/// How a stage tells how far it is.
pub(in crate::session) type Tell<'a> = &'a mut dyn FnMut(Told);

pub(in crate::session) enum Walk<'a> {
    /// Runs what is stale, and makes each result durable as soon as it is there, under the name of `change`.
    Make {
        writer: &'a mut Writer,
        change: &'a str,
        forced: &'a Forced,
        on_event: &'a mut dyn FnMut(&Event),
        reports: Vec<StageReport>,
        /// The last stage to be made, and whether it has been.
        until: Option<(String, Stage)>,
        ended: bool,
        /// Whether the caller makes all of it durable at once, as one change.
        at_once: bool,
    },
    /// Makes again what is recorded but damaged or missing, and records nothing: the same comes out of the same.
    Mend { session: &'a Session, mended: &'a mut Mended, on_event: &'a mut dyn FnMut(&Event) },
    /// Runs nothing: a stale stage is an error.
    Look { session: &'a Session, reports: Vec<StageReport>, stale: Vec<StaleStage> },
}

impl<'a> Walk<'a> {
    pub fn make(
        writer: &'a mut Writer,
        change: &'a str,
        forced: &'a Forced,
        on_event: &'a mut dyn FnMut(&Event),
    ) -> Self {
        Self::Make { writer, change, forced, on_event, reports: Vec::new(), until: None, ended: false, at_once: false }
    }

    /// Ends with this stage: those after it count as not built.
    pub fn until(mut self, step: &str, stage: Stage) -> Self {
        if let Self::Make { until, .. } = &mut self {
            *until = Some((step.into(), stage));
        }
        self
    }

    /// Leaves it to the caller to make the results durable: together, as part of one change.
    pub fn at_once(mut self) -> Self {
        if let Self::Make { at_once, .. } = &mut self {
            *at_once = true;
        }
        self
    }

    pub fn mend(session: &'a Session, mended: &'a mut Mended, on_event: &'a mut dyn FnMut(&Event)) -> Self {
        Self::Mend { session, mended, on_event }
    }

    pub fn look(session: &'a Session) -> Self {
        Self::Look { session, reports: Vec::new(), stale: Vec::new() }
    }

    pub fn session(&self) -> &Session {
        match self {
            Self::Make { writer, .. } => &writer.session,
            Self::Look { session, .. } | Self::Mend { session, .. } => session,
        }
    }

    /// The stages that were looked at and found stale.
    pub fn stale(&self) -> &[StaleStage] {
        match self {
            Self::Make { .. } | Self::Mend { .. } => &[],
            Self::Look { stale, .. } => stale,
        }
    }

    pub fn into_reports(self) -> Vec<StageReport> {
        match self {
            Self::Make { reports, .. } | Self::Look { reports, .. } => reports,
            Self::Mend { .. } => Vec::new(),
        }
    }

    /// The result of a stage: kept where nothing that it depends on has changed, else made by `call`.
    pub fn stage<T: Serialize>(
        &mut self,
        step: &str,
        stage: Stage,
        inputs: Value,
        call: impl FnOnce(&Session, Tell) -> Result<Outcome<T>, SessionError>,
    ) -> Result<Kept<T>, SessionError> {
        let from = inputs;
        let inputs = hash_of_inputs(stage, &from);
        if let Self::Mend { session, mended, on_event } = self {
            return mended.stage(session, step, stage, inputs, *on_event, call);
        }
        let standing = standing(self.session(), step, stage, inputs);
        let not_built = || SessionError::NotBuilt { step: step.into(), stage };
        match (self, standing) {
            // A walk that mends has been handled above.
            (Self::Make { ended: true, .. } | Self::Mend { .. }, _) => Err(not_built()),
            (Self::Look { session, reports, .. }, Some(record)) => {
                reports.push(report(session, step, stage, &record, Vec::new()));
                Ok(Kept::named(record.output))
            }
            (Self::Look { session, stale, .. }, None) => {
                stale.push(StaleStage { step: step.into(), stage, why: why(session, step, stage, inputs, &from) });
                Err(not_built())
            }
            (Self::Make { writer, forced, on_event, reports, until, ended, .. }, Some(record))
                if !forced.holds(step, stage) =>
            {
                let old = report(&writer.session, step, stage, &record, Vec::new());
                on_event(&Event::Stood(&old));
                reports.push(old);
                *ended = is_last(until, step, stage);
                Ok(Kept::named(record.output))
            }
            (Self::Make { writer, change, on_event, reports, until, ended, at_once, .. }, standing) => {
                let why = match standing {
                    Some(_) => vec![Reason::of(Cause::Forced)],
                    None => why(&writer.session, step, stage, inputs, &from),
                };
                on_event(&Event::Started { step, stage });
                let began = Instant::now();
                let mut tell = |told: Told| told.show(step, stage, *on_event);
                let outcome = call(&writer.session, &mut tell)?;
                let kept = writer.session.store.keep(&outcome.value)?;
                writer.session.timings.note(step, stage, began.elapsed().as_secs_f64());
                let Outcome { measures, findings, .. } = outcome;
                let code = stage.code_version();
                let record = StageRecord { inputs, code, from, output: kept.hash, measures, findings };
                let mut new = report(&writer.session, step, stage, &record, why);
                new.ran = true;
                writer.session.state.put(step, stage, record);
                if !*at_once {
                    writer.save(change)?;
                }
                on_event(&Event::Ran(&new));
                reports.push(new);
                *ended = is_last(until, step, stage);
                Ok(kept)
            }
        }
    }
}

/// What a walk made again.
#[derive(Debug, Default)]
pub(in crate::session) struct Mended {
    /// The names of the artefacts that are sound again.
    pub made: BTreeSet<String>,
    /// Why the walk went no further.
    pub stopped: Option<String>,
}

impl Mended {
    fn stage<T: Serialize>(
        &mut self,
        session: &Session,
        step: &str,
        stage: Stage,
        inputs: ContentHash,
        on_event: &mut dyn FnMut(&Event),
        call: impl FnOnce(&Session, Tell) -> Result<Outcome<T>, SessionError>,
    ) -> Result<Kept<T>, SessionError> {
        let recorded = session.state.record(step, stage).filter(|r| r.inputs == inputs);
        let Some(record) = recorded else { return Err(SessionError::NotBuilt { step: step.into(), stage }) };
        if session.store.health(record.output) != Health::Sound {
            on_event(&Event::Started { step, stage });
            let outcome = call(session, &mut |told| told.show(step, stage, on_event))?;
            let made = session.store.keep(&outcome.value)?.hash;
            if made == record.output {
                self.made.insert(made.to_string());
            } else {
                return Err(SessionError::NotBuilt { step: step.into(), stage });
            }
        }
        Ok(Kept::named(record.output))
    }
}

fn is_last(until: &Option<(String, Stage)>, step: &str, stage: Stage) -> bool {
    until.as_ref().is_some_and(|(last, of)| last == step && *of == stage)
}

/// Why a stage that does not stand does not.
fn why(session: &Session, step: &str, stage: Stage, inputs: ContentHash, from: &Value) -> Vec<Reason> {
    let Some(record) = session.state.record(step, stage) else { return vec![Reason::of(Cause::NeverRan)] };
    if record.inputs == inputs {
        return vec![Reason::of(Cause::ResultMissing)];
    }
    match reasons(record, stage, from) {
        none if none.is_empty() => vec![Reason::of(Cause::Unknown)],
        some => some,
    }
}

fn hash_of_inputs(stage: Stage, inputs: &Value) -> ContentHash {
    ContentHash::of_json(&json!({ "schema": SCHEMA, "stage": stage, "code": stage.code_version(), "inputs": inputs }))
}

fn standing(session: &Session, step: &str, stage: Stage, inputs: ContentHash) -> Option<StageRecord> {
    session.state.record(step, stage).filter(|r| r.inputs == inputs && session.store.has(r.output)).cloned()
}

fn report(session: &Session, step: &str, stage: Stage, record: &StageRecord, why: Vec<Reason>) -> StageReport {
    StageReport {
        step: step.into(),
        stage,
        ran: false,
        why,
        secs: session.timings.secs(step, stage),
        measures: record.measures.clone(),
        findings: record.findings.clone(),
    }
}
