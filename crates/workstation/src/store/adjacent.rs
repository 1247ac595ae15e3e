//! Structure sets, doses and segmentations that lie beside the CT, or that the case names.

use crate::Error;
use crate::names::name_of;
use serde::Serialize;
use std::path::PathBuf;
use supine_flow::{CarriedKind, Session, tumour_regions};

/// An object that lies beside the CT.
#[derive(Clone, Debug)]
pub(crate) struct AdjacentObject {
    pub(crate) kind: CarriedKind,
    pub(crate) path: PathBuf,
    /// Regions of a structure set.
    regions: Vec<String>,
}

/// It as the page shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct AdjacentShown {
    id: String,
    /// `structures`, `dose` or `segmentation`.
    kind: &'static str,
    name: String,
    /// Whether the case carries it along.
    on: bool,
    /// Regions that can be the tumour.
    regions: Vec<String>,
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

/// All of them.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Adjacent {
    #[serde(skip)]
    objects: Vec<AdjacentObject>,
    #[serde(rename = "beside")]
    shown: Vec<AdjacentShown>,
}

impl Adjacent {
    pub(super) fn found(&mut self, objects: Vec<AdjacentObject>) {
        self.objects = objects;
    }

    /// An object by its number.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn get(&self, id: &str) -> Result<&AdjacentObject, Error> {
        let one = id.parse().ok().and_then(|n: usize| self.objects.get(n));
        one.ok_or(Error::NotBelow)
    }

    /// The case may name others now.
    pub(super) fn follow(&mut self, session: &Session) {
        let (case, spec) = (session.case(), session.spec());
        let carried: Vec<PathBuf> =
            case.carried.iter().map(|file| spec.folder().join(&file.path)).collect();
        for (file, path) in case.carried.iter().zip(&carried) {
            if !self.objects.iter().any(|one| one.path == *path) {
                self.objects.push(AdjacentObject::new(file.kind, path.clone()));
            }
        }
        let shown = self.objects.iter().enumerate().map(|(n, one)| AdjacentShown {
            id: n.to_string(),
            kind: one.kind.name(),
            name: name_of(&one.path),
            on: carried.contains(&one.path),
            regions: one.regions.clone(),
        });
        self.shown = shown.collect();
    }
}
