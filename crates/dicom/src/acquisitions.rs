//! Slices of several acquisitions in one series.

use crate::error::Error;
use crate::slice::Slice;
use std::collections::BTreeSet;
use supine_volume::median;

/// What two slices differ in that tells acquisitions apart.
pub(crate) fn differing_acquisition<'a>(
    a: &'a Slice,
    b: &'a Slice,
) -> impl Iterator<Item = (&'static str, &'a String, &'a String)> {
    let pairs = a.acquisition.iter().zip(&b.acquisition);
    pairs.filter(|(x, y)| x.1 != y.1).map(|(x, y)| (x.0, &x.1, &y.1))
}

/// Checks that slices, ascending along their normal, do not take turns between acquisitions.
pub(crate) fn in_order(places: &[f64], slices: &[&Slice]) -> Result<(), Error> {
    let Err(alternating) = not_interleaved(slices) else { return Ok(()) };
    Err(joined(places, slices).unwrap_or(alternating))
}

/// Slices of several acquisitions may follow each other, station by station, but not alternate:
/// they would make a volume that nobody scanned.
fn not_interleaved(slices: &[&Slice]) -> Result<(), Error> {
    for n in 0..slices[0].acquisition.len() {
        let value = |slice: &Slice| slice.acquisition[n].1.clone();
        let mut ended = BTreeSet::new();
        for pair in slices.windows(2).filter(|pair| value(pair[0]) != value(pair[1])) {
            let [value_a, value_b] = [value(pair[0]), value(pair[1])];
            ended.insert(value_a.clone());
            if ended.contains(&value_b) {
                let (attribute, a, b) =
                    (pair[0].acquisition[n].0, pair[0].file.clone(), pair[1].file.clone());
                let values = format!("is {value_a:?} and {value_b:?}");
                return Err(Error::SeveralAcquisitions { attribute, a, b, values });
            }
        }
    }
    Ok(())
}

/// Where acquisitions that follow each other share a place, the slice of the one may come to lie
/// within the other: that is no alternation, for without one of the two all is in order.
fn joined(places: &[f64], slices: &[&Slice]) -> Option<Error> {
    let steps: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let half = 0.5 * median(&mut steps.clone())?;
    let twice: Vec<usize> = (0..steps.len()).filter(|&n| steps[n] < half).collect();
    // One such place for each join.
    if twice.is_empty() || twice.len() >= acquisitions(slices) {
        return None;
    }
    let apart_mm = steps[twice[0]];
    let without = |upper: usize| {
        let left_out: Vec<usize> = twice.iter().map(|n| n + upper).collect();
        let rest = (0..slices.len()).filter(|n| !left_out.contains(n)).map(|n| slices[n]);
        let sound = not_interleaved(&rest.collect::<Vec<_>>()).is_ok();
        sound.then(|| left_out.iter().map(|&n| slices[n].file.as_str()).collect::<Vec<_>>())
    };
    let files = without(1).or_else(|| without(0))?;
    let [a, b] = [slices[twice[0]], slices[twice[0] + 1]];
    let (attribute, x, y) = differing_acquisition(a, b).next()?;
    Some(Error::JoinedAcquisitions {
        a: a.file.clone(),
        b: b.file.clone(),
        differ: format!("{attribute} is {x:?} and {y:?}"),
        apart_mm,
        exclude: excluding(&files),
    })
}

/// How many acquisitions the slices name.
fn acquisitions(slices: &[&Slice]) -> usize {
    let names: BTreeSet<_> = slices.iter().map(|slice| &slice.acquisition).collect();
    names.len()
}

/// Files left out, as the case file and the command line say it.
pub(crate) fn excluding(files: &[&str]) -> String {
    format!("exclude = {files:?} in the case file, or --exclude of warp, segment and carry")
}
