//! The chest wall of real CTs against contours, each with what was chosen without it.

use super::{Bench, output, real, run};
use anyhow::Result;
use std::process::Command;

const TEXT: &str = include_str!("walls.md");
/// Real CTs with contours, and whether the project owns these.
const CTS: [(&str, bool); 6] = [
    ("breast-flt001", false),
    ("breast-flt013", false),
    ("breast-lidc0314", false),
    ("breast-rider0109", false),
    ("chest-cmb01068", true),
    ("chest-lidc0001", true),
];

/// Text and tables.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    run(Command::new("cargo").args([
        "build",
        "--release",
        "-p",
        "supine-benches",
        "--bin",
        "bench-walls",
    ]))?;
    let reference = bench.shared.join("reference/segment");
    let mut study = Command::new(&bench.python);
    study.arg(bench.house.root.join("xtask/study/walls.py"));
    study.arg(bench.house.target.join("release/bench-walls"));
    study.arg(&reference).arg(bench.work.join("walls"));
    for (name, own) in CTS {
        let ct = real::unpacked(bench, name)?;
        let contours = if own {
            bench.house.root.join(format!("fixtures/contours/{name}.json"))
        } else {
            reference.join(format!("contours_{name}.json"))
        };
        study.arg(format!("{name}={}={}", ct.display(), contours.display()));
    }
    Ok([TEXT, &output(&mut study)?].concat())
}
