//! DICOM: folders of many files, what `supine verify-export` finds, and the way to an archive and
//! back.

use super::{Bench, output, run};
use anyhow::Result;
use std::path::Path;
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
    let (series, fixture) =
        (house.target.join("release/examples/series"), house.root.join("fixtures/patient/ct"));
    let mut script = Command::new(house.target.join("readers/bin/python"));
    script.arg(house.root.join("xtask/study/dicom.py")).arg(&bench.supine).arg(&series);
    script.arg(&fixture).arg(bench.shared.join("reference/dicom"));
    let report = output(script.arg(chest).arg(&work))?;
    Ok(String::from(TEXT) + &report + &network(bench, &series, &fixture, &work)?)
}

/// Times of an archive, in a network name space: Orthanc listens on every address.
fn network(bench: &Bench<'_>, series: &Path, fixture: &Path, work: &Path) -> Result<String> {
    let (export, scratch) = (work.join("to-send"), work.join("network"));
    for old in [&export, &scratch] {
        if old.exists() {
            std::fs::remove_dir_all(old)?;
        }
    }
    std::fs::create_dir(&scratch)?;
    run(Command::new(series).arg("copy").arg(fixture).arg(&export))?;
    let mut script = Command::new("unshare");
    script.args(["-n", "sh", "-c", "ip link set lo up && PATH=$PATH:/usr/sbin exec \"$@\"", "sh"]);
    script.arg(bench.house.target.join("readers/bin/python")).arg("-B");
    script.arg(bench.house.root.join("xtask/study/network.py"));
    output(script.arg(&bench.supine).arg(export).arg(fixture).arg(scratch))
}
