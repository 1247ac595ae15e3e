//! Which of the objects beside the CT the case carries along, and which of their regions is the
//! tumour.

use crate::Error;
use crate::store::case::Change;
use crate::workers::edit::change;
use crate::workers::live::Live;
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use supine_flow::spec::Edit;
use supine_flow::tumour_centre;

/// Whether the case carries an object along.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Carry {
    revision: u64,
    id: String,
    on: bool,
}

/// A region that is the tumour.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Region {
    revision: u64,
    id: String,
    region: String,
}

/// Lets the case carry an object along, or not.
///
/// # Errors
/// When it was not given out, or the case cannot be changed.
pub(crate) fn carry(live: &Arc<Live>, asked: &Carry) -> Result<(), Error> {
    let edit = live.workspace.look(|store| {
        let adjacent = store.adjacent.get(&asked.id)?;
        let session = store.case.session()?;
        let (case, spec) = (session.case(), session.spec());
        let same = case.carried.iter().filter(|file| file.kind == adjacent.kind);
        let others = same.map(|file| &file.path);
        let others = others.filter(|path| spec.folder().join(path) != adjacent.path);
        let mut paths: Vec<&PathBuf> = others.collect();
        paths.extend(asked.on.then_some(&adjacent.path));
        let value = if paths.is_empty() { Value::Null } else { json!(paths) };
        Ok::<_, Error>(Edit { key: adjacent.kind.key().into(), value })
    })?;
    change(live, asked.revision, Change::Edits(vec![edit], None))
}

/// Makes a region of a structure set the tumour.
///
/// # Errors
/// As [`carry`].
pub(crate) fn tumour_of(live: &Arc<Live>, asked: &Region) -> Result<(), Error> {
    let path =
        live.workspace.look(|store| Ok::<_, Error>(store.adjacent.get(&asked.id)?.path.clone()))?;
    let edits = [
        ("tumour.centre", Value::Null),
        ("tumour.radius", Value::Null),
        ("tumour.structure", asked.region.as_str().into()),
        ("tumour.file", json!(path)),
    ];
    let edits = edits.map(|(key, value)| Edit { key: key.into(), value }).into();
    let placed = Some(tumour_centre(&path, &asked.region)?);
    change(live, asked.revision, Change::Edits(edits, placed))
}
