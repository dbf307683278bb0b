//! A walk through the stages: runs those that are out of date, rebuilds damaged results, or only checks.

use super::ahead::{Ahead, Begun};
use super::event::{Event, Forced, Made, OnProgress, Outcome, as_events};
use super::mention;
use super::reason::{Cause, Reason, reasons};
use super::report::{StageReport, verdict_on};
use super::run::Run;
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer};
use crate::session::recipe::StepRecipe;
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Failure, Health, SCHEMA, StageRecord, Store, Warning};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::time::Instant;

/// A stage that is out of date.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::session) struct OutOfDateStage {
    pub step: String,
    pub stage: Stage,
    pub why: Vec<Reason>,
    /// Why it failed on the same inputs when it last ran.
    pub failure: Option<Failure>,
}

/// A stage of a step, with the version of its code and all inputs of its result by name.
pub(in crate::session::pipeline) struct StageCall<'a> {
    pub step: &'a str,
    pub stage: Stage,
    pub version: u32,
    pub inputs: Value,
}

impl StageCall<'_> {
    fn hash(&self) -> ContentHash {
        let Self { stage, version, inputs, .. } = self;
        ContentHash::of_json(&json!({ "schema": SCHEMA, "stage": stage, "code": version, "inputs": inputs }))
    }

    fn not_built(&self) -> SessionError {
        SessionError::NotBuilt { step: self.step.into(), stage: self.stage }
    }

    /// The stage's record if it is up to date. Equal inputs give equal results, so it may be that of another step: the garments
    /// of an outfit share their scan, their pose and the evidence.
    fn up_to_date(&self, session: &Session) -> Option<StageRecord> {
        let hash = self.hash();
        let sound = |record: &&StageRecord| record.inputs == hash && session.store.has(record.output);
        let others = || session.state.steps.iter().filter_map(|step| step.stages.get(&self.stage));
        let own = session.state.record(self.step, self.stage);
        own.filter(sound).or_else(|| others().find(sound)).cloned()
    }

    /// Why the stage is out of date.
    fn why(&self, session: &Session) -> Vec<Reason> {
        let Some(record) = session.state.record(self.step, self.stage) else {
            return vec![Reason::of(Cause::NeverRan)];
        };
        if record.inputs == self.hash() {
            return vec![Reason::of(Cause::ResultMissing)];
        }
        match reasons(record, self.version, &self.inputs) {
            none if none.is_empty() => vec![Reason::of(Cause::Unknown)],
            some => some,
        }
    }

    fn report(&self, session: &Session, record: &StageRecord) -> StageReport {
        let worded = |text: &str| mention::worded(text, &session.recipe, self.step);
        StageReport {
            step: self.step.into(),
            stage: self.stage,
            ran: false,
            why: Vec::new(),
            secs: session.timings.secs(self.step, self.stage),
            measures: record.measures.clone(),
            findings: record.findings.iter().map(|finding| worded(finding)).collect(),
            warnings: (record.warnings.iter().map(|of| Warning::new(worded(&of.what), worded(&of.remedy)))).collect(),
        }
    }

    fn is_last(&self, until: &Option<(String, Stage)>) -> bool {
        until.as_ref().is_some_and(|(step, stage)| step == self.step && *stage == self.stage)
    }
}

/// The mode of a walk.
pub(in crate::session) enum Walk<'a> {
    /// Runs the stages that are out of date and makes each result durable at once, under the name of `change`.
    Make {
        writer: &'a mut Writer,
        change: &'a str,
        forced: &'a Forced,
        on_event: &'a mut dyn FnMut(&Event),
        reports: Vec<StageReport>,
        /// The last stage to run, and whether it was reached.
        until: Option<(String, Stage)>,
        ended: bool,
        /// Whether the caller makes all results durable together, as one change.
        at_once: bool,
        /// Whether a failure is noted for `status`: the recipe already has the step.
        notes_failures: bool,
        /// The steps of which a stage failed, in their order.
        failed: Vec<String>,
        /// Stages that run already.
        ahead: Ahead,
    },
    /// Rebuilds results that are recorded but damaged or missing, and records nothing: equal inputs give equal bytes.
    Repair { session: &'a Session, repaired: &'a mut Repaired, on_event: &'a mut dyn FnMut(&Event) },
    /// Runs nothing: a stage that is out of date is an error.
    Look { session: &'a Session, reports: Vec<StageReport>, out_of_date: Vec<OutOfDateStage> },
}

impl<'a> Walk<'a> {
    pub fn make(
        writer: &'a mut Writer,
        change: &'a str,
        forced: &'a Forced,
        on_event: &'a mut dyn FnMut(&Event),
    ) -> Self {
        Self::Make {
            writer,
            change,
            forced,
            on_event,
            reports: Vec::new(),
            until: None,
            ended: false,
            at_once: false,
            notes_failures: false,
            failed: Vec::new(),
            ahead: Ahead::default(),
        }
    }

    /// Ends with this stage; later stages count as not built.
    pub fn until(mut self, step: &str, stage: Stage) -> Self {
        if let Self::Make { until, .. } = &mut self {
            *until = Some((step.into(), stage));
        }
        self
    }

    /// Notes a failure for `status`.
    pub fn noting_failures(mut self) -> Self {
        if let Self::Make { notes_failures, .. } = &mut self {
            *notes_failures = true;
        }
        self
    }

    /// Lets the caller make all results durable as one change.
    pub fn at_once(mut self) -> Self {
        if let Self::Make { at_once, .. } = &mut self {
            *at_once = true;
        }
        self
    }

    pub fn repair(session: &'a Session, repaired: &'a mut Repaired, on_event: &'a mut dyn FnMut(&Event)) -> Self {
        Self::Repair { session, repaired, on_event }
    }

    pub fn look(session: &'a Session) -> Self {
        Self::Look { session, reports: Vec::new(), out_of_date: Vec::new() }
    }

    pub fn session(&self) -> &Session {
        match self {
            Self::Make { writer, .. } => &writer.session,
            Self::Look { session, .. } | Self::Repair { session, .. } => session,
        }
    }

    /// Reports the verdict on a step of which all stages have run or were up to date.
    pub fn end_step(&mut self, step: &StepRecipe) {
        if let Self::Make { reports, on_event, failed, ended: false, .. } = self {
            on_event(&Event::StepDone(&verdict_on(step, reports, failed.last().map(String::as_str))));
        }
    }

    /// Whether a stage of a step failed, now or when it last ran on the same inputs.
    pub fn has_failed(&self, step: &str) -> bool {
        match self {
            Self::Make { failed, .. } => failed.iter().any(|name| name == step),
            Self::Look { out_of_date, .. } => out_of_date.iter().any(|of| of.step == step && of.failure.is_some()),
            Self::Repair { session, .. } => session.failures.has(step),
        }
    }

    /// The stages that are out of date.
    pub fn out_of_date(&self) -> &[OutOfDateStage] {
        match self {
            Self::Make { .. } | Self::Repair { .. } => &[],
            Self::Look { out_of_date, .. } => out_of_date,
        }
    }

    pub fn into_reports(self) -> Vec<StageReport> {
        match self {
            Self::Make { reports, .. } | Self::Look { reports, .. } => reports,
            Self::Repair { .. } => Vec::new(),
        }
    }

    /// Begins a stage that will have to run, on a thread of its own where there is more than one.
    pub(in crate::session::pipeline) fn begin<I: Send + 'static, T: Send + 'static>(
        &mut self,
        call: &StageCall,
        inputs: impl FnOnce() -> I,
        run: fn(I, &Store, OnProgress) -> Run<T>,
    ) {
        let Self::Make { writer, forced, ahead, ended: false, .. } = self else { return };
        let is_made = call.up_to_date(&writer.session).is_some() && !forced.includes(call.step, call.stage);
        if !is_made && !ahead.has(call.hash()) && rayon::current_num_threads() > 1 {
            ahead.begin(call.hash(), writer.session.store.clone(), inputs(), run);
        }
    }

    /// The stage, if it was begun.
    pub(in crate::session::pipeline) fn begun(&mut self, call: &StageCall) -> Option<Begun> {
        match self {
            Self::Make { ahead, .. } => ahead.take(call.hash()),
            Self::Repair { .. } | Self::Look { .. } => None,
        }
    }

    /// The result of a stage: the recorded one if it is up to date, otherwise that of `run`.
    pub(in crate::session::pipeline) fn stage<T: Serialize>(
        &mut self,
        call: StageCall,
        run: impl FnOnce(&Session, OnProgress) -> Result<Outcome<T>, SessionError>,
    ) -> Result<Made<T>, SessionError> {
        match self {
            Self::Make { ended: true, .. } => Err(call.not_built()),
            Self::Make {
                writer,
                change,
                forced,
                on_event,
                reports,
                until,
                ended,
                at_once,
                notes_failures,
                failed,
                ahead: _,
            } => {
                let recorded = call.up_to_date(&writer.session);
                *ended = call.is_last(until);
                if let Some(record) = &recorded
                    && !forced.includes(call.step, call.stage)
                {
                    let report = call.report(&writer.session, record);
                    if writer.session.state.record(call.step, call.stage) != Some(record) {
                        // From another step.
                        writer.session.state.put(call.step, call.stage, record.clone());
                        if !*at_once {
                            writer.save(change)?;
                        }
                    }
                    on_event(&Event::UpToDate(&report));
                    reports.push(report);
                    return Ok(Made::of(record));
                }
                let why = match recorded {
                    Some(_) => vec![Reason::of(Cause::Forced)],
                    None => call.why(&writer.session),
                };
                let record = match run_and_keep(writer, &call, *on_event, run) {
                    Ok(made) => made,
                    Err(error) => {
                        failed.push(call.step.into());
                        return Err(if *notes_failures { note_failure(writer, &call, error) } else { error });
                    }
                };
                if writer.session.failures.forget(call.step, call.stage) {
                    writer.session.failures.write(writer.session.dir())?;
                }
                let report = StageReport { ran: true, why, ..call.report(&writer.session, &record) };
                let made = Made::of(&record);
                writer.session.state.put(call.step, call.stage, record);
                if !*at_once {
                    writer.save(change)?;
                }
                on_event(&Event::Ran(&report));
                reports.push(report);
                Ok(made)
            }
            Self::Repair { session, repaired, on_event } => repaired.stage(session, &call, *on_event, run),
            Self::Look { session, reports, out_of_date } => match call.up_to_date(session) {
                Some(record) => {
                    reports.push(call.report(session, &record));
                    Ok(Made::of(&record))
                }
                None => {
                    let failure = session.failures.of(call.step, call.stage, call.hash()).cloned();
                    out_of_date.push(OutOfDateStage {
                        step: call.step.into(),
                        stage: call.stage,
                        why: call.why(session),
                        failure,
                    });
                    Err(call.not_built())
                }
            },
        }
    }
}

/// Notes that a stage failed, so that `status` can say so; gives the error back.
fn note_failure(writer: &mut Writer, call: &StageCall, error: SessionError) -> SessionError {
    let (stage, inputs) = (call.stage, call.hash());
    // The step and the stage are known where the failure is shown.
    let what = match &error {
        SessionError::Stage { source, .. } | SessionError::Animation { source, .. } => source.to_string(),
        other => other.to_string(),
    };
    let failure = Failure { stage, inputs, what, remedy: error.hint() };
    writer.session.failures.note(call.step, failure);
    // The error itself is what the user must read; without the note `status` only says that the stage is out of date.
    let _ = writer.session.failures.write(writer.session.dir());
    error
}

/// Runs a stage, and stores its result and duration. The caller adds the record to the state.
fn run_and_keep<T: Serialize>(
    writer: &mut Writer,
    call: &StageCall,
    on_event: &mut dyn FnMut(&Event),
    run: impl FnOnce(&Session, OnProgress) -> Result<Outcome<T>, SessionError>,
) -> Result<StageRecord, SessionError> {
    let StageCall { step, stage, .. } = *call;
    on_event(&Event::Started { step, stage });
    let began = Instant::now();
    let Outcome { value, measures, findings, warnings, duration } =
        run(&writer.session, &mut as_events(step, stage, on_event))?;
    let output = writer.session.store.keep(&value)?.hash;
    writer.session.timings.note(step, stage, duration.unwrap_or_else(|| began.elapsed()).as_secs_f64());
    let (inputs, from) = (call.hash(), call.inputs.clone());
    Ok(StageRecord { inputs, code: call.version, from, output, measures, findings, warnings })
}

/// The artefacts that a walk has rebuilt.
#[derive(Debug, Default)]
pub(in crate::session) struct Repaired {
    /// The names of the rebuilt artefacts.
    pub made: BTreeSet<String>,
    /// Why the walk stopped early.
    pub stopped: Option<String>,
}

impl Repaired {
    fn stage<T: Serialize>(
        &mut self,
        session: &Session,
        call: &StageCall,
        on_event: &mut dyn FnMut(&Event),
        run: impl FnOnce(&Session, OnProgress) -> Result<Outcome<T>, SessionError>,
    ) -> Result<Made<T>, SessionError> {
        let StageCall { step, stage, .. } = *call;
        let recorded = session.state.record(step, stage).filter(|r| r.inputs == call.hash());
        let Some(record) = recorded else { return Err(call.not_built()) };
        if session.store.health(record.output) != Health::Sound {
            on_event(&Event::Started { step, stage });
            let outcome = run(session, &mut as_events(step, stage, on_event))?;
            let made = session.store.keep(&outcome.value)?.hash;
            if made != record.output {
                return Err(call.not_built());
            }
            self.made.insert(made.to_string());
        }
        Ok(Made::of(record))
    }
}
