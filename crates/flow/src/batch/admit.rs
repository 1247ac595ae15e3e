//! Who may begin: a case begins when it fits beside those running; one always may.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How often one that waits asks whether it is to stop.
const PATIENCE: Duration = Duration::from_millis(100);

/// Memory and cores, shared out among the cases that run.
#[derive(Debug)]
pub(crate) struct Admission {
    /// Memory for all together, bytes.
    memory: u64,
    cores: usize,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    running: usize,
    /// What they may come to hold, bytes.
    held: u64,
    /// Those that run, wait, or will come.
    workers: usize,
}

/// A case that runs: it gives back what it was given when it is dropped.
#[derive(Debug)]
pub(crate) struct Admitted<'a> {
    from: &'a Admission,
    need: u64,
    /// Threads that it may use.
    pub(crate) threads: usize,
}

impl Admission {
    /// So much memory (bytes) and so many cores for so many at once.
    pub(crate) fn new(memory: u64, cores: usize, workers: usize) -> Self {
        let state = Mutex::new(State { running: 0, held: 0, workers });
        Self { memory, cores: cores.max(1), state, changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until a case that needs so many bytes fits; none when the work is to stop first.
    pub(crate) fn enter(&self, need: u64, go_on: &dyn Fn() -> bool) -> Option<Admitted<'_>> {
        let mut state = self.state();
        loop {
            if !go_on() {
                return None;
            }
            if state.running == 0 || state.held.saturating_add(need) <= self.memory {
                break;
            }
            let waited = self.changed.wait_timeout(state, PATIENCE);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.running += 1;
        state.held = state.held.saturating_add(need);
        // Cores of those that memory keeps out are not left idle.
        let at_once = (self.memory / need.max(1)).clamp(1, state.workers.max(1) as u64);
        let threads = (self.cores / at_once as usize).max(1);
        Some(Admitted { from: self, need, threads })
    }

    /// One that would have come does not: the others have its cores.
    pub(crate) fn leave(&self) {
        let mut state = self.state();
        state.workers = state.workers.saturating_sub(1);
    }
}

impl Drop for Admitted<'_> {
    fn drop(&mut self) {
        let mut state = self.from.state();
        state.running -= 1;
        state.held -= self.need;
        drop(state);
        self.from.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::mpsc::channel;

    fn enter(admission: &Admission, need: u64) -> Option<Admitted<'_>> {
        // Those that do not fit at once are told to stop at their second look.
        let looks = AtomicUsize::new(0);
        admission.enter(need, &|| looks.fetch_add(1, Ordering::SeqCst) == 0)
    }

    #[test]
    fn a_case_begins_when_it_fits_and_one_always_may() {
        let admission = Admission::new(1000, 4, 3);
        let large = enter(&admission, 5000).expect("nobody else runs");
        assert_eq!(large.threads, 4, "nobody fits beside it");
        assert!(enter(&admission, 1).is_none());
        drop(large);
        let first = enter(&admission, 300).expect("it fits");
        let second = enter(&admission, 700).expect("it just fits");
        assert_eq!((first.threads, second.threads), (1, 4));
        assert!(enter(&admission, 1).is_none());
        drop(first);
        assert!(enter(&admission, 300).is_some());
    }

    #[test]
    fn the_last_ones_have_the_cores_of_those_that_are_done() {
        let admission = Admission::new(u64::MAX, 8, 4);
        assert_eq!(enter(&admission, 1).unwrap().threads, 2);
        admission.leave();
        admission.leave();
        assert_eq!(enter(&admission, 1).unwrap().threads, 4);
        admission.leave();
        assert_eq!(enter(&admission, 1).unwrap().threads, 8);
    }

    #[test]
    fn who_waits_is_let_in_when_another_ends() {
        let admission = &Admission::new(10, 2, 2);
        let first = admission.enter(8, &|| true).unwrap();
        let (looks, looked) = channel();
        std::thread::scope(|scope| {
            let second = scope.spawn(move || {
                let look = || looks.send(()).is_ok();
                admission.enter(8, &look).is_some()
            });
            // It looks a second time only after it has waited.
            (0..2).for_each(|_| looked.recv().expect("it waits"));
            assert!(!second.is_finished());
            drop(first);
            assert!(second.join().unwrap());
        });
    }
}
