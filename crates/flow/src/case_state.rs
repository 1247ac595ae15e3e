//! What was given: all else is derived from it.

use crate::inputs::{InputFile, Inputs};
use crate::key::Key;
use crate::shared::{PlacedTumour, TumourCache};
use crate::spec::{Case, Spec, TumourSpec};
use crate::{Error, NodeId};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A case, the folder that its paths lead from, and results that were given in place of being made.
#[derive(Clone, Debug)]
pub(crate) struct CaseState {
    /// The values as they were given, with the folder that their paths lead from.
    pub(crate) spec: Arc<Spec>,
    /// What they make.
    pub(crate) case: Arc<Case>,
    /// Hashes of the case's files.
    pub(crate) inputs: Arc<Inputs>,
    /// Tumours that were found in structure sets.
    pub(crate) tumours: Arc<TumourCache>,
    /// What takes the patient out of exports, when the case asks for it.
    pub(crate) secret: Option<[u8; 32]>,
    /// Keys of the results that were given.
    pub(crate) given: BTreeMap<NodeId, Key>,
}

impl CaseState {
    /// A path of the case.
    pub(crate) fn path(&self, path: &Path) -> PathBuf {
        self.spec.folder().join(path)
    }

    /// A file that a key of the case names, with its hash.
    ///
    /// # Errors
    /// When it is not there.
    pub(crate) fn file(&self, key: &'static str, path: &Path) -> Result<InputFile, Error> {
        self.inputs.file(key, &self.path(path))
    }

    /// Where the tumour is.
    ///
    /// # Errors
    /// When it is not given, or its region cannot be had from its structure set.
    pub(crate) fn tumour(&self) -> Result<PlacedTumour, Error> {
        match self.case.tumour()? {
            TumourSpec::Sphere(sphere) => {
                Ok(PlacedTumour { sphere: *sphere, drawn: None, warnings: vec![] })
            }
            TumourSpec::Structure { name, file } => {
                self.tumours.place(name, self.file("tumour.file", file)?)
            }
        }
    }

    /// Several of them.
    ///
    /// # Errors
    /// As [`CaseState::file`].
    pub(crate) fn files(
        &self,
        key: &'static str,
        paths: &[PathBuf],
    ) -> Result<Vec<InputFile>, Error> {
        paths.iter().map(|path| self.file(key, path)).collect()
    }
}
