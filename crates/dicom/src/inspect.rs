//! What a folder of DICOM holds, and whether it can be used.

use crate::accept::Accept;
use crate::deformed::DEFORMED_ALREADY;
use crate::error::Error;
use crate::excluded::{LeftOut, LeftOutReason};
use crate::files::Place;
use crate::folder::{Folder, Series, kind};
use crate::geometry::stack;
use crate::padding::Padding;
use crate::plausible::Tally;
use crate::read::{Opened, SliceFile, shared};
use crate::slice::Slice;
use crate::warnings::{of_series, of_values};
use dicom_dictionary_std::uids;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_record::PatientIdentity;
use supine_space::{Posture, Progress, Warning};

/// What a folder holds. Carries no name, ID or date of a patient.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Inspection {
    /// Number of files looked at.
    pub files: usize,
    /// CT series, ascending by Series Instance UID.
    pub series: Vec<SeriesReport>,
    /// DICOM objects of other kinds, counted.
    pub other: Vec<KindCount>,
    /// Those of them that belong to a plan, in the order of their files. They are not told: files
    /// may be named after patients.
    #[serde(skip)]
    pub objects: Vec<PlanObject>,
    /// Files that are not DICOM.
    pub foreign: Vec<LeftOut>,
    /// DICOM files that cannot be read, with the reason.
    pub damaged: Vec<String>,
    /// What is odd about the files.
    #[serde(serialize_with = "crate::warnings::texts")]
    pub warnings: Vec<Warning>,
}

impl Inspection {
    /// The series that can be read.
    pub fn usable(&self) -> impl Iterator<Item = &SeriesReport> {
        self.series.iter().filter(|s| s.usable)
    }
}

/// An object that may go with a CT.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanObject {
    /// What it is.
    pub kind: PlanObjectKind,
    /// Where it is.
    pub path: PathBuf,
}

/// Kinds of objects that may go with a CT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanObjectKind {
    /// An RT structure set.
    Structures,
    /// An RT dose.
    Dose,
    /// A segmentation.
    Segmentation,
}

impl PlanObjectKind {
    /// Its name in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Structures => "structures",
            Self::Dose => "dose",
            Self::Segmentation => "segmentation",
        }
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
    /// The innermost folder that holds all its files. It is not told: folders may be named after
    /// patients.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Whose it is. For the screen, not for logs and documents.
    #[serde(skip)]
    pub whose: PatientIdentity,
    /// Series Description.
    pub description: String,
    /// Series Number as written.
    pub number: String,
    /// Number of slices without localizers.
    pub slices: usize,
    /// Number of localizers.
    pub localizers: usize,
    /// Whether the headers make one regular volume in HU that this program did not deform, and no
    /// damaged file may be of it.
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
    /// What is odd about the series.
    #[serde(serialize_with = "crate::warnings::texts")]
    pub warnings: Vec<Warning>,
    /// What the pixels are, if they were looked at.
    pub pixels: Option<PixelReport>,
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

/// What decoding every slice of a series showed.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct PixelReport {
    /// The slices in the order of their files and frames.
    pub slices: Vec<SlicePixels>,
    /// Slices that cannot be decoded, with the reason.
    pub failed: Vec<String>,
}

/// The values of a slice.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct SlicePixels {
    /// Its file, and its frame when the file holds several.
    pub file: String,
    /// Lowest and highest HU, padding included.
    pub hu_range: [i16; 2],
    /// SHA-256 of the HU as 16-bit little endian integers, row by row.
    pub sha256: String,
}

/// What [`inspect`] looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depth {
    /// The headers alone.
    #[default]
    Headers,
    /// The pixels too: every slice is decoded.
    Pixels,
}

/// Looks at a folder, or at the series of a file.
///
/// # Errors
/// Only when the folder cannot be read or the user stops: what is wrong with a file or series is
/// part of the answer.
pub fn inspect(
    path: &Path,
    depth: Depth,
    accept: Accept,
    progress: Progress<'_>,
) -> Result<Inspection, Error> {
    let headers = if depth == Depth::Pixels { 0.2 } else { 1.0 };
    let folder = Folder::scan(path, accept, progress.part(0.0, headers))?;
    let mut series: Vec<SeriesReport> =
        folder.series.iter().map(|series| report(series, accept)).collect();
    if depth == Depth::Pixels {
        let all: usize = folder.series.iter().map(|s| s.files.len()).sum();
        let mut before = 0;
        for (series, report) in folder.series.iter().zip(&mut series) {
            let share = |done: usize| headers + (1.0 - headers) * done as f64 / all as f64;
            let (start, end) = (share(before), share(before + series.files.len()));
            look_at_pixels(series, report, progress.part(start, end))?;
            before += series.files.len();
        }
    }
    for report in series.iter_mut().filter(|report| report.usable) {
        report.reason = folder.told_damage_to(&report.uid);
        report.usable = report.reason.is_none();
    }
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for object in &folder.other {
        *kinds.entry(object.reason.to_string()).or_default() += 1;
    }
    let objects = plan_objects(&folder, &Place::of(path)?.root);
    let other = kinds.into_iter().map(|(kind, files)| KindCount { kind, files });
    Ok(Inspection {
        files: folder.files,
        other: other.collect(),
        objects,
        series,
        foreign: folder.foreign,
        damaged: folder.damaged.iter().map(|d| d.error.to_string()).collect(),
        warnings: folder.warnings,
    })
}

/// The objects of a folder that may go with a CT.
fn plan_objects(folder: &Folder, root: &Path) -> Vec<PlanObject> {
    let known = [
        (uids::RT_STRUCTURE_SET_STORAGE, PlanObjectKind::Structures),
        (uids::RT_DOSE_STORAGE, PlanObjectKind::Dose),
        (uids::SEGMENTATION_STORAGE, PlanObjectKind::Segmentation),
    ]
    .map(|(class, of)| (LeftOutReason::OtherObject(kind(class)), of));
    let of = |left: &LeftOut| {
        let (_, kind) = known.iter().find(|(reason, _)| *reason == left.reason)?;
        Some(PlanObject { kind: *kind, path: root.join(&left.file) })
    };
    folder.other.iter().filter_map(of).collect()
}

/// What a case must say of a patient who did not lie on her back.
fn lying(slices: &[&Slice]) -> Option<Warning> {
    let position = &slices.first()?.patient_position;
    let lay = Posture::of_patient_position(position).filter(|lay| *lay != Posture::Supine)?;
    let text = format!(
        "Patient Position is {position}: the patient {}; a case of this CT says position = \"{}\"",
        lay.told(),
        lay.name()
    );
    Some(Warning::new("patient-not-supine", text))
}

fn report(series: &Series, accept: Accept) -> SeriesReport {
    let slices: Vec<&Slice> = series.files.iter().filter_map(|f| f.slice.as_ref().ok()).collect();
    let faulty = series.files.iter().find_map(|f| f.slice.as_ref().err());
    let stacked = match faulty {
        _ if slices.iter().any(|s| s.deformed) => Err(format!("it is {DEFORMED_ALREADY}")),
        Some(error) => Err(error.to_string()),
        None => stack(&series.head.uid, &slices, accept).map_err(|e| e.to_string()),
    };
    let mut warnings = of_series(&slices);
    warnings.extend(lying(&slices));
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
        folder: innermost(series),
        whose: series.head.whose.clone(),
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
        warnings,
        pixels: None,
    }
}

/// The innermost folder that holds all files of a series.
fn innermost(series: &Series) -> PathBuf {
    let mut folders = series.files.iter().filter_map(|file| file.path.parent());
    let mut all = folders.next().unwrap_or(Path::new("")).to_path_buf();
    for folder in folders {
        while !folder.starts_with(&all) && all.pop() {}
    }
    all
}

/// Decodes every slice of a series: one that cannot be, or values that are no HU, make it unusable.
fn look_at_pixels(
    series: &Series,
    report: &mut SeriesReport,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let files: Vec<SliceFile> = series
        .files
        .iter()
        .filter_map(|f| {
            let slice = f.slice.as_ref().ok()?.clone();
            Some(SliceFile { path: f.path.clone(), slice })
        })
        .collect();
    // A file that cannot be opened is told once per slice below.
    let shared = shared(&files).unwrap_or_default();
    let done = AtomicUsize::new(0);
    let decoded: Vec<Result<SliceSeen, Error>> = files
        .par_iter()
        .map(|SliceFile { path, slice }| {
            progress.at(done.fetch_add(1, Ordering::Relaxed) as f64 / files.len() as f64)?;
            match shared.get(path.as_path()) {
                Some(opened) => SliceSeen::of(opened, slice),
                None => SliceSeen::of(&Opened::new(path, slice)?, slice),
            }
        })
        .collect();
    let mut pixels = PixelReport { slices: Vec::new(), failed: Vec::new() };
    let (mut tally, mut padding, mut clipped) = (Tally::default(), Vec::new(), 0);
    let mut behind = None;
    for one in decoded {
        match one {
            Ok(seen) => {
                pixels.slices.push(seen.pixels);
                tally.join(seen.tally);
                padding.push(seen.padding);
                clipped += seen.clipped;
                behind = behind.or(seen.behind);
            }
            Err(stopped @ Error::Stopped(_)) => return Err(stopped),
            Err(error) => pixels.failed.push(error.to_string()),
        }
    }
    let fault = match pixels.failed.first() {
        Some(failed) => Some(failed.clone()),
        None => tally.plausible().err().map(|error| error.to_string()),
    };
    if let (true, Some(reason)) = (report.usable, fault) {
        (report.usable, report.reason) = (false, Some(reason));
    }
    report.warnings.extend(behind);
    report.warnings.extend(of_values(&Padding::join(padding), clipped));
    report.pixels = Some(pixels);
    Ok(())
}

/// What decoding a slice showed.
struct SliceSeen {
    pixels: SlicePixels,
    tally: Tally,
    padding: Padding,
    clipped: usize,
    behind: Option<Warning>,
}

impl SliceSeen {
    fn of(opened: &Opened, slice: &Slice) -> Result<Self, Error> {
        let mut hu = vec![0; slice.pixels.len()];
        let (padding, clipped) = opened.measured(slice, 0, &mut hu)?;
        // Told as the file has it.
        padding.runs().for_each(|(voxels, value)| hu[voxels].fill(value));
        let tally = Tally::of(&hu);
        let bytes: Vec<u8> = hu.iter().flat_map(|v| v.to_le_bytes()).collect();
        let sha256 = format!("{:x}", Sha256::digest(&bytes));
        let pixels = SlicePixels { file: slice.file.clone(), hu_range: tally.range(), sha256 };
        Ok(Self { pixels, tally, padding, clipped, behind: opened.told_behind() })
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
