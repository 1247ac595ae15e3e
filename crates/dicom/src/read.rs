//! A CT series as a volume of Hounsfield units.

use crate::accept::Accept;
use crate::data_set::{Container, DataSet, OpenError, Parsed, TransferSyntax, Until};
use crate::error::Error;
use crate::excluded::{LeftOut, LeftOutReason as Reason};
use crate::folder::{CtFile, Folder, Series};
use crate::form;
use crate::geometry::{Stack, stack};
use crate::multi_frame;
use crate::object::told_behind;
use crate::padding::Padding;
use crate::pixel_format::Frame;
use crate::pixels;
use crate::plausible::Tally;
use crate::slice::Slice;
use crate::source::{Source, SourceSlice};
use crate::warnings::{of_series, of_values};
use dicom_dictionary_std::tags;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Progress, Warning};
use supine_volume::Ct;

/// What to read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadParams {
    /// Series Instance UID; required when the folder holds several series that make a volume. A
    /// file given instead of a folder names its own series.
    pub series: Option<String>,
    /// Files to leave out, by their paths below the folder.
    pub exclude: Vec<String>,
    /// What is accepted beyond what is safe.
    pub accept: Accept,
}

/// What was read, and what a user must know of it.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ReadInfo {
    /// What a user must know before trusting it.
    #[serde(serialize_with = "crate::warnings::texts")]
    pub warnings: Vec<Warning>,
    /// Series Instance UID.
    pub series_uid: String,
    /// Series Description.
    pub description: String,
    /// Number of slices.
    pub slices: usize,
    /// Files in the folder that are not part of the volume.
    pub left_out: Vec<LeftOut>,
    /// Patient Position as written (HFS, FFS, ...).
    pub patient_position: String,
    /// Number of CT series in the folder.
    pub series_count: usize,
    /// Transfer syntaxes of the slices.
    pub transfer_syntaxes: Vec<String>,
    /// Voxels without measurement (padding, outside the reconstruction circle), taken for air.
    pub padded_voxels: usize,
    /// Voxels whose HU do not fit 16 bits and were clipped.
    pub clipped_voxels: usize,
    /// Lowest and highest HU of the voxels with measurement.
    pub hu_range: [i16; 2],
}

/// A slice and its file.
pub(crate) struct SliceFile {
    pub(crate) path: PathBuf,
    pub(crate) slice: Slice,
}

/// What a slice holds beside its HU.
struct Decoded {
    source: SourceSlice,
    padding: Padding,
    clipped: usize,
}

/// Reads a CT series from a folder, or from the folder of a file.
///
/// HU = round half to even(slope * stored + intercept), per slice. The grid comes from the written
/// Image Position, Image Orientation and Pixel Spacing: i along a row, j along a column, k along
/// their cross product. Voxels without measurement are air (-1000 HU).
///
/// # Errors
/// When there is no CT series, several could be meant, a file is damaged, or the slices do not make
/// one regular untilted volume in HU. The message names the file.
pub fn read_series(
    path: &Path,
    params: &ReadParams,
    progress: Progress<'_>,
) -> Result<(Ct, Source, ReadInfo), Error> {
    let mut folder = Folder::scan(path, params.accept, progress.part(0.0, 0.2))?;
    folder.exclude(&params.exclude)?;
    read_folder(folder, params, progress.part(0.2, 1.0))
}

/// Reads one series of a folder whose heads are known.
pub(crate) fn read_folder(
    mut folder: Folder,
    params: &ReadParams,
    progress: Progress<'_>,
) -> Result<(Ct, Source, ReadInfo), Error> {
    let series_count = folder.series.iter().filter(|s| !s.files.is_empty()).count();
    let series = folder.choose(params.series.as_deref())?;
    // A damaged file may be a slice of this series.
    if let Some(error) = folder.damage_to(&series.head.uid) {
        return Err(error);
    }
    let transfer_syntaxes = transfer_syntaxes(&series);
    let left_out = left_out(&folder, &series);
    let (stack, files) = assemble(&series.head.uid, series.files, params.accept)?;
    believable(stack.grid.len(), &files)?;
    let [columns, rows, _] = stack.grid.size();
    let mut hu = vec![0; columns * rows * files.len()];
    let slices = decode(&files, &mut hu, progress)?;

    let mut warnings = std::mem::take(&mut folder.warnings);
    warnings.extend(stack.warnings);
    let mut info = ReadInfo {
        warnings,
        series_uid: series.head.uid.clone(),
        description: series.head.description.clone(),
        slices: slices.len(),
        left_out,
        patient_position: slices[0].source.slice.patient_position.clone(),
        series_count,
        transfer_syntaxes,
        padded_voxels: 0,
        clipped_voxels: slices.iter().map(|s| s.clipped).sum(),
        hu_range: [0, 0],
    };
    let (mut source, mut padding) = (Vec::new(), Vec::new());
    for slice in slices {
        source.push(slice.source);
        padding.push(slice.padding);
    }
    let mut padding = Padding::join(padding);
    info.padded_voxels = padding.len();
    info.hu_range = Tally::of(&hu).plausible()?;
    warn(&mut info, &source, &padding);
    if let Some(steps) = stack.equalised {
        hu = steps.volume(&hu, columns * rows);
        source = steps.headers(&source, &stack.grid);
        // Between the slices there is no telling what was padding.
        padding = Padding::default();
    }
    let ct = Ct::new(stack.grid, hu).map_err(|e| Error::NotHounsfield { reason: e.to_string() })?;
    Ok((ct, Source { slices: source, padding }, info))
}

/// Most voxels that a byte of the files may stand for. Slices of nothing but air come to some 250;
/// what claims more is made to exhaust the memory, which is asked for before the first slice is
/// decoded.
const MAX_VOXELS_PER_BYTE: u64 = 1 << 10;

/// Checks the size of the volume against that of its files.
fn believable(voxels: usize, files: &[SliceFile]) -> Result<(), Error> {
    let paths: BTreeSet<&PathBuf> = files.iter().map(|file| &file.path).collect();
    let mut bytes = 0u64;
    for path in paths {
        let meta =
            std::fs::metadata(path).map_err(|source| Error::Read { path: path.clone(), source })?;
        bytes = bytes.saturating_add(meta.len());
    }
    if voxels as u64 <= bytes.saturating_mul(MAX_VOXELS_PER_BYTE) {
        return Ok(());
    }
    let file = files.first().map(|file| file.slice.file.clone()).unwrap_or_default();
    let reason = format!("the series claims {voxels} voxels in {bytes} bytes");
    Err(Error::Pixels { file, reason })
}

/// The slices of a series in order along the normal, with the grid they make.
fn assemble(
    uid: &str,
    files: Vec<CtFile>,
    accept: Accept,
) -> Result<(Stack, Vec<SliceFile>), Error> {
    let mut slices = Vec::new();
    for file in files {
        slices.push(Some(SliceFile { path: file.path, slice: file.slice? }));
    }
    let heads: Vec<&Slice> = slices.iter().flatten().map(|file| &file.slice).collect();
    let stack = stack(uid, &heads, accept).map_err(|error| same_pixels(error, &slices))?;
    let ordered = stack.order.iter().filter_map(|&n| slices[n].take()).collect();
    Ok((stack, ordered))
}

/// Says of two slices at one place whether they are the same picture under two names.
fn same_pixels(error: Error, slices: &[Option<SliceFile>]) -> Error {
    let Error::DuplicatePosition { a, b, hint } = error else { return error };
    let hu = |file: &str| {
        let SliceFile { path, slice } = slices.iter().flatten().find(|s| s.slice.file == file)?;
        Opened::new(path, slice).ok()?.hu(slice).ok()
    };
    let hint = match (hint.is_empty(), hu(&a), hu(&b)) {
        (true, Some(x), Some(y)) if x == y => ": their pixels are equal; remove one copy".into(),
        _ => hint,
    };
    let hint = hint + &crate::geometry::leave_out(&b);
    Error::DuplicatePosition { a, b, hint }
}

/// Decodes all slices into `hu`; the first error in the order of the slices wins.
fn decode(
    files: &[SliceFile],
    hu: &mut [i16],
    progress: Progress<'_>,
) -> Result<Vec<Decoded>, Error> {
    let done = AtomicUsize::new(0);
    let per_slice = hu.len() / files.len();
    let shared = shared(files)?;
    let decoded: Vec<Result<Decoded, Error>> = files
        .par_iter()
        .zip(hu.par_chunks_mut(per_slice))
        .enumerate()
        .map(|(k, (SliceFile { path, slice }, hu))| {
            let n = done.fetch_add(1, Ordering::Relaxed);
            progress.at(n as f64 / files.len() as f64)?;
            match shared.get(path.as_path()) {
                Some(opened) => opened.decode(slice, k * per_slice, hu),
                None => Opened::new(path, slice)?.decode(slice, k * per_slice, hu),
            }
        })
        .collect();
    decoded.into_iter().collect()
}

/// The files that hold several of the slices, so that each is opened once.
pub(crate) fn shared(files: &[SliceFile]) -> Result<BTreeMap<&Path, Opened>, Error> {
    let mut shared = BTreeMap::new();
    for SliceFile { path, slice } in files.iter().filter(|f| f.slice.frame != Frame::ONLY) {
        if !shared.contains_key(path.as_path()) {
            shared.insert(path.as_path(), Opened::new(path, slice)?);
        }
    }
    Ok(shared)
}

/// A file that was read as a whole.
pub(crate) struct Opened {
    syntax: TransferSyntax,
    data: DataSet,
    /// The header of each frame when the file holds several.
    frames: Vec<DataSet>,
    /// Bytes behind the last element.
    behind: usize,
}

impl Opened {
    /// Opens the file of a slice.
    pub(crate) fn new(path: &Path, slice: &Slice) -> Result<Self, Error> {
        let file = &slice.file;
        let opened = |error| match error {
            OpenError::Io(source) => Error::Read { path: path.to_owned(), source },
            OpenError::NotDicom(reason) => {
                Error::Malformed { file: file.clone(), reason: reason.to_owned() }
            }
            OpenError::Malformed { reason, .. } => Error::Malformed { file: file.clone(), reason },
        };
        let mut container = Container::open(path).map_err(opened)?;
        let Parsed { set: mut data, behind, .. } = container.data(Until::End).map_err(opened)?;
        container.identify(&mut data);
        let several = slice.frame != Frame::ONLY;
        let frames = if several { multi_frame::headers(file, &data)? } else { Vec::new() };
        Ok(Self { syntax: container.syntax, data, frames, behind })
    }

    /// Decodes a slice whose first voxel is `start` into its HU.
    fn decode(&self, slice: &Slice, start: usize, hu: &mut [i16]) -> Result<Decoded, Error> {
        let (padding, clipped) = self.measured(slice, start, hu)?;
        let mut header = match self.frames.get(slice.frame.index) {
            Some(header) => header.clone(),
            None => self.data.without(tags::PIXEL_DATA),
        };
        form::mend(&mut header);
        let mut slice = slice.clone();
        slice.warnings.extend(self.told_behind());
        let source = SourceSlice { header, slice };
        Ok(Decoded { source, padding, clipped })
    }

    /// The HU of a slice whose first voxel is `start`, what has no measurement being air; what
    /// that is, and how many voxels were clipped.
    pub(crate) fn measured(
        &self,
        slice: &Slice,
        start: usize,
        hu: &mut [i16],
    ) -> Result<(Padding, usize), Error> {
        let samples = self.samples(slice)?;
        rescale(slice, &samples, hu);
        let (clipped, padding) = padding_and_clipped(slice, &samples, start, hu);
        Ok((padding, clipped))
    }

    /// That the file is longer than what it holds.
    pub(crate) fn told_behind(&self) -> Option<Warning> {
        told_behind(self.behind)
    }

    /// The HU of a slice as its numbers say, padding included.
    pub(crate) fn hu(&self, slice: &Slice) -> Result<Vec<i16>, Error> {
        let mut hu = vec![0; slice.pixels.len()];
        rescale(slice, &self.samples(slice)?, &mut hu);
        Ok(hu)
    }

    fn samples(&self, slice: &Slice) -> Result<Vec<u16>, Error> {
        pixels::samples(&slice.file, &self.data, &self.syntax, slice.pixels, slice.frame)
    }
}

fn rescale(slice: &Slice, samples: &[u16], hu: &mut [i16]) {
    let table = slice.rescale.table(slice.pixels);
    hu.iter_mut().zip(samples).for_each(|(hu, &s)| *hu = table[slice.pixels.pattern(s)]);
}

/// Tells the clipped voxels, counted, and those without measurement, which become air.
fn padding_and_clipped(
    slice: &Slice,
    samples: &[u16],
    start: usize,
    hu: &mut [i16],
) -> (usize, Padding) {
    let stored = |n: usize| slice.pixels.stored(samples[n]);
    // Only values at the ends of the 16 bits can have been clipped.
    let clips = |&n: &usize| {
        matches!(hu[n], i16::MIN | i16::MAX)
            && slice.rescale.hu(stored(n)).round_ties_even() != f64::from(hu[n])
    };
    let clipped = (0..hu.len()).filter(clips).count();
    let marked = |n: usize| slice.padding.is_some_and(|[a, b]| (a..=b).contains(&stored(n)));
    (clipped, Padding::take(start, hu, marked))
}

fn transfer_syntaxes(series: &Series) -> Vec<String> {
    let names: BTreeSet<&str> = series.files.iter().map(|f| f.syntax).collect();
    names.into_iter().map(str::to_owned).collect()
}

/// Every file that is not part of the volume, ascending by name.
fn left_out(folder: &Folder, series: &Series) -> Vec<LeftOut> {
    let mut left: Vec<LeftOut> = folder.other.iter().chain(&folder.foreign).cloned().collect();
    let named =
        |file: &String, reason: &Reason| LeftOut { file: file.clone(), reason: reason.clone() };
    left.extend(series.localizers.iter().map(|file| named(file, &Reason::Localizer)));
    for other in &folder.series {
        let localizers = other.localizers.iter();
        left.extend(localizers.map(|file| named(file, &Reason::LocalizerOfAnotherSeries)));
        left.extend(other.files.iter().map(|f| named(&f.name, &Reason::ImageOfAnotherSeries)));
    }
    left.sort_by(|a, b| a.file.cmp(&b.file));
    // A file of several frames is one file.
    left.dedup();
    left
}

/// Adds the warnings that need the whole series.
fn warn(info: &mut ReadInfo, source: &[SourceSlice], padding: &Padding) {
    let slices: Vec<&Slice> = source.iter().map(|s| &s.slice).collect();
    info.warnings.extend(of_series(&slices));
    info.warnings.extend(of_values(padding, info.clipped_voxels));
    let of_another = [Reason::ImageOfAnotherSeries, Reason::LocalizerOfAnotherSeries];
    let series = info.left_out.iter().filter(|l| of_another.contains(&l.reason)).count();
    if series > 0 {
        let text = format!("{series} CT file(s) of other series were left out");
        info.warnings.push(Warning::new("other-series-left-out", text));
    }
}
