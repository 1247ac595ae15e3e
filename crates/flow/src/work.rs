//! What a node is given to work with, beside what it may see.

use crate::Error;
use crate::folder::Shelf;
use crate::shared::ExportSource;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use supine_dicom::Clock;
use supine_report::{Output, Warning as Told};
use supine_space::{Progress, Warning};

/// Progress, a place for files, and a way to warn.
pub(crate) struct Work<'a> {
    /// How far the node is; may answer stop.
    pub(crate) progress: Progress<'a>,
    /// Where the node's files go; none in a session without a folder.
    pub(crate) shelf: Option<Shelf<'a>>,
    /// Warnings of the nodes that this one rests on, in the order of the nodes.
    pub(crate) warned: &'a [Told],
    /// Files of the nodes that this one rests on, in the same order.
    pub(crate) written: &'a [Output],
    /// When the run began; none where nobody said so.
    pub(crate) clock: Option<&'a Clock>,
    warnings: Mutex<Vec<Warning>>,
}

impl<'a> Work<'a> {
    pub(crate) fn new(
        progress: Progress<'a>,
        shelf: Option<Shelf<'a>>,
        (warned, written): (&'a [Told], &'a [Output]),
        clock: Option<&'a Clock>,
    ) -> Self {
        Self { progress, shelf, warned, written, clock, warnings: Mutex::default() }
    }

    /// The date and time that an object bears: the case's, the run's, or, where nobody said it or
    /// the patient was taken out, those of the series that it is made from.
    pub(crate) fn clock_of(&self, given: Option<&str>, named: &ExportSource) -> Clock {
        let of_case = given.and_then(Clock::parse);
        let of_run = || self.clock.filter(|_| named.anonymiser.is_none()).cloned();
        of_case.or_else(of_run).unwrap_or_else(|| named.source.clock())
    }

    /// Says what the user must know.
    pub(crate) fn warn(&self, warning: Warning) {
        if let Ok(mut all) = self.warnings.lock() {
            all.push(warning);
        }
    }

    /// Says all of them.
    pub(crate) fn warn_all(&self, warnings: impl IntoIterator<Item = Warning>) {
        warnings.into_iter().for_each(|warning| self.warn(warning));
    }

    /// What was said since it was last asked.
    pub(crate) fn take_warnings(&self) -> Vec<Warning> {
        self.warnings.lock().map(|mut all| std::mem::take(&mut *all)).unwrap_or_default()
    }

    /// Where a file or folder of the node goes.
    ///
    /// # Errors
    /// [`Error::NoFolder`] in a session without one; when its parent folder cannot be made.
    pub(crate) fn place(&self, artifact: &'static str) -> Result<PathBuf, Error> {
        self.shelf.as_ref().ok_or(Error::NoFolder)?.place(artifact)
    }

    /// Has a folder of the node filled under a passing name and puts it in its place: it is there
    /// with all its files or not at all.
    ///
    /// # Errors
    /// As [`Self::place`] and as `write`; when the folder cannot be made or renamed.
    pub(crate) fn fill<T>(
        &self,
        artifact: &'static str,
        write: impl FnOnce(&Path) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.shelf.as_ref().ok_or(Error::NoFolder)?.fill(artifact, write)
    }
}
