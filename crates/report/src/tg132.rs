//! The table of the report that speaks the language of AAPM's Task Group 132.

use crate::summary::SkinAgreement;
use crate::tables::Table;
use crate::words::{count, fixed};
use crate::{Agreement, Consistency, Summary};

/// Said over the table.
const TITLE: &str = "Measures of AAPM TG-132, where they apply. The deformation is a prediction, not a registration: \
                     they say whether the files agree with it, not whether it is true";

/// One place in so many may have no skin near it. Chosen.
const LOST: usize = 20;
/// The mean distance of the skins that is within, mm.
const SKIN_MM: f64 = 2.0;

/// Whether the skin of the exported CT lies where the moved mesh has it.
pub(crate) fn is_skin_within(skin: &SkinAgreement) -> bool {
    skin.mean_mm <= SKIN_MM && skin.lost * LOST <= skin.places
}

/// Whether the fields lead back to within the longest side of a voxel.
pub(crate) fn is_consistent(fields: &Consistency, a: &Agreement) -> bool {
    fields.max_mm <= a.voxel_mm
}

/// Measure, tolerance, figure and verdict; none for a summary that holds no figures.
pub(crate) fn table(s: &Summary) -> Option<Table> {
    let agreement = s.agreement.as_ref()?;
    let head = ["Measure", "Tolerance", "This run", "Verdict"];
    let mut table = Table::list(TITLE, &head);
    table.rows = [
        skin(agreement),
        jacobian(s),
        consistency(s, agreement),
        not_measured(
            "Target registration error",
            "longest voxel side, 2 to 3 mm",
            "needs landmarks seen on the operating table",
        ),
        not_measured("Dice coefficient", "0.80 to 0.90", "needs contours of the deformed anatomy"),
    ]
    .map(Vec::from)
    .into();
    Some(table)
}

type Row = [String; 4];

fn row(measure: &str, tolerance: String, figure: String, within: bool) -> Row {
    let verdict = if within { "within" } else { "outside: look" };
    [measure.into(), tolerance, figure, verdict.into()]
}

fn not_measured(measure: &str, tolerance: &str, why: &str) -> Row {
    [measure.into(), tolerance.into(), why.into(), "not measured".into()]
}

fn mm(length: f64) -> String {
    format!("{} mm", fixed(length, 2))
}

fn skin(a: &Agreement) -> Row {
    let measure = "Mean distance to agreement: skin of the moved mesh and of the exported CT";
    let Some(skin) = &a.skin else {
        return not_measured(measure, "2 to 3 mm", "no skin was simulated");
    };
    let lost = match skin.lost {
        0 => String::new(),
        n => format!("; no skin near {} of them", count(n)),
    };
    let figure = format!(
        "{}; 95 % below {}, at most {}, {} places{lost}",
        mm(skin.mean_mm),
        mm(skin.p95_mm),
        mm(skin.max_mm),
        count(skin.places)
    );
    let tolerance =
        format!("2 to 3 mm, judged by {SKIN_MM}; a skin near all but 1 place in {LOST}");
    row(measure, tolerance, figure, is_skin_within(skin))
}

fn jacobian(s: &Summary) -> Row {
    let j = &s.warp.jacobian;
    let mut figure = format!(
        "{} to {}; {} voxels fold",
        fixed(j.min, 2),
        fixed(j.max, 2),
        count(s.warp.folded_voxels)
    );
    if let Some(all) = s.volumes.first() {
        let change = 100.0 * (all.after_ml / all.before_ml - 1.0);
        figure += &format!("; volume of {} by {} %", all.structure, fixed(change, 2));
    }
    let sound = s.warp.folded_voxels == 0 && s.solve.min_det_f > 0.0;
    let tolerance = "above 0 everywhere; else as clinically expected";
    row(
        "Jacobian determinant of the exported map, with its fade at the cut",
        tolerance.into(),
        figure,
        sound,
    )
}

fn consistency(s: &Summary, a: &Agreement) -> Row {
    let measure = "Inverse consistency: forward by one field, back by the other";
    let tolerance = format!("longest voxel side, {}", mm(a.voxel_mm));
    let Some(c) = &s.warp.forward_then_backward else {
        return not_measured(measure, &tolerance, "nothing moves");
    };
    let figure = format!(
        "{} in the mean, 99 % below {}, at most {}",
        mm(c.mean_mm),
        mm(c.p99_mm),
        mm(c.max_mm)
    );
    row(measure, tolerance, figure, is_consistent(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    fn verdicts(s: &Summary) -> Vec<String> {
        table(s).unwrap().rows.into_iter().map(|mut row| row.remove(3)).collect()
    }

    #[test]
    fn each_measure_has_its_verdict() {
        let mut s = example();
        let within = verdicts(&s);
        assert_eq!(within.iter().filter(|v| *v == "within").count(), 3, "{within:?}");
        assert_eq!(within.iter().filter(|v| *v == "not measured").count(), 2, "{within:?}");
        s.warp.folded_voxels = 1;
        assert_eq!(verdicts(&s)[1], "outside: look");
        if let Some(skin) = s.agreement.as_mut().and_then(|a| a.skin.as_mut()) {
            skin.lost = skin.places / LOST + 1;
        }
        assert_eq!(verdicts(&s)[0], "outside: look");
        if let Some(agreement) = &mut s.agreement {
            agreement.skin = None;
        }
        assert_eq!(verdicts(&s)[..2], ["not measured", "outside: look"]);
        s.agreement = None;
        assert!(table(&s).is_none());
    }
}
