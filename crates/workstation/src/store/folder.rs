//! The folders that were looked through, and what was found there.

use crate::Error;
use crate::names::name_of;
use crate::roots::Named;
use serde::Serialize;
use std::path::PathBuf;
use supine_flow::CarriedKind;
use supine_flow::commands::dicom::{Inspection, PlanObject, PlanObjectKind};

/// What a folder of DICOM holds.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct InspectionShown {
    dir: String,
    name: String,
    series: Vec<SeriesShown>,
    /// Structure sets, doses and segmentations.
    objects: Vec<ObjectShown>,
}

/// An object that is no CT.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ObjectShown {
    kind: &'static str,
    name: String,
}

/// A series of it.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SeriesShown {
    id: String,
    /// The patient's name.
    patient: String,
    /// Her ID, date of birth and study, in one line.
    known: String,
    description: String,
    modality: &'static str,
    size: Option<[usize; 3]>,
    spacing_mm: Option<[f64; 3]>,
    files: usize,
    usable: bool,
    problems: Vec<String>,
    /// Whether there is one.
    picture: bool,
}

/// Where a series lies, and its Series Instance UID.
pub(crate) type Series = (PathBuf, String);

/// What was found.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Folder {
    /// Of all folders that were looked through: their numbers hold until the end.
    #[serde(skip)]
    series: Vec<Series>,
    /// Objects of other kinds in the last of them.
    #[serde(skip)]
    objects: Vec<(CarriedKind, PathBuf)>,
    inspection: Option<InspectionShown>,
}

impl Folder {
    /// A folder was looked through.
    pub(super) fn inspected(&mut self, dir: Named, found: &Inspection) {
        let first = self.series.len();
        self.series.extend(found.series.iter().map(|one| (one.folder.clone(), one.uid.clone())));
        self.objects = found.objects.iter().map(as_carried).collect();
        let series = found.series.iter().enumerate().map(|(n, series)| SeriesShown {
            id: (first + n).to_string(),
            patient: series.whose.name.clone(),
            known: series.whose.beside_name(),
            description: series.description.clone(),
            modality: "CT",
            size: series.grid.as_ref().map(|grid| grid.size),
            spacing_mm: series.grid.as_ref().map(|grid| grid.spacing),
            files: series.slices,
            usable: series.usable,
            problems: series
                .reason
                .iter()
                .cloned()
                .chain(series.warnings.iter().map(ToString::to_string))
                .collect(),
            picture: series.usable,
        });
        let objects = found
            .objects
            .iter()
            .map(|object| ObjectShown { kind: object.kind.name(), name: name_of(&object.path) });
        let (series, objects) = (series.collect(), objects.collect());
        self.inspection = Some(InspectionShown { dir: dir.id, name: dir.name, series, objects });
    }

    /// A series that was found.
    ///
    /// # Errors
    /// When it was not.
    pub(crate) fn series(&self, id: &str) -> Result<&Series, Error> {
        let series = id.parse().ok().and_then(|n: usize| self.series.get(n));
        series.ok_or(Error::NotBelow)
    }

    /// Structure sets, doses and segmentations that were found.
    pub(crate) fn objects(&self) -> &[(CarriedKind, PathBuf)] {
        &self.objects
    }
}

/// An object of a folder, as a case may name it.
fn as_carried(found: &PlanObject) -> (CarriedKind, PathBuf) {
    let kind = match found.kind {
        PlanObjectKind::Structures => CarriedKind::Structures,
        PlanObjectKind::Dose => CarriedKind::Dose,
        PlanObjectKind::Segmentation => CarriedKind::Segmentation,
    };
    (kind, found.path.clone())
}
