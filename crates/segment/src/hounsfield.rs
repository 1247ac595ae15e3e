//! Whether the values can be Hounsfield units of a whole patient at all.

use crate::Error;
use crate::frame::Frame;
use rayon::prelude::*;
use supine_record::QualityCheck;
use supine_volume::Ct;

// But for the share of air, chosen, not measured.
/// Values below are padding; air and lung lie between this and the level of tissue, HU.
const PADDING_HU: i16 = -1100;
const TISSUE_HU: i16 = -300;
/// Air and lung take at least this share of a CT of the chest. Measured: 0.47 to 0.84.
const AIR_SHARE: f64 = 0.05;
/// The air around the patient lies below this, HU.
const AIR_HU: i16 = -700;
/// A slice with less than this share of the usual tissue between fuller ones is an empty slice.
const EMPTY_SHARE: f64 = 0.15;

/// Gives what was measured.
///
/// # Errors
/// [`Error::Uniform`], [`Error::NotHounsfield`] or [`Error::EmptySlices`].
pub(crate) fn check(ct: &Ct, frame: &Frame) -> Result<Vec<QualityCheck>, Error> {
    let first = ct.data()[0];
    if ct.data().par_iter().all(|&v| v == first) {
        return Err(Error::Uniform { value: first });
    }
    let plane = frame.plane();
    let slices: Vec<Slice> = ct.data().par_chunks(plane).map(Slice::new).collect();
    let sum = |of: fn(&Slice) -> usize| slices.iter().map(of).sum::<usize>() as f64;
    let (air, tissue) = (sum(|s| s.air.iter().sum()), sum(|s| s.tissue));
    let share = 100.0 * air / (air + tissue).max(1.0);
    if air < AIR_SHARE * (air + tissue) {
        return Err(Error::NotHounsfield {
            why: format!("{share:.0} % of the values are those of air or lung"),
        });
    }
    let bins = (0..AIR_BINS).map(|b| slices.iter().map(|s| s.air[b]).sum::<usize>());
    let mode = bins.enumerate().max_by_key(|&(b, n)| (n, std::cmp::Reverse(b)));
    let mode = mode.map_or(0, |(b, _)| i32::from(PADDING_HU) + BIN_HU as i32 * b as i32);
    if mode >= i32::from(AIR_HU) {
        return Err(Error::NotHounsfield { why: format!("most of the air is at {mode}") });
    }
    gap(&slices)?;
    Ok(vec![
        QualityCheck::at_least("air and lung, share of the CT", share, "%")
            .refuses(100.0 * AIR_SHARE),
        QualityCheck::at_most("commonest value of air", mode.into(), "HU").refuses(AIR_HU.into()),
    ])
}

/// Slices without a patient between slices with one.
fn gap(slices: &[Slice]) -> Result<(), Error> {
    let mut counts: Vec<usize> = slices.iter().map(|s| s.tissue).collect();
    counts.sort_unstable();
    let usual = counts[counts.len() / 2] as f64;
    let full = |s: &Slice| s.tissue as f64 > EMPTY_SHARE * usual;
    let (first, last) = (slices.iter().position(full), slices.iter().rposition(full));
    let (Some(first), Some(last)) = (first, last) else { return Ok(()) };
    let empty: Vec<usize> = (first..last).filter(|&k| !full(&slices[k])).collect();
    match (empty.first(), empty.last()) {
        (Some(&from), Some(&to)) => Err(Error::EmptySlices { first: from, last: to }),
        _ => Ok(()),
    }
}

const BIN_HU: usize = 20;
const AIR_BINS: usize = (TISSUE_HU as isize - PADDING_HU as isize) as usize / BIN_HU;

/// What a slice holds.
struct Slice {
    air: [usize; AIR_BINS],
    tissue: usize,
}

impl Slice {
    fn new(values: &[i16]) -> Self {
        let mut out = Self { air: [0; AIR_BINS], tissue: 0 };
        for &v in values {
            if v >= TISSUE_HU {
                out.tissue += 1;
            } else if v >= PADDING_HU {
                out.air[(i32::from(v) - i32::from(PADDING_HU)) as usize / BIN_HU] += 1;
            }
        }
        out
    }
}
