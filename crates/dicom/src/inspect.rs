//! What a folder of DICOM holds, and whether it can be used.

use crate::error::Error;
use crate::folder::{Folder, LeftOut, Series};
use crate::geometry::stack;
use crate::slice::Slice;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use supine_space::Progress;

/// What a folder holds. Carries no name, ID or date of a patient.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Inspection {
    /// Number of files looked at.
    pub files: usize,
    /// CT series, ascending by Series Instance UID.
    pub series: Vec<SeriesReport>,
    /// DICOM objects of other kinds, counted.
    pub other: Vec<KindCount>,
    /// Files that are not DICOM.
    pub foreign: Vec<LeftOut>,
    /// DICOM files that cannot be read, with the reason.
    pub damaged: Vec<String>,
    /// Doubts about the files.
    pub warnings: Vec<String>,
}

impl Inspection {
    /// The series that can be read.
    pub fn usable(&self) -> impl Iterator<Item = &SeriesReport> {
        self.series.iter().filter(|s| s.usable)
    }
}

/// How many objects of one kind there are.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct KindCount {
    /// Name of the SOP class.
    pub kind: String,
    /// Number of files.
    pub files: usize,
}

/// A CT series, from its headers alone.
#[derive(Clone, Debug, serde::Serialize)]
pub struct SeriesReport {
    /// Series Instance UID.
    pub uid: String,
    /// Series Description.
    pub description: String,
    /// Series Number as written.
    pub number: String,
    /// Number of slices without localizers.
    pub slices: usize,
    /// Number of localizers.
    pub localizers: usize,
    /// Whether the headers make one regular volume in HU.
    pub usable: bool,
    /// Why not, otherwise.
    pub reason: Option<String>,
    /// The grid, when there is one.
    pub grid: Option<GridReport>,
    /// Patient Position as written.
    pub patient_position: String,
    /// Transfer syntaxes of the slices.
    pub transfer_syntaxes: Vec<String>,
    /// Bits Stored and whether values are signed, for example `12 bits unsigned`.
    pub stored: String,
    /// Doubts about the series.
    pub warnings: Vec<String>,
}

/// A grid in numbers: LPS, mm.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct GridReport {
    /// Voxels along i, j, k.
    pub size: [usize; 3],
    /// Distance of voxel centres along i, j, k, mm.
    pub spacing: [f64; 3],
    /// Centre of the first voxel, mm.
    pub origin: [f64; 3],
    /// Unit vectors of the i, j and k axes.
    pub axes: [[f64; 3]; 3],
}

/// Looks at a folder, or at the series of a file, without decoding any pixel.
///
/// # Errors
/// Only when the folder cannot be read or the user stops: what is wrong with a file or series is
/// part of the answer.
pub fn inspect(path: &Path, progress: Progress<'_>) -> Result<Inspection, Error> {
    let folder = Folder::scan(path, progress)?;
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for object in &folder.other {
        *kinds.entry(&object.reason).or_default() += 1;
    }
    let other = kinds.iter().map(|(&kind, &files)| KindCount { kind: kind.to_owned(), files });
    Ok(Inspection {
        files: folder.files,
        other: other.collect(),
        series: folder.series.iter().map(report).collect(),
        foreign: folder.foreign,
        damaged: folder.damaged.iter().map(|d| d.error.to_string()).collect(),
        warnings: folder.warnings,
    })
}

fn report(series: &Series) -> SeriesReport {
    let slices: Vec<&Slice> = series.files.iter().filter_map(|f| f.slice.as_ref().ok()).collect();
    let faulty = series.files.iter().find_map(|f| f.slice.as_ref().err());
    let stacked = match faulty {
        Some(error) => Err(error.to_string()),
        None => stack(&series.head.uid, &slices).map_err(|e| e.to_string()),
    };
    let mut warnings: BTreeSet<String> = slices.iter().flat_map(|s| s.warnings.clone()).collect();
    let (grid, reason) = match stacked {
        Ok(stack) => {
            warnings.extend(stack.warnings);
            (Some(grid_report(&stack.grid)), None)
        }
        Err(reason) => (None, Some(reason)),
    };
    let syntaxes: BTreeSet<&str> = series.files.iter().map(|f| f.syntax).collect();
    let stored: BTreeSet<String> = slices
        .iter()
        .map(|s| {
            let sign = if s.pixels.signed { "signed" } else { "unsigned" };
            format!("{} bits {sign}", s.pixels.bits_stored)
        })
        .collect();
    SeriesReport {
        uid: series.head.uid.clone(),
        description: series.head.description.clone(),
        number: series.head.number.clone(),
        slices: series.files.len(),
        localizers: series.localizers.len(),
        usable: reason.is_none(),
        reason,
        grid,
        patient_position: slices.first().map_or(String::new(), |s| s.patient_position.clone()),
        transfer_syntaxes: syntaxes.into_iter().map(str::to_owned).collect(),
        stored: stored.into_iter().collect::<Vec<_>>().join(", "),
        warnings: warnings.into_iter().collect(),
    }
}

fn grid_report(grid: &supine_space::Grid) -> GridReport {
    let axis = |n: usize| grid.direction().column(n).into_owned().into();
    GridReport {
        size: grid.size(),
        spacing: grid.spacing().into(),
        origin: grid.origin().coords.into(),
        axes: [axis(0), axis(1), axis(2)],
    }
}
