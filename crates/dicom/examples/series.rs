//! Drives the crate from a shell, for tests with independent readers:
//!
//! `series inspect PATH`, `series read PATH`, `series verify DIR [SOURCE]`, and
//! `series copy PATH OUT`, which exports the unchanged volume as if it had been deformed.
#![expect(clippy::print_stdout, reason = "a program for the shell")]

use std::error::Error;
use std::path::Path;
use supine_dicom::{
    Accept, Depth, Expected, ExportParams, Original, Policy, ReadParams, Verification, inspect,
    read_series, verify_export, write_series,
};
use supine_space::{Progress, Side};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let (params, progress) = (ReadParams::default(), Progress::none());
    match args[..] {
        ["inspect", path] => {
            let inspection = inspect(Path::new(path), Depth::Pixels, Accept::default(), progress)?;
            println!("{}", serde_json::to_string_pretty(&inspection)?);
        }
        ["read", path] => {
            let (ct, _, info) = read_series(Path::new(path), &params, progress)?;
            println!("{:#?}\n{info:#?}", ct.grid());
        }
        ["copy", path, out] => {
            let (ct, source, _) = read_series(Path::new(path), &params, progress)?;
            let params = ExportParams {
                series_description: "DEFORMED by nothing [copy]".into(),
                derivation: "The unchanged volume, exported to test readers".into(),
                image_comments: "SIMULATED DEFORMATION - not acquired anatomy".into(),
                laterality: Side::Left,
                clock: source.clock(),
                software_version: env!("CARGO_PKG_VERSION").into(),
                identity: [0; 32],
                reach_mm: 10.0,
                policy: Policy::default(),
            };
            println!("{:#?}", write_series(&ct, &source, &params, Path::new(out), progress)?);
        }
        ["verify", dir] => {
            print_checks(&verify_export(Path::new(dir), None, Expected::default(), progress)?)
        }
        ["verify", dir, source] => {
            print_checks(&verify_export(
                Path::new(dir),
                Some(Original::Files(Path::new(source))),
                Expected::default(),
                progress,
            )?);
        }
        _ => {
            return Err(
                "usage: series inspect|read PATH, copy PATH OUT, verify DIR [SOURCE]".into()
            );
        }
    }
    Ok(())
}

fn print_checks(verification: &Verification) {
    for check in &verification.checks {
        let verdict = match check.passed {
            Some(true) => "PASS",
            Some(false) => "FAIL",
            None => "SKIP",
        };
        println!("{verdict}  {}   [{}]", check.rule, check.detail);
    }
}
