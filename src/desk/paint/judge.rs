//! What happens beside the strokes: verdicts, and a look at what other commands do to the session.

use super::easel::{Easel, locked};
use super::news::without_commands;
use super::refusal::{Kind, Refusal};
use crate::check::Verdict;
use crate::session::{SessionError, Stage, StageRequest, Writer};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long nothing is painted before the verdict is found: people draw several strokes in a row.
const PAUSE: Duration = Duration::from_millis(900);
/// How often it is looked for something to do.
const POLL: Duration = Duration::from_millis(100);
/// How long the session is left alone between two stages, so that a command that waits for it gets it.
const YIELD: Duration = Duration::from_millis(50);
/// The stages after the cut, up to the verdict. Between two of them a stroke may come.
const AFTER_CUT: [Stage; 5] = [Stage::Rig, Stage::Stack, Stage::Figure, Stage::Press, Stage::Check];

impl Easel {
    /// Finds verdicts and notices other commands until `ended`.
    pub(super) fn judge(&self, ended: &AtomicBool) {
        self.say_verdicts();
        while !ended.load(Ordering::Relaxed) {
            std::thread::sleep(POLL);
            let has_changed = {
                let mut work = locked(&self.work);
                let now = self.journal();
                std::mem::replace(&mut work.journal, now) != now
            };
            if has_changed {
                self.after_another_command();
            }
            self.judge_next(ended);
        }
    }

    /// Cuts the layers that have to be judged, and builds the innermost one up to its verdict, stage by stage; stops where a stroke
    /// comes, and tries again later.
    fn judge_next(&self, ended: &AtomicBool) {
        let (quiet_since, to_judge) = {
            let work = locked(&self.work);
            (work.quiet_since, work.to_judge.clone())
        };
        if quiet_since.is_none_or(|at| at.elapsed() < PAUSE) {
            return;
        }
        let names: Vec<String> = locked(&self.news).layers.iter().map(|layer| layer.name.clone()).collect();
        let layers: Vec<&String> = names.iter().filter(|name| to_judge.contains(*name)).collect();
        let Some(&innermost) = layers.first() else { return };
        let tasks = layers.iter().map(|&layer| (layer, None)).chain(AFTER_CUT.map(|stage| (innermost, Some(stage))));
        for (layer, stage) in tasks {
            if ended.load(Ordering::Relaxed) || self.waiting.load(Ordering::SeqCst) > 0 {
                return;
            }
            let built = match stage {
                None => self.cut_again(layer),
                Some(stage) => self.write(|writer| {
                    let (name, step) = ("build".into(), Some(layer.clone()));
                    let request = StageRequest { name, stages: vec![stage], step, ..StageRequest::default() };
                    writer.run_stages(&request, &mut |_| {}).map(drop)
                }),
            };
            match built {
                Ok(()) => std::thread::sleep(YIELD),
                Err(refusal) if refusal.kind == Kind::Later => {
                    locked(&self.work).quiet_since = Some(Instant::now());
                    return;
                }
                Err(refusal) => {
                    self.give_verdict(layer, refusal.what, "bad");
                    if layer == innermost {
                        break;
                    }
                }
            }
        }
        let mut work = locked(&self.work);
        if work.quiet_since == quiet_since {
            work.to_judge.remove(innermost);
        }
        drop(work);
        self.say_verdicts();
    }

    /// Changes the session. Only one thread does at a time.
    fn write<T>(&self, change: impl FnOnce(&mut Writer) -> Result<T, SessionError>) -> Result<T, Refusal> {
        let mut work = locked(&self.work);
        let mut writer = Writer::open(&self.dir)?;
        writer.remember(&self.memory);
        let changed = change(&mut writer);
        // Before another command can begin.
        work.journal = self.journal();
        Ok(changed?)
    }

    /// Cuts a layer, and shows it if a stroke on another garment of its scan has changed it.
    fn cut_again(&self, layer: &str) -> Result<(), Refusal> {
        let recut = self.write(|writer| writer.recut(layer, &mut |_| {}))?;
        let has_changed =
            recut.reports.iter().any(|report| report.ran && report.step == layer && report.stage == Stage::Cut);
        if has_changed { self.look_again(layer) } else { Ok(()) }
    }

    fn give_verdict(&self, layer: &str, verdict: String, class: &'static str) {
        if let Some(layer) = locked(&self.news).layer(layer) {
            layer.verdict = Some((without_commands(&verdict), class));
        }
    }

    /// Reads the verdict on each layer that is up to date.
    fn say_verdicts(&self) {
        let Ok(status) = self.reader().and_then(|session| session.status()) else { return };
        for step in status {
            let class = match &step.verdict {
                Some(Verdict::Good) => "good",
                Some(Verdict::Check(_)) => "doubt",
                Some(Verdict::Failed(_)) => "bad",
                None => continue,
            };
            self.give_verdict(&step.name, step.verdict.map(|verdict| verdict.to_string()).unwrap_or_default(), class);
        }
    }

    /// Another command has changed the session: shows what it made.
    fn after_another_command(&self) {
        let looked = || -> Result<(), Refusal> {
            let session = self.reader()?;
            self.list_layers(&session)?;
            let change = session.history().current().head().map(|entry| entry.change.clone()).unwrap_or_default();
            let loaded: Vec<String> = {
                let news = locked(&self.news);
                news.layers.iter().filter(|layer| layer.is_loaded).map(|layer| layer.name.clone()).collect()
            };
            let mut shown = BTreeSet::new();
            for layer in loaded {
                shown.extend(session.layers_labelled_with(&layer)?);
            }
            for layer in shown {
                self.look_again(&layer)?;
            }
            locked(&self.news).say(format!("another command has changed the session; its last change is '{change}'"));
            Ok(())
        };
        if let Err(refusal) = looked() {
            locked(&self.news).say(refusal.what);
        }
        self.say_verdicts();
    }
}
