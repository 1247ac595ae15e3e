//! Work in another thread, whose result is taken when it is there.

use std::thread::JoinHandle;

/// At most one piece of work at a time; dropped, it waits for the end.
pub(crate) struct Beside<T>(Option<JoinHandle<Option<T>>>);

impl<T: Send + 'static> Beside<T> {
    /// No work.
    pub(crate) fn idle() -> Self {
        Self(None)
    }

    /// Whether there is work of which the result has not been taken.
    pub(crate) fn is_busy(&self) -> bool {
        self.0.is_some()
    }

    /// Begins to work, unless work is under way.
    pub(crate) fn begin(&mut self, work: impl FnOnce() -> Option<T> + Send + 'static) {
        if self.0.is_none() {
            self.0 = Some(std::thread::spawn(work));
        }
    }

    /// What came of the work, if it has ended and something did.
    pub(crate) fn take(&mut self) -> Option<T> {
        self.0.take_if(|thread| thread.is_finished())?.join().ok().flatten()
    }
}

impl<T> Drop for Beside<T> {
    fn drop(&mut self) {
        // What came of it is not wanted any more, whatever it is.
        self.0.take().map(JoinHandle::join);
    }
}
