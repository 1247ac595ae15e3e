//! The text of docs/VERIFICATION.md.

use super::study::Study;
use super::{image, mesh, number, patients, real, study_tables, texture};
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;

const HEAD: &str = include_str!("head.md");
const MESH: &str = include_str!("mesh.md");
const REAL: &str = include_str!("real.md");
const STUDY: &str = include_str!("study.md");
const SPEED: &str = include_str!("speed.md");
const TESTS: &str = include_str!("tests.md");

pub(crate) fn page(
    date: &str,
    patients: &[patients::Row],
    real: &[real::Row],
    (study, speed): (&Study, &str),
    (meshes, others): (&[mesh::Row], &str),
) -> Result<String> {
    let mut page = HEAD.replace("{date}", date);
    page += &patient_rows(patients)?;
    page += &image::table(patients)?;
    page += &texture::table(patients)?;
    page += REAL;
    page += &real_rows(real)?;
    page += STUDY;
    page += &study_tables::tables(study)?;
    page += SPEED;
    page += speed;
    page += MESH;
    for row in meshes {
        page += &mesh::line("", row)?;
    }
    page += others;
    page += TESTS;
    Ok(page)
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
