//! What happens beside the strokes: verdicts, and a look at what other commands do to the session.

use super::easel::{Easel, locked};
use super::refusal::Refusal;
use crate::check::Verdict;
use crate::session::{SessionError, Stage, StageRequest, Writer};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long nothing is painted before the verdict is found: people draw several strokes in a row.
const PAUSE: Duration = Duration::from_millis(900);
/// How often it is looked for something to do.
const POLL: Duration = Duration::from_millis(100);
/// The stages after the cut, up to the verdict. Between two of them a stroke may come.
const AFTER_CUT: [Stage; 5] = [Stage::Rig, Stage::Stack, Stage::Figure, Stage::Press, Stage::Check];

impl Easel {
    /// Finds verdicts and notices other commands until `ended`.
    pub fn watch(&self, ended: &AtomicBool) {
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
            let layer = locked(&self.work).to_judge.clone().filter(|(_, since)| since.elapsed() >= PAUSE);
            if let Some((layer, since)) = layer
                && self.waiting.load(Ordering::SeqCst) == 0
            {
                self.judge(&layer, since, ended);
            }
        }
    }

    /// Builds one layer up to its verdict, stage by stage; stops where a stroke comes.
    fn judge(&self, layer: &str, since: Instant, ended: &AtomicBool) {
        locked(&self.news).is_judging = true;
        let mut stopped = false;
        for stage in AFTER_CUT {
            stopped = ended.load(Ordering::Relaxed) || self.waiting.load(Ordering::SeqCst) > 0;
            if stopped {
                break;
            }
            // Only one thread changes the session at a time.
            let mut work = locked(&self.work);
            let built = Writer::open(&self.dir).and_then(|mut writer| {
                writer.remember(&self.memory);
                let (name, step) = ("build".into(), Some(layer.to_string()));
                let request = StageRequest { name, stages: vec![stage], step, ..StageRequest::default() };
                let run = writer.run_stages(&request, &mut |_| {});
                // Before another command can begin.
                work.journal = self.journal();
                run
            });
            drop(work);
            match built {
                Ok(_) => {}
                Err(SessionError::Locked { .. }) => {
                    stopped = true;
                    break;
                }
                Err(error) => {
                    self.give_verdict(layer, error.to_string(), "bad");
                    break;
                }
            }
        }
        if !stopped {
            let mut work = locked(&self.work);
            work.to_judge = work.to_judge.take().filter(|(of, at)| of != layer || *at != since);
            drop(work);
            self.say_verdicts();
        }
        locked(&self.news).is_judging = false;
    }

    fn give_verdict(&self, layer: &str, verdict: String, class: &'static str) {
        if let Some(layer) = locked(&self.news).layer(layer) {
            layer.verdict = Some((verdict, class));
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
            let layers: Vec<String> = locked(&self.news)
                .layers
                .iter()
                .filter(|layer| layer.is_loaded)
                .map(|layer| layer.name.clone())
                .collect();
            for layer in layers {
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
