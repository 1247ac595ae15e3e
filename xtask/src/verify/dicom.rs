//! DICOM: folders of many files, and what `supine verify-export` finds.

use super::{Bench, output, run};
use anyhow::Result;
use std::process::Command;

const TEXT: &str = include_str!("dicom.md");

/// Times and the table of planted defects.
pub(crate) fn section(bench: &Bench<'_>) -> Result<String> {
    let house = bench.house;
    let example = ["build", "--release", "-p", "supine-dicom", "--example", "series"];
    run(Command::new("cargo").args(example))?;
    let work = bench.work.join("dicom");
    let chest = work.join("chest");
    std::fs::create_dir_all(&chest)?;
    let packed = bench.shared.join("real/chest-lidc0001/series.tar.zst");
    run(Command::new("tar").arg("--zstd").arg("-xf").arg(packed).arg("-C").arg(&chest))?;
    let mut script = Command::new(house.target.join("readers/bin/python"));
    script.arg(house.root.join("xtask/study/dicom.py")).arg(&bench.supine);
    script.arg(house.target.join("release/examples/series"));
    script.arg(house.root.join("fixtures/patient/ct")).arg(bench.shared.join("reference/dicom"));
    Ok(String::from(TEXT) + &output(script.arg(chest).arg(work))?)
}
