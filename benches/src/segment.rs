//! Time and memory of the segmentation of one CT: `bench-segment CT`, JSON on stdout.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads the clock and tells its result"
)]

use anyhow::{Context, Result};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use supine_segment::{Params, Segmenter};
use supine_space::{Grid, Progress};
use supine_volume::{LabelMap, Seeds, label};

/// Changes of the seeds whose median is told.
const CHANGES: usize = 7;

fn main() -> Result<()> {
    let path = std::env::args_os().nth(1).context("bench-segment CT")?;
    let import = Instant::now();
    let input = supine_flow::read_ct(Path::new(&path), &Default::default(), Progress::none())?;
    let import = import.elapsed();
    let field = input.field();
    let ct = Arc::new(input.ct);
    let after_import = peak_mb()?;
    let params = Params::default();
    let whole = Instant::now();
    let segmenter = Segmenter::new(ct.clone(), &field, &params, Progress::none())?;
    let (made, _) = segmenter.segment(&Seeds::default(), Progress::none())?;
    let whole = whole.elapsed();
    let found = peak_mb()?;
    let mut changes = Vec::new();
    for n in 0..CHANGES {
        let seeds = seeds(&made.labels, n);
        let change = Instant::now();
        segmenter.segment(&seeds, Progress::none())?;
        changes.push(change.elapsed().as_secs_f64());
    }
    changes.sort_by(f64::total_cmp);
    let surfaces = Instant::now();
    segmenter.surfaces(&made, Progress::none())?;
    let surfaces = surfaces.elapsed();
    let result = serde_json::json!({
        "size": ct.grid().size(),
        "raw_mb": 2e-6 * ct.grid().len() as f64,
        "import_s": import.as_secs_f64(),
        "segment_s": whole.as_secs_f64(),
        "seed_change_s": changes[CHANGES / 2],
        "surfaces_s": surfaces.as_secs_f64(),
        "peak_import_mb": after_import,
        "peak_segment_mb": found,
        "peak_surfaces_mb": peak_mb()?,
    });
    println!("{result}");
    Ok(())
}

/// A point of soft tissue, another one for each `n`, told to be soft tissue.
fn seeds(labels: &LabelMap, n: usize) -> Seeds {
    let grid: &Grid = labels.grid();
    let middle = grid.len() / 3 + n * grid.len() / (4 * CHANGES);
    let soft = (middle..grid.len()).find(|&n| label::is_soft_tissue(labels.data()[n]));
    let point = soft.map(|n| grid.centre(grid.voxel(n)));
    Seeds { soft_tissue: point.into_iter().collect(), ..Seeds::default() }
}

/// Largest memory this process has held, MB.
fn peak_mb() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status").context("/proc/self/status")?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).context("VmHWM")?;
    let kib: f64 = line.trim().trim_end_matches("kB").trim().parse()?;
    Ok(kib * 1.024e-3)
}
