//! The tables of the segmentation's study.

use super::number;
use super::study::{Cell, Row, Study};
use anyhow::Result;
use serde_json::Value;
use std::fmt::Write;

const SPREAD: &str = "
The same on variants of every patient: noise added, kernels, slices, tube voltage, sizes, shapes. Dice:
the lowest of the four synthetic patients; distances: the largest of them. `breast-flt013`: clear
parts mean / 95 % / max, bias; unclear parts mean / 95 %; where the variant moves the anatomy there are
no contours. \"Boundary moves\": mean distance, both ways, between the wall's surface (known between the
voxels) and that found in the CT as it is, within the breast's sphere, the largest of all five. Bent and shifted variants are interpolated, their truth too.

| variant | Dice soft | Dice wall | surface mean / 95 % / max | real: clear | real: unclear | skin | \
boundary moves |
|---|---|---|---|---|---|---|---|
";

pub(super) fn tables(study: &Study) -> Result<String> {
    let mut page = beside(study)?;
    page += SPREAD;
    for row in &study.variants {
        let (truth, contours) = (worst(row)?, contours(row)?);
        let moved = row.cells.iter().filter_map(|c| c.moved.as_ref());
        let moved = moved.map(|m| number(m, "/mean_mm")).collect::<Result<Vec<_>>>()?;
        let moved = moved.into_iter().reduce(f64::max);
        let moved = moved.map_or("-".into(), |mm| format!("{mm:.2} mm"));
        writeln!(page, "| {} | {truth} | {contours} | {moved} |", row.name)?;
    }
    Ok(page)
}

/// Ours beside the practitioner's script, on the CTs as they are.
fn beside(study: &Study) -> Result<String> {
    let mut page = String::from("| CT |");
    let ours = study.variants.first();
    let methods: Vec<&Row> = ours.into_iter().chain(&study.others).collect();
    for (n, method) in methods.iter().enumerate() {
        write!(page, " {} |", if n == 0 { "supine" } else { &method.name })?;
    }
    page += "\n|---|";
    page += &"---|".repeat(methods.len());
    page += "\n";
    for (p, name) in study.patients.iter().enumerate() {
        write!(page, "| {name} |")?;
        for method in &methods {
            write!(page, " {} |", figures(&method.cells[p])?)?;
        }
        page += "\n";
    }
    Ok(page)
}

fn figures(cell: &Cell) -> Result<String> {
    if let Some(truth) = &cell.truth {
        let n = |key: &str| number(truth, &format!("/{key}"));
        return Ok(format!(
            "Dice {:.4} / {:.4}; {}",
            n("dice_soft_roi")?,
            n("dice_wall_roi")?,
            triple(truth, "wall_surface_")?
        ));
    }
    match &cell.contours {
        Some(contours) => Ok(format!(
            "clear {}; unclear {}; skin {:.2}",
            triple(contours, "clear_")?,
            triple(contours, "unclear_")?,
            number(contours, "/skin_mean_mm")?
        )),
        None => Ok("-".into()),
    }
}

fn triple(json: &Value, prefix: &str) -> Result<String> {
    let n = |key: &str| number(json, &format!("/{prefix}{key}_mm"));
    Ok(format!("{:.2} / {:.2} / {:.1}", n("mean")?, n("p95")?, n("max")?))
}

/// The worst of the synthetic patients.
fn worst(row: &Row) -> Result<String> {
    let known: Vec<&Value> = row.cells.iter().filter_map(|c| c.truth.as_ref()).collect();
    let all = |key: &str| -> Result<Vec<f64>> {
        known.iter().map(|t| number(t, &format!("/{key}"))).collect()
    };
    let least = |key| Ok::<_, anyhow::Error>(all(key)?.into_iter().fold(f64::INFINITY, f64::min));
    let most = |key| Ok::<_, anyhow::Error>(all(key)?.into_iter().fold(0.0, f64::max));
    Ok(format!(
        "{:.4} | {:.4} | {:.2} / {:.2} / {:.1}",
        least("dice_soft_roi")?,
        least("dice_wall_roi")?,
        most("wall_surface_mean_mm")?,
        most("wall_surface_p95_mm")?,
        most("wall_surface_max_mm")?
    ))
}

fn contours(row: &Row) -> Result<String> {
    let Some(read) = row.cells.iter().find_map(|c| c.contours.as_ref()) else {
        return Ok("- | - | -".into());
    };
    let n = |key: &str| number(read, &format!("/{key}_mm"));
    Ok(format!(
        "{}, {:+.2} | {:.2} / {:.2} | {:.2}",
        triple(read, "clear_")?,
        n("clear_bias")?,
        n("unclear_mean")?,
        n("unclear_p95")?,
        n("skin_mean")?
    ))
}
