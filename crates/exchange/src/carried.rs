//! Volumes that someone brings to be carried: label maps with whatever labels, doses.

use crate::{
    Error, Problem, file,
    labels::segments,
    mha, nii,
    nrrd::{self, Axis},
    raster::Raster,
    raster_file,
    volumes::is_meta_image,
    write_labels,
};
use std::{collections::BTreeMap, path::Path};
use supine_space::{Grid, Progress};
use supine_volume::{Volume, label};

/// Which kind of volume a file is to be taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeKind {
    /// Numbers of labels.
    Labels,
    /// Values that can be interpolated, such as a dose.
    Scalar,
}

/// A volume of one of two kinds.
#[derive(Clone, Debug)]
pub enum AnyVolume {
    /// Labels.
    Labels(LabelLayers),
    /// Values that can be interpolated.
    Scalar(Volume<f32>),
}

/// Label maps on one grid that may overlap, with the names that their file gives them.
#[derive(Clone, Debug)]
pub struct LabelLayers {
    /// The maps; 0 is nothing.
    pub layers: Vec<Volume<u16>>,
    /// Layer, number and name of each label that has one.
    pub names: Vec<(usize, u16, String)>,
    /// What the header says about segments, as 3D Slicer writes it.
    keys: BTreeMap<String, String>,
}

/// Reads a label map (NRRD, 3D Slicer segmentation, NIfTI-1, MetaImage; any numbers and names,
/// overlapping layers) or a volume of values. Without `kind` a file without names of segments is
/// one of values when a value is not a whole number from 0 to 65535.
///
/// A segmentation that 3D Slicer cropped is put back on the grid of its reference image when the
/// file tells it.
///
/// # Errors
/// When the file cannot be read, is damaged, does not say which way its axes point, or holds what
/// its kind does not allow.
pub fn read_any_volume(
    path: &Path,
    kind: Option<VolumeKind>,
    progress: Progress<'_>,
) -> Result<AnyVolume, Error> {
    let raster = raster_file::read(path, progress)?;
    let scalar = || scalar(&raster).map(AnyVolume::Scalar).map_err(|p| p.of(path));
    if kind == Some(VolumeKind::Scalar) {
        return scalar();
    }
    let values = raster.whole::<u16>("expected a whole number from 0 to 65535, that of a label");
    match values {
        Err(Problem::Value { .. }) if kind.is_none() && raster.segments.is_empty() => scalar(),
        Err(problem) => Err(problem.of(path)),
        Ok(values) => layers(&raster, &values).map(AnyVolume::Labels).map_err(|p| p.of(path)),
    }
}

fn scalar(raster: &Raster) -> Result<Volume<f32>, Problem> {
    if raster.layers != 1 {
        let reason = format!("{} values per voxel, expected one", raster.layers);
        return Err(Problem::field("sizes", reason));
    }
    let mut values = Vec::with_capacity(raster.grid.len());
    raster.scalar.try_each(&raster.bytes, raster.big_endian, |place, sample| {
        let value = sample * raster.slope + raster.intercept;
        if !value.is_finite() {
            let voxel = raster.grid.voxel(place);
            return Err(Problem::Value { voxel, value, reason: "expected a finite number" });
        }
        values.push(value as f32);
        Ok(())
    })?;
    Volume::new(raster.grid.clone(), values).map_err(|e| Problem::field("sizes", e.to_string()))
}

fn layers(raster: &Raster, values: &[u16]) -> Result<LabelLayers, Problem> {
    if raster.layers != 1 && raster.segments.is_empty() {
        let reason = format!("{} values per voxel without names of segments", raster.layers);
        return Err(Problem::field("sizes", reason));
    }
    if !segments::fit_together(raster.layers, &raster.keys) {
        let reason = format!("{} layers are too many for the reference image", raster.layers);
        return Err(Problem::field("sizes", reason));
    }
    let grid = &raster.grid;
    let layer = |layer| {
        let map = Volume::from_fn(grid.clone(), |v| values[raster.place(layer, grid.offset(v))]);
        segments::uncropped(map, &raster.keys)
    };
    let names = raster.segments.iter().filter_map(|s| {
        let value = u16::try_from(s.value).ok()?;
        Some((s.layer, value, s.name.clone()))
    });
    let keys = raster.keys.iter().filter(|(key, _)| key.starts_with("Segment"));
    Ok(LabelLayers {
        layers: (0..raster.layers).map(layer).collect(),
        names: names.collect(),
        keys: keys.map(|(k, v)| (k.clone(), v.clone())).collect(),
    })
}

impl LabelLayers {
    /// The same labels and names in other voxels: one map for each of [`Self::layers`], on one
    /// grid.
    #[must_use]
    pub fn with_layers(&self, layers: Vec<Volume<u16>>) -> Self {
        Self { layers, names: self.names.clone(), keys: self.keys.clone() }
    }

    /// The grid; `None` without layers.
    pub fn grid(&self) -> Option<&Grid> {
        self.layers.first().map(Volume::grid)
    }

    /// Volume of each label that is there or has a name, mL, by layer and number.
    pub fn volumes_ml(&self) -> BTreeMap<(usize, u16), f64> {
        let mut voxels: BTreeMap<(usize, u16), usize> =
            self.names.iter().map(|(layer, value, _)| ((*layer, *value), 0)).collect();
        for (layer, map) in self.layers.iter().enumerate() {
            for run in map.data().chunk_by(|a, b| a == b).filter(|run| run[0] != 0) {
                *voxels.entry((layer, run[0])).or_default() += run.len();
            }
        }
        let ml = self.grid().map_or(0.0, Grid::voxel_volume) / 1000.0;
        voxels.into_iter().map(|(key, n)| (key, n as f64 * ml)).collect()
    }

    /// The header's account of the segments, on the grid the maps are on.
    fn header_keys(&self, grid: &Grid) -> Vec<(String, String)> {
        let mut keys = self.keys.clone();
        if !self.names.is_empty() {
            let geometry = segments::reference_geometry(grid);
            let meaning = "Grid of the image the segmentation belongs to";
            let parameters = format!("Reference image geometry|{geometry}|{meaning}");
            keys.insert("Segmentation_ConversionParameters".into(), parameters);
            keys.insert("Segmentation_ReferenceImageExtentOffset".into(), "0 0 0".into());
            let whole: Vec<String> = grid.size().iter().map(|n| format!("0 {}", n - 1)).collect();
            for (key, value) in &mut keys {
                if key.ends_with("_Extent") {
                    *value = whole.join(" ");
                }
            }
        }
        keys.into_iter().collect()
    }

    /// The one map with our own labels, if that is what it is.
    fn own(&self) -> Option<Volume<u8>> {
        let [map] = self.layers.as_slice() else { return None };
        let known = |v: u16| v == 0 || label::ALL.iter().any(|l| u16::from(l.0) == v);
        (self.names.is_empty() && map.data().iter().all(|&v| known(v)))
            .then(|| map.map(|&v| v as u8))
    }
}

/// Writes label maps with the names they came with: as 3D Slicer segmentation (`.seg.nrrd`), NRRD
/// or, one map without its names, NIfTI-1 (`.nii`, `.nii.gz`) or MetaImage (`.mha`); 16 bit where 8
/// do not do.
///
/// # Errors
/// When the name ends otherwise, there are several maps for NIfTI or MetaImage or labels without
/// names for a segmentation, the file cannot be written or the callback asked to stop.
pub fn write_label_layers(
    labels: &LabelLayers,
    path: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let refused = |reason: &str| Error::Unwritable { path: path.into(), reason: reason.into() };
    if let Some(own) = labels.own() {
        return write_labels(&own, path, progress);
    }
    let grid = labels.grid().ok_or_else(|| refused("there are no labels"))?;
    let small = labels.layers.iter().all(|l| l.data().iter().all(|&v| v <= u8::MAX.into()));
    if file::has_suffix(path, ".nrrd") {
        if labels.names.is_empty() && file::has_suffix(path, ".seg.nrrd") {
            return Err(refused("a segmentation needs names of its labels: write .nrrd"));
        }
        let axis = match labels.layers.len() {
            1 => Axis::Scalar,
            count => Axis::List(count),
        };
        let keys = labels.header_keys(grid);
        let samples = (0..grid.len()).flat_map(|n| labels.layers.iter().map(move |l| l.data()[n]));
        return if small {
            nrrd::write(path, grid, &axis, &keys, samples.map(|v| v as u8), progress)
        } else {
            nrrd::write(path, grid, &axis, &keys, samples, progress)
        };
    }
    match labels.layers.as_slice() {
        [map] if is_meta_image(path) && small => {
            mha::write(path, (grid, 1), "", map.data().iter().map(|&v| v as u8), progress)
        }
        [map] if is_meta_image(path) => {
            mha::write(path, (grid, 1), "", map.data().iter().copied(), progress)
        }
        [map] if small => nii::write(path, &map.map(|&v| v as u8), "", progress),
        [map] => nii::write(path, map, "", progress),
        _ => Err(refused("labels overlap, which only .seg.nrrd can hold")),
    }
}
