//! The modulus by scans of the synthetic patients.

use super::{Bench, output, patients};
use anyhow::Result;
use std::process::Command;

const TEXT: &str = include_str!("fit.md");
const SCRIPT: &str = "xtask/src/verify/fit.py";

pub(crate) fn section(bench: &Bench<'_>) -> Result<String> {
    let work = bench.work.join("fit");
    let mut score = Command::new(&bench.python);
    score.arg(bench.house.root.join(SCRIPT)).arg(&bench.supine).arg(&work);
    for (name, folder) in patients::folders(bench) {
        let ct = patients::unpacked(&folder, &work.join("ct").join(name))?;
        score.arg(format!("{name}={}={}", folder.display(), ct.display()));
    }
    Ok(String::from(TEXT) + &output(&mut score)?)
}
