//! A volume on the grid of its source as a derived CT series.

mod attributes;
mod encoding;
mod folder;
mod params;
mod read_back;

pub use params::ExportParams;

use crate::error::Error;
use crate::geometry::{grid_of, same_grid};
use crate::source::Source;
use attributes::Attributes;
pub(crate) use attributes::{COPIED_PER_SLICE, EQUIPMENT, SCAN};
use encoding::Encoding;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Progress, Warning};
use supine_volume::Ct;

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct WriteInfo {
    /// What a user must know before trusting it.
    #[serde(serialize_with = "crate::warnings::texts")]
    pub warnings: Vec<Warning>,
    /// The new Series Instance UID.
    pub series_uid: String,
    /// The new Frame of Reference UID.
    pub frame_of_reference_uid: String,
    /// The new Series Number.
    pub series_number: i64,
    /// Files written.
    pub files: Vec<String>,
    /// Whether bits, sign and rescale are those of the source.
    pub source_encoding: bool,
}

/// Writes a volume as a CT series into the new folder `dir`.
///
/// The volume must lie on the grid of the source; geometry strings, patient and study are copied,
/// identity, frame of reference and equipment are new, and all says that it is derived
/// (PS3.3 A.3, C.12.4). All UIDs are 2.25 from the hash of everything that is written, so that the
/// same export has the same bytes. Files are `CT0001.dcm` and so on in the order of their Instance
/// Number, Explicit VR Little Endian; they appear under `dir` only when another reader has read
/// them back equal, voxel by voxel. A folder of an earlier export is replaced.
///
/// # Errors
/// When the volume does not fit the source, a text does not fit its attribute, the folder cannot be
/// written or holds other files, or a file does not read back. Nothing is left behind then.
pub fn write_series(
    ct: &Ct,
    source: &Source,
    params: &ExportParams,
    dir: &Path,
    progress: Progress<'_>,
) -> Result<WriteInfo, Error> {
    let grid = grid_of(source)?;
    same_grid(ct.grid(), &grid)?;
    let hu = source.padding.put_back(ct, params.policy.clip_padding);
    let encoding = Encoding::choose(source, &hu);
    let attributes = Attributes::new(source, params, &grid, &encoding)?;
    let target = folder::Target::new(dir)?;

    let per_slice = hu.len() / source.slices.len();
    let slice_hu = |k: usize| &hu[k * per_slice..(k + 1) * per_slice];
    let n = source.slices.len();
    let hash = content_hash(params, n, progress.part(0.0, 0.3), |k| {
        crate::data_set::encode(&attributes.slice(k, None, encoding.stored(slice_hu(k))))
    })?;
    let names = attributes::Names::new(&hash, source, params.policy);

    let done = AtomicUsize::new(0);
    let work = progress.part(0.3, 1.0);
    let written: Vec<Result<(), Error>> = (0..n)
        .into_par_iter()
        .map(|k| {
            work.at(done.fetch_add(1, Ordering::Relaxed) as f64 / n as f64)?;
            let set = attributes.slice(k, Some(&names), encoding.stored(slice_hu(k)));
            let version = attributes.implementation_version();
            let bytes = crate::data_set::part10(&set, version);
            let path = target.write(&attributes.file_name(k), &bytes)?;
            read_back::check(&path, &set, slice_hu(k), &source.slices[k].slice)
        })
        .collect();
    written.into_iter().collect::<Result<(), Error>>()?;
    progress.at(1.0)?;
    target.commit()?;

    let mut files: Vec<String> = (0..n).map(|k| attributes.file_name(k)).collect();
    files.sort();
    Ok(WriteInfo {
        warnings: attributes.warnings().to_vec(),
        series_uid: names.series,
        frame_of_reference_uid: names.frame_of_reference,
        series_number: attributes.series_number(),
        files,
        source_encoding: encoding.inherited,
    })
}

/// Hash of the parameters and of every slice's data set without its UIDs, in order.
fn content_hash(
    params: &ExportParams,
    slices: usize,
    progress: Progress<'_>,
    encoded: impl Fn(usize) -> Vec<u8> + Sync,
) -> Result<[u8; 32], Error> {
    let done = AtomicUsize::new(0);
    let hashes: Vec<Result<[u8; 32], Error>> = (0..slices)
        .into_par_iter()
        .map(|k| {
            progress.at(done.fetch_add(1, Ordering::Relaxed) as f64 / slices as f64)?;
            Ok(Sha256::digest(encoded(k)).into())
        })
        .collect();
    let mut whole = Sha256::new();
    whole.update(params.identity);
    for hash in hashes {
        whole.update(hash?);
    }
    Ok(whole.finalize().into())
}
