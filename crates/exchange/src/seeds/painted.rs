//! Painted seeds from files: segmentations, label maps, and masks in folders or one file.

use super::map::Map;
use super::masks::{Masks, RIM_MM};
use super::names;
use crate::raster::Raster;
use crate::raster_file;
use crate::{Error, Problem, is_volume_name};
use std::{collections::BTreeMap, path::Path};
use supine_space::Progress;
use supine_volume::{SeedKind, Seeds, Volume, label};

/// The number that stands for exclude in a label map.
const EXCLUDE: i16 = 255;

/// Reads a painted map, or the masks of the thorax among those of a whole body.
pub(super) fn read(path: &Path, progress: Progress<'_>) -> Result<Map, Error> {
    let name = path.file_name().map(|n| n.to_string_lossy());
    let of_file = name.as_deref().and_then(names::kind);
    let raster = raster_file::read(path, progress)?;
    let whole_body = raster.segments.iter().any(|s| names::is_of_whole_body(&s.id));
    let map = if whole_body { of_whole_body(&raster) } else { map(&raster, of_file) };
    map.and_then(|map| {
        if map.data().iter().all(Option::is_none) {
            return Err(Problem::field("segments", "nothing is painted"));
        }
        Ok(map)
    })
    .map_err(|p| p.of(path))
}

const WHOLE: &str = "expected a whole number, the number of a label";

fn of_whole_body(raster: &Raster) -> Result<Map, Problem> {
    let values = raster.whole::<i16>(WHOLE)?;
    let mut masks = Masks::new(raster.grid.clone());
    for segment in &raster.segments {
        if let Some(kind) = names::mask_kind(&segment.id) {
            let place = |n| raster.place(segment.layer, n);
            masks.add(kind, |n| values[place(n)] == segment.value);
        }
    }
    Ok(masks.into_map())
}

/// Reads every mask of a folder whose name tells its tissue; masks on one grid become one map.
pub(super) fn read_folder(folder: &Path, progress: Progress<'_>) -> Result<Seeds, Error> {
    let unread = |cause| Error::Read { path: folder.into(), cause };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if let Some(kind) = names::mask_kind(&name).filter(|_| is_volume_name(&path)) {
            files.push((path, kind));
        }
    }
    if files.is_empty() {
        let reason =
            format!("no mask (.nii.gz, .nrrd, .mha) begins with {}", names::accepted_masks());
        return Err(Problem::field("folder", reason).of(folder));
    }
    files.sort();
    let mut all: Vec<Masks> = Vec::new();
    let count = files.len() as f64;
    for (n, (path, kind)) in files.into_iter().enumerate() {
        let part = progress.part(n as f64 / count, (n + 1) as f64 / count);
        let raster = raster_file::read(&path, part)?;
        let values = raster.whole::<i16>(WHOLE).map_err(|p| p.of(&path))?;
        let on = |n| (0..raster.layers).any(|l| values[raster.place(l, n)] != 0);
        match all.iter_mut().find(|m| m.grid == raster.grid) {
            Some(masks) => masks.add(kind, on),
            None => {
                let mut masks = Masks::new(raster.grid.clone());
                masks.add(kind, on);
                all.push(masks);
            }
        }
    }
    let said = |map: &Map| map.data().iter().any(Option::is_some);
    let painted: Vec<Map> = all.into_iter().map(Masks::into_map).filter(said).collect();
    if painted.is_empty() {
        let reason = format!("its masks are empty, or nowhere thicker than {:.0} mm", 2.0 * RIM_MM);
        return Err(Problem::field("folder", reason).of(folder));
    }
    Ok(Seeds { painted, ..Seeds::default() })
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
    let values = raster.whole::<i16>(WHOLE)?;
    let segments = &raster.segments;
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
