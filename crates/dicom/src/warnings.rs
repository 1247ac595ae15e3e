//! Warnings of several parts of a series, and how they are written.

use crate::padding::Padding;
use crate::pixel_format::{Frame, Rescale};
use crate::slice::Slice;
use serde::{Serializer, ser::SerializeSeq as _};
use std::collections::BTreeMap;
use supine_space::Warning;

/// Most slices that are named in one warning.
const MOST_NAMED: usize = 5;
/// Values above this are those of tissue, HU.
const TISSUE_HU: i16 = -300;

/// Each warning once, in the order of their texts: slices say the same again and again.
pub(crate) fn distinct(warnings: impl IntoIterator<Item = Warning>) -> Vec<Warning> {
    let by_text: BTreeMap<String, Warning> =
        warnings.into_iter().map(|warning| (warning.to_string(), warning)).collect();
    by_text.into_values().collect()
}

/// Writes warnings as their texts.
pub(crate) fn texts<S: Serializer>(warnings: &[Warning], serializer: S) -> Result<S::Ok, S::Error> {
    let mut texts = serializer.serialize_seq(Some(warnings.len()))?;
    for warning in warnings {
        texts.serialize_element(&warning.to_string())?;
    }
    texts.end()
}

/// What the headers of a series say that no one of them says alone, behind what each says.
pub(crate) fn of_series(slices: &[&Slice]) -> Vec<Warning> {
    let mut warnings = distinct(slices.iter().flat_map(|slice| slice.warnings.iter().cloned()));
    let mut warn = |code, text: String| warnings.push(Warning::new(code, text));
    if let Some(text) = different_rescales(slices) {
        warn("rescale-per-slice", text);
    }
    let whole =
        |Rescale { slope, intercept }: Rescale| slope.fract() == 0.0 && intercept.fract() == 0.0;
    if slices.iter().any(|slice| !whole(slice.rescale)) {
        let text = "the rescale is not whole-numbered; HU were rounded to integers";
        warn("rescale-rounded", text.into());
    }
    if let Some(text) = shared_instance(slices) {
        warn("instance-uid-twice", text);
    }
    warnings
}

/// What the voxels of a series say: those without measurement, and those that were clipped.
pub(crate) fn of_values(padding: &Padding, clipped: usize) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if padding.len() > 0 {
        let text =
            "voxels hold no measurement (padding, or below -1024 HU); they are taken for air";
        warnings.push(Warning::new("padding-as-air", format!("{} {text}", padding.len())));
    }
    let tissue = || padding.runs().filter(|(_, hu)| *hu > TISSUE_HU);
    if let Some((_, hu)) = tissue().next() {
        let voxels: usize = tissue().map(|(range, _)| range.len()).sum();
        let text = format!(
            "{voxels} voxels of the values of tissue ({hu} HU) are marked as padding by Pixel Padding Value and were \
             taken for air: is that value right?"
        );
        warnings.push(Warning::new("padding-in-tissue", text));
    }
    if clipped > 0 {
        let text = format!("{clipped} voxels were clipped to 16 bits");
        warnings.push(Warning::new("clipped-to-16-bits", text));
    }
    warnings
}

/// Two files that bear one SOP Instance UID: archives keep only one of them.
fn shared_instance(slices: &[&Slice]) -> Option<String> {
    let mut seen = BTreeMap::new();
    // Frames of one file are one instance.
    let mut single = slices.iter().filter(|slice| slice.frame == Frame::ONLY);
    single.find_map(|Slice { file, instance, .. }| {
        let other = seen.insert(instance, file)?;
        Some(format!(
            "{other} and {file} bear the same SOP Instance UID: archives keep one of them"
        ))
    })
}

/// What is said where slices have different rescales. Some scanners give each its own; a few that
/// differ from all others may be a fault and are named.
fn different_rescales(slices: &[&Slice]) -> Option<String> {
    let mut groups: Vec<(Rescale, Vec<&str>)> = Vec::new();
    for slice in slices {
        match groups.iter_mut().find(|(rescale, _)| *rescale == slice.rescale) {
            Some((_, files)) => files.push(&slice.file),
            None => groups.push((slice.rescale, vec![&slice.file])),
        }
    }
    groups.sort_by_key(|(_, files)| std::cmp::Reverse(files.len()));
    let told = "the rescale differs from slice to slice; it was applied per slice";
    let line = |of: &Rescale| format!("{} x value + {}", of.slope, of.intercept);
    match groups.as_slice() {
        [] | [_] => None,
        [(usual, _), (odd, files)] if files.len() <= MOST_NAMED => {
            let (files, odd, usual) = (files.join(", "), line(odd), line(usual));
            Some(format!("{told}: {files} has HU = {odd}, all others {usual}"))
        }
        _ => Some(told.into()),
    }
}
