//! A table of cases, as `supine batch` takes it: its rows, their values, and the page that tells of
//! them. There is no CT, so that every case fails before its work.
#![no_main]

use std::path::Path;
use supine_flow::batch::{Batch, BatchObserver, batch};
use supine_flow::{Options, RunStatus};
use supine_report::Colour;

/// Watches nothing.
struct Unwatched;

impl BatchObserver for Unwatched {}

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    supine_fuzz::file("case.toml", b"ct = 'none'\nbreast = 'left'\nbed = { ap = 1, lat = 2 }\n");
    let table = supine_fuzz::file("cases.csv", input);
    let out = table.with_file_name("out");
    let _ = std::fs::remove_dir_all(&out);
    let given = Batch {
        cases: vec![table],
        out: out.clone(),
        jobs: Some(1),
        memory: Some(1 << 30),
        cores: 1,
        changes: vec![],
        anonymise: input.len() % 2 == 1,
        worst: Colour::Amber,
        options: Options::default(),
        start: None,
    };
    let Ok(done) = batch(&given, &Unwatched) else { return };
    assert!(done.page.is_file() && done.patients == done.ended.len());
    for status in &done.ended {
        assert_eq!(status.exit, 1, "{}", status.line());
        assert_eq!(RunStatus::read(&status.text()).as_ref(), Some(status));
    }
    assert!(stays_in(&out), "a name led out of the folder");
});

/// Whether beside a folder there is nothing but what was put there.
fn stays_in(out: &Path) -> bool {
    let beside = out.parent().and_then(|folder| std::fs::read_dir(folder).ok());
    let known = ["out", "case.toml", "cases.csv"];
    let mut names = beside.into_iter().flatten().flatten().map(|entry| entry.file_name());
    names.all(|name| known.iter().any(|known| name == *known))
}
