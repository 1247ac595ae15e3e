//! What the CT shape is taken for, and what stands for the tissue beyond the region.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What is taken as stress-free.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum RestState {
    /// The CT shape; the load is the difference of the two gravities.
    #[default]
    Net,
    /// The shape that the CT's gravity deforms into the CT shape; the load is the target's gravity.
    Unloaded,
}

impl RestState {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Net, Self::Unloaded];

    /// Name in case files, on the command line, in summaries and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Net => "net",
            Self::Unloaded => "unloaded",
        }
    }
}

impl fmt::Display for RestState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How tissue resists beyond small strain, where all laws agree.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Compressible neo-Hookean.
    #[default]
    NeoHookean,
    /// Stiffens exponentially.
    Exponential,
    /// Stiffens without bound towards a largest stretch.
    Gent,
    /// Stiffens evenly.
    Yeoh,
}

impl Law {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::NeoHookean, Self::Exponential, Self::Gent, Self::Yeoh];
    /// Their names.
    pub const NAMES: [&'static str; Self::ALL.len()] = {
        let mut names = [""; Self::ALL.len()];
        let mut n = 0;
        while n < names.len() {
            names[n] = Self::ALL[n].name();
            n += 1;
        }
        names
    };

    /// Name in case files, on the command line, in summaries and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo-hookean",
            Self::Exponential => "exponential",
            Self::Gent => "gent",
            Self::Yeoh => "yeoh",
        }
    }

    /// Whether it is the one of cases that name none.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What happens at the sphere that bounds the region.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Cut {
    /// No traction: the tissue beyond follows.
    Free,
    /// Held.
    Fixed,
    /// On springs in place of the tissue beyond.
    #[default]
    Spring,
}

impl Cut {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Free, Self::Fixed, Self::Spring];

    /// Name in case files, on the command line, in summaries and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Fixed => "fixed",
            Self::Spring => "spring",
        }
    }
}

impl fmt::Display for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
