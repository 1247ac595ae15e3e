//! Tissue that an applicator presses, beside another program's solution.

use super::{Bench, environment, number, output, run};
use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;
use std::process::Command;

const TEXT: &str = include_str!("contact.md");

/// Text and table.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let build = ["build", "--release", "-p", "supine-benches", "--bin", "bench-contact"];
    run(Command::new("cargo").args(build))?;
    let python = environment(bench.house, "solvers")?;
    let folder = bench.work.join("contact");
    std::fs::create_dir_all(&folder)?;
    let mut own = Command::new(bench.house.target.join("release/bench-contact"));
    own.arg(bench.shared.join("reference/fem")).arg(&folder);
    let mut page = String::from(TEXT);
    for line in output(&mut own)?.lines() {
        let told: Value = serde_json::from_str(line)?;
        let name = told["name"].as_str().context("a problem without a name")?;
        let mut peer = Command::new(&python);
        peer.arg(bench.house.root.join("xtask/study/contact.py"));
        peer.arg(folder.join(format!("{name}.npz")));
        let peer: Value = serde_json::from_str(&output(&mut peer)?)?;
        let n = |key: &str| number(&peer, &format!("/{key}"));
        let last = peer["rounds_mm"].as_array().and_then(|all| all.last()?.as_f64());
        let [from, mesh, elements] = words(name).context("three words name a problem")?;
        write!(page, "| {from} | {mesh} | {elements} | {} |", number(&told, "/pressed")?)?;
        write!(page, " {:.1} | {:.4} / {:.5} |", n("moved_mm")?, n("off_mm")?, n("mean_mm")?)?;
        write!(
            page,
            " {:.1} | {:.3} | {:.3} |",
            n("force_mn")?,
            1e2 * n("force_off")?,
            1e2 * n("node_force_off")?
        )?;
        writeln!(page, " {:.4} |", last.context("no rounds")?)?;
    }
    Ok(page)
}

fn words(name: &str) -> Option<[&str; 3]> {
    let mut words = name.splitn(3, '-');
    Some([words.next()?, words.next()?, words.next()?])
}
