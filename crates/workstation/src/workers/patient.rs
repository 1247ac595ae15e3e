//! Whose CT a case or a run of the list is of: a folder may hold those of several patients.

use crate::Error;
use crate::roots::is_run;
use crate::workspace::Workspace;
use std::collections::BTreeSet;
use supine_flow::commands::dicom::{Inspect, inspect};
use supine_flow::{Spec, Unwatched};

/// Name, ID and study of the patient of a case or a run by its number, or of what was kept of a
/// case, in one line, from the headers of its CT; nothing where it names none or cannot be read.
///
/// # Errors
/// When it was not given out.
pub(crate) fn patient(workspace: &Workspace, id: &str) -> Result<Option<String>, Error> {
    let spec = match workspace.look(|store| store.unsaved.case(id)) {
        Some(case) => case.spec().ok(),
        None => {
            let path = workspace.look(|store| store.roots.path(id))?;
            Spec::read(&if is_run(&path) { path.join("summary.json") } else { path }).ok()
        }
    };
    Ok(spec.and_then(|spec| patient_of(&spec)))
}

fn patient_of(spec: &Spec) -> Option<String> {
    let case = spec.case().ok()?;
    let path = case.ct().ok()?.to_path_buf();
    let given = Inspect { spec: Spec::new(""), path, pixels: false };
    let inspection = inspect(&given, &Unwatched).ok()?;
    let wanted = |uid: &String| case.series.as_ref().is_none_or(|series| series == uid);
    let series = inspection.series.iter().filter(|one| wanted(&one.uid));
    let lines: BTreeSet<String> = series.map(|one| one.whose.line()).collect();
    let lines: Vec<String> = lines.into_iter().filter(|line| !line.is_empty()).collect();
    // Which of several series it means is told once it is open.
    (!lines.is_empty()).then(|| lines.join(" or "))
}
