//! Reads a written file with another reader (dicom-object) and compares it with what was meant.

use crate::data_set::DataSet;
use crate::error::Error;
use crate::number::{parse_ds, parse_ds_list};
use crate::slice::Slice;
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, open_file};
use std::borrow::Cow;
use std::path::Path;

/// Compares identity, geometry and every voxel.
pub(super) fn check(path: &Path, meant: &DataSet, hu: &[i16], source: &Slice) -> Result<(), Error> {
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    compare(path, meant, hu, source).map_err(|reason| Error::ReadBack { file, reason })
}

fn compare(path: &Path, meant: &DataSet, hu: &[i16], source: &Slice) -> Result<(), String> {
    let object = open_file(path).map_err(|e| e.to_string())?;
    if object.meta().media_storage_sop_instance_uid.trim_end_matches('\0')
        != meant.text(tags::SOP_INSTANCE_UID)
    {
        return Err("its header names another SOP Instance UID".into());
    }
    for tag in [tags::SOP_INSTANCE_UID, tags::SERIES_INSTANCE_UID, tags::FRAME_OF_REFERENCE_UID] {
        if text(&object, tag)? != meant.text(tag) {
            return Err(format!("{tag} differs"));
        }
    }
    let position: [f64; 3] = numbers(&object, tags::IMAGE_POSITION_PATIENT)?;
    let [a, b, c, d, e, f] = numbers(&object, tags::IMAGE_ORIENTATION_PATIENT)?;
    let spacing: [f64; 2] = numbers(&object, tags::PIXEL_SPACING)?;
    let off = |x: &[f64], y: &[f64]| x.iter().zip(y).any(|(x, y)| (x - y).abs() > 1e-4);
    if off(&position, source.position.coords.as_slice())
        || off(&[a, b, c], source.row_direction.as_slice())
        || off(&[d, e, f], source.column_direction.as_slice())
        || off(&spacing, &[source.row_spacing, source.column_spacing])
    {
        return Err("position, orientation or spacing differs from the source".into());
    }
    same_hu(&object, hu, source)
}

fn same_hu(object: &DefaultDicomObject, hu: &[i16], source: &Slice) -> Result<(), String> {
    let number = |tag: Tag| -> Result<u16, String> {
        let element = object.element(tag).map_err(|e| e.to_string())?;
        element.to_int::<u16>().map_err(|e| e.to_string())
    };
    if (number(tags::ROWS)?, number(tags::COLUMNS)?) != (source.pixels.rows, source.pixels.columns)
    {
        return Err("the matrix differs".into());
    }
    let signed = number(tags::PIXEL_REPRESENTATION)? == 1;
    let mask = ((1u32 << number(tags::BITS_STORED)?) - 1) as u16;
    let one = |tag: Tag| parse_ds(&text(object, tag)?).ok_or_else(|| format!("{tag} is no number"));
    let (slope, intercept) = (one(tags::RESCALE_SLOPE)?, one(tags::RESCALE_INTERCEPT)?);
    let element = object.element(tags::PIXEL_DATA).map_err(|e| e.to_string())?;
    let samples: Cow<'_, [u16]> = match element.uint16_slice() {
        Ok(samples) => Cow::Borrowed(samples),
        Err(_) => Cow::Owned(element.to_multi_int().map_err(|e| e.to_string())?),
    };
    if samples.len() != hu.len() {
        return Err(format!("{} samples of pixels, {} are needed", samples.len(), hu.len()));
    }
    let hu_of = |sample: u16| {
        let stored = if signed { f64::from(sample as i16) } else { f64::from(sample & mask) };
        stored * slope + intercept
    };
    let wrong = |&(_, (sample, meant)): &(usize, (&u16, &i16))| hu_of(*sample) != f64::from(*meant);
    match samples.iter().zip(hu).enumerate().find(wrong) {
        Some((n, (&sample, meant))) => {
            Err(format!("voxel {n} is {} HU, {meant} was meant", hu_of(sample)))
        }
        None => Ok(()),
    }
}

fn text(object: &DefaultDicomObject, tag: Tag) -> Result<String, String> {
    let element = object.element(tag).map_err(|e| e.to_string())?;
    let text = element.to_str().map_err(|e| e.to_string())?;
    Ok(text.trim_matches([' ', '\0']).to_owned())
}

fn numbers<const N: usize>(object: &DefaultDicomObject, tag: Tag) -> Result<[f64; N], String> {
    let texts: Vec<String> = text(object, tag)?.split('\\').map(str::to_owned).collect();
    parse_ds_list(&texts).ok_or_else(|| format!("{tag} is not {N} numbers"))
}
