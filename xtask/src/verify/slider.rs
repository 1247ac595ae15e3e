//! From the slider of the table to the picture, in a browser.

use super::{Bench, output, real};
use anyhow::Result;
use std::process::Command;

const TEXT: &str = include_str!("slider.md");
/// The whole case of the chest CT.
const CASE: &str = "breast = \"left\"\ntable = { ap = 0.0, lat = 0.0 }\n\
                    tumour = { centre = [112.0, -72.0, -165.0], radius = 9.0 }\n";

/// Text and table: of `benches/page/slider.py`.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let folder = bench.work.join("slider");
    std::fs::create_dir_all(&folder)?;
    let case = folder.join("case.toml");
    let ct = real::unpacked(bench, "chest-lidc0001")?;
    std::fs::write(&case, format!("ct = {ct:?}\n{CASE}"))?;
    let house = bench.house;
    let mut script = Command::new(house.target.join("readers/bin/python"));
    script.arg("-B").arg(house.root.join("benches/page/slider.py")).arg("--case").arg(case);
    script.arg("--supine").arg(&bench.supine);
    Ok(String::from(TEXT) + &output(&mut script)?)
}
