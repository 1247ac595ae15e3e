//! The table of a cohort for spreadsheets: RFC 4180, a row for each patient, units in the head.

use super::{Figures, Patient};
use crate::words::plain;
use supine_record::ModulusOrigin;
use supine_space::to_cell;

/// A column: its name, and what stands in it; the figures' columns are empty without a result.
enum Cell {
    /// Of how the run ended.
    Status(fn(&Patient) -> String),
    /// Of its result.
    Figure(fn(&Figures) -> String),
}

use Cell::{Figure, Status};

/// The first columns of the table: by them it is known again.
pub const TABLE_HEAD: &str = "name,status,exit,error_code,verdict";

/// The columns in their order: how the run ended, the mesh, the tissue, the tumour, the mechanics,
/// the cost.
const COLUMNS: &[(&str, Cell)] = &[
    ("name", Status(|p| p.status.case.clone())),
    ("status", Status(|p| p.status.status.word().into())),
    ("exit", Status(|p| p.status.exit.to_string())),
    ("error_code", Status(|p| p.status.error.as_ref().map_or("".into(), |e| e.code.clone()))),
    ("verdict", Status(|p| p.status.colour.map_or("".into(), |c| format!("{c:?}").to_lowercase()))),
    ("reasons", Status(|p| p.status.reasons.join(" | "))),
    ("warnings", Status(|p| p.status.warnings.to_string())),
    ("codes", Status(|p| p.codes.join(" "))),
    ("breast", Figure(|f| f.breast.clone())),
    ("bed_ap_deg", Figure(|f| number(f.table_deg[0]))),
    ("bed_lat_deg", Figure(|f| number(f.table_deg[1]))),
    ("ct_voxels_i", Figure(|f| f.size[0].to_string())),
    ("ct_voxels_j", Figure(|f| f.size[1].to_string())),
    ("ct_voxels_k", Figure(|f| f.size[2].to_string())),
    ("ct_spacing_i_mm", Figure(|f| number(f.spacing_mm[0]))),
    ("ct_spacing_j_mm", Figure(|f| number(f.spacing_mm[1]))),
    ("ct_spacing_k_mm", Figure(|f| number(f.spacing_mm[2]))),
    ("region_radius_mm", Figure(|f| plain(f.radius_mm, 1))),
    ("tetrahedra", Figure(|f| f.tetrahedra.to_string())),
    ("nodes", Figure(|f| f.nodes.to_string())),
    ("unknowns", Figure(|f| f.unknowns.to_string())),
    ("element_order", Figure(|f| f.order.to_string())),
    ("min_dihedral_deg", Figure(|f| plain(f.min_dihedral_deg, 1))),
    ("mean_radius_ratio", Figure(|f| plain(f.mean_radius_ratio, 3))),
    ("volume_ml", Figure(|f| plain(f.volume_ml, 1))),
    ("young_kpa", Figure(|f| plain(f.young_kpa, 3))),
    ("young_low_kpa", Figure(|f| known(f, |k| plain(k.0[0], 3)))),
    ("young_high_kpa", Figure(|f| known(f, |k| plain(k.0[1], 3)))),
    ("young_from", Figure(|f| known(f, |k| k.1.name().into()))),
    ("rest_state", Figure(|f| f.rest.to_string())),
    ("tumour_x_mm", Figure(|f| tumour(f, |t| Some(t.displacement_mm[0])))),
    ("tumour_y_mm", Figure(|f| tumour(f, |t| Some(t.displacement_mm[1])))),
    ("tumour_z_mm", Figure(|f| tumour(f, |t| Some(t.displacement_mm[2])))),
    ("tumour_length_mm", Figure(|f| tumour(f, |t| Some(t.length_mm)))),
    ("tumour_length_low_95_mm", Figure(|f| tumour(f, |t| Some(t.interval_mm?[0])))),
    ("tumour_length_high_95_mm", Figure(|f| tumour(f, |t| Some(t.interval_mm?[1])))),
    ("tumour_within_95_mm", Figure(|f| tumour(f, |t| t.within_mm))),
    ("min_det_f", Figure(|f| plain(f.min_det_f, 3))),
    ("residual", Figure(|f| format!("{:.1e}", f.residual))),
    ("folded_voxels", Figure(|f| f.folded_voxels.to_string())),
    ("scan_points", Figure(|f| f.scan.map_or("".into(), |scan| scan.points.to_string()))),
    ("scan_mean_mm", Figure(|f| f.scan.map_or("".into(), |scan| plain(scan.mean_mm, 2)))),
    ("scan_rms_mm", Figure(|f| f.scan.map_or("".into(), |scan| plain(scan.rms_mm, 2)))),
    ("scan_p95_mm", Figure(|f| f.scan.map_or("".into(), |scan| plain(scan.p95_mm, 2)))),
    ("scan_max_mm", Figure(|f| f.scan.map_or("".into(), |scan| plain(scan.max_mm, 2)))),
    ("seconds", Status(|p| plain(p.status.seconds, 1))),
    ("peak_memory_mb", Status(|p| p.status.peak_memory_mb.map_or("".into(), |m| plain(m, 0)))),
    ("threads", Status(|p| p.status.threads.to_string())),
    ("version", Status(|p| p.status.version.clone())),
    ("run_id", Figure(|f| f.run_id.clone())),
    ("ct", Figure(|f| f.ct.as_ref().map_or("".into(), |ct| ct.display().to_string()))),
];

/// The table: a head, then a row for each patient in the order given; lines end with CR LF,
/// positions and displacements are LPS.
pub fn table(patients: &[Patient]) -> String {
    let names: Vec<String> = COLUMNS.iter().map(|(name, _)| (*name).into()).collect();
    let rows = patients.iter().map(|patient| {
        let cell = |(_, cell): &(&str, Cell)| match cell {
            Status(of) => of(patient),
            Figure(of) => patient.figures.as_ref().map(of).unwrap_or_default(),
        };
        COLUMNS.iter().map(cell).collect()
    });
    let line = |cells: Vec<String>| {
        cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\r\n"
    };
    std::iter::once(names).chain(rows).map(line).collect()
}

/// A cell, in quotation marks where it must be.
fn quoted(cell: &str) -> String {
    let cell = to_cell(cell).into_owned();
    if cell.contains([',', '"', '\r', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell
    }
}

/// As many digits as the number has.
fn number(x: f64) -> String {
    format!("{x}")
}

fn known(figures: &Figures, of: impl Fn(&([f64; 2], ModulusOrigin)) -> String) -> String {
    figures.young_known.as_ref().map(of).unwrap_or_default()
}

fn tumour(figures: &Figures, of: impl Fn(&crate::TumourMoved) -> Option<f64>) -> String {
    figures.tumour.as_ref().and_then(of).map(|mm| plain(mm, 2)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cohort::tests::{failed, finished};

    #[test]
    fn every_patient_has_a_row_of_as_many_cells_as_the_head() {
        let patients = [finished("a"), Patient::new(failed("b, \"the\" second"), None)];
        let text = table(&patients);
        assert!(text.starts_with(TABLE_HEAD) && text.ends_with("\r\n"));
        let lines: Vec<&str> = text.split_terminator("\r\n").collect();
        assert_eq!(lines.len(), 3);
        // Without what stands in quotation marks.
        let cells = |line: &str| {
            let bare: String = line.split('"').step_by(2).collect();
            bare.matches(',').count() + 1
        };
        assert!(lines.iter().all(|line| cells(line) == COLUMNS.len()), "{text}");
        assert!(lines[2].starts_with("\"b, \"\"the\"\" second\",failed,1,case-value,"), "{text}");
        assert!(lines[1].contains(",3.74,1.10,8.20,4.60,"), "{text}");
    }

    #[test]
    fn no_text_is_taken_for_a_formula() {
        assert_eq!(quoted("=1+1"), "'=1+1");
        assert_eq!(quoted("-0.5"), "-0.5");
        assert_eq!(plain(-0.001, 1), "0.0");
    }
}
