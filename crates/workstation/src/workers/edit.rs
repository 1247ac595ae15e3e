//! Changes of the case: each is checked, on disk and told before the next.

use crate::Error;
use crate::store::case::Change;
use crate::workers::live::Live;
use serde::Deserialize;
use serde_json::Value;
use std::sync::Arc;
use supine_flow::spec::{Edit, Kind, TABLE};

/// Changes that the page asks for, and the state that it saw.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Edits {
    revision: u64,
    edits: Vec<OneEdit>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OneEdit {
    key: String,
    value: Value,
}

/// A tick of a warning.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tick {
    id: String,
    on: bool,
}

/// Makes changes of the case that the page sent. Files are no values that it may type: it names
/// them by the numbers that were given out, and can only take them away here.
///
/// # Errors
/// As [`change`]; [`Error::NotBelow`] when a value names a file.
pub(crate) fn edit(live: &Arc<Live>, asked: Edits) -> Result<(), Error> {
    let may_send = |edit: &OneEdit| {
        // A table of keys may hold any of them.
        let is_within = |key: &str| {
            key.strip_prefix(&*edit.key)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let mut files = TABLE.iter().filter(|p| matches!(p.kind, Kind::File | Kind::Files));
        edit.value.is_null() || !files.any(|file| is_within(file.key))
    };
    if !asked.edits.iter().all(may_send) {
        return Err(Error::NotBelow);
    }
    let edits = asked.edits.into_iter().map(|OneEdit { key, value }| Edit { key, value });
    change(live, asked.revision, Change::Edits(edits.collect(), None))
}

/// Ticks a warning as looked at, or takes the tick away.
///
/// # Errors
/// When nothing is open, there is no such warning, or the case cannot be written.
pub(crate) fn tick(live: &Arc<Live>, Tick { id, on }: Tick) -> Result<(), Error> {
    let (revision, mut seen) = live.workspace.look(|store| {
        if !store.work.warns_of(&id) {
            return Err(Error::Request("there is no such warning".into()));
        }
        Ok((store.case.revision(), store.case.session()?.case().names("report.seen")))
    })?;
    seen.retain(|known| *known != id);
    seen.extend(on.then_some(id));
    let value = if seen.is_empty() { Value::Null } else { seen.into() };
    let edits = vec![Edit { key: "report.seen".into(), value }];
    change(live, revision, Change::Edits(edits, None))
}

/// Changes the case; `seen`: the revision that the page saw.
///
/// # Errors
/// [`Error::Old`] when it was changed since; when a value does not fit, or the file cannot be
/// written.
pub(crate) fn change(live: &Arc<Live>, seen: u64, change: Change) -> Result<(), Error> {
    let session = live.workspace.look(|store| store.case.session())?;
    let (is_other, done) = live.workspace.change(|store| store.change_case(seen, change));
    if is_other {
        live.follow_case(&session);
    }
    done
}
