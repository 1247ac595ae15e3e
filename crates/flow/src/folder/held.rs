//! Whose finished result a folder holds.

use super::record::Record;
use super::{kept_case, names, resolve, summary_of};
use crate::NodeId;
use crate::inputs::Inputs;
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use supine_exchange::is_volume_name;
use supine_space::Progress;

/// What the summary of a finished run tells of its CT.
#[derive(Clone, Debug)]
pub(crate) struct HeldResult {
    /// Where the CT was, if the run tells that.
    pub(crate) ct: Option<PathBuf>,
    /// When the run began.
    pub(crate) started: Option<String>,
    /// Its exported series, if that names the patient.
    exported: Option<PathBuf>,
    blake3: String,
    /// The series as it was before the patient was taken out.
    series: Option<String>,
    /// Of a result without a summary: the key of its CT.
    import: Option<String>,
}

impl HeldResult {
    /// The result in a folder; none when no run was finished there.
    pub(crate) fn of(root: &Path) -> Option<Self> {
        let summary = summary_of(root).filter(|s| s["tool"]["name"] == "supine")?;
        let text = |place: &str| summary.pointer(place).and_then(Json::as_str).map(str::to_owned);
        let nameless = summary.pointer("/case/export/anonymise") == Some(&Json::Bool(true));
        let kept = if nameless { kept_case(&root.join(names::SUMMARY)) } else { None };
        let case = kept.as_ref().unwrap_or(&summary);
        let at = |place: &str| case.pointer(place).and_then(Json::as_str).map(PathBuf::from);
        let ct = at("/case/ct").and_then(|ct| match at("/run/case_folder") {
            Some(folder) => Some(folder.join(ct)),
            None => ct.is_absolute().then_some(ct),
        });
        let inputs = summary["inputs"].as_array();
        let origin = inputs.and_then(|all| all.iter().find(|input| input["role"] == "ct"));
        Some(Self {
            ct,
            started: text("/run/started"),
            exported: (!nameless).then(|| root.join(names::path_of(NodeId::Export, "series"))),
            blake3: origin.and_then(|ct| ct["blake3"].as_str()).unwrap_or_default().to_owned(),
            series: case.pointer("/source/series_uid").and_then(Json::as_str).map(str::to_owned),
            import: None,
        })
    }

    /// The result in a folder whose summary is missing or cannot be read: that there is an exported
    /// series, and of which CT, its records tell.
    pub(crate) fn without_summary(root: &Path) -> Option<Self> {
        let of = |node: NodeId| Record::read(root, node.name());
        of(NodeId::Export).filter(|record| !record.files.is_empty())?;
        Some(Self {
            ct: None,
            started: None,
            exported: None,
            blake3: String::new(),
            series: None,
            import: Some(of(NodeId::Import).map(|record| record.key).unwrap_or_default()),
        })
    }

    /// The result that a later run has set aside until it is finished itself.
    pub(crate) fn set_aside(root: &Path) -> Option<Self> {
        Self::of(&root.join(names::PREVIOUS))
    }

    /// In words for people.
    pub(crate) fn told(&self) -> String {
        let of =
            self.ct.as_ref().map_or("another CT".into(), |ct| format!("the CT {}", ct.display()));
        let when = self.started.as_ref().map_or(String::new(), |at| format!(", made at {at}"));
        format!("the finished result of {of}{when}")
    }

    /// Whether it is of a CT: one with the same content, or the same series in the same place, of
    /// which slices were added, left out or changed. A volume of another format has no series: its
    /// place tells.
    ///
    /// `key` is that of the CT with what the case says of it: it tells where there is no summary.
    pub(crate) fn is_of(&self, ct: &Path, inputs: &Inputs, key: Option<&str>) -> bool {
        if let Some(made_of) = &self.import {
            return key == Some(made_of);
        }
        let hash = inputs.file("ct", ct).ok();
        if hash.is_some_and(|found| found.hash() == self.blake3) {
            return true;
        }
        let there = self.ct.as_deref().is_some_and(|held| place(held) == place(ct));
        if !there || is_volume_name(ct) {
            return there;
        }
        let patients = [self.exported.as_deref(), Some(ct)].map(|of| patient_in(of?));
        let others = matches!(patients, [Some(held), Some(own)] if held != own);
        !others && self.series.as_deref().is_some_and(|uid| holds(ct, uid))
    }
}

/// Whether a folder holds a finished result that names its patient, or has set one aside.
pub(super) fn names_its_patient(root: &Path) -> bool {
    let all = [root.into(), root.join(names::PREVIOUS)];
    let mut summaries = all.iter().filter_map(|folder| summary_of(folder));
    summaries.any(|summary| summary.pointer("/case/export/anonymise") != Some(&Json::Bool(true)))
}

/// Where a CT lies: a file of a series stands for its folder.
fn place(ct: &Path) -> PathBuf {
    let whole = resolve(ct);
    match whole.parent() {
        Some(folder) if whole.is_file() && !is_volume_name(&whole) => folder.into(),
        _ => whole,
    }
}

/// Whether a folder, or one that is not there any more, may hold a series.
fn holds(ct: &Path, uid: &str) -> bool {
    if !ct.exists() {
        return true;
    }
    series_in(ct).iter().any(|series| series == uid)
}

/// The Patient ID of the series in a folder, if they name but one patient.
fn patient_in(folder: &Path) -> Option<String> {
    let (depth, accept) = (supine_dicom::Depth::Headers, supine_dicom::Accept::default());
    let inspection = supine_dicom::inspect(folder, depth, accept, Progress::none()).ok()?;
    let mut all: Vec<String> = inspection.series.into_iter().map(|one| one.whose.id).collect();
    all.dedup();
    all.pop().filter(|id| all.is_empty() && !id.is_empty())
}

/// The series of a folder that can be read, if there is but one.
pub(crate) fn only_series(ct: &Path) -> Option<String> {
    let mut all = if is_volume_name(ct) { Vec::new() } else { series_in(ct) };
    all.pop().filter(|_| all.is_empty())
}

fn series_in(ct: &Path) -> Vec<String> {
    let (depth, accept) = (supine_dicom::Depth::Headers, supine_dicom::Accept::default());
    let inspection = supine_dicom::inspect(ct, depth, accept, Progress::none());
    inspection.map_or_else(
        |_| Vec::new(),
        |inspection| inspection.series.into_iter().map(|s| s.uid).collect(),
    )
}
