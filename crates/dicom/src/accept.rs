//! What is read although it is not what a series should be, when that is asked for.

/// What is accepted of a series beyond what is safe; all false is the safest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Accept {
    /// Stored values are taken for HU where both Rescale Slope and Rescale Intercept are missing,
    /// with a warning. Whether they can be HU is still judged: in most such files air lies at 24.
    pub assume_hu: bool,
    /// Slices at unequal steps are interpolated linearly to equal ones, with a warning; else
    /// refused.
    pub equalise_steps: bool,
}
