//! The text of docs/VERIFICATION.md: parts that are measured one by one.

use super::study::Study;
use super::{Bench, Part, image, mesh, number, patients, real, study_tables, texture};
use anyhow::{Context, Result};
use clap::ValueEnum;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

const HEAD: &str = include_str!("head.md");
const PATIENTS: &str = include_str!("patients.md");
const MESH: &str = include_str!("mesh.md");
const REAL: &str = include_str!("real.md");
const STUDY: &str = include_str!("study.md");
const SPEED: &str = include_str!("speed.md");
const TESTS: &str = include_str!("tests.md");
/// What stands before a part.
const MARK: &str = "\n<!-- part: ";

/// The page as it stands.
pub(crate) struct Page {
    path: PathBuf,
    /// Text of the parts that are there.
    parts: BTreeMap<Part, String>,
}

impl Page {
    pub(crate) fn read(bench: &Bench<'_>) -> Result<Self> {
        let path = bench.house.root.join("docs/VERIFICATION.md");
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let (text, _) = text.split_once(TESTS).unwrap_or((&text, ""));
        let part = |text: &str| {
            let (name, text) = text.split_once(" -->\n")?;
            Some((Part::from_str(name, true).ok()?, text.to_owned()))
        };
        let parts = text.split(MARK).skip(1).filter_map(part).collect();
        Ok(Self { path, parts })
    }

    /// Puts a part that was measured on `date` in its place and writes the page.
    pub(crate) fn put(&mut self, part: Part, date: &str, text: &str) -> Result<()> {
        let text = format!("{}\n\nMeasured on {date}.\n", text.trim_end());
        self.parts.insert(part, text);
        let mut page = String::from(HEAD);
        for (part, text) in &self.parts {
            write!(page, "{MARK}{} -->\n{text}", part.name())?;
        }
        page += TESTS;
        std::fs::write(&self.path, page).with_context(|| self.path.display().to_string())
    }
}

/// The synthetic patients, with the truth of their pictures.
pub(crate) fn patients(rows: &[patients::Row]) -> Result<String> {
    let tables = [patient_rows(rows)?, image::table(rows)?, texture::table(rows)?];
    Ok(String::from(PATIENTS) + &tables.concat())
}

pub(crate) fn real(rows: &[real::Row]) -> Result<String> {
    Ok(String::from(REAL) + &real_rows(rows)?)
}

pub(crate) fn segmentation(study: &Study, speed: &str) -> Result<String> {
    Ok([STUDY, &study_tables::tables(study)?, SPEED, speed].concat())
}

pub(crate) fn meshes(rows: &[mesh::Row], others: &str) -> Result<String> {
    let lines: Vec<String> = rows.iter().map(|row| mesh::line("", row)).collect::<Result<_>>()?;
    Ok([MESH, &lines.concat(), others].concat())
}

fn patient_rows(rows: &[patients::Row]) -> Result<String> {
    let mut movement = String::from(
        "| patient | given tissue | tumour moves (true) | tumour error | fiducials: error mean / \
         95 % / max | nipple error |\n|---|---|---|---|---|---|\n",
    );
    let mut image = String::from(
        "\n| patient | HU error in soft tissue: undeformed / run / floor | recovered | Dice soft | \
         Dice wall | wall surface mean / 95 % / max |\n|---|---|---|---|---|---|\n",
    );
    let mut cost = String::from(
        "\n| patient | tetrahedra | dihedral angles | Newton iterations | Jacobian min / 1 % / 99 \
         % / max | seconds | peak memory MB | warnings |\n|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let s = |key: &str| number(&row.score, &format!("/{key}"));
        writeln!(
            movement,
            "| {} | {} | {:.2} mm | **{:.2} mm** | {:.2} / {:.2} / {:.2} mm | {:.2} mm |",
            row.name,
            row.tissue,
            s("tumour_displacement_true_mm")?,
            s("tumour_error_mm")?,
            s("fiducial_error_mean_mm")?,
            s("fiducial_error_p95_mm")?,
            s("fiducial_error_max_mm")?,
            s("nipple_error_mm")?,
        )?;
        writeln!(
            image,
            "| {} | {:.1} / **{:.1}** / {:.1} HU | {:.2} | {:.4} | {:.4} | {:.2} / {:.2} / {:.2} \
             mm |",
            row.name,
            s("hu_no_deformation")?,
            s("hu_error_mean_abs")?,
            s("hu_floor_true_field")?,
            s("hu_recovered")?,
            s("dice_soft_roi")?,
            s("dice_wall_roi")?,
            s("wall_surface_mean_mm")?,
            s("wall_surface_p95_mm")?,
            s("wall_surface_max_mm")?,
        )?;
        cost += &run_row(&row.name, &row.summary)?;
    }
    Ok(movement + &image + &cost)
}

fn real_rows(rows: &[real::Row]) -> Result<String> {
    rows.iter().map(|row| run_row(&row.name, &row.summary)).collect()
}

/// What a run cost and how sound it is.
fn run_row(name: &str, summary: &Value) -> Result<String> {
    let n = |pointer: &str| number(summary, pointer);
    Ok(format!(
        "| {name} | {} (asked {}) | {:.1}-{:.1} deg | {} | {:.2} / {:.2} / {:.2} / {:.2} | {:.1} | \
         {:.0} | {} |\n",
        n("/mesh/tetrahedra")?,
        n("/mesh/asked")?,
        n("/mesh/min_dihedral_deg")?,
        n("/mesh/max_dihedral_deg")?,
        n("/solve/iterations")?,
        n("/warp/jacobian/min")?,
        n("/warp/jacobian/p01")?,
        n("/warp/jacobian/p99")?,
        n("/warp/jacobian/max")?,
        n("/run/total_seconds")?,
        n("/run/peak_memory_mb")?,
        summary["warnings"].as_array().map_or(0, Vec::len),
    ))
}
