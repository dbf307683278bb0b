//! A cache of values loaded or prepared from artefacts, for a process that works on a session repeatedly.

use super::hash::ContentHash;
use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

/// A value of any type.
type Anything = Arc<dyn Any + Send + Sync>;

/// Values by artefact and type. A clone shares the cache.
#[derive(Clone, Default)]
pub struct Memory {
    /// Most recently used last.
    values: Arc<Mutex<Vec<(ContentHash, Anything)>>>,
}

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Memory")
    }
}

/// Capacity: ten values for each of a handful of garments, about 100 MB.
const GREATEST_COUNT: usize = 48;

impl Memory {
    /// The value of that type from that artefact: cached, or computed now.
    pub(in crate::session) fn have<T: Send + Sync + 'static, E>(
        &self,
        of: ContentHash,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        if let Some(there) = self.take(of) {
            return Ok(there);
        }
        let made = Arc::new(make()?);
        let mut values = self.values.lock().unwrap_or_else(PoisonError::into_inner);
        values.push((of, made.clone()));
        if values.len() > GREATEST_COUNT {
            values.remove(0);
        }
        Ok(made)
    }

    fn take<T: Send + Sync + 'static>(&self, of: ContentHash) -> Option<Arc<T>> {
        let mut values = self.values.lock().unwrap_or_else(PoisonError::into_inner);
        let at = values.iter().position(|(hash, value)| *hash == of && value.is::<T>())?;
        let used = values.remove(at);
        let value = used.1.clone().downcast().ok();
        values.push(used);
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_made_once_for_its_artefact_and_type_and_the_least_used_goes() {
        let memory = Memory::default();
        let mut made = 0;
        let mut have = |of: &[u8]| {
            let value = memory.have(ContentHash::of(of), || {
                made += 1;
                Ok::<_, ()>(made)
            });
            *value.unwrap()
        };
        assert_eq!((have(b"a"), have(b"a"), have(b"b"), have(b"a")), (1, 1, 2, 1));
        let other_type = memory.have(ContentHash::of(b"a"), || Ok::<_, ()>("text")).unwrap();
        assert_eq!(*other_type, "text");
        for k in 0..GREATEST_COUNT - 2 {
            have(&[k as u8]);
        }
        assert_eq!(have(b"a"), 1);
        assert!(have(b"b") > 2, "b was used least");
    }
}
