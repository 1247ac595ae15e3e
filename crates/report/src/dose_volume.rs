//! Dose-volume histograms: a small chart for every structure and the figures that plans are judged by.

use crate::DoseVolumeHistogram;
use crate::tables::Table;
use crate::words::{fixed, trimmed};
use crate::{DoseVolumeCurve, Summary};
use std::fmt::Write;

/// Size of a chart and of its margins (left, top, right, bottom), pixels.
const SIZE: [f64; 2] = [300.0, 190.0];
const MARGIN: [f64; 4] = [44.0, 24.0, 12.0, 34.0];

/// The charts, one per structure, as SVG that any browser draws.
pub(crate) fn charts(s: &Summary) -> Vec<String> {
    s.dose_volume.iter().map(chart).collect()
}

fn chart(of: &DoseVolumeHistogram) -> String {
    let [wide, high] = SIZE;
    let [left, top, right, bottom] = MARGIN;
    let last = of.before.shares.len().max(2) - 1;
    let most = (of.step_gy * last as f64).max(f64::MIN_POSITIVE);
    let x = |gy: f64| left + gy / most * (wide - left - right);
    let y = |share: f64| top + (1.0 - share) * (high - top - bottom);
    let title = html_escape(&of.region);
    let mut svg = format!(
        "<svg class=\"dvh\" viewBox=\"0 0 {wide} {high}\" role=\"img\" aria-label=\"Dose-volume histogram of {title}\">\
         <text x=\"{left}\" y=\"15\" class=\"name\">{title}</text>"
    );
    let line = |svg: &mut String, class: &str, points: &str| {
        let _ = write!(svg, "<polyline class=\"{class}\" points=\"{points}\"/>");
    };
    for share in [0.0, 0.5, 1.0] {
        let at = y(share);
        line(&mut svg, "rule", &format!("{left},{at:.1} {:.1},{at:.1}", wide - right));
        let label = fixed(100.0 * share, 0);
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" class=\"tick end\">{label} %</text>",
            left - 5.0,
            at + 4.0
        );
    }
    for part in [0.0, 0.5, 1.0] {
        let (at, label) = (x(part * most), trimmed((10.0 * part * most).round() / 10.0));
        let _ = write!(
            svg,
            "<text x=\"{at:.1}\" y=\"{:.1}\" class=\"tick mid\">{label}</text>",
            high - bottom + 15.0
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" class=\"tick mid\">Gy</text>",
        x(0.5 * most),
        high - 4.0
    );
    for (class, curve) in [("before", &of.before), ("after", &of.after)] {
        let places = curve.shares.iter().enumerate();
        let points: Vec<String> =
            places.map(|(n, s)| format!("{:.1},{:.1}", x(n as f64 * of.step_gy), y(*s))).collect();
        line(&mut svg, class, &points.join(" "));
    }
    svg + "</svg>"
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
        t.rows.push(vec![
            of.region.clone(),
            pair(|c| c.volume_ml, 1),
            pair(|c| c.mean_gy, 2),
            pair(|c| c.d98_gy, 2),
            pair(|c| c.d50_gy, 2),
            pair(|c| c.d2_gy, 2),
            pair(|c| c.max_gy, 2),
            format!("{} %", pair(|c| 100.0 * c.beyond, 0)),
        ]);
    }
    (!t.rows.is_empty()).then_some(t)
}

fn html_escape(text: &str) -> String {
    let one = |c| match c {
        '&' => "&amp;".into(),
        '<' => "&lt;".into(),
        '>' => "&gt;".into(),
        '"' => "&quot;".into(),
        c => String::from(c),
    };
    text.chars().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    #[test]
    fn a_chart_holds_both_curves_within_its_frame_and_no_markup_of_a_name() {
        let summary = example();
        let svg = charts(&summary).concat();
        assert!(svg.contains("CTV &lt;2&gt;") && !svg.contains("CTV <2>"));
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
        let row = &table(&summary).unwrap().rows[0];
        assert_eq!(row[2], "19.80 to 19.60");
    }
}
