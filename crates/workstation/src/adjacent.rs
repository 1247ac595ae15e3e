//! Structure sets, doses and segmentations that lie beside the CT: which of them the case carries
//! along, and whether one of their regions is the tumour.

use crate::Error;
use crate::edit::{Edits, OneEdit};
use crate::job::JobObserver;
use crate::names::name_of;
use crate::state::{BesideShown, Problem};
use crate::workspace::{OpenCase, Workspace};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use supine_flow::{CarriedKind, Lane, NodeId, Request, Session, tumour_centre, tumour_regions};

/// An object that lies beside the CT.
#[derive(Clone, Debug)]
pub(crate) struct AdjacentObject {
    kind: CarriedKind,
    path: PathBuf,
    /// Regions of a structure set.
    regions: Vec<String>,
}

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

impl AdjacentObject {
    pub(crate) fn new(kind: CarriedKind, path: PathBuf) -> Self {
        // A file that cannot be read has no regions; that it cannot, is told when it is to be
        // carried.
        let regions = match kind {
            CarriedKind::Structures => tumour_regions(&path).unwrap_or_default(),
            _ => vec![],
        };
        Self { kind, path, regions }
    }
}

impl Workspace {
    /// Lets the case carry an object along, or not.
    ///
    /// # Errors
    /// When it was not given out, or the case cannot be changed.
    pub(crate) fn carry(self: &Arc<Self>, asked: &Carry) -> Result<(), Error> {
        let edit = {
            let held = self.held();
            let beside = held.beside_of(&asked.id)?;
            let session = held.session.as_ref().ok_or(Error::Nothing)?;
            let (case, spec) = (session.case(), session.spec());
            let same = case.carried.iter().filter(|file| file.kind == beside.kind);
            let others = same.map(|file| &file.path);
            let others = others.filter(|path| spec.folder().join(path) != beside.path);
            let mut paths: Vec<&PathBuf> = others.collect();
            paths.extend(asked.on.then_some(&beside.path));
            let value = if paths.is_empty() { Value::Null } else { json!(paths) };
            OneEdit { key: beside.kind.key().into(), value }
        };
        self.edit(Edits { revision: asked.revision, edits: vec![edit], placed: None })
    }

    /// Makes a region of a structure set the tumour.
    ///
    /// # Errors
    /// As [`Self::carry`].
    pub(crate) fn tumour_of(self: &Arc<Self>, asked: &Region) -> Result<(), Error> {
        let path = self.held().beside_of(&asked.id)?.path.clone();
        let edits = [
            ("tumour.centre", Value::Null),
            ("tumour.radius", Value::Null),
            ("tumour.structure", asked.region.as_str().into()),
            ("tumour.file", json!(path)),
        ];
        let edits = edits.map(|(key, value)| OneEdit { key: key.into(), value }).into();
        let placed = Some(tumour_centre(&path, &asked.region)?);
        self.edit(Edits { revision: asked.revision, edits, placed })
    }

    /// Reads the objects that the case carries along, and moves them where that takes no longer
    /// work; what is wrong with them is told and ends nothing.
    pub(crate) fn read_objects(&self, session: &Session, watching: &JobObserver, lane: Lane) {
        if session.case().carried.is_empty() {
            return;
        }
        let mut nodes = vec![NodeId::Objects];
        nodes.extend(session.is_fresh(NodeId::Solve).then_some(NodeId::MovedObjects));
        if nodes.iter().all(|node| session.is_fresh(*node)) {
            return;
        }
        let request = Request { observer: watching, lane, ..Request::default() };
        let done = session.update(&nodes, &request);
        self.change(|held| {
            held.show_results(session);
            match done {
                Ok(()) | Err(supine_flow::Error::Stopped) => {}
                Err(error) => held.state.problem = Some(Problem::of(&error.into())),
            }
        });
    }
}

impl OpenCase {
    fn beside_of(&self, id: &str) -> Result<&AdjacentObject, Error> {
        let one = id.parse().ok().and_then(|n: usize| self.beside.get(n));
        one.ok_or(Error::NotBelow)
    }

    /// Shows what lies beside the CT: what was found there, and what the case names.
    pub(crate) fn show_beside(&mut self) {
        let Some(session) = &self.session else { return };
        let (case, spec) = (session.case(), session.spec());
        let carried: Vec<PathBuf> =
            case.carried.iter().map(|file| spec.folder().join(&file.path)).collect();
        for (file, path) in case.carried.iter().zip(&carried) {
            if !self.beside.iter().any(|one| one.path == *path) {
                self.beside.push(AdjacentObject::new(file.kind, path.clone()));
            }
        }
        let shown = self.beside.iter().enumerate().map(|(n, one)| BesideShown {
            id: n.to_string(),
            kind: one.kind.name(),
            name: name_of(&one.path),
            on: carried.contains(&one.path),
            regions: one.regions.clone(),
        });
        self.state.beside = shown.collect();
    }
}
