//! Dose-volume histograms: a small chart for every structure and the figures that plans are judged
//! by.

use crate::DoseVolumeHistogram;
use crate::tables::Table;
use crate::words::{fixed, trimmed};
use crate::{DoseVolumeCurve, Summary};
use askama::Template;

/// Size of a chart and of its margins (left, top, right, bottom), pixels.
const SIZE: [f64; 2] = [300.0, 190.0];
const MARGIN: [f64; 4] = [44.0, 24.0, 12.0, 34.0];

/// A chart, as SVG that any browser draws; the template escapes the name.
#[derive(Template)]
#[template(path = "dose_volume.svg")]
pub(crate) struct Chart {
    region: String,
    /// Left and right end of the horizontal lines, and the bottom of the vertical axis.
    frame: [f64; 3],
    /// Height of each horizontal line and its share, %.
    shares: [(f64, u8); 3],
    /// Place of each label of the dose, and its text.
    doses: [(f64, String); 3],
    before: String,
    after: String,
}

/// The charts, one per structure and dose; none of a structure that the dose does not cover.
pub(crate) fn charts(s: &Summary) -> Vec<Chart> {
    let covered = s.dose_volume.iter().filter(|of| of.outside().is_none());
    covered.map(|of| chart(of, named(s, of))).collect()
}

/// The structure, and where there are several doses the dose.
fn named(s: &Summary, of: &DoseVolumeHistogram) -> String {
    let several = s.dose_volume.iter().any(|other| other.dose != of.dose);
    if several { format!("{} in {}", of.region, of.dose) } else { of.region.clone() }
}

fn chart(of: &DoseVolumeHistogram, region: String) -> Chart {
    let [wide, high] = SIZE;
    let [left, top, right, bottom] = MARGIN;
    let last = of.before.shares.len().max(2) - 1;
    let most = (of.step_gy * last as f64).max(f64::MIN_POSITIVE);
    let x = |gy: f64| left + gy / most * (wide - left - right);
    let y = |share: f64| top + (1.0 - share) * (high - top - bottom);
    let points = |curve: &DoseVolumeCurve| {
        let places = curve.shares.iter().enumerate();
        let points = places.map(|(n, s)| format!("{:.1},{:.1}", x(n as f64 * of.step_gy), y(*s)));
        points.collect::<Vec<_>>().join(" ")
    };
    Chart {
        region,
        frame: [left, wide - right, high - bottom],
        shares: [0u8, 50, 100].map(|percent| (y(f64::from(percent) / 100.0), percent)),
        doses: [0.0, 0.5, 1.0]
            .map(|part| (x(part * most), trimmed((10.0 * part * most).round() / 10.0))),
        before: points(&of.before),
        after: points(&of.after),
    }
}

/// Volume and doses of every structure before and after.
pub(crate) fn table(s: &Summary) -> Option<Table> {
    let mut t = Table::list(
        "Dose in the structures, CT and operating table",
        &[
            "Structure",
            "Volume, ml",
            "Mean, Gy",
            "D98 %, Gy",
            "D50 %, Gy",
            "D2 %, Gy",
            "Largest, Gy",
            "Beyond the dose's grid",
        ],
    );
    for of in &s.dose_volume {
        let pair = |value: fn(&DoseVolumeCurve) -> f64, digits| {
            format!("{} to {}", fixed(value(&of.before), digits), fixed(value(&of.after), digits))
        };
        let gy = |value| if of.outside().is_some() { "\u{2013}".into() } else { pair(value, 2) };
        t.rows.push(vec![
            named(s, of),
            pair(|c| c.volume_ml, 1),
            gy(|c| c.mean_gy),
            gy(|c| c.d98_gy),
            gy(|c| c.d50_gy),
            gy(|c| c.d2_gy),
            gy(|c| c.max_gy),
            format!("{} %", pair(|c| 100.0 * c.beyond, 0)),
        ]);
    }
    (!t.rows.is_empty()).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    #[test]
    fn a_chart_holds_both_curves_within_its_frame_and_no_markup_of_a_name() {
        let summary = example();
        let svg = charts(&summary).iter().map(|c| c.render().unwrap()).collect::<String>();
        assert!(svg.contains("CTV &#60;2&#62;") && !svg.contains("CTV <2>"));
        for class in ["before", "after"] {
            let points = svg.split(&format!("class=\"{class}\" points=\"")).nth(1).unwrap();
            let points: Vec<[f64; 2]> = points
                .split('"')
                .next()
                .unwrap()
                .split(' ')
                .map(|p| {
                    let (x, y) = p.split_once(',').unwrap();
                    [x.parse().unwrap(), y.parse().unwrap()]
                })
                .collect();
            assert_eq!(points.len(), summary.dose_volume[0].before.shares.len());
            assert!(
                points.iter().all(|[x, y]| *x >= 44.0 && *x <= 288.1 && *y >= 23.9 && *y <= 156.1)
            );
            assert!(points.windows(2).all(|p| p[1][1] >= p[0][1]), "cumulative: it only falls");
        }
    }

    #[test]
    fn of_what_the_dose_does_not_cover_no_dose_is_told_and_several_doses_have_their_names() {
        let mut summary = example();
        let first = |summary: &Summary| table(summary).unwrap().rows[0].clone();
        assert_eq!(first(&summary)[2], "19.80 to 19.60");
        summary.dose_volume[0].after.beyond = 0.93;
        let row = first(&summary);
        assert!(row[2..7].iter().all(|cell| cell == "\u{2013}"), "{row:?}");
        assert_eq!(row[7], "0 to 93 %");
        assert!(charts(&summary).is_empty());
        let mut other = summary.dose_volume[0].clone();
        (other.dose, other.after.beyond) = ("boost.dcm".into(), 0.0);
        summary.dose_volume.push(other);
        assert!(table(&summary).unwrap().rows[1][0].ends_with(" in boost.dcm"));
        assert!(charts(&summary)[0].render().unwrap().contains("in boost.dcm"));
    }
}
