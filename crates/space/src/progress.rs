//! The one callback of a stage: it is told how far the stage is and may answer stop.

/// The user asked to stop; nothing was produced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Stopped;

/// Receives the progress of a stage, and may stop it.
///
/// A stage calls [`Progress::at`] with the share of its work that is done; a stage made of parts
/// hands [`Progress::part`] to each part. The callback returns false to stop the stage.
#[derive(Clone, Copy)]
pub struct Progress<'a> {
    sink: &'a (dyn Fn(f64) -> bool + Sync),
    from: f64,
    to: f64,
}

impl std::fmt::Debug for Progress<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Progress({}..{})", self.from, self.to)
    }
}

impl<'a> Progress<'a> {
    /// Reports to `sink`, which is given the share done, 0..=1, and returns false to stop.
    pub fn new(sink: &'a (dyn Fn(f64) -> bool + Sync)) -> Self {
        Self { sink, from: 0.0, to: 1.0 }
    }

    /// Reports to nobody and never stops.
    pub fn none() -> Progress<'static> {
        Progress { sink: &|_| true, from: 0.0, to: 1.0 }
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
        if (self.sink)(whole) { Ok(()) } else { Err(Stopped) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

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
