//! The map as DICOM registrations between the CT and its deformed export.

use crate::Error;
use std::path::Path;
use supine_dicom::{CompanionParams, ReadParams, Source, write_chest_wall, write_deformable};
use supine_mesh::Deformation;
use supine_report::Registration;
use supine_space::{Grid, Progress, Vector};
use supine_volume::Volume;
use supine_warp::{Fields, Params, interpolation_error, resampling};

/// The file of the deformable registration, within its folder.
pub(crate) const DEFORMABLE: &str = "deformable.dcm";
const CHEST_WALL: &str = "chest-wall.dcm";

/// The files of a folder of registrations.
pub const REGISTRATIONS: [&str; 2] = [DEFORMABLE, CHEST_WALL];
/// Vectors lie this many pixels apart.
const PIXELS: f64 = 2.0;
/// Most vectors: 96 MiB in the file.
const MAX_VECTORS: usize = 8 << 20;

/// Two series that are registered with each other.
#[derive(Clone, Copy, Debug)]
pub struct RegisteredSeries<'a> {
    /// Grid of the CT.
    pub ct: &'a Grid,
    /// Its series, as exports may name it.
    pub source: &'a Source,
    /// Folder of the exported series.
    pub exported: &'a Path,
}

/// Writes `deformable.dcm` and `chest-wall.dcm` into `folder`: registrations of an exported series
/// with the CT it was made from.
///
/// `deformation` as the solver gave it, `fields` those of it on voxels of the CT, by which the
/// vectors are judged. The vectors ([`resampling`]) lie on a coarser grid around what moves; beyond
/// it nothing does.
///
/// # Errors
/// When the exported series cannot be read, or a file cannot be written.
pub fn write_registration(
    between: &RegisteredSeries<'_>,
    deformation: &Deformation,
    fields: &Fields,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<Registration, Error> {
    let &RegisteredSeries { ct, source, exported } = between;
    let series = ReadParams::default();
    let (_, deformed, _) = supine_dicom::read_series(exported, &series, progress.part(0.0, 0.3))
        .map_err(Error::Export)?;
    let grid = coarse(ct);
    let part = progress.part(0.3, 0.9);
    let vectors = resampling(&grid, deformation, &Params::default(), part)?;
    let error = interpolation_error(&vectors, fields);
    std::fs::create_dir_all(folder)
        .map_err(|source| Error::Output { path: folder.into(), source })?;
    write(&vectors, source, &deformed, folder)?;
    progress.at(1.0)?;
    Ok(Registration {
        folder: "registration".into(),
        grid: vectors.grid().size(),
        spacing_mm: vectors.grid().spacing().into(),
        error: error.unwrap_or_default(),
    })
}

fn write(
    vectors: &Volume<[f32; 3]>,
    source: &Source,
    deformed: &Source,
    folder: &Path,
) -> Result<(), Error> {
    let params = |description: &str| CompanionParams {
        series_description: description.into(),
        derivation: "DERIVED: map of a simulated deformation".into(),
        clock: deformed.clock(),
        before: 0,
        software_version: env!("CARGO_PKG_VERSION").into(),
    };
    let path = folder.join(DEFORMABLE);
    let named = params("DEFORMED to CT registration [supine]");
    write_deformable(vectors, source, deformed, &named, &path).map_err(Error::Export)?;
    let path = folder.join(CHEST_WALL);
    let named = params("CHEST WALL ONLY registration [supine]");
    write_chest_wall(source, deformed, &named, &path).map_err(Error::Export)?;
    Ok(())
}

/// A grid that covers the CT, its first place on the first voxel: vectors [`PIXELS`] pixels apart
/// in a slice and as far, or in every slice where those lie further apart, along the normal.
fn coarse(ct: &Grid) -> Grid {
    let (size, spacing) = (ct.size(), ct.spacing());
    let mut apart = PIXELS * spacing.x.min(spacing.y);
    loop {
        let step = [0, 1, 2].map(|a| (apart / spacing[a]).round().max(1.0) as usize);
        let places = [0, 1, 2].map(|a| (size[a] - 1).div_ceil(step[a]).max(1) + 1);
        let wide = Vector::from([0, 1, 2].map(|a| step[a] as f64 * spacing[a]));
        if let (true, Ok(grid)) = (
            places.iter().product::<usize>() <= MAX_VECTORS,
            Grid::new(places, wide, ct.origin(), *ct.direction()),
        ) {
            return grid;
        }
        apart *= 1.25;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point};

    fn ct(size: [usize; 3], spacing: [f64; 3]) -> Grid {
        Grid::new(size, Vector::from(spacing), Point::new(1.0, 2.0, 3.0), Matrix::identity())
            .unwrap()
    }

    #[test]
    fn the_coarse_grid_covers_the_ct_and_stays_small() {
        for (size, spacing) in [
            ([512, 512, 300], [0.7, 0.7, 1.0]),
            ([256, 255, 86], [1.5, 1.5, 2.5]),
            ([3, 4, 2], [1.0, 2.0, 5.0]),
        ] {
            let ct = ct(size, spacing);
            let grid = coarse(&ct);
            assert!(grid.len() <= MAX_VECTORS && grid.origin() == ct.origin());
            let last = grid.index_from_patient(&ct.centre(size.map(|n| n - 1)));
            assert!((0..3).all(|a| last[a] <= (grid.size()[a] - 1) as f64 + 1e-9), "{last:?}");
        }
    }
}
