//! Our mesher beside CGAL, gmsh and MMG, and the meshers one can choose beside each other.

use super::mesh::{self, Reference, surfaces};
use super::{Bench, environment, number, output, run};
use crate::meshers;
use anyhow::Result;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The labels of both tables.
const LABELS: &str = "dome";
/// Counts at which the other programs are run.
const BESIDE: [usize; 3] = [1581, 4997, 11_828];
/// Counts at which the meshers of `supine` are run, and those.
const CHOSEN: [usize; 4] = [1581, 4997, 11_828, 40_000];
const MESHERS: [&str; 3] = ["native", "cgal", "tetgen"];
/// Tetrahedra of the mesh whose surface gmsh is given.
const FINE: usize = 40_000;

const CHOSEN_TEXT: &str = include_str!("meshers.md");
const BESIDE_TEXT: &str = include_str!("peers.md");

/// The meshers that `supine mesh --mesher` offers: text and table.
pub(crate) fn chosen(bench: &Bench<'_>) -> Result<String> {
    let supine = with_meshers(bench)?;
    let reference = Reference::open(bench, LABELS)?;
    let mut page = String::from(CHOSEN_TEXT);
    for (asked, mesher) in CHOSEN.into_iter().flat_map(|n| MESHERS.map(|m| (n, m))) {
        let mut command = Command::new(&supine);
        command.env("RAYON_NUM_THREADS", "1").args(["mesh", "--overwrite", "--mesher", mesher]);
        let out = bench.work.join(format!("{LABELS}-{asked}-{mesher}.vtu"));
        page += &mesh::line(&format!(" {mesher} |"), &reference.row(command, asked, &out)?)?;
    }
    Ok(page)
}

/// `supine` with all meshers, kept beside the plain one.
fn with_meshers(bench: &Bench<'_>) -> Result<PathBuf> {
    meshers::install()?;
    let build = ["build", "--release", "-p", "supine"];
    run(Command::new("cargo").args(build).args(["--features", "cgal,tetgen"]))?;
    let kept = bench.work.join("supine-meshers");
    std::fs::copy(&bench.supine, &kept)?;
    run(Command::new("cargo").args(build))?;
    Ok(kept)
}

/// A mesh of another program, or ours.
struct Peer {
    name: &'static str,
    runs: usize,
    once_s: f64,
    search_s: f64,
    score: Value,
}

/// Our mesher beside other programs: text and table.
pub(crate) fn beside(bench: &Bench<'_>) -> Result<String> {
    meshers::install()?;
    let features = ["-p", "supine-benches", "--features", "cgal"];
    run(Command::new("cargo").args(["build", "--release"]).args(features))?;
    let python = environment(bench.house, "peers")?;
    let reference = Reference::open(bench, LABELS)?;
    let fine = bench.work.join("fine.vtu");
    let mut ours = Command::new(&bench.supine);
    ours.args(["mesh", "--overwrite"]);
    reference.row(ours, FINE, &fine)?;
    let mut page = String::from(BESIDE_TEXT);
    for asked in BESIDE {
        let peers = peers(bench, &reference, &python, &fine, asked)?;
        let native_s = peers[0].once_s;
        for peer in &peers {
            page += &line(asked, peer, native_s)?;
        }
    }
    Ok(page)
}

/// All programs at one count, ours first.
fn peers(
    bench: &Bench<'_>,
    reference: &Reference<'_>,
    python: &Path,
    fine: &Path,
    asked: usize,
) -> Result<Vec<Peer>> {
    let count = asked.to_string();
    let folder = bench.work.join(format!("beside-{asked}"));
    std::fs::create_dir_all(&folder)?;
    let mut own = Command::new(bench.house.target.join("release/bench-mesh"));
    own.env("RAYON_NUM_THREADS", "1").arg(&reference.labels).arg(&reference.centre);
    own.arg(reference.radius.to_string()).arg(&count).arg(&folder);
    let own: Value = serde_json::from_str(&output(&mut own)?)?;
    let n = |key: &str| number(&own, &format!("/{key}"));
    let (native, cgal) = (folder.join("native.vtu"), folder.join("cgal.vtu"));
    let native_s = n("native_s")?;
    let mut peers = vec![
        Peer {
            name: "ours",
            runs: 1,
            once_s: native_s,
            search_s: native_s,
            score: reference.score(&native, asked)?,
        },
        Peer {
            name: "CGAL",
            runs: n("cgal_runs")? as usize,
            once_s: n("cgal_once_s")?,
            search_s: n("cgal_search_s")?,
            score: reference.score(&cgal, asked)?,
        },
    ];
    for (name, kind, given) in [("gmsh", "gmsh", fine), ("MMG", "mmg", cgal.as_path())] {
        let out = folder.join(format!("{kind}.npz"));
        let mut script = Command::new(python);
        script.arg(bench.house.root.join("xtask/study/peers.py")).arg(kind).arg(given);
        script.arg(&count).arg(n("volume_mm3")?.to_string()).arg(&out);
        let told: Value = serde_json::from_str(&output(&mut script)?)?;
        let t = |key: &str| number(&told, &format!("/{key}"));
        peers.push(Peer {
            name,
            runs: t("runs")? as usize,
            once_s: t("once_s")?,
            search_s: t("search_s")?,
            score: reference.score(&out, asked)?,
        });
    }
    Ok(peers)
}

fn line(asked: usize, peer: &Peer, native_s: f64) -> Result<String> {
    let s = |pointer: &str| number(&peer.score, pointer);
    Ok(format!(
        "| {asked} | {} | {} | {} | {:.1}-{:.1} | {} | {:.2} | {} | {:.2} | {:.2} | {:.2} | {:.2} |\n",
        peer.name,
        s("/tets")?,
        peer.runs,
        s("/dihedral_min")?,
        s("/dihedral_max")?,
        s("/tets_below_30")?,
        s("/radius_ratio_min")?,
        surfaces(&peer.score)?,
        peer.once_s,
        peer.search_s,
        native_s / peer.once_s,
        native_s / peer.search_s,
    ))
}
