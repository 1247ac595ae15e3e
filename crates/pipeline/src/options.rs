//! What a run is asked beside its case.

use crate::Stage;

/// What a run is asked beside its case.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Ends after this stage.
    pub until: Option<Stage>,
    /// Redoes this stage and all later ones, done or not.
    pub force: Option<Stage>,
}
