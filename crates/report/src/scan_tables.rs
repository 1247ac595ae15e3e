//! What was fitted to scans, and how far one lies off, as files for spreadsheets.

use crate::files::builder;
use crate::{Error, Evaluation, SkinDistances, TissueFit};
use std::io::Write;
use std::path::Path;

/// Writes what was fitted (`.csv`), one row for each rest state.
///
/// # Errors
/// [`Error::Write`] when the folder does not exist or cannot be written.
pub fn write_fit_table(fit: &TissueFit, path: &Path) -> Result<(), Error> {
    let mut text =
        "rest,young_kpa,young_low_kpa,young_high_kpa,lean_deg,misfit_mm,chosen\n".to_string();
    for (n, state) in fit.states.iter().enumerate() {
        let [low, high] = state.interval_kpa;
        text += &format!(
            "{},{:.4},{low:.4},{high:.4},{:.2},{:.3},{}\n",
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
            }
        );
    }
    write(&text, path)
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
    write(&text, path)
}

fn write(text: &str, path: &Path) -> Result<(), Error> {
    let fail = |source| Error::Write { path: path.to_path_buf(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = builder(0o666).tempfile_in(folder).map_err(fail)?;
    file.write_all(text.as_bytes()).map_err(fail)?;
    file.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}
