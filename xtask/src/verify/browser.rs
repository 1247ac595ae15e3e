//! The workstation's page beside its peers, in a browser.

use super::{Bench, output, run};
use anyhow::Result;
use std::process::Command;

const TEXT: &str = include_str!("browser.md");

/// Text and tables: of `benches/page`.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    Ok(String::from(TEXT) + &table(bench)?)
}

/// The tables.
pub(super) fn table(bench: &Bench<'_>) -> Result<String> {
    let folder = bench.work.join("page");
    let ct = folder.join("ct");
    if !ct.is_dir() {
        std::fs::create_dir_all(&ct)?;
        let packed = bench.shared.join("real/chest-lidc0001/series.tar.zst");
        run(Command::new("tar").arg("--zstd").arg("-xf").arg(packed).arg("-C").arg(&ct))?;
    }
    let case = folder.join("case.toml");
    std::fs::write(&case, "ct = \"ct\"\n")?;
    let house = bench.house;
    let mut script = Command::new(house.target.join("readers/bin/python"));
    script.arg("-B").arg(house.root.join("benches/page/bench.py")).arg("--case").arg(case);
    script.arg("--supine").arg(&bench.supine).arg("--work").arg(house.target.join("page-bench"));
    output(&mut script)
}
