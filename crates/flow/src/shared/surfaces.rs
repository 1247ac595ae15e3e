//! Skin and chest wall between the voxels, as two files of a folder.

use crate::Error;
use std::path::Path;
use supine_exchange::{read_signed_distance, write_signed_distance};
use supine_space::Progress;
use supine_volume::{LabelMap, RegionError, SignedDistance, Surfaces};

const SKIN: &str = "skin.nrrd";
const CHEST_WALL: &str = "chest_wall.nrrd";

/// The files of a folder of surfaces.
pub const SURFACES: [&str; 2] = [SKIN, CHEST_WALL];

/// Writes the surfaces into a folder, made when there is none: `skin.nrrd` and `chest_wall.nrrd`,
/// as [`write_signed_distance`] writes them.
///
/// # Errors
/// When the folder or a file cannot be written, or the callback asked to stop.
pub fn write_surfaces(
    surfaces: &Surfaces,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    std::fs::create_dir_all(folder)
        .map_err(|source| Error::Output { path: folder.into(), source })?;
    let write = |surface, name, progress| {
        write_signed_distance(surface, &folder.join(name), progress).map_err(Error::product)
    };
    write(&surfaces.skin, SKIN, progress.part(0.0, 0.5))?;
    write(&surfaces.chest_wall, CHEST_WALL, progress.part(0.5, 1.0))
}

/// The surfaces in a folder, on the labels' grid to the bit; none when there is no such folder.
///
/// # Errors
/// When a file cannot be read, is of another grid, or the callback asked to stop.
pub fn read_surfaces(
    folder: &Path,
    labels: &LabelMap,
    progress: Progress<'_>,
) -> Result<Option<Surfaces>, Error> {
    if !folder.join(SKIN).exists() {
        return Ok(None);
    }
    let read = |name, progress| {
        let distance =
            read_signed_distance(&folder.join(name), progress).map_err(Error::product)?;
        let (grid, values) = distance.into_values().into_parts();
        let (surfaces, size) = (grid.size(), labels.grid().size());
        let values = labels.with_data(values);
        let values = values.map_err(|_| RegionError::OtherGrid { surfaces, labels: size })?;
        Ok::<_, Error>(SignedDistance::from_values(values))
    };
    let skin = read(SKIN, progress.part(0.0, 0.5))?;
    Ok(Some(Surfaces { skin, chest_wall: read(CHEST_WALL, progress.part(0.5, 1.0))? }))
}
