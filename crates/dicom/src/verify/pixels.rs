//! Rules D: what the voxels say.

use super::histogram::Histogram;
use super::mirrors::mirrored;
use super::{Checks, Image, NEEDS_SOURCE, Reference};
use crate::number::parse_ds;
use crate::pixel_format::{PixelFormat, Rescale};
use crate::policy::Policy;
use dicom_dictionary_std::tags;
use rayon::prelude::*;

const PLAUSIBLE: &str =
    "D3 HU are plausible: 90 % in -1100..3500 without padding, none below -8192";
const HIGH_BITS: &str = "D4 nothing stands above Bits Stored but the sign";
const AGAINST_SOURCE: [&str; 5] = [
    "D5 HU stay within the source's range (interpolation cannot overshoot)",
    "D6 quartile, median and mean HU are near the source's",
    "D7 the border of the volume equals the source",
    "D8 every slice has more in common with its source slice than with that one's neighbours",
    "D9 the volume resembles the source more than any mirror image of it",
];

/// HU of the export, slices ascending along the normal.
struct Pixels {
    /// Columns, rows, slices.
    size: [usize; 3],
    hu: Vec<i16>,
    histogram: Histogram,
    /// Exact range, also where `hu` is clipped to 16 bits.
    range: [f64; 2],
}

pub(super) fn check(
    checks: &mut Checks,
    images: &[Image],
    order: &[usize],
    reference: Option<&Reference<'_>>,
    policy: Policy,
) {
    let faults: Vec<String> = images.iter().filter_map(pixel_fault).collect();
    checks.none_of("D1 pixel size, bits and rescale go together", &faults);
    let off: Vec<String> = images
        .iter()
        .filter(|i| i.text(tags::RESCALE_TYPE) != "HU")
        .map(|i| i.file.clone())
        .collect();
    checks.none_of("D2 Rescale Type is HU", &off);
    let pixels = if faults.is_empty() { decode(images, order) } else { None };
    let Some(pixels) = pixels else {
        let rules = [PLAUSIBLE, HIGH_BITS].into_iter().chain(AGAINST_SOURCE);
        rules.for_each(|rule| checks.skip(rule, "the pixels cannot be read as one volume"));
        return;
    };
    check_plausible(checks, &pixels);
    check_high_bits(checks, images);
    against_source(checks, &pixels, reference, policy);
}

fn format(image: &Image) -> Option<PixelFormat> {
    let number = |tag| image.set.u16(tag);
    Some(PixelFormat {
        rows: number(tags::ROWS)?,
        columns: number(tags::COLUMNS)?,
        bits_allocated: number(tags::BITS_ALLOCATED)?,
        bits_stored: number(tags::BITS_STORED)?,
        signed: number(tags::PIXEL_REPRESENTATION)? == 1,
    })
}

fn pixel_fault(image: &Image) -> Option<String> {
    let fault = |text: String| Some(format!("{}: {text}", image.file));
    let Some(format) = format(image) else { return fault("the pixel format is incomplete".into()) };
    let (allocated, stored) = (format.bits_allocated, format.bits_stored);
    let high = image.set.u16(tags::HIGH_BIT).unwrap_or(0);
    if allocated != 16 || !(12..=16).contains(&stored) || high + 1 != stored {
        return fault(format!("bits {allocated}/{stored}/{high}"));
    }
    if image.set.u16(tags::SAMPLES_PER_PIXEL) != Some(1)
        || image.text(tags::PHOTOMETRIC_INTERPRETATION) != "MONOCHROME2"
    {
        return fault("not one sample of MONOCHROME2".into());
    }
    let length = image.set.bytes(tags::PIXEL_DATA).map_or(0, <[u8]>::len);
    if length != format.bytes() {
        return fault(format!("{length} bytes of pixels, {} are needed", format.bytes()));
    }
    let slope = parse_ds(&image.text(tags::RESCALE_SLOPE));
    if slope.is_none_or(|s| s <= 0.0) || parse_ds(&image.text(tags::RESCALE_INTERCEPT)).is_none() {
        return fault("the rescale is missing or unusable".into());
    }
    None
}

fn samples(image: &Image) -> impl Iterator<Item = u16> {
    let bytes = image.set.bytes(tags::PIXEL_DATA).unwrap_or_default();
    bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
}

fn decode(images: &[Image], order: &[usize]) -> Option<Pixels> {
    let first = format(&images[0])?;
    let size = [first.columns.into(), first.rows.into(), order.len()];
    let mut hu = vec![0; size.iter().product()];
    let ranges: Vec<Option<[f64; 2]>> = order
        .par_iter()
        .zip(hu.par_chunks_mut(first.len().max(1)))
        .map(|(&n, hu)| {
            let image = &images[n];
            let format = format(image)?;
            if (format.rows, format.columns) != (first.rows, first.columns) {
                return None;
            }
            let rescale = Rescale {
                slope: parse_ds(&image.text(tags::RESCALE_SLOPE))?,
                intercept: parse_ds(&image.text(tags::RESCALE_INTERCEPT))?,
            };
            let table = rescale.table(format);
            hu.iter_mut().zip(samples(image)).for_each(|(hu, s)| *hu = table[format.pattern(s)]);
            let (low, high) = samples(image).fold((i32::MAX, i32::MIN), |(low, high), sample| {
                let stored = format.stored(sample);
                (low.min(stored), high.max(stored))
            });
            Some([rescale.hu(low), rescale.hu(high)])
        })
        .collect();
    let ranges: Vec<[f64; 2]> = ranges.into_iter().collect::<Option<_>>()?;
    let join = |all: [f64; 2], one: &[f64; 2]| [all[0].min(one[0]), all[1].max(one[1])];
    let range = ranges.iter().fold([f64::INFINITY, f64::NEG_INFINITY], join);
    let histogram = Histogram::of(&hu);
    Some(Pixels { size, hu, histogram, range })
}

fn check_plausible(checks: &mut Checks, pixels: &Pixels) {
    let between = |low: i16, high: i16| pixels.histogram.between(low, high);
    // Voxels outside the reconstruction circle may have one value of their own.
    let padding = between(i16::MIN, -1101).iter().copied().max().unwrap_or(0);
    let inside: usize = between(-1100, 3500).iter().sum();
    let usual = inside as f64 / (pixels.hu.len() - padding).max(1) as f64;
    let [lowest, highest] = pixels.range;
    checks.say(
        PLAUSIBLE,
        usual > 0.9 && lowest >= -8192.0 && inside > 0,
        format!("{lowest} to {highest} HU, {:.1} % usual", 100.0 * usual),
    );
}

fn check_high_bits(checks: &mut Checks, images: &[Image]) {
    let dirty = |image: &Image| {
        let Some(format) = format(image) else { return true };
        let clean = |s: u16| format.stored(s) as u16 == s;
        format.bits_stored < 16 && !samples(image).all(clean)
    };
    let name = |image: &Image| dirty(image).then(|| image.file.clone());
    let files: Vec<String> = images.par_iter().filter_map(name).collect();
    checks.none_of(HIGH_BITS, &files);
}

fn against_source(
    checks: &mut Checks,
    pixels: &Pixels,
    reference: Option<&Reference<'_>>,
    policy: Policy,
) {
    let rules = AGAINST_SOURCE;
    let Some(reference) = reference else {
        rules.iter().for_each(|rule| checks.skip(rule, NEEDS_SOURCE));
        return;
    };
    let source = reference.source.padding.put_back(&reference.ct, policy.clip_padding);
    let histogram = Histogram::of(&source);
    let [low, high] = histogram.range().unwrap_or([0, 0]).map(f64::from);
    let low = low.min(-1000.0);
    let [lowest, highest] = pixels.range;
    checks.say(
        rules[0],
        lowest >= low - 1.0 && highest <= high + 1.0,
        format!("{lowest} to {highest} HU, the source {low} to {high}"),
    );
    let ([q1, m1, mean1], [q2, m2, mean2]) = (pixels.histogram.summary(), histogram.summary());
    checks.say(
        rules[1],
        (q1 - q2).abs() < 50.0 && (m1 - m2).abs() < 100.0 && (mean1 - mean2).abs() < 60.0,
        format!("off by {:.0}, {:.0} and {:.0} HU", q1 - q2, m1 - m2, mean1 - mean2),
    );
    if pixels.size != reference.ct.grid().size() || pixels.size.iter().any(|&n| n < 4) {
        rules[2..].iter().for_each(|rule| checks.skip(rule, "the sizes differ or are below 4"));
        return;
    }
    check_border(checks, rules[2], pixels, &source);
    check_slices(checks, rules[3], pixels, &source);
    let moments = [pixels.histogram.moments(), histogram.moments()];
    check_mirrors(checks, rules[4], &pixels.hu, &source, pixels.size, moments);
}

/// Whether the voxels beyond any region still are the source's.
fn check_border(checks: &mut Checks, rule: &str, pixels: &Pixels, source: &[i16]) {
    let [ni, nj, nk] = pixels.size;
    let off_in = |range: std::ops::Range<usize>| {
        let pairs = pixels.hu[range.clone()].iter().zip(&source[range]);
        pairs.filter(|(a, b)| a.abs_diff(**b) > 1).count()
    };
    // The end slices, and two voxels at each end of every row and column of the others.
    let off = |row: usize| {
        let (j, k, start) = (row % nj, row / nj, row * ni);
        if k == 0 || k + 1 == nk || j < 2 || j + 2 >= nj {
            off_in(start..start + ni)
        } else {
            off_in(start..start + 2) + off_in(start + ni - 2..start + ni)
        }
    };
    let off: usize = (0..nj * nk).into_par_iter().map(off).sum();
    let voxels = ni * nj * nk - (ni - 4) * (nj - 4) * (nk - 2);
    let share = off as f64 / voxels as f64;
    checks.say(rule, share < 0.01, format!("{:.2} % differ", 100.0 * share));
}

/// What did not move is equal to the last bit of noise, in the right slice only.
fn check_slices(checks: &mut Checks, rule: &str, pixels: &Pixels, source: &[i16]) {
    let [ni, nj, nk] = pixels.size;
    let slice = |k: usize| k * ni * nj..(k + 1) * ni * nj;
    let common = |k: usize, l: usize| {
        let alike = |(a, b): (&[i16], &[i16])| {
            // Few enough for a counter of 16 bits, which the processor counts eight at a time.
            let alike = a.iter().zip(b).map(|(a, b)| u16::from(a.abs_diff(*b) <= 1));
            u64::from(alike.fold(0, u16::wrapping_add))
        };
        pixels.hu[slice(k)].chunks(4096).zip(source[slice(l)].chunks(4096)).map(alike).sum::<u64>()
    };
    let strange = |&k: &usize| {
        let own = common(k, k);
        (k > 0 && common(k, k - 1) > own) || (k + 1 < nk && common(k, k + 1) > own)
    };
    let slices: Vec<usize> = (0..nk).into_par_iter().filter(strange).collect();
    let names: Vec<String> =
        slices.iter().map(|k| format!("slice {} along the normal", k + 1)).collect();
    checks.none_of(rule, &names);
}

/// Correlation with the source against that with its seven mirror images. `moments` are the mean
/// and the standard deviation of the export and of the source.
fn check_mirrors(
    checks: &mut Checks,
    rule: &str,
    ours: &[i16],
    source: &[i16],
    size: [usize; 3],
    moments: [[f64; 2]; 2],
) {
    let [[mean, deviation], [source_mean, source_deviation]] = moments;
    let count = ours.len() as f64;
    let correlations = mirrored(ours, source, size).map(|product| {
        (product as f64 / count - mean * source_mean) / (deviation * source_deviation)
    });
    let own = correlations[0];
    let best = correlations[1..].iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let detail = format!("correlation {own:.3}, best mirror image {best:.3}");
    checks.say(rule, own > 0.5 && own > best, detail);
}
