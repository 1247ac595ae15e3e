//! The patient's own doses, structures and segmentations, before and after, as arrays.

use crate::arrays::{self, VolumeParts};
use numpy::PyArray2;
use pyo3::prelude::*;
use std::sync::Arc;
use supine_flow::{Contours, OwnObjects};

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
    let (mut doses, mut structures, mut segments) = (vec![], vec![], vec![]);
    let Some(all) = all.map(Arc::new) else { return Ok((doses, structures, segments)) };
    for (n, dose) in all.doses().enumerate().filter(|(_, dose)| dose.after.is_some()) {
        let before = arrays::held_volume(py, &all, |all| Some(all.doses().nth(n)?.before))?;
        let after = arrays::held_volume(py, &all, |all| all.doses().nth(n)?.after)?;
        doses.push((dose.file.into(), before, after));
    }
    for one in all.structures() {
        let (Some([before_ml, after_ml]), Some(after)) = (one.volume_ml, one.after) else {
            continue;
        };
        let (before, after) = (lines(py, one.before)?, lines(py, after)?);
        structures.push((one.file.into(), one.name.into(), before, after, (before_ml, after_ml)));
    }
    for (n, one) in all.segments().enumerate() {
        let Some([before_ml, after_ml]) = one.volume_ml else { continue };
        let before = arrays::volume(py, Arc::new(one.before()))?;
        let after = arrays::held_volume(py, &all, |all| all.segments().nth(n)?.after)?;
        segments.push((one.file.into(), one.name.into(), before, after, (before_ml, after_ml)));
    }
    Ok((doses, structures, segments))
}

fn lines<'py>(py: Python<'py>, contours: &Contours) -> PyResult<Lines<'py>> {
    contours.iter().map(|contour| arrays::points(py, contour)).collect()
}
