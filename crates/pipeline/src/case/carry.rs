//! What is carried along, as typed.

use crate::{Kind, Wanted};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The table `carry` of a case file.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct CarryFile {
    points: Vec<PathBuf>,
    dose: Vec<PathBuf>,
    structures: Vec<PathBuf>,
    segmentation: Vec<PathBuf>,
}

impl CarryFile {
    /// The lists of points; relative paths are relative to `base`.
    pub(super) fn points(&self, base: &Path) -> Vec<PathBuf> {
        self.points.iter().map(|path| base.join(path)).collect()
    }

    /// The DICOM objects, kind by kind.
    pub(super) fn objects(&self, base: &Path) -> Vec<Wanted> {
        let kinds = [
            (Kind::Dose, &self.dose),
            (Kind::Structures, &self.structures),
            (Kind::Segmentation, &self.segmentation),
        ];
        let named =
            kinds.into_iter().flat_map(|(kind, paths)| paths.iter().map(move |p| (kind, p)));
        named.map(|(kind, path)| Wanted { kind, path: base.join(path) }).collect()
    }
}
