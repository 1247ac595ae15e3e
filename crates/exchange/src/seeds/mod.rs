//! Seeds of the segmentation, placed or painted by the user.

mod map;
mod masks;
mod names;
mod painted;

use crate::{Error, NamedPoint, Problem, file, is_volume_name, markups, points};
use std::path::Path;
use supine_space::Progress;
use supine_volume::Seeds;

/// Reads seeds: points from 3D Slicer markups (`.mrk.json`) or CSV `name,x,y,z`, painted voxels
/// from a 3D Slicer segmentation (`.seg.nrrd`), a label map (`.nrrd`, `.nii`, `.nii.gz`, `.mha`,
/// `.mhd`) or a folder of masks.
///
/// Names tell the tissue; case does not matter, `_` and `-` count as spaces, and what follows the
/// word is free. Chest wall: `chest wall`, `muscle`, `rib`, `sternum`, `costal`, `intercostal`,
/// `pectoral`, `bone`, `lung`. Soft tissue: `soft`, `gland`, `fat`, `breast`, `skin`, `tumour`.
/// Exclude: `exclude`, `wire`, `table`, `lead`, `electrode`. A leading `left` or `right` is passed
/// over.
///
/// - Points: the point's own name decides; if it says nothing, that of its list, or the file's.
/// - Segmentations: the name of the segment.
/// - Label maps: the file's name, when it says one; else the numbers of [`supine_volume::label`],
///   and 255 for exclude.
/// - Folders: every mask whose name begins with `rib`, `sternum`, `costal`, `intercostal`,
///   `pectoral`, `serratus`, `chest wall` or `breast`, as TotalSegmentator names them; others are
///   passed over, and empty ones. The same holds for a file of all classes that names them in its
///   header (NIfTI) or by the IDs of its segments (`.seg.nrrd`). Of masks other than bone,
///   cartilage and intercostals, 3 mm along the edge say nothing, nor do voxels that two kinds
///   claim.
///
/// Maps keep the grid of their file, which need not be that of the CT.
///
/// # Errors
/// When a file cannot be read or is damaged, a point, a segment with voxels or a label belongs to
/// none of the three, a voxel belongs to two of them, or nothing is found.
pub fn read_seeds(path: &Path, progress: Progress<'_>) -> Result<Seeds, Error> {
    if path.is_dir() {
        return painted::read_folder(path, progress);
    }
    if is_volume_name(path) {
        return Ok(Seeds { painted: vec![painted::read(path, progress)?], ..Seeds::default() });
    }
    let bytes = file::read(path)?;
    let lists = if points::is_markups(path) {
        markups::parse(&bytes)
    } else if file::has_suffix(path, ".csv") {
        points::parse_csv(&bytes).map(|points| vec![markups::List { name: None, points }])
    } else {
        Err(Problem::Format(
            "seeds as .mrk.json, .csv, .seg.nrrd, .nrrd, .nii, .nii.gz, .mha or .mhd",
        ))
    };
    let stem = path.file_name().map(|n| n.to_string_lossy());
    let seeds = lists.and_then(|lists| {
        let mut seeds = Seeds::default();
        for list in &lists {
            for (n, p) in list.points.iter().enumerate() {
                add(&mut seeds, n + 1, p, &[list.name.as_deref(), stem.as_deref()])?;
            }
        }
        Ok(seeds)
    });
    seeds.map_err(|p| p.of(path))
}

/// Adds a point by its own name, else by the names of its list.
fn add(
    seeds: &mut Seeds,
    number: usize,
    p: &NamedPoint,
    of: &[Option<&str>],
) -> Result<(), Problem> {
    let mut names = std::iter::once(Some(p.name.as_str())).chain(of.iter().copied()).flatten();
    let Some(kind) = names.find_map(names::kind) else {
        let reason = "neither its name nor that of its list begins with `chest_wall`, \
                      `soft_tissue`, `exclude` or another word for them";
        return Err(Problem::Point { number, name: p.name.clone(), reason });
    };
    seeds.points_mut(kind).push(p.position);
    Ok(())
}
