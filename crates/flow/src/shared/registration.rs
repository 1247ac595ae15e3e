//! The map as DICOM registrations between the CT and its deformed export.

use crate::Error;
use std::path::Path;
use supine_dicom::{CompanionParams, ReadParams, Source, write_chest_wall, write_deformable};
use supine_mesh::Deformation;
use supine_report::Registration;
use supine_space::{Grid, Progress, Vector};
use supine_volume::Volume;
use supine_warp::{Fields, Origin, Origins, Params, interpolation_error};

/// The file of the deformable registration, within its folder.
pub(crate) const DEFORMABLE: &str = "deformable.dcm";
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

/// Writes `deformable.dcm` and `chest-wall.dcm` into `folder`: registrations of an exported series with the CT it was
/// made from.
///
/// `deformation` as the solver gave it, `fields` those of it on the CT's grid, by which the vectors are judged. The vectors
/// lie on a coarser grid around what moves; beyond it nothing does. Around the tissue, as far as a cell of the
/// grid reaches, they follow the skin, so that the tissue beside it is interpolated between vectors of its own; where tissue was
/// and now is air, they lead to air as well, so that the vectors alone leave no ghost of it.
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
    let layer_mm = 1.01 * grid.spacing().norm();
    let part = progress.part(0.3, 0.9);
    let origins = Origins::new(&grid, deformation, &Params::default(), layer_mm, part)?;
    let vectors = moving(filled(&origins));
    let error = interpolation_error(&vectors, fields);
    std::fs::create_dir_all(folder)
        .map_err(|source| Error::Output { path: folder.into(), source })?;
    write(&vectors, source, &deformed, folder)?;
    progress.at(1.0)?;
    Ok(Registration {
        folder: "registration".into(),
        grid: vectors.grid().size(),
        spacing_mm: vectors.grid().spacing().into(),
        voxels: error.as_ref().map_or(0, |e| e.voxels),
        mean_mm: error.as_ref().map_or(0.0, |e| e.mean_mm),
        p99_mm: error.as_ref().map_or(0.0, |e| e.p99_mm),
        max_mm: error.as_ref().map_or(0.0, |e| e.max_mm),
    })
}

/// The vectors of origins; where tissue left, that of the nearest place that has one.
fn filled(origins: &Origins) -> Volume<[f32; 3]> {
    let vector = |origin| match origin {
        Origin::Here | Origin::Vacated => None,
        Origin::Tissue(to) | Origin::Beside(to) | Origin::BesideVacated(to) => Some(to),
    };
    let grid = origins.grid();
    let mut known = Volume::from_fn(grid.clone(), |voxel| vector(origins.at(voxel)));
    let left = |n: &usize| matches!(origins.at(grid.voxel(*n)), Origin::Vacated);
    let mut open: Vec<usize> = (0..grid.len()).filter(left).collect();
    loop {
        // All of a round rest on the round before: the order does not matter.
        let found: Vec<(usize, [f32; 3])> =
            open.iter().filter_map(|&n| Some((n, beside(&known, grid.voxel(n))?))).collect();
        if found.is_empty() {
            break;
        }
        for (n, to) in found {
            known.data_mut()[n] = Some(to);
        }
        open.retain(|&n| known.data()[n].is_none());
    }
    known.map(|to| to.unwrap_or([0.0; 3]))
}

/// The vector of the nearest neighbour that has one.
fn beside(known: &Volume<Option<[f32; 3]>>, voxel: [usize; 3]) -> Option<[f32; 3]> {
    let size = known.grid().size();
    let steps = (0..27).map(|n: usize| [n % 3, n / 3 % 3, n / 9]);
    let mut nearest: Option<(usize, [f32; 3])> = None;
    for step in steps {
        let at = [0, 1, 2].map(|a| (voxel[a] + step[a]).wrapping_sub(1));
        let away = step.iter().filter(|s| **s != 1).count();
        let better = nearest.is_none_or(|(best, _)| away < best);
        if better && (0..3).all(|a| at[a] < size[a]) {
            nearest = known.at(at).map(|to| (away, to)).or(nearest);
        }
    }
    nearest.map(|(_, to)| to)
}

/// The part around the vectors that are not 0, one place wider; of vectors that all are, the first places.
fn moving(vectors: Volume<[f32; 3]>) -> Volume<[f32; 3]> {
    let grid = vectors.grid();
    let (mut low, mut high) = (grid.size(), [0; 3]);
    for (n, _) in vectors.data().iter().enumerate().filter(|(_, to)| **to != [0.0; 3]) {
        let voxel = grid.voxel(n);
        low = [0, 1, 2].map(|a| low[a].min(voxel[a]));
        high = [0, 1, 2].map(|a| high[a].max(voxel[a]));
    }
    let low = [0, 1, 2].map(|a| low[a].min(high[a]).saturating_sub(1));
    let size = [0, 1, 2].map(|a| (high[a] + 2).min(grid.size()[a]) - low[a]);
    match grid.crop(low, size) {
        Ok(part) => Volume::from_fn(part, |at| vectors.at([0, 1, 2].map(|a| at[a] + low[a]))),
        Err(_) => vectors,
    }
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
    let path = folder.join("chest-wall.dcm");
    let named = params("CHEST WALL ONLY registration [supine]");
    write_chest_wall(source, deformed, &named, &path).map_err(Error::Export)?;
    Ok(())
}

/// A grid that covers the CT, its first place on the first voxel: vectors [`PIXELS`] pixels apart in a slice and as far, or
/// in every slice where those lie further apart, along the normal.
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
