//! A dose that was carried along, as the same kind of object of the exported CT.

use super::{Dose, read_dose};
use crate::companion::{
    CompanionParams, Kind, ObjectReference, common, item, put_derivation, put_texts, same_patient,
    write,
};
use crate::data_set::{DataSet, Value};
use crate::derived::copy;
use crate::error::Error;
use crate::number::{format_ds, parse_ds};
use crate::series::Place;
use crate::source::Source;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};
use std::path::Path;
use supine_space::{Grid, Warning};
use supine_volume::Volume;

/// What a reader of the object is told, besides the derivation.
const COMMENT: &str = "carried with the tissue, not recalculated";
const KIND: Kind = Kind { class: uids::RT_DOSE_STORAGE, modality: "RTDOSE", role: "dose" };
/// What the dose means, as its source says it.
const MEANING: &[Tag] = &[
    tags::DOSE_TYPE,
    tags::DOSE_SUMMATION_TYPE,
    tags::TISSUE_HETEROGENEITY_CORRECTION,
    tags::REFERENCED_RT_PLAN_SEQUENCE,
];

/// What was written.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct DoseInfo {
    /// The object.
    pub object: ObjectReference,
    /// Dose Grid Scaling: the step of the stored values, Gy.
    pub step_gy: f64,
    /// Largest difference of a dose that was read back, Gy.
    pub error_gy: f64,
    /// What a user must know before trusting it.
    #[serde(serialize_with = "crate::warnings::texts")]
    pub warnings: Vec<Warning>,
}

/// Writes a dose after deformation (Gy) as an RT dose of the exported CT into the file `path`.
///
/// 32 bits unsigned. Dose Type, Dose Summation Type and the Referenced RT Plan are those of `from`:
/// no plan is made up. Frame of reference, patient and study are those of `ct`, and all says that
/// the dose was moved and not computed anew: Image Type, Derivation, Dose Comment, Spatial
/// Transform of Dose NON_RIGID with the `registration` (PS3.3 C.8.8.3). Histograms and the
/// normalisation point, which no longer hold, are left out. UIDs are 2.25 from the hash of all that
/// is written. The file appears only when it was read back equal.
///
/// # Errors
/// When the dose is of another patient than the CT, negative or not finite, a text does not fit its
/// attribute, or the file cannot be written or does not read back. Nothing is left then.
pub fn write_dose(
    dose: &Volume<f32>,
    from: &Dose,
    ct: &Source,
    params: &CompanionParams,
    registration: Option<&ObjectReference>,
    path: &Path,
) -> Result<DoseInfo, Error> {
    same_patient(&from.file, &from.header, ct)?;
    let mut warnings = Vec::new();
    let mut set = common(ct, params, (&KIND, Place::Dose(params.before)))?;
    put_derivation(&mut set, params, ct, &from.header);
    for &tag in MEANING {
        copy(&mut set, tag, &from.header);
    }
    if set.items(tags::REFERENCED_RT_PLAN_SEQUENCE).is_empty() {
        let text = "the dose names no plan (Referenced RT Plan); some systems refuse that";
        warnings.push(Warning::new("dose-without-plan", text));
    }
    put_texts(
        &mut set,
        &[
            (tags::OPERATORS_NAME, VR::PN, ""),
            (tags::CONTENT_DATE, VR::DA, &params.clock.date),
            (tags::CONTENT_TIME, VR::TM, &params.clock.time),
            (tags::DOSE_UNITS, VR::CS, "GY"),
            (tags::DOSE_COMMENT, VR::LO, COMMENT),
            (tags::SPATIAL_TRANSFORM_OF_DOSE, VR::CS, "NON_RIGID"),
        ],
    );
    let by = registration.map(|r| item(&r.class_uid, &r.instance_uid));
    if by.is_none() {
        let text = "the dose names no registration: there is none beside the CT";
        warnings.push(Warning::new("dose-without-registration", text));
    }
    set.put_items(tags::REFERENCED_SPATIAL_REGISTRATION_SEQUENCE, by.into_iter().collect());
    put_grid(&mut set, dose.grid())?;
    let step_gy = put_values(&mut set, dose.data())?;
    let mut error_gy = 0.0;
    let object = write(set, params, &KIND, path, |written| {
        let read = read_dose(written).map_err(|e| e.to_string())?;
        error_gy = difference(read.volume(), dose, step_gy)?;
        Ok(())
    })?;
    Ok(DoseInfo { object, step_gy, error_gy, warnings })
}

/// Position, orientation and spacing; planes by offsets from the first (form a of PS3.3 C.8.8.3.2).
fn put_grid(set: &mut DataSet, grid: &Grid) -> Result<(), Error> {
    if grid.direction().determinant() < 0.0 {
        let reason = "its planes do not follow each other along row x column direction".into();
        return Err(Error::OtherGrid { reason });
    }
    let ([columns, rows, frames], spacing) = (grid.size(), grid.spacing());
    let joined = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|v| format_ds(*v)).collect();
        texts.join("\\")
    };
    let [row, column] = [0, 1].map(|axis| grid.direction().column(axis).into_owned());
    let cosines = [row.as_slice(), column.as_slice()].concat();
    let offsets: Vec<f64> = (0..frames).map(|k| k as f64 * spacing.z).collect();
    put_texts(
        set,
        &[
            (tags::IMAGE_POSITION_PATIENT, VR::DS, &joined(grid.origin().coords.as_slice())),
            (tags::IMAGE_ORIENTATION_PATIENT, VR::DS, &joined(&cosines)),
            (tags::PIXEL_SPACING, VR::DS, &joined(&[spacing.y, spacing.x])),
            (tags::SLICE_THICKNESS, VR::DS, &format_ds(spacing.z)),
            (tags::NUMBER_OF_FRAMES, VR::IS, &frames.to_string()),
            (tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, &joined(&offsets)),
        ],
    );
    let Tag(group, element) = tags::GRID_FRAME_OFFSET_VECTOR;
    let pointer = [group.to_le_bytes(), element.to_le_bytes()].concat();
    set.put(tags::FRAME_INCREMENT_POINTER, VR::AT, Value::Bytes(pointer));
    for (tag, size) in [(tags::ROWS, rows), (tags::COLUMNS, columns)] {
        let Ok(size) = u16::try_from(size) else {
            return Err(Error::OtherGrid { reason: format!("{size} voxels along an axis") });
        };
        set.put_u16(tag, VR::US, size);
    }
    Ok(())
}

/// Stored values and their step, which is rounded to a decimal string first (PS3.3 C.8.8.3.4).
fn put_values(set: &mut DataSet, gy: &[f32]) -> Result<f64, Error> {
    if gy.iter().any(|d| !d.is_finite() || *d < 0.0) {
        let reason = "a voxel is negative or not finite".into();
        return Err(Error::Text { attribute: "dose", reason });
    }
    let most = gy.iter().copied().fold(0.0, f32::max);
    let (text, step) = scaling(f64::from(most));
    let stored = |d: &f32| (f64::from(*d) / step).round() as u32;
    let bytes = gy.iter().flat_map(|d| stored(d).to_le_bytes()).collect();
    for (tag, number) in [
        (tags::SAMPLES_PER_PIXEL, 1),
        (tags::BITS_ALLOCATED, 32),
        (tags::BITS_STORED, 32),
        (tags::HIGH_BIT, 31),
        (tags::PIXEL_REPRESENTATION, 0),
    ] {
        set.put_u16(tag, VR::US, number);
    }
    set.put_text(tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2");
    set.put_text(tags::DOSE_GRID_SCALING, VR::DS, &text);
    set.put(tags::PIXEL_DATA, VR::OW, Value::Bytes(bytes));
    Ok(step)
}

/// The finest step, as it is written and as it is read, by which `most` still fits 31 bits: some
/// readers take the stored values for signed ones.
pub(super) fn scaling(most: f64) -> (String, f64) {
    let full = f64::from(i32::MAX);
    let mut step = if most > 0.0 { most / full } else { 1.0 / full };
    loop {
        let text = format_ds(step);
        let read = parse_ds(&text).unwrap_or(step);
        if read > 0.0 && (most / read).round() <= full {
            return (text, read);
        }
        // The written digits rounded it down.
        step *= 1.0 + 1e-9;
    }
}

/// The largest difference, Gy; an error when it is more than half a step and the rounding of f32.
fn difference(read: &Volume<f32>, meant: &Volume<f32>, step_gy: f64) -> Result<f64, String> {
    let (a, b) = (read.grid(), meant.grid());
    if a.size() != b.size() {
        return Err("the grid differs".into());
    }
    let last = a.size().map(|n| n - 1);
    let off = [[0; 3], last].map(|v| (a.centre(v) - b.centre(v)).norm());
    if off.iter().any(|mm| *mm > 1e-6) {
        return Err(format!("the grid lies {off:?} mm off"));
    }
    let mut most = 0.0f64;
    for (n, (x, y)) in read.data().iter().zip(meant.data()).enumerate() {
        let (x, y) = (f64::from(*x), f64::from(*y));
        if (x - y).abs() > 0.5001 * step_gy + 1.2e-7 * y {
            return Err(format!("voxel {n} is {x} Gy, {y} was meant"));
        }
        most = most.max((x - y).abs());
    }
    Ok(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_what_is_written_and_the_maximum_fits() {
        let mut most = 1e-6;
        while most < 1e4 {
            let (text, step) = scaling(most);
            assert_eq!(parse_ds(&text), Some(step), "{text}");
            assert!(text.len() <= 16 && (most / step).round() <= f64::from(i32::MAX), "{text}");
            assert!(step < 1.001 * most / f64::from(i32::MAX), "{most}: {text}");
            most *= 1.37;
        }
        assert!(scaling(0.0).1 > 0.0);
    }
}
