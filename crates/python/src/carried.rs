//! The patient's own doses, structures and segmentations, before and after, as arrays.

use crate::arrays::{self, Holder, VolumeParts};
use numpy::PyArray2;
use pyo3::prelude::*;
use std::sync::Arc;
use supine_flow::{Contours, OwnObjects};
use supine_volume::Volume;

/// Closed contours, each (n, 3), LPS, mm.
type Lines<'py> = Vec<Bound<'py, PyArray2<f64>>>;
/// The name of its file, before and after, Gy.
type Dose<'py> = (String, VolumeParts<'py>, VolumeParts<'py>);
/// The name of its file and its own, before and after, and both volumes, ml.
type Structure<'py> = (String, String, Lines<'py>, Lines<'py>, (f64, f64));
/// The same of voxels.
type Segment<'py> = (String, String, VolumeParts<'py>, VolumeParts<'py>, (f64, f64));
/// All of them, in the order of the case.
pub(crate) type CarriedParts<'py> = (Vec<Dose<'py>>, Vec<Structure<'py>>, Vec<Segment<'py>>);

/// Objects that were carried; nothing where the case names none.
///
/// # Errors
/// When Python has no memory.
pub(crate) fn carried(py: Python<'_>, all: Option<OwnObjects>) -> PyResult<CarriedParts<'_>> {
    let Some(all) = all else { return Ok((vec![], vec![], vec![])) };
    // The volumes lie in what the objects share.
    let holder = || Arc::new(all.clone()) as Holder;
    let lent = |volume: &Volume<f32>| arrays::held_volume(py, volume, holder());
    let doses = all.doses().filter_map(|dose| Some((dose.file, dose.before, dose.after?)));
    let doses = doses.map(|(file, before, after)| Ok((file.into(), lent(before)?, lent(after)?)));
    let structures = all.structures().filter_map(|one| {
        let ([before_ml, after_ml], after) = (one.volume_ml?, one.after?);
        Some((one.file, one.name, one.before, after, (before_ml, after_ml)))
    });
    let structures = structures.map(|(file, name, before, after, ml)| {
        Ok((file.into(), name.into(), lines(py, before)?, lines(py, after)?, ml))
    });
    let segments = all.segments().filter_map(|one| {
        let ([before_ml, after_ml], after) = (one.volume_ml?, one.after?);
        Some((one.file, one.name, one.before, after, (before_ml, after_ml)))
    });
    let segments = segments.map(|(file, name, before, after, ml)| {
        let before = arrays::volume(py, Arc::new(before))?;
        Ok((file.into(), name.into(), before, arrays::held_volume(py, after, holder())?, ml))
    });
    let doses = doses.collect::<PyResult<_>>()?;
    Ok((doses, structures.collect::<PyResult<_>>()?, segments.collect::<PyResult<_>>()?))
}

fn lines<'py>(py: Python<'py>, contours: &Contours) -> PyResult<Lines<'py>> {
    contours.iter().map(|contour| arrays::points(py, contour)).collect()
}
