//! The CT as it is, on another grid.

use crate::filter;
use crate::kernel::Source;
use crate::{Error, Params};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Grid, Point, Progress, Stopped};
use supine_volume::{Ct, Volume};

/// `ct` on `grid`: itself where that is its own; air outside it.
pub(crate) fn onto(
    grid: &Grid,
    ct: &Ct,
    params: &Params,
    progress: Progress<'_>,
) -> Result<Ct, Error> {
    if grid == ct.grid() {
        return Ok(ct.clone());
    }
    let source = Source::new(ct.data(), ct.grid().size());
    let voxel = |grid: &Grid| grid.spacing().product();
    let samples = filter::samples(voxel(ct.grid()) / voxel(grid), params.supersample_below);
    let at = |place: [f64; 3]| {
        let within = (0..3).all(|a| place[a] >= -0.5 && place[a] <= source.size()[a] as f64 - 0.5);
        let value = || filter::value(&source, params.interpolation, place);
        if within { value() } else { f64::from(params.air_hu) }
    };
    let mut out = Volume::from_fn(grid.clone(), |_| params.air_hu);
    let [ni, nj, nk] = grid.size();
    let done = AtomicUsize::new(0);
    let slices = out.data_mut().par_chunks_mut(ni * nj).enumerate();
    slices.try_for_each(|(k, slice)| -> Result<(), Stopped> {
        for (n, value) in slice.iter_mut().enumerate() {
            let index = [n % ni, n / ni, k].map(|n| n as f64);
            let inner = filter::offsets(samples).map(|d| [0, 1, 2].map(|a| index[a] + d[a]));
            let place = |p: [f64; 3]| -> Point { grid.patient_from_index(p) };
            let sum: f64 = inner.map(|p| at(ct.grid().index_from_patient(&place(p)))).sum();
            *value = (sum / samples.pow(3) as f64).round_ties_even() as i16;
        }
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.at(done as f64 / nk as f64)
    })?;
    Ok(out)
}
