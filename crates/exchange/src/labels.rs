//! Label maps: 3D Slicer segmentations, plain NRRD and NIfTI.

pub(crate) mod segments;

use crate::{
    Error, Problem, file, mha, nii,
    nrrd::{self, Axis},
    raster::Raster,
    raster_file,
    volumes::is_meta_image,
};
use segments::Segment;
use std::{collections::BTreeMap, path::Path};
use supine_space::Progress;
use supine_volume::{LabelMap, Volume, label};

/// Reads a label map from NRRD, a 3D Slicer segmentation, NIfTI-1 or MetaImage.
///
/// Plain volumes hold the numbers of [`supine_volume::label`]. In a segmentation the names of the
/// segments decide (`soft tissue`, `chest wall`, ...; case, `_` and `-` do not matter), whatever
/// their numbers. Where segments overlap, the finer label stands (tumour before soft tissue); an
/// overlap of soft tissue and chest wall is refused. A segmentation that 3D Slicer cropped to its
/// segments is put back on the grid of its reference image when the file tells it.
///
/// # Errors
/// When the file cannot be read or is damaged, does not say which way its axes point, or holds a
/// label or segment that is not one of [`supine_volume::label::ALL`].
pub fn read_labels(path: &Path, progress: Progress<'_>) -> Result<LabelMap, Error> {
    let raster = raster_file::read(path, progress)?;
    labels(&raster).map_err(|p| p.of(path))
}

/// Labels that someone supplies: known by their numbers, or by names that others gave them.
#[derive(Debug)]
pub enum SuppliedLabels {
    /// The numbers of [`supine_volume::label`].
    Numbers(LabelMap),
    /// Named segments, whatever their names.
    Segments(Segments),
}

/// Reads labels as [`read_labels`], but leaves open what segments with names stand for: those of a
/// 3D Slicer segmentation and those that a NIfTI file names in a header extension.
///
/// # Errors
/// When the file cannot be read or is damaged, does not say which way its axes point, or holds a
/// number without a name that is not one of [`supine_volume::label::ALL`].
pub fn read_supplied_labels(path: &Path, progress: Progress<'_>) -> Result<SuppliedLabels, Error> {
    let raster = raster_file::read(path, progress)?;
    if raster.segments.is_empty() {
        return labels(&raster).map(SuppliedLabels::Numbers).map_err(|p| p.of(path));
    }
    let expected = "expected a whole number, the number of a segment";
    let values = raster.whole::<i16>(expected).map_err(|p| p.of(path))?;
    Ok(SuppliedLabels::Segments(Segments { raster, values }))
}

/// Named segments of a file.
#[derive(Debug)]
pub struct Segments {
    raster: Raster,
    values: Vec<i16>,
}

impl Segments {
    /// Their names, in the order of the file.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.raster.segments.iter().map(|s| s.name.as_str())
    }

    /// The voxels of a segment, by its place in the list. What 3D Slicer cropped is put back on the
    /// grid of its reference image when the file tells it.
    ///
    /// # Panics
    /// When there is no segment at that place.
    pub fn mask(&self, place: usize) -> Volume<bool> {
        let segment = &self.raster.segments[place];
        let grid = &self.raster.grid;
        let on = |v| self.values[self.raster.place(segment.layer, grid.offset(v))] == segment.value;
        segments::uncropped(Volume::from_fn(grid.clone(), on), &self.raster.keys)
    }
}

fn labels(raster: &Raster) -> Result<LabelMap, Problem> {
    let values = raster.whole::<i16>("expected a whole number, the number of a label")?;
    let data = if raster.segments.is_empty() {
        if raster.layers != 1 {
            let reason = format!("{} values per voxel, a label map has one", raster.layers);
            return Err(Problem::field("sizes", reason));
        }
        by_number(&values)?
    } else {
        by_segment(raster, &values, &raster.segments)?
    };
    let labels = Volume::new(raster.grid.clone(), data)
        .map_err(|e| Problem::field("sizes", e.to_string()))?;
    Ok(segments::uncropped(labels, &raster.keys))
}

/// Labels that are meant by their number.
fn by_number(values: &[i16]) -> Result<Vec<u8>, Problem> {
    let known = |v: i16| v == 0 || label::ALL.iter().any(|(n, ..)| i16::from(*n) == v);
    if let Some(&value) = values.iter().find(|&&v| !known(v)) {
        let voxels = values.iter().filter(|&&v| v == value).count();
        return Err(unknown(value, None, voxels));
    }
    Ok(values.iter().map(|&v| v as u8).collect())
}

fn unknown(value: i16, name: Option<String>, voxels: usize) -> Problem {
    let known: Vec<String> = label::ALL.iter().map(|(n, name, _)| format!("{n} {name}")).collect();
    Problem::Label { value: value.into(), name, voxels, known: known.join(", ") }
}

/// Labels that are meant by the names of their segments.
fn by_segment(raster: &Raster, values: &[i16], segments: &[Segment]) -> Result<Vec<u8>, Problem> {
    let by_value: BTreeMap<(usize, i16), &Segment> =
        segments.iter().map(|s| ((s.layer, s.value), s)).collect();
    refuse_foreign(raster, values, &by_value)?;
    let mut data = vec![label::OUTSIDE; raster.grid.len()];
    let mut overlap: Option<(u8, u8, usize)> = None;
    // Labels come in runs: the last value of each layer and its label.
    let mut last: Vec<(i16, Option<u8>)> = vec![(0, None); raster.layers];
    for (voxel, out) in data.iter_mut().enumerate() {
        for layer in 0..raster.layers {
            let value = values[raster.place(layer, voxel)];
            if last[layer].0 != value {
                last[layer] = (value, by_value.get(&(layer, value)).and_then(|s| s.label));
            }
            let Some(new) = last[layer].1 else { continue };
            if label::is_soft_tissue(*out) && label::is_chest_wall(new)
                || label::is_chest_wall(*out) && label::is_soft_tissue(new)
            {
                let (_, _, voxels) = overlap.get_or_insert((*out, new, 0));
                *voxels += 1;
            }
            // The finer labels have the higher numbers.
            *out = new.max(*out);
        }
    }
    match overlap {
        None => Ok(data),
        Some((first, second, voxels)) => {
            let (first, second) = (segments::name(first), segments::name(second));
            Err(Problem::Overlap { first, second, voxels })
        }
    }
}

/// Refuses voxels whose segment has no name or one that is not ours.
fn refuse_foreign(
    raster: &Raster,
    values: &[i16],
    by_value: &BTreeMap<(usize, i16), &Segment>,
) -> Result<(), Problem> {
    let mut foreign: BTreeMap<(usize, i16), usize> = BTreeMap::new();
    let mut last = None;
    for (place, &value) in values.iter().enumerate() {
        if value == 0 {
            continue;
        }
        let key = (raster.layer_of(place), value);
        if last == Some(key) {
            continue;
        }
        if by_value.get(&key).is_some_and(|s| s.label.is_some()) {
            last = Some(key);
        } else {
            *foreign.entry(key).or_default() += 1;
        }
    }
    match foreign.pop_first() {
        None => Ok(()),
        Some((key, voxels)) => {
            Err(unknown(key.1, by_value.get(&key).map(|s| s.name.clone()), voxels))
        }
    }
}

/// Writes a label map as a 3D Slicer segmentation (`.seg.nrrd`, with names and colours), as NRRD
/// (`.nrrd`), NIfTI-1 (`.nii`, `.nii.gz`) or MetaImage (`.mha`); 8 bit.
///
/// # Errors
/// When the name ends otherwise, a label of a segmentation has no name in
/// [`supine_volume::label::ALL`] or the file cannot be written.
pub fn write_labels(labels: &LabelMap, path: &Path, progress: Progress<'_>) -> Result<(), Error> {
    let samples = labels.data().iter().copied();
    let refused = |reason| Error::Unwritable { path: path.into(), reason };
    if file::has_suffix(path, ".seg.nrrd") {
        let keys = segments::keys(labels).map_err(refused)?;
        nrrd::write(path, labels.grid(), &Axis::Scalar, &keys, samples, progress)
    } else if file::has_suffix(path, ".nrrd") {
        nrrd::write(path, labels.grid(), &Axis::Scalar, &[], samples, progress)
    } else if file::has_suffix(path, ".nii") || file::has_suffix(path, ".nii.gz") {
        nii::write(path, labels, "", progress)
    } else if is_meta_image(path) {
        mha::write(path, (labels.grid(), 1), "", samples, progress)
    } else {
        Err(refused("labels are written as .seg.nrrd, .nrrd, .nii, .nii.gz or .mha".into()))
    }
}

#[cfg(test)]
mod tests;
