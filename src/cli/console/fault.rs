//! Bugs in Overcoat: a panic becomes one sentence and an exit code, and the session is unchanged.

use std::panic::{AssertUnwindSafe, catch_unwind, set_hook};
use std::sync::{Arc, Mutex};

/// Runs `work`. A panic becomes an error with its source location. `in_full` also prints the usual report on stderr.
pub(in crate::cli) fn caught<T>(in_full: bool, work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let place = Arc::new(Mutex::new(String::new()));
    if !in_full {
        let noted = Arc::clone(&place);
        set_hook(Box::new(move |info| {
            if let (Some(at), Ok(mut place)) = (info.location(), noted.lock()) {
                *place = format!(" at {}:{}", at.file(), at.line());
            }
        }));
    }
    // All state of a command is either dropped or complete on disk, so no half-changed value is used after a panic.
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let what = match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
            (Some(text), _) => text,
            (None, Some(text)) => text.as_str(),
            (None, None) => "no reason given",
        };
        let place = place.lock().map(|p| p.clone()).unwrap_or_default();
        Err(anyhow::anyhow!("this is a fault of Overcoat, not of your data, please report it: {what}{place}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_sentence_and_results_pass() {
        assert_eq!(caught(true, || Ok(3)).unwrap(), 3);
        let error = caught::<()>(true, || panic!("the {} fell", "sky")).unwrap_err();
        assert!(error.to_string().ends_with("please report it: the sky fell"), "{error}");
    }
}
