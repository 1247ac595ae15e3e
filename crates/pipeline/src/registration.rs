//! The map as DICOM registrations between the CT and its deformed export.

use crate::RunError;
use rayon::prelude::*;
use std::path::Path;
use supine_dicom::{CompanionParams, ReadParams, Source, write_chest_wall, write_deformable};
use supine_mesh::{Displacement, TetMesh};
use supine_report::Registration;
use supine_space::{Grid, Progress, Vector};
use supine_volume::Volume;
use supine_warp::{Fields, Origin, Origins, Params, fields};

/// Vectors lie this many pixels apart.
const PIXELS: f64 = 2.0;
/// Most vectors: 96 MiB in the file.
const MOST: usize = 8 << 20;

/// Writes `deformable.dcm` and `chest-wall.dcm` into `folder`: registrations of the `exported` series with
/// the CT it was made from, of which `source` says what may be said, on whose grid `ct` it lies.
///
/// `map` is the mesh with the displacement as the solver gave it. The vectors lie on a coarser grid that covers the whole CT and
/// are 0 where nothing moved. Around the tissue, as far as a cell of the grid reaches, they follow
/// the skin, so that the tissue beside it is interpolated between vectors of its own.
///
/// # Errors
/// When the exported series cannot be read, or a file cannot be written.
pub fn write_registration(
    ct: &Grid,
    (source, exported): (&Source, impl AsRef<Path>),
    map: (&TetMesh, &Displacement),
    folder: &Path,
    progress: Progress<'_>,
) -> Result<Registration, RunError> {
    let (exported, series) = (exported.as_ref(), ReadParams::default());
    let (_, deformed, _) = supine_dicom::read_series(exported, &series, progress.part(0.0, 0.2))
        .map_err(RunError::Export)?;
    let params = Params::default();
    let grid = coarse(ct);
    let layer_mm = 1.01 * grid.spacing().norm();
    let origins = Origins::new(&grid, map, &params, layer_mm, progress.part(0.2, 0.5))?;
    let vectors = Volume::from_fn(grid, |voxel| match origins.at(voxel) {
        Origin::Here | Origin::Vacated => [0.0; 3],
        Origin::Tissue(to) | Origin::Beside(to) | Origin::BesideVacated(to) => to,
    });
    let exact = fields(ct, map.0, map.1, &params, progress.part(0.5, 0.8))?;
    let facts = compared(&vectors, &exact);
    std::fs::create_dir_all(folder)
        .map_err(|source| RunError::Output { path: folder.into(), source })?;
    write(&vectors, (source, &deformed), folder)?;
    progress.at(1.0)?;
    Ok(facts)
}

fn write(
    vectors: &Volume<[f32; 3]>,
    (source, deformed): (&Source, &Source),
    folder: &Path,
) -> Result<(), RunError> {
    let params = |description: &str| CompanionParams {
        series_description: description.into(),
        derivation: "DERIVED: map of a simulated deformation".into(),
        clock: source.clock(),
        software_version: env!("CARGO_PKG_VERSION").into(),
    };
    let path = folder.join("deformable.dcm");
    let named = params("DEFORMED to CT registration [supine]");
    write_deformable(vectors, source, deformed, &named, &path).map_err(RunError::Export)?;
    let path = folder.join("chest-wall.dcm");
    let named = params("CHEST WALL ONLY registration [supine]");
    write_chest_wall(source, deformed, &named, &path).map_err(RunError::Export)?;
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
            places.iter().product::<usize>() <= MOST,
            Grid::new(places, wide, ct.origin(), *ct.direction()),
        ) {
            return grid;
        }
        apart *= 1.25;
    }
}

/// What a reader that interpolates linearly gets at the voxels of the deformed tissue, against the map itself.
fn compared(vectors: &Volume<[f32; 3]>, exact: &Fields) -> Registration {
    let truth = &exact.deformed_to_ct;
    let off = |(n, to): (usize, &[f32; 3])| {
        if *to == [0.0; 3] {
            return None;
        }
        let at = truth.grid().centre(truth.grid().voxel(n));
        let to = Vector::from(to.map(f64::from));
        Some((between(vectors, vectors.grid().index_from_patient(&at)) - to).norm())
    };
    let mut off: Vec<f64> = truth.data().par_iter().enumerate().filter_map(off).collect();
    off.par_sort_unstable_by(f64::total_cmp);
    let count = off.len().max(1);
    Registration {
        folder: "registration".into(),
        grid: vectors.grid().size(),
        spacing_mm: vectors.grid().spacing().into(),
        voxels: off.len(),
        mean_mm: off.iter().sum::<f64>() / count as f64,
        p99_mm: off.get((count - 1) * 99 / 100).copied().unwrap_or(0.0),
        max_mm: off.last().copied().unwrap_or(0.0),
    }
}

/// The vector at a continuous index, trilinear.
fn between(vectors: &Volume<[f32; 3]>, index: [f64; 3]) -> Vector {
    let size = vectors.grid().size();
    let low = [0, 1, 2].map(|a| index[a].floor().clamp(0.0, (size[a] - 2) as f64));
    let mut sum = Vector::zeros();
    for corner in 0..8 {
        let step = [0, 1, 2].map(|a| corner >> a & 1);
        let value = vectors.at([0, 1, 2].map(|a| low[a] as usize + step[a]));
        let share = (0..3).map(|a| {
            let t = (index[a] - low[a]).clamp(0.0, 1.0);
            if step[a] == 1 { t } else { 1.0 - t }
        });
        sum += Vector::from(value.map(f64::from)) * share.product::<f64>();
    }
    sum
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
            assert!(grid.len() <= MOST && grid.origin() == ct.origin());
            let last = grid.index_from_patient(&ct.centre(size.map(|n| n - 1)));
            assert!((0..3).all(|a| last[a] <= (grid.size()[a] - 1) as f64 + 1e-9), "{last:?}");
        }
    }

    #[test]
    fn linear_vectors_are_found_between_their_places() {
        let fine = ct([7, 6, 5], [1.0; 3]);
        let grid = coarse(&fine);
        let at = |p: Point| [p.x as f32, 0.5 * p.y as f32, -p.z as f32];
        let vectors = Volume::from_fn(grid.clone(), |v| at(grid.centre(v)));
        let p = fine.centre([5, 3, 4]);
        let found = between(&vectors, grid.index_from_patient(&p));
        assert!((found - Vector::from(at(p).map(f64::from))).norm() < 1e-6);
    }
}
