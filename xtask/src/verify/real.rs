//! The real CTs: no truth, but they must go through, and be looked at.

use super::{Bench, run, run_case};
use anyhow::Result;
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// One breast of a real CT, on a table of AP 7, LAT 5, with the default tissue.
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) summary: Value,
}

/// Folder, side, and a point in the breast that stands for a tumour (LPS, mm).
const BREASTS: [(&str, &str, [f64; 3]); 5] = [
    ("breast-flt013", "left", [60.0, -212.0, -590.0]),
    ("breast-flt013", "right", [-70.0, -215.0, -590.0]),
    ("chest-lidc0001", "left", [112.0, -72.0, -165.0]),
    ("breast-rider0109", "right", [-120.0, -85.0, -140.0]),
    ("chest-cmb01068", "left", [106.0, -76.0, -142.0]),
];

pub(crate) fn all(bench: &Bench<'_>) -> Result<Vec<Row>> {
    BREASTS.iter().map(|(folder, side, tumour)| row(bench, folder, side, tumour)).collect()
}

fn row(bench: &Bench<'_>, folder: &str, side: &str, tumour: &[f64; 3]) -> Result<Row> {
    let ct = unpacked(bench, folder)?;
    let name = format!("{folder}, {side}");
    let case = bench.work.join(format!("{folder}-{side}.toml"));
    std::fs::write(
        &case,
        format!(
            "ct = {ct:?}\nbreast = {side:?}\ntable = {{ ap = 7.0, lat = 5.0 }}\n\
             tumour = {{ centre = {tumour:?}, radius = 5.0 }}\n"
        ),
    )?;
    let out = bench.work.join(format!("{folder}-{side}"));
    Ok(Row { name, summary: run_case(bench, &case, &out)? })
}

/// A slice whose place is there twice, of another acquisition.
const DOUBLED: (&str, &str) = ("breast-rider0109", "2-01.dcm");

/// The folder of slices.
pub(crate) fn unpacked(bench: &Bench<'_>, folder: &str) -> Result<PathBuf> {
    let ct = bench.work.join(folder);
    if !ct.is_dir() {
        std::fs::create_dir_all(&ct)?;
        let packed = bench.shared.join("real").join(folder).join("series.tar.zst");
        run(Command::new("tar").arg("--zstd").arg("-xf").arg(packed).arg("-C").arg(&ct))?;
        if folder == DOUBLED.0 {
            std::fs::remove_file(ct.join(DOUBLED.1))?;
        }
    }
    Ok(ct)
}
