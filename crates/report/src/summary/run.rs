//! Where a result came from and how it was made: the series, the time, the stages.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The DICOM series that a CT was read from.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct SourceSeries {
    /// Study Instance UID.
    pub study_uid: String,
    /// Series Instance UID.
    pub series_uid: String,
    /// Frame of Reference UID; empty when it has none.
    pub frame_of_reference_uid: String,
    /// SOP Instance UIDs, ascending along the slices' normal.
    pub instance_uids: Vec<String>,
}

/// What differs from run to run of the same case.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// The folder that the case's paths lead from; `None` when the patient was taken out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case_folder: Option<std::path::PathBuf>,
    /// When it began, `YYYY-MM-DD HH:MM:SS` of the place where it ran; `None` when it was not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started: Option<String>,
    /// The command that began it, word by word; `None` when the patient was taken out, since paths
    /// may name her.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<Vec<String>>,
    /// The stages in the order they ran.
    pub stages: Vec<StageTime>,
    /// Wall time of the whole run, seconds.
    pub total_seconds: f64,
    /// Largest resident memory of the whole run, MB; `None` where the system does not tell.
    pub peak_memory_mb: Option<f64>,
    /// Threads used.
    pub threads: usize,
}

/// How long a stage took.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct StageTime {
    /// Name of the stage.
    pub name: String,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Whether its result came from the cache.
    pub cached: bool,
    /// Largest resident memory of the process up to its end, MB; `None` where the system does not
    /// tell.
    pub peak_memory_mb: Option<f64>,
}

/// A result of a stage, and what it was made from.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Link {
    /// Name of the stage.
    pub stage: String,
    /// Hash (BLAKE3, hexadecimal) of its name, of the version of its method, of its own parameters
    /// and input files, and of the keys of the results that it was made from.
    pub key: String,
    /// Hash of what it made, where the results that were made from it are known by that; else
    /// absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<String>,
    /// Those keys, or values.
    pub parents: Vec<String>,
}
