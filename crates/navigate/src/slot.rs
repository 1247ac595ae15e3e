//! A place for the newest of something: what was there before is forgotten, so that nothing queues.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Holds at most one thing.
#[derive(Debug)]
pub(crate) struct Slot<T> {
    held: Mutex<Held<T>>,
    came: Condvar,
}

#[derive(Debug)]
struct Held<T> {
    newest: Option<T>,
    closed: bool,
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self { held: Mutex::new(Held { newest: None, closed: false }), came: Condvar::new() }
    }
}

impl<T> Slot<T> {
    fn held(&self) -> MutexGuard<'_, Held<T>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts something in; gives back what nobody took.
    pub(crate) fn put(&self, thing: T) -> Option<T> {
        let before = self.held().newest.replace(thing);
        self.came.notify_one();
        before
    }

    /// Waits for something; nothing once it is closed, or when `patience` has passed.
    pub(crate) fn take(&self, patience: Duration) -> Option<T> {
        let held = self.held();
        let waits = |held: &mut Held<T>| held.newest.is_none() && !held.closed;
        let waited = self.came.wait_timeout_while(held, patience, waits);
        waited.unwrap_or_else(PoisonError::into_inner).0.newest.take()
    }

    /// Nobody waits any more.
    pub(crate) fn close(&self) {
        self.held().closed = true;
        self.came.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_wins_and_the_one_before_is_told() {
        let slot = Slot::default();
        assert_eq!((slot.put(1), slot.put(2), slot.put(3)), (None, Some(1), Some(2)));
        assert_eq!(slot.take(Duration::ZERO), Some(3));
        assert_eq!(slot.take(Duration::from_millis(1)), None);
    }

    #[test]
    fn who_waits_is_woken_by_what_comes_and_by_the_end() {
        let slot = Slot::default();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| slot.take(Duration::from_secs(60)));
            slot.put(7);
            assert_eq!(waiting.join().unwrap(), Some(7));
            let waiting = scope.spawn(|| slot.take(Duration::from_secs(60)));
            slot.close();
            assert_eq!(waiting.join().unwrap(), None);
        });
    }
}
