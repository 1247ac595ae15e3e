//! How a run ended, in a small file: the one contract that a workflow engine reads.

use crate::{Colour, Summary};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use supine_space::Failure;

/// How a run ended, whether it left a result or not.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct RunStatus {
    /// Version of this structure: [`RunStatus::SCHEMA`].
    pub schema: String,
    /// Name of the case: that of its file, of its folder where the file is called `case.toml` or
    /// `summary.json`, of its row in a table; of a de-identified run that of the status file.
    pub case: String,
    /// The case file, or the table in which it stands; absent when the patient was taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case_file: Option<PathBuf>,
    /// The folder of the run; absent when the patient was taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
    /// The exit code of `supine run`.
    pub exit: u8,
    /// How it ended, in a word.
    pub status: Ended,
    /// The verdict; none without a result.
    pub colour: Option<Colour>,
    /// Why the verdict is not green, the worst first.
    pub reasons: Vec<String>,
    /// Number of warnings.
    pub warnings: usize,
    /// Why the exit code is not 0; none where it is.
    pub error: Option<RunError>,
    /// Wall time, seconds.
    pub seconds: f64,
    /// The most memory that the run held at once, MB; none where it was not counted.
    pub peak_memory_mb: Option<f64>,
    /// Voxels of the CT; none where it was not read.
    pub voxels: Option<usize>,
    /// Threads that worked on it.
    pub threads: usize,
    /// The tumour's displacement; none without a result or a tumour.
    pub tumour: Option<TumourMoved>,
    /// Version of the program.
    pub version: String,
}

/// How a run ended.
#[derive(
    Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord,
)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// With a green verdict.
    Usable,
    /// With an amber verdict: to be looked at before use.
    Flagged,
    /// With a red verdict: not to be used.
    NotUsable,
    /// Without a result.
    Failed,
    /// Somebody stopped it.
    Stopped,
    /// After the stage that was asked for: without a verdict.
    Partial,
}

impl Ended {
    /// All of them: with a result, and without.
    pub const ALL: [Self; 6] =
        [Self::Usable, Self::Flagged, Self::NotUsable, Self::Failed, Self::Stopped, Self::Partial];

    /// Its word, as the file has it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Usable => "usable",
            Self::Flagged => "flagged",
            Self::NotUsable => "not-usable",
            Self::Failed => "failed",
            Self::Stopped => "stopped",
            Self::Partial => "partial",
        }
    }

    /// How a run with this verdict ended.
    pub fn of(colour: Colour) -> Self {
        match colour {
            Colour::Green => Self::Usable,
            Colour::Amber => Self::Flagged,
            Colour::Red => Self::NotUsable,
        }
    }
}

/// Why a run ended with another code than 0.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct RunError {
    /// A word that stays the same from version to version.
    pub code: String,
    /// The kind of failure, which has the exit code.
    pub kind: String,
    /// The exit code.
    pub exit: u8,
    /// What is wrong, where, and what to do.
    pub message: String,
    /// Where it lies, as far as that is known.
    pub place: RunPlace,
    /// What to do: what the message says of it, else what helps with its kind. Absent from what
    /// older versions left.
    pub advice: Option<String>,
}

/// What to do about a failure of a kind: its own advice, else what usually helps.
pub fn advice_for(kind: Failure, own: Option<String>) -> String {
    let usual = match kind {
        Failure::Input => "put right what the message names, and give the same call again",
        Failure::Usage => "`supine help`, with the command, lists what can be given",
        Failure::Method => {
            "look at the labels and the region in the page (`supine open`); seeds, another region or mesh help most often"
        }
        Failure::Check => "look at each reason; nothing may be used until it is settled",
        Failure::Output => "make the folder or file writable, or name another",
        Failure::Retry => {
            "give the same call again, with more memory or disk or when the other is done"
        }
        Failure::Stopped => "the same call goes on where it was",
    };
    own.filter(|own| !own.trim().is_empty()).unwrap_or_else(|| usual.into())
}

impl RunError {
    /// One of a kind, which has the exit code; without advice of its own it gets that of its kind.
    pub fn new(kind: Failure, code: &str, message: String, advice: Option<String>) -> Self {
        let (exit, place) = (kind.exit_code(), RunPlace::default());
        let advice = Some(advice_for(kind, advice));
        Self { code: code.into(), kind: kind.name().into(), exit, message, place, advice }
    }
}

/// Where a failure lies.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, Default, PartialEq)]
pub struct RunPlace {
    /// The file or folder; absent when the patient was taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The key of the case.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// The stage of the flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
}

/// How far the tumour moves.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct TumourMoved {
    /// From the CT to the operating table, LPS, mm.
    pub displacement_mm: [f64; 3],
    /// Its length, mm.
    pub length_mm: f64,
    /// Interval of the length, mm; none where it is not known.
    pub interval_mm: Option<[f64; 2]>,
    /// The true place lies within this distance of the place given, mm; none where it is not known.
    pub within_mm: Option<f64>,
    /// Probability of both; none where they are not known.
    pub level: Option<f64>,
}

impl TumourMoved {
    /// The tumour of a summary, if it has one.
    pub fn of(summary: &Summary) -> Option<Self> {
        let (moved, interval) = (summary.tumour.as_ref()?, summary.tumour_interval.as_ref());
        Some(Self {
            displacement_mm: moved.displacement_mm,
            length_mm: moved.distance_mm,
            interval_mm: interval.map(|interval| interval.length_mm),
            within_mm: interval.map(|interval| interval.within_mm),
            level: interval.map(|interval| interval.level),
        })
    }
}

/// The JSON schema of a status.
pub fn status_schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(RunStatus);
    schema.insert("$id".into(), "urn:supine:schema:status:1".into());
    schema.into()
}

impl RunStatus {
    /// The word for this version of its structure.
    pub const SCHEMA: &'static str = "supine-status/1";

    /// That of a run which was begun and of whose end nothing is told.
    pub fn unfinished(case: &str) -> Self {
        let advice = "run it again: it goes on where it was";
        let message = format!("the run was begun and did not come to its end; {advice}");
        let error = RunError::new(Failure::Stopped, "run-unfinished", message, Some(advice.into()));
        Self {
            schema: Self::SCHEMA.into(),
            case: case.into(),
            case_file: None,
            out: None,
            exit: error.exit,
            status: Ended::Stopped,
            colour: None,
            reasons: vec![],
            warnings: 0,
            error: Some(error),
            seconds: 0.0,
            peak_memory_mb: None,
            voxels: None,
            threads: 0,
            tumour: None,
            version: env!("CARGO_PKG_VERSION").into(),
        }
    }

    /// As JSON on one line.
    pub fn line(&self) -> String {
        // Plain structs of numbers, strings and lists: there is no value that JSON cannot hold.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// As JSON for a file: indented, ends with a line feed.
    pub fn text(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// The status in a file's text, if it is one of this version.
    pub fn read(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok().filter(|status: &Self| status.schema == Self::SCHEMA)
    }

    /// Whether it says the same as another, aside from what it took: time, memory and threads.
    pub fn says_the_same(&self, other: &Self) -> bool {
        let bare = |status: &Self| Self {
            seconds: 0.0,
            peak_memory_mb: None,
            threads: 0,
            ..status.clone()
        };
        bare(self) == bare(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_comes_back_from_its_text_and_other_versions_do_not() {
        let status = crate::cohort::tests::failed("p2");
        assert_eq!(RunStatus::read(&status.text()).as_ref(), Some(&status));
        assert_eq!(RunStatus::read(&status.line()).as_ref(), Some(&status));
        assert!(!status.line().contains('\n') && status.text().ends_with("}\n"));
        let other = RunStatus { schema: "supine-status/9".into(), ..status.clone() };
        assert_eq!(RunStatus::read(&other.text()), None);
        let later = RunStatus { seconds: 9.0, threads: 2, ..status.clone() };
        assert!(status.says_the_same(&later));
        assert!(!status.says_the_same(&RunStatus { exit: 0, ..status.clone() }));
    }
}
