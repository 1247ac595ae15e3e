//! Whether a finished run is as it was left: asked before anything of it leaves.

use super::Record;
use crate::NodeId;
use crate::inputs::{files_below, hash_of};
use std::path::Path;

/// What of a finished run is not as the run left it, in words; none when all is.
pub(crate) fn changed_since(run: &Path, summary: &serde_json::Value) -> Option<String> {
    let outputs = summary["outputs"].as_array().map(Vec::as_slice).unwrap_or_default();
    let outputs: Vec<(&str, &str)> = outputs
        .iter()
        .filter_map(|output| Some((output["path"].as_str()?, output["blake3"].as_str()?)))
        .collect();
    if let Some(told) = outputs.iter().find_map(|(path, hash)| is_changed(run, path, hash)) {
        return Some(told);
    }
    if let Some(told) = told_verdict(run).filter(|told| *told != summary["verdict"]) {
        let colour = told["colour"].as_str().unwrap_or("another");
        return Some(format!("the verdict of its summary.json was changed: it was {colour}"));
    }
    let known = |path: &Path| outputs.iter().any(|(output, _)| path.starts_with(run.join(output)));
    let foreign = files_below(run).unwrap_or_default();
    let foreign =
        foreign.into_iter().find(|path| !known(path) && supine_dicom::has_marker(path))?;
    let shown = foreign.strip_prefix(run).unwrap_or(&foreign).display().to_string();
    Some(format!("{shown} lies in its folder and was not written by the run: move it away"))
}

/// What one file of a finished run is, if not what the run left.
pub(super) fn changed_file(run: &Path, summary: &serde_json::Value, path: &str) -> Option<String> {
    let mut outputs = summary["outputs"].as_array()?.iter();
    let own = outputs.find(|output| output["path"] == path)?;
    is_changed(run, path, own["blake3"].as_str()?)
}

fn is_changed(run: &Path, path: &str, hash: &str) -> Option<String> {
    match hash_of(&run.join(path)) {
        Ok(found) if found.blake3 == hash => None,
        Ok(_) => Some(format!("{path} is not what the run wrote: it was changed since")),
        Err(error) => Some(format!("{path}, which the run wrote, cannot be read: {error}")),
    }
}

/// The verdict as the run recorded it beside its summary; none in a copy that lost its records.
fn told_verdict(run: &Path) -> Option<serde_json::Value> {
    Record::read(run, NodeId::Report.name())?.facts.get("verdict").cloned()
}
