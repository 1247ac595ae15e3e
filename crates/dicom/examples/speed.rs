//! How long an export takes, part by part: `speed SERIES OUT`.
#![expect(clippy::print_stdout, reason = "a program for the shell")]
#![expect(clippy::disallowed_methods, reason = "it measures times")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;
use supine_dicom::{
    Expected, ExportParams, Original, Policy, ReadParams, read_series, verify_export, write_series,
};
use supine_space::{Progress, Side};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [series, out] = &args[..] else { return Err("usage: speed SERIES OUT".into()) };
    let (series, out, progress) = (Path::new(series), Path::new(out), Progress::none());
    let begun = Instant::now();
    let (ct, source, _) = read_series(series, &ReadParams::default(), progress)?;
    println!("read   {:.3} s", begun.elapsed().as_secs_f64());
    let params = ExportParams {
        series_description: "DEFORMED by nothing [copy]".into(),
        derivation: "The unchanged volume, exported to measure times".into(),
        image_comments: "SIMULATED DEFORMATION - not acquired anatomy".into(),
        laterality: Side::Left,
        clock: source.clock(),
        software_version: "0.1.0".into(),
        identity: [0; 32],
        reach_mm: 10.0,
        policy: Policy::default(),
    };
    let begun = Instant::now();
    write_series(&ct, &source, &params, out, progress)?;
    println!("write  {:.3} s", begun.elapsed().as_secs_f64());
    let begun = Instant::now();
    let files = verify_export(out, Some(Original::Files(series)), Expected::default(), progress)?;
    println!("verify {:.3} s, the source read again", begun.elapsed().as_secs_f64());
    let begun = Instant::now();
    let held = Original::Read { ct: &ct, source: &source };
    let checks = verify_export(out, Some(held), Expected::default(), progress)?;
    let same = if checks == files { "the same verdict" } else { "ANOTHER VERDICT" };
    println!("verify {:.3} s, the source in memory: {same}", begun.elapsed().as_secs_f64());
    Ok(())
}
