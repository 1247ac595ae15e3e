//! Words and numbers that can be typed.

use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::str::FromStr;
use supine_flow::NodeId;
use supine_flow::commands::SurfaceFrame;
use supine_flow::commands::carry::CarryVolume;
use supine_space::Side;

/// What has a schema.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Schema {
    /// A case file
    Case,
    /// summary.json
    Summary,
    /// What `run --status` writes
    Status,
}

/// How things are said on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// For people
    Text,
    /// One JSON object a line
    Json,
}

/// Words of the command line for values of the flow.
macro_rules! words {
    ($(#[$meta:meta])* $name:ident for $of:path { $($(#[$doc:meta])* $word:ident => $value:expr),* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, ValueEnum)]
        pub(crate) enum $name { $($(#[$doc])* $word),* }
        impl From<$name> for $of {
            fn from(word: $name) -> Self {
                match word { $($name::$word => $value),* }
            }
        }
    };
}

words!(Frame for SurfaceFrame {
    /// Left, posterior, superior
    Lps => SurfaceFrame::Lps,
    /// Right, anterior, superior
    Ras => SurfaceFrame::Ras
});
words!(BreastSide for Side {
    /// The patient's left
    Left => Side::Left,
    /// The patient's right
    Right => Side::Right
});
words!(CarryGrid for bool {
    /// Those of the label map
    Own => false,
    /// Those of the CT
    Ct => true
});
words!(CarryKind for CarryVolume {
    /// Numbers of labels, never mixed
    Labels => CarryVolume::Labels,
    /// A dose or another quantity that can be interpolated
    Dose => CarryVolume::Dose
});

/// Numbers of one argument, with commas between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbers<const N: usize>(pub(crate) [f64; N]);

impl<const N: usize> FromStr for Numbers<N> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |n: &str| n.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let parsed: Option<Vec<f64>> = text.split(',').map(number).collect();
        let numbers = parsed.and_then(|all| all.try_into().ok()).map(Self);
        numbers.ok_or_else(|| format!("expected {N} numbers with commas between"))
    }
}

/// The name of a stage: help and completion list them.
pub(crate) fn stages() -> impl TypedValueParser<Value = NodeId> {
    let names = PossibleValuesParser::new(NodeId::ALL.map(NodeId::name));
    names.try_map(|name| NodeId::of_name(&name).ok_or("no stage"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_counted() {
        assert_eq!("-1, 2.5,3".parse(), Ok(Numbers([-1.0, 2.5, 3.0])));
        assert!("1,2".parse::<Numbers<3>>().is_err());
        assert!("1,nan".parse::<Numbers<2>>().is_err());
    }
}
