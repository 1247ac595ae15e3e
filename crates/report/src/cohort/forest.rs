//! The tumours' displacements, a line for each patient with its interval: none is shown without.

use super::Patient;
use super::card::{anchor, class};
use super::plot::{Axis, escaped, shape};
use crate::words::fixed;
use std::fmt::Write;

/// With more patients no line can be told from the next.
const MOST: usize = 60;
/// Width of the drawing and of the names in it, height of a line.
const WIDTH: f64 = 1200.0;
const NAMES: f64 = 190.0;
const LINE: f64 = 17.0;
/// Characters of a name that fit.
const FITS: usize = 24;

/// The drawing, the largest displacement first; none when there is nothing to show, or too much.
pub(super) fn forest(patients: &[Patient]) -> Option<String> {
    let mut rows: Vec<(&Patient, f64, [f64; 2])> = patients.iter().filter_map(row).collect();
    if rows.is_empty() || rows.len() > MOST {
        return None;
    }
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    let high = rows.iter().fold(0.0, |most: f64, (_, x, [_, high])| most.max(*x).max(*high));
    let axis = Axis::over(0.0, high, [NAMES, WIDTH - 24.0]);
    let bottom = LINE * rows.len() as f64 + 8.0;
    let mut svg = format!(
        "<svg class=\"strip\" viewBox=\"0 0 {WIDTH} {:.0}\" role=\"group\" aria-label=\"Tumour's displacement with its interval, mm\">",
        bottom + 24.0
    );
    let mut add = |text: std::fmt::Arguments<'_>| {
        // What is written to a string cannot fail.
        let _written = svg.write_fmt(text);
    };
    for tick in &axis.ticks {
        let (x, text) = (axis.place(*tick), axis.label(*tick));
        add(format_args!("<path class=\"rule\" d=\"M{x:.1} 0V{bottom:.1}\"/>"));
        add(format_args!("<text x=\"{x:.1}\" y=\"{:.1}\">{text}</text>", bottom + 16.0));
    }
    for (n, (patient, x, [low, high])) in rows.iter().enumerate() {
        let (y, status) = (LINE * (n as f64 + 0.5) + 4.0, patient.status.status);
        let name = &patient.status.case;
        let mut shown: String = name.chars().take(FITS).collect();
        if shown.len() < name.len() {
            shown.push('…');
        }
        let told = format!(
            "{}: {} mm, 95 % {} to {} mm, {}",
            escaped(name),
            fixed(*x, 1),
            fixed(*low, 1),
            fixed(*high, 1),
            status.word()
        );
        add(format_args!(
            "<a href=\"#{}\" tabindex=\"-1\" class=\"{}\"><title>{told}</title>",
            anchor(name),
            class(status)
        ));
        add(format_args!(
            "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            NAMES - 12.0,
            y + 4.5,
            escaped(&shown)
        ));
        let [from, to] = [axis.place(*low), axis.place(*high)];
        add(format_args!("<path class=\"room\" d=\"M{from:.1} {y:.1}H{to:.1}\"/>"));
        add(format_args!("<path d=\"{}\"/></a>", shape(status, axis.place(*x), y)));
    }
    Some(svg + "</svg>")
}

/// A displacement with its interval; one without moves for sure as far as it is said, or not at
/// all.
fn row(patient: &Patient) -> Option<(&Patient, f64, [f64; 2])> {
    let tumour = patient.figures.as_ref()?.tumour.as_ref()?;
    let x = tumour.length_mm;
    Some((patient, x, tumour.interval_mm.unwrap_or([x, x])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cohort::tests::finished;

    #[test]
    fn no_displacement_stands_without_its_interval() {
        let patients = ["a", "a name that is much too long for the drawing"].map(finished);
        let svg = forest(&patients).unwrap();
        assert_eq!(svg.matches("class=\"room\"").count(), 2);
        assert!(svg.contains("a: 3.7 mm, 95 % 1.1 to 8.2 mm, flagged"), "{svg}");
        assert!(svg.contains(">a name that is much too …<"), "{svg}");
        let many: Vec<Patient> = (0..61).map(|n| finished(&n.to_string())).collect();
        assert!(forest(&many).is_none() && forest(&[]).is_none());
    }
}
