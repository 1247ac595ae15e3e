//! Hours of use of the workstation's page, and the memory of server and page.

use super::{Bench, output, real, run};
use anyhow::Result;
use std::process::{Command, Stdio};

const TEXT: &str = include_str!("hours.md");
/// Names how long it is used, minutes.
const MINUTES: &str = "SUPINE_HOURS_MINUTES";

/// Text and table: of `benches/page/hours.py`.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let folder = bench.work.join("hours");
    std::fs::create_dir_all(&folder)?;
    let patient = bench.house.root.join("fixtures/patient");
    run(Command::new("cp").arg("-r").arg(patient.join("ct")).arg(&folder))?;
    // The page writes into it: what a run before has left there does not count.
    std::fs::copy(patient.join("case.toml"), folder.join("hours-case.toml"))?;
    let case = folder.join("case.toml");
    std::fs::write(&case, format!("ct = {:?}\n", real::unpacked(bench, "chest-lidc0001")?))?;
    let minutes = std::env::var(MINUTES).unwrap_or_else(|_| "240".into());
    let house = bench.house;
    let mut script = Command::new(house.target.join("readers/bin/python"));
    script.arg("-B").arg(house.root.join("benches/page/hours.py")).arg("--case").arg(case);
    script.arg("--supine").arg(&bench.supine).arg("--minutes").arg(minutes);
    // Its progress is seen while it runs.
    script.stderr(Stdio::inherit());
    Ok(String::from(TEXT) + &output(&mut script)?)
}
