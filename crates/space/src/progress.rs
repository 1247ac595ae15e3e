//! The one callback of a stage: it is told how far the stage is and what it found on the way, and
//! may answer stop.

use std::sync::{Mutex, PoisonError};

/// The user asked to stop; nothing was produced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Stopped;

/// Who watches a stage: a closure that is told the share alone, or more.
pub trait Watch: Sync {
    /// The share that is done, 0..=1; answers false to stop the stage.
    fn share(&self, share: f64) -> bool;
    /// What the stage found on its way, in words for people.
    fn found(&self, _text: &str) {}
}

impl<F: Fn(f64) -> bool + Sync> Watch for F {
    fn share(&self, share: f64) -> bool {
        self(share)
    }
}

/// Receives the progress of a stage, and may stop it.
///
/// A stage calls [`Progress::at`] with the share of its work that is done; a stage made of parts
/// hands [`Progress::part`] to each part. The callback returns false to stop the stage.
#[derive(Clone, Copy)]
pub struct Progress<'a> {
    sink: &'a dyn Watch,
    from: f64,
    to: f64,
}

impl std::fmt::Debug for Progress<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Progress({}..{})", self.from, self.to)
    }
}

impl<'a> Progress<'a> {
    /// Reports to `sink`.
    pub fn new(sink: &'a dyn Watch) -> Self {
        Self { sink, from: 0.0, to: 1.0 }
    }

    /// Reports to nobody and never stops.
    pub fn none() -> Progress<'static> {
        Progress { sink: &|_: f64| true, from: 0.0, to: 1.0 }
    }

    /// The part of the work from share `from` to share `to` (0..=1).
    #[must_use]
    pub fn part(&self, from: f64, to: f64) -> Self {
        let span = self.to - self.from;
        Self { sink: self.sink, from: self.from + span * from, to: self.from + span * to }
    }

    /// Says that `share` (0..=1) of this part is done.
    ///
    /// # Errors
    /// [`Stopped`] when the callback answered stop; the stage must return at once.
    pub fn at(&self, share: f64) -> Result<(), Stopped> {
        let whole = self.from + (self.to - self.from) * share.clamp(0.0, 1.0);
        if self.sink.share(whole) { Ok(()) } else { Err(Stopped) }
    }

    /// Says in words for people what was found on the way.
    pub fn found(&self, text: &str) {
        self.sink.found(text);
    }
}

/// Works of about the same length that go on side by side, watched as one.
#[derive(Debug)]
pub struct Beside<'a> {
    whole: Progress<'a>,
    shares: Mutex<Vec<f64>>,
}

/// One of them.
#[derive(Clone, Copy, Debug)]
pub struct OneOf<'a> {
    all: &'a Beside<'a>,
    n: usize,
}

impl<'a> Beside<'a> {
    /// So many works that are the whole of `whole`.
    pub fn new(whole: Progress<'a>, works: usize) -> Self {
        Self { whole, shares: Mutex::new(vec![0.0; works]) }
    }

    /// Watches the n-th of them.
    pub fn one(&'a self, n: usize) -> OneOf<'a> {
        OneOf { all: self, n }
    }
}

impl Watch for OneOf<'_> {
    fn share(&self, share: f64) -> bool {
        let mut shares = self.all.shares.lock().unwrap_or_else(PoisonError::into_inner);
        shares[self.n] = share;
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        self.all.whole.at(mean).is_ok()
    }

    fn found(&self, text: &str) {
        self.all.whole.found(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn works_side_by_side_are_one() {
        let seen = Mutex::new(Vec::new());
        let sink = |x: f64| {
            seen.lock().unwrap().push(x);
            x < 0.7
        };
        let beside = Beside::new(Progress::new(&sink), 2);
        let (one, other) = (beside.one(0), beside.one(1));
        assert!(Progress::new(&one).at(0.5).is_ok());
        assert!(Progress::new(&other).part(0.5, 1.0).at(0.5).is_ok());
        assert!(Progress::new(&one).at(1.0).is_err());
        assert_eq!(*seen.lock().unwrap(), vec![0.25, 0.625, 0.875]);
    }

    #[test]
    fn parts_nest() {
        let seen = Mutex::new(Vec::new());
        let sink = |x: f64| {
            seen.lock().unwrap().push(x);
            x < 0.7
        };
        let whole = Progress::new(&sink);
        assert_eq!(whole.part(0.5, 1.0).part(0.0, 0.5).at(0.5), Ok(()));
        assert_eq!(whole.at(0.8), Err(Stopped));
        assert_eq!(*seen.lock().unwrap(), vec![0.625, 0.8]);
    }
}
