//! Work in another thread, whose result is taken when it is there.

use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;

type Work<T> = Box<dyn FnOnce() -> Option<T> + Send>;

/// At most one piece of work at a time; dropped, it waits for the end.
pub(crate) struct Background<T> {
    worker: Option<Worker<T>>,
    busy: bool,
}

/// One thread for all pieces of work: what each would leave to the memory of a thread of its own is
/// used by the next.
struct Worker<T> {
    work: Option<Sender<Work<T>>>,
    results: Receiver<Option<T>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Background<T> {
    /// No work.
    pub(crate) fn idle() -> Self {
        Self { worker: None, busy: false }
    }

    /// Whether there is work of which the result has not been taken.
    pub(crate) fn is_busy(&self) -> bool {
        self.busy
    }

    /// Begins to work, unless work is under way.
    pub(crate) fn begin(&mut self, work: impl FnOnce() -> Option<T> + Send + 'static) {
        if self.busy {
            return;
        }
        let worker = self.worker.get_or_insert_with(Worker::new);
        self.busy = worker.work.as_ref().is_some_and(|to| to.send(Box::new(work)).is_ok());
        if !self.busy {
            self.worker = None;
        }
    }

    /// What came of the work, if it has ended and something did.
    pub(crate) fn take(&mut self) -> Option<T> {
        let received = self.worker.as_ref().map(|worker| worker.results.try_recv())?;
        match received {
            Ok(result) => {
                self.busy = false;
                result
            }
            Err(TryRecvError::Empty) => None,
            // The work panicked, and its thread is gone.
            Err(TryRecvError::Disconnected) => {
                *self = Self::idle();
                None
            }
        }
    }
}

impl<T: Send + 'static> Worker<T> {
    fn new() -> Self {
        let (work, pieces) = channel::<Work<T>>();
        let (done, results) = channel();
        let thread = std::thread::spawn(move || {
            while let Ok(piece) = pieces.recv() {
                if done.send(piece()).is_err() {
                    break;
                }
            }
        });
        Self { work: Some(work), results, thread: Some(thread) }
    }
}

impl<T> Drop for Worker<T> {
    fn drop(&mut self) {
        // The thread ends with its last piece; what came of it is not wanted any more, whatever it
        // is.
        self.work = None;
        self.thread.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn taken<T: Send + 'static>(beside: &mut Background<T>) -> Option<T> {
        for _ in 0..20_000 {
            if !beside.is_busy() {
                break;
            }
            if let Some(found) = beside.take() {
                return Some(found);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        None
    }

    #[test]
    fn one_piece_after_the_other_by_the_same_thread() {
        let mut beside = Background::idle();
        assert!(beside.take().is_none());
        let mut threads = vec![];
        for _ in 0..3 {
            beside.begin(|| Some(std::thread::current().id()));
            beside.begin(|| panic!("a second piece was begun"));
            threads.extend(taken(&mut beside));
        }
        assert!(threads.len() == 3 && threads.iter().all(|one| *one == threads[0]), "{threads:?}");
        beside.begin(|| None);
        assert!(taken(&mut beside).is_none() && !beside.is_busy());
    }

    #[test]
    fn after_a_panic_there_is_another_thread() {
        let mut beside: Background<u8> = Background::idle();
        beside.begin(|| panic!("meant: the work of this test panics"));
        assert_eq!(taken(&mut beside), None);
        assert!(!beside.is_busy());
        beside.begin(|| Some(7));
        assert_eq!(taken(&mut beside), Some(7));
    }
}
