//! Painted seeds: segmentations, label maps and folders of masks.

use super::names;
use crate::labels::segments;
use crate::raster::{self, Raster};
use crate::{Error, Problem};
use std::{collections::BTreeMap, path::Path};
use supine_volume::{SeedKind, Seeds, Volume, label};

type Map = Volume<Option<SeedKind>>;

/// The number that stands for exclude in a label map.
const EXCLUDE: i16 = 255;

/// Reads a painted map.
pub(super) fn read(path: &Path) -> Result<Map, Error> {
    let name = path.file_name().map(|n| n.to_string_lossy());
    let of_file = name.as_deref().and_then(names::kind);
    let raster = raster::read(path)?;
    map(&raster, of_file).map_err(|p| p.of(path))
}

/// Reads every mask of a folder whose name tells its tissue; masks on one grid become one map.
pub(super) fn read_folder(folder: &Path) -> Result<Seeds, Error> {
    let unread = |cause| Error::Read { path: folder.into(), cause };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let is_mask = [".nii", ".nii.gz", ".nrrd"].iter().any(|s| name.ends_with(s));
        if let Some(kind) = names::mask_kind(&name).filter(|_| is_mask) {
            files.push((path, kind));
        }
    }
    files.sort();
    let mut painted: Vec<Map> = Vec::new();
    for (path, kind) in files {
        let raster = raster::read(&path)?;
        let mask = map(&raster, Some(kind)).map_err(|p| p.of(&path))?;
        match painted.iter_mut().find(|m| m.grid() == mask.grid()) {
            Some(whole) => merge(whole, &mask).map_err(|p| p.of(&path))?,
            None => painted.push(mask),
        }
    }
    if painted.is_empty() {
        let reason = format!("no mask (.nii.gz, .nrrd) begins with {}", names::accepted_masks());
        return Err(Problem::field("folder", reason).of(folder));
    }
    Ok(Seeds { painted, ..Seeds::default() })
}

/// Adds a map to another one on the same grid.
fn merge(whole: &mut Map, more: &Map) -> Result<(), Problem> {
    let grid = more.grid();
    for (n, (w, &m)) in whole.data_mut().iter_mut().zip(more.data()).enumerate() {
        match (*w, m) {
            (_, None) => {}
            (Some(a), Some(b)) if a != b => return Err(overlap(grid, n, a, b)),
            _ => *w = m,
        }
    }
    Ok(())
}

fn overlap(grid: &supine_space::Grid, n: usize, a: SeedKind, b: SeedKind) -> Problem {
    let at = grid.centre(grid.voxel(n));
    let reason = format!(
        "the voxel at [{:.1}, {:.1}, {:.1}] mm (LPS) belongs both to {} and to {}; erase one",
        at.x,
        at.y,
        at.z,
        a.name(),
        b.name()
    );
    Problem::field("segments", reason)
}

/// The kinds of the voxels of a file whose name may say what all of them are.
fn map(raster: &Raster, of_file: Option<SeedKind>) -> Result<Map, Problem> {
    let values = raster.whole::<i16>("expected a whole number, the number of a label")?;
    let segments = segments::parse(&raster.keys, raster.layers)?;
    let known: BTreeMap<(usize, i16), Option<SeedKind>> =
        segments.iter().map(|s| ((s.layer, s.value), names::kind(&s.name))).collect();
    let name = |key: &(usize, i16)| {
        let segment = segments.iter().find(|s| (s.layer, s.value) == *key);
        segment.map_or_else(|| format!("label {}", key.1), |s| format!("`{}`", s.name))
    };
    let mut data = vec![None; raster.grid.len()];
    for (voxel, out) in data.iter_mut().enumerate() {
        for layer in 0..raster.layers {
            let value = values[raster.place(layer, voxel)];
            if value == 0 {
                continue;
            }
            let kind = match known.get(&(layer, value)) {
                Some(kind) => *kind,
                None if segments.is_empty() => of_file.or_else(|| by_number(value)),
                None => None,
            };
            let Some(kind) = kind else {
                let what = name(&(layer, value));
                let reason = format!(
                    "{what} is no kind of seed. Names that are: {}. Numbers that are: those of \
                     labels, and {EXCLUDE} for exclude",
                    names::accepted()
                );
                return Err(Problem::field("segments", reason));
            };
            match *out {
                Some(other) if other != kind => {
                    return Err(overlap(&raster.grid, voxel, other, kind));
                }
                _ => *out = Some(kind),
            }
        }
    }
    if data.iter().all(Option::is_none) {
        return Err(Problem::field("segments", "nothing is painted"));
    }
    Volume::new(raster.grid.clone(), data).map_err(|e| Problem::field("sizes", e.to_string()))
}

fn by_number(value: i16) -> Option<SeedKind> {
    let number = u8::try_from(value).ok()?;
    if value == EXCLUDE {
        Some(SeedKind::Exclude)
    } else if label::is_chest_wall(number) {
        Some(SeedKind::ChestWall)
    } else if label::is_soft_tissue(number) {
        Some(SeedKind::SoftTissue)
    } else {
        None
    }
}
