//! Cache of the arms and motions of the last runs, shared by threads.

use std::sync::{Mutex, PoisonError};

/// Maximum number of values in the cache.
const KEPT: usize = 64;

/// Values by their keys, most recently used last.
pub(super) struct Recent<T>(Mutex<Vec<(String, T)>>);

impl<T> Default for Recent<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Clone> Recent<T> {
    pub(super) fn get(&self, key: &str) -> Option<T> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = kept.iter().rposition(|(known, _)| known == key)?;
        let found = kept.remove(place);
        let value = found.1.clone();
        kept.push(found);
        Some(value)
    }

    pub(super) fn put(&self, key: String, value: T) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= KEPT {
            kept.remove(0);
        }
        kept.push((key, value));
    }
}
