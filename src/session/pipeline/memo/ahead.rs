//! Stages that run on threads of their own before the walk comes to them: the next scan is read, and a garment is checked, while the
//! garment is put on the figure.

use super::event::{OnProgress, StageProgress};
use super::run::Run;
use crate::session::store::{ContentHash, Store};
use std::any::Any;
use std::panic::resume_unwind;
use std::thread::JoinHandle;
use std::time::Instant;

/// The stages that were begun, by the hash of their inputs. The threads have ended when this is dropped.
#[derive(Default)]
pub(in crate::session) struct Ahead {
    begun: Vec<(ContentHash, Thread)>,
}

type Thread = JoinHandle<Box<dyn Any + Send>>;

/// A stage that was begun; its result may not be there yet.
pub(in crate::session) struct Begun(Thread);

/// What a thread returns: the result with its duration, and the progress in words.
struct Ended<T> {
    result: Run<T>,
    texts: Vec<String>,
}

/// As much as the main thread has: stages were written for that.
const STACK: usize = 8 << 20;

impl Ahead {
    pub fn has(&self, inputs: ContentHash) -> bool {
        self.begun.iter().any(|(hash, _)| *hash == inputs)
    }

    /// Begins a stage, unless no thread can be made.
    pub fn begin<I: Send + 'static, T: Send + 'static>(
        &mut self,
        hash: ContentHash,
        store: Store,
        inputs: I,
        run: fn(I, &Store, OnProgress) -> Run<T>,
    ) {
        let all = move || {
            let mut texts = Vec::new();
            let mut on_progress = |progress: StageProgress| {
                if let StageProgress::Text(text) = progress {
                    texts.push(text.to_string());
                }
            };
            let began = Instant::now();
            let result = run(inputs, &store, &mut on_progress).map(|outcome| outcome.lasting(began.elapsed()));
            Box::new(Ended { result, texts }) as Box<dyn Any + Send>
        };
        if let Ok(thread) = std::thread::Builder::new().stack_size(STACK).spawn(all) {
            self.begun.push((hash, thread));
        }
    }

    pub fn take(&mut self, inputs: ContentHash) -> Option<Begun> {
        let at = self.begun.iter().position(|(hash, _)| *hash == inputs)?;
        Some(Begun(self.begun.swap_remove(at).1))
    }
}

impl Drop for Ahead {
    fn drop(&mut self) {
        for (_, thread) in self.begun.drain(..) {
            // Nobody asks for its result, so nobody needs to know why it has none.
            let _ = thread.join();
        }
    }
}

impl Begun {
    /// Waits for the result, and passes its progress on; `None` if it is not of this type.
    pub fn ended<T: 'static>(self, on_progress: OnProgress) -> Option<Run<T>> {
        let Ended { result, texts } = *self.0.join().unwrap_or_else(|panic| resume_unwind(panic)).downcast().ok()?;
        texts.iter().for_each(|text| on_progress(StageProgress::Text(text)));
        Some(result)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::pipeline::memo::event::Outcome;

    fn twice(number: u32, _: &Store, on_progress: OnProgress) -> Run<u32> {
        assert!(number < 100, "too much");
        on_progress(StageProgress::Text("doubled"));
        Ok(Outcome::of(2 * number))
    }

    #[test]
    fn what_was_begun_ends_as_if_it_ran_when_it_is_asked_for() {
        let store = Store::in_session(std::path::Path::new("nowhere"));
        let hash = |text: &str| ContentHash::of(text.as_bytes());
        let mut ahead = Ahead::default();
        ahead.begin(hash("a"), store.clone(), 21, twice);
        ahead.begin(hash("b"), store.clone(), 100, twice);
        assert!(ahead.has(hash("a")) && !ahead.has(hash("c")) && ahead.take(hash("c")).is_none());
        let mut texts = Vec::new();
        let mut on_progress = |progress: StageProgress| {
            if let StageProgress::Text(text) = progress {
                texts.push(text.to_string());
            }
        };
        let result = ahead.take(hash("a")).unwrap().ended::<u32>(&mut on_progress);
        assert_eq!(result.unwrap().ok().map(|outcome| outcome.value), Some(42));
        assert_eq!(texts, ["doubled"]);
        assert!(!ahead.has(hash("a")));
        // A panic is that of the stage, and of nobody if the stage is not asked for.
        let begun = ahead.take(hash("b")).unwrap();
        let ended =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| begun.ended::<u32>(&mut |_| {}).is_some()));
        assert!(ended.is_err());
        ahead.begin(hash("b"), store, 100, twice);
        drop(ahead);
    }
}
