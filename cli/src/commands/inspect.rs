//! `supine inspect`.

use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use supine_dicom::{Inspection, SeriesReport};
use supine_space::Progress;

pub(crate) fn inspect(args: &args::Inspect, screen: &Screen) -> Result<u8, Failure> {
    let watch = |share| screen.share("inspect", share);
    let found = supine_dicom::inspect(&args.path, Progress::new(&watch))?;
    screen.clear();
    if screen.json {
        screen.result(&found, "");
    } else {
        print(&found);
    }
    Ok(u8::from(found.usable().next().is_none()))
}

fn print(found: &Inspection) {
    if found.series.is_empty() {
        println!("no CT series");
    }
    for series in &found.series {
        print_series(series);
    }
    for kind in &found.other {
        println!("left out: {} x {}", kind.files, kind.kind);
    }
    for file in &found.foreign {
        println!("left out: {}: {}", file.file, file.reason);
    }
    for warning in found.damaged.iter().chain(&found.warnings) {
        println!("warning: {warning}");
    }
}

fn print_series(series: &SeriesReport) {
    let verdict = match &series.reason {
        None => "usable".to_string(),
        Some(reason) => format!("NOT usable: {reason}"),
    };
    println!("series {}", series.uid);
    println!("  {verdict}");
    println!("  {:?}, number {:?}, {} slices", series.description, series.number, series.slices);
    if let Some(grid) = &series.grid {
        let ([i, j, k], [x, y, z]) = (grid.size, grid.spacing);
        println!("  {i} x {j} x {k} voxels of {x} x {y} x {z} mm, {}", series.patient_position);
    }
    for warning in &series.warnings {
        println!("  warning: {warning}");
    }
}
