//! What was fitted to scans, and how far one lies off, as files for spreadsheets.

use crate::files::write_text;
use crate::{Error, Evaluation, SkinDistances, TissueFit};
use std::path::Path;

/// Writes what was fitted (`.csv`), one row for each rest state.
///
/// # Errors
/// [`Error::Write`] when the folder does not exist or cannot be written.
pub fn write_fit_table(fit: &TissueFit, path: &Path) -> Result<(), Error> {
    let mut text =
        "rest,young_kpa,young_low_kpa,young_high_kpa,lean_deg,misfit_mm,chosen,deviation_scan,\
         deviation_posture,deviation_tissues,deviation_mesh,deviation_wall,deviation_misfit\n"
            .to_string();
    for (n, state) in fit.states.iter().enumerate() {
        let [low, high] = state.interval_kpa;
        text += &format!(
            "{},{:.4},{low:.4},{high:.4},{:.2},{:.3},{},{}\n",
            state.rest,
            state.young_kpa,
            state.lean_deg,
            state.misfit_mm,
            if n > 0 {
                "no"
            } else if fit.decided {
                "yes"
            } else {
                "open"
            },
            state.parts.all().map(|part| format!("{part:.4}")).join(",")
        );
    }
    write_text(&text, path)
}

/// Writes how far a scan lies off each surface (`.csv`), one row for each surface and part.
///
/// # Errors
/// [`Error::Write`] when the folder does not exist or cannot be written.
pub fn write_evaluation_table(evaluation: &Evaluation, path: &Path) -> Result<(), Error> {
    let mut text = "surface,part,points,mean_mm,rms_mm,p95_mm,max_mm\n".to_string();
    for surface in &evaluation.surfaces {
        for (part, of) in [("near tumour", surface.near), ("breast", surface.breast)] {
            let SkinDistances { points, mean_mm, rms_mm, p95_mm, max_mm } = of;
            let name = &surface.name;
            text += &format!(
                "{name},{part},{points},{mean_mm:.3},{rms_mm:.3},{p95_mm:.3},{max_mm:.3}\n"
            );
        }
    }
    write_text(&text, path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::{evaluation, fit};

    #[test]
    fn tables_have_a_row_for_each_state_and_each_part() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        let read = || std::fs::read_to_string(&path).unwrap();
        write_evaluation_table(&evaluation(), &path).unwrap();
        let text = read();
        assert_eq!(text.lines().count(), 7, "{text}");
        assert!(text.contains("ct,near tumour,180,-0.500,0.500,0.900,1.250\n"), "{text}");
        write_fit_table(&fit(), &path).unwrap();
        let (text, best) = (read(), fit());
        assert_eq!(text.lines().count(), 1 + best.states.len(), "{text}");
        let row = format!("{},{:.4},", best.best().rest, best.best().young_kpa);
        assert!(text.lines().nth(1).unwrap().starts_with(&row), "{text}");
    }
}
