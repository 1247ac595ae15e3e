//! The case file, and the case in a summary.
#![no_main]

use supine_flow::Spec;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    // The first byte decides which of the two it is.
    let (name, text) = match input.split_first() {
        Some((0, text)) => ("summary.json", text),
        _ => ("case.toml", input),
    };
    if let Ok(spec) = Spec::read(&supine_fuzz::file(name, text)) {
        let _ = spec.case().map(|case| case.canonical());
    }
});
