//! What the search for the chest wall weighs against what.

/// Costs of the search for the chest wall. The defaults are those that do best on all CTs with
/// known walls; what they would be without one of these, and what that one then scores, is told in
/// docs/VERIFICATION.md.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Cost per mm of fat enclosed between rib shell and wall.
    pub fat: f32,
    /// Cost per mm of muscle left outside.
    pub muscle: f32,
    /// Tissue whose mean lies no more than this below the level of muscle is muscle, not gland, HU.
    pub muscle_hu: f32,
    /// Reward for a full edge from muscle to fat.
    pub edge: f32,
    /// Cost per mm of jump between rays 1 degree apart.
    pub jump: f32,
    /// Cost per mm by which the wall lies nearer to the lung than its least usual thickness.
    pub lung: f32,
}

impl Default for Weights {
    fn default() -> Self {
        Self { fat: 0.35, muscle: 0.5, muscle_hu: 9.0, edge: 4.0, jump: 1.2, lung: 0.3 }
    }
}
