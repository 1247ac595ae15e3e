//! Scans of the patient's skin held against the model, as they are held: for those who show them.

use crate::Error;
use crate::nodes::{Evaluation, Fit};
use crate::session::{Freshness, Request, Session};
use std::sync::Arc;
use supine_mesh::ScanDistances;

impl Session {
    /// The scans held against the model, made or read if they are not held.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn read_scans(&self, request: &Request<'_>) -> Result<(), Error> {
        let case = self.case();
        if case.fit_scans().is_some() {
            self.get::<Fit>(request)?;
        }
        if case.scans.as_ref().is_some_and(|scans| scans.intraop.is_some()) {
            self.get::<Evaluation>(request)?;
        }
        Ok(())
    }

    /// The scan of the sitting patient laid onto the CT, with its distances from skins, that of the
    /// CT first; nothing is read or made, and nothing told that is of what was given before.
    pub fn peek_sitting_scan(&self) -> Option<Arc<ScanDistances>> {
        let (fitted, freshness) = self.peek::<Fit>()?;
        fitted.shared_distances().filter(|_| freshness == Freshness::Fresh)
    }

    /// The scan on the operating table with its distances from skins, that of the result last;
    /// nothing is read or made, and nothing told that is of what was given before.
    pub fn peek_table_scan(&self) -> Option<Arc<ScanDistances>> {
        let (evaluated, freshness) = self.peek::<Evaluation>()?;
        evaluated.shared_distances().filter(|_| freshness == Freshness::Fresh)
    }
}
