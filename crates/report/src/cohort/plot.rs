//! A figure of all patients on one axis: a mark for each, quartiles, and what lies apart.
//!
//! SVG, not pixels: each mark leads to its patient, says its value and follows the page's colours,
//! which no library for plots keeps.

use super::Patient;
use super::card::{anchor, class};
use super::outliers::Spread;
use crate::Ended;
use crate::words::fixed;
use askama::filters::{Escaper, Html};
use std::fmt::Write;
use supine_record::RestState;

/// A figure that patients are compared by.
struct Measure {
    title: &'static str,
    unit: &'static str,
    decimals: usize,
    of: fn(&Patient) -> Option<f64>,
}

const MEASURES: [Measure; 6] = [
    Measure {
        title: "Tumour's displacement",
        unit: "mm",
        decimals: 1,
        of: |p| Some(p.figures.as_ref()?.tumour.as_ref()?.length_mm),
    },
    Measure {
        title: "Tumour's place known within (95 %)",
        unit: "mm",
        decimals: 1,
        of: |p| p.figures.as_ref()?.tumour.as_ref()?.within_mm,
    },
    Measure {
        title: "Young's modulus, rest state net",
        unit: "kPa",
        decimals: 2,
        of: |p| young(p, RestState::Net),
    },
    Measure {
        title: "Young's modulus, rest state unloaded",
        unit: "kPa",
        decimals: 2,
        of: |p| young(p, RestState::Unloaded),
    },
    Measure {
        title: "Smallest det F",
        unit: "",
        decimals: 2,
        of: |p| Some(p.figures.as_ref()?.min_det_f),
    },
    Measure {
        title: "Time",
        unit: "s",
        decimals: 1,
        of: |p| p.figures.as_ref().map(|_| p.status.seconds),
    },
];

/// A modulus belongs to its rest state: those of two are not compared.
fn young(patient: &Patient, rest: RestState) -> Option<f64> {
    patient.figures.as_ref().filter(|figures| figures.rest == rest).map(|f| f.young_kpa)
}

/// A plot for the page.
pub(super) struct Plot {
    pub(super) title: String,
    /// Median and quartiles in words.
    pub(super) told: String,
    pub(super) svg: String,
    /// What lies apart: where it stands on the page, and in words.
    pub(super) apart: Vec<(String, String)>,
}

/// The plots of all figures that at least one patient has whose result may be used.
pub(super) fn plots(patients: &[Patient]) -> Vec<Plot> {
    MEASURES.iter().filter_map(|measure| plot(measure, patients)).collect()
}

/// Width and height, and where the axis lies, in units of the drawing.
const SIZE: [f64; 2] = [600.0, 112.0];
const AXIS: f64 = 86.0;
const MARGIN: f64 = 24.0;
/// Marks are this wide.
const MARK: f64 = 8.0;

fn plot(measure: &Measure, patients: &[Patient]) -> Option<Plot> {
    let marks: Vec<(&Patient, f64)> =
        patients.iter().filter_map(|p| Some((p, (measure.of)(p)?))).collect();
    // A result that must not be used shifts no median; it stands beside those that may.
    let may = marks.iter().filter(|(p, _)| p.status.status != Ended::NotUsable);
    let counted = may.clone().count();
    let spread = Spread::of(may.map(|(_, x)| *x))?;
    let say = |x: f64| format!("{} {}", fixed(x, measure.decimals), measure.unit);
    let middle = say(spread.median);
    let mut told = match counted {
        1 => format!("1 patient: {}", middle.trim_end()),
        _ => format!(
            "{counted} patients, median {}; half of them {} to {}",
            middle.trim_end(),
            fixed(spread.low, measure.decimals),
            say(spread.high).trim_end()
        ),
    };
    if counted < marks.len() {
        told += &format!("; left out: {} not usable", marks.len() - counted);
    }
    let apart = marks.iter().filter(|(_, x)| spread.is_apart(*x));
    let apart = apart.map(|(p, x)| {
        let name = &p.status.case;
        (anchor(name), format!("{name}: {}", say(*x).trim_end()))
    });
    let apart = apart.collect();
    let unit = if measure.unit.is_empty() { String::new() } else { format!(", {}", measure.unit) };
    let title = format!("{}{unit}", measure.title);
    let svg = drawing(&title, &marks, &spread, &say);
    Some(Plot { title, told, svg, apart })
}

fn drawing(
    title: &str,
    marks: &[(&Patient, f64)],
    spread: &Spread,
    say: &dyn Fn(f64) -> String,
) -> String {
    let values = || marks.iter().map(|(_, x)| *x);
    let axis = Axis::over(
        values().fold(f64::INFINITY, f64::min),
        values().fold(f64::NEG_INFINITY, f64::max),
        [MARGIN, SIZE[0] - MARGIN],
    );
    let [width, height] = SIZE;
    let mut svg = format!(
        "<svg class=\"strip\" viewBox=\"0 0 {width} {height}\" role=\"group\" aria-label=\"{}\">",
        escaped(title)
    );
    let (low, high) = (axis.place(spread.low), axis.place(spread.high));
    let mut add = |text: std::fmt::Arguments<'_>| {
        // What is written to a string cannot fail.
        let _written = svg.write_fmt(text);
    };
    add(format_args!(
        "<rect class=\"half\" x=\"{low:.1}\" y=\"10\" width=\"{:.1}\" height=\"{:.1}\"/>",
        (high - low).max(1.0),
        AXIS - 10.0
    ));
    let median = axis.place(spread.median);
    add(format_args!("<path class=\"median\" d=\"M{median:.1} 10V{AXIS}\"/>"));
    add(format_args!("<path class=\"axis\" d=\"M{MARGIN} {AXIS}H{:.1}\"/>", width - MARGIN));
    for tick in &axis.ticks {
        let x = axis.place(*tick);
        add(format_args!("<path class=\"axis\" d=\"M{x:.1} {AXIS}v4\"/>"));
        let text = axis.label(*tick);
        add(format_args!("<text x=\"{x:.1}\" y=\"{:.1}\">{text}</text>", AXIS + 18.0));
    }
    for ((patient, x), y) in marks.iter().zip(heights(marks, &axis)) {
        let (at, status) = (axis.place(*x), patient.status.status);
        let apart = spread.is_apart(*x);
        let name = escaped(&patient.status.case);
        let told = format!("{name}: {}, {}", say(*x).trim_end(), status.word());
        add(format_args!(
            "<a href=\"#{}\" tabindex=\"-1\" class=\"{}\"><title>{told}</title>",
            anchor(&patient.status.case),
            class(status)
        ));
        if apart {
            add(format_args!("<circle class=\"ring\" cx=\"{at:.1}\" cy=\"{y:.1}\" r=\"7\"/>"));
        }
        add(format_args!("<path d=\"{}\"/></a>", shape(status, at, y)));
    }
    svg + "</svg>"
}

/// Marks of one place stand on each other.
fn heights(marks: &[(&Patient, f64)], axis: &Axis) -> Vec<f64> {
    let column = |x: f64| (axis.place(x) / MARK).floor() as usize;
    let mut counts = std::collections::BTreeMap::new();
    for (_, x) in marks {
        *counts.entry(column(*x)).or_insert(0_usize) += 1;
    }
    let highest = counts.values().copied().max().unwrap_or(1) as f64;
    let step = MARK.min((AXIS - 20.0) / highest);
    let mut stacked = std::collections::BTreeMap::new();
    let height = |(_, x): &(&Patient, f64)| {
        let below = stacked.entry(column(*x)).or_insert(0_usize);
        let y = AXIS - 6.0 - *below as f64 * step;
        *below += 1;
        y
    };
    marks.iter().map(height).collect()
}

/// The verdict as a shape, for those who do not see the colour: round, pointed, square.
pub(super) fn shape(status: Ended, x: f64, y: f64) -> String {
    match status {
        Ended::Flagged => format!("M{x:.1} {:.1}l4.4 4.4l-4.4 4.4l-4.4 -4.4z", y - 4.4),
        Ended::NotUsable => format!("M{:.1} {:.1}h7v7h-7z", x - 3.5, y - 3.5),
        _ => format!("M{:.1} {y:.1}a3.6 3.6 0 1 0 7.2 0a3.6 3.6 0 1 0 -7.2 0z", x - 3.6),
    }
}

/// An axis with round numbers.
pub(super) struct Axis {
    from: f64,
    to: f64,
    /// Where it begins and ends in the drawing.
    ends: [f64; 2],
    pub(super) ticks: Vec<f64>,
    decimals: usize,
}

impl Axis {
    /// One that holds two numbers and all between, drawn between two places.
    pub(super) fn over(low: f64, high: f64, ends: [f64; 2]) -> Self {
        let span = if high - low > 1e-9 { high - low } else { high.abs().max(1.0) * 0.2 };
        let rough = span / 5.0;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|n| n * power).into_iter().find(|s| *s >= rough);
        let step = step.unwrap_or(10.0 * power);
        let middle = if high - low > 1e-9 { 0.0 } else { span / 2.0 };
        let (first, last) = (
            ((low - middle) / step + 1e-9).floor() as i64,
            ((high + middle) / step - 1e-9).ceil() as i64,
        );
        let ticks = (first..=last).map(|n| n as f64 * step).collect();
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        Self { from: first as f64 * step, to: last as f64 * step, ends, ticks, decimals }
    }

    /// Where a number lies in the drawing.
    pub(super) fn place(&self, x: f64) -> f64 {
        let [begin, end] = self.ends;
        begin + (x - self.from) / (self.to - self.from) * (end - begin)
    }

    /// A number as it stands below the axis.
    pub(super) fn label(&self, x: f64) -> String {
        fixed(x, self.decimals)
    }
}

/// Text as it stands in HTML.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // What is written to a string cannot fail.
    let _written = Html.write_escaped_str(&mut out, text);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cohort::tests::finished;

    #[test]
    fn axes_have_round_numbers_around_all_figures() {
        let axis = Axis::over(1.3, 8.9, [0.0, 1.0]);
        assert_eq!((axis.from, axis.to, axis.decimals), (0.0, 10.0, 0));
        assert_eq!(axis.ticks, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        let one = Axis::over(0.609, 0.609, [0.0, 1.0]);
        assert!(one.from < 0.609 && one.to > 0.609, "{} to {}", one.from, one.to);
        assert!(Axis::over(0.0, 0.0, [0.0, 1.0]).place(0.0).is_finite());
    }

    #[test]
    fn every_patient_has_a_mark_and_who_lies_apart_is_named() {
        let mut patients: Vec<Patient> = ["a", "b", "c", "d", "e", "<f>"].map(finished).into();
        if let Some(figures) = &mut patients[5].figures {
            figures.min_det_f = 0.01;
        }
        let plots = plots(&patients);
        let titles: Vec<&str> = plots.iter().map(|plot| plot.title.as_str()).collect();
        assert!(titles.contains(&"Young's modulus, rest state net, kPa"), "{titles:?}");
        assert!(!titles.iter().any(|title| title.contains("unloaded")), "{titles:?}");
        let plot = plots.iter().find(|plot| plot.title == "Smallest det F").unwrap();
        assert_eq!(plot.svg.matches("<a ").count(), 6);
        assert_eq!(plot.svg.matches("class=\"ring\"").count(), 1);
        assert_eq!(plot.apart[0].1, "<f>: 0.01");
        assert!(plot.svg.contains("&#60;f&#62;: 0.01, flagged") && !plot.svg.contains("<f>"));
    }

    #[test]
    fn a_result_that_must_not_be_used_is_drawn_and_shifts_no_median() {
        let mut patients: Vec<Patient> = ["a", "b"].map(finished).into();
        let usable = plots(&patients);
        patients.push(finished("red"));
        patients[2].status.status = Ended::NotUsable;
        if let Some(figures) = &mut patients[2].figures {
            figures.min_det_f = 0.01;
        }
        let all = plots(&patients);
        let [before, after] = [&usable, &all]
            .map(|plots| plots.iter().find(|plot| plot.title == "Smallest det F").unwrap());
        assert_eq!(after.told, format!("{}; left out: 1 not usable", before.told));
        assert_eq!(after.svg.matches("<a ").count(), 3);
        patients.drain(..2);
        assert!(plots(&patients).is_empty());
    }
}
