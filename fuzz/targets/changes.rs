//! Changes of a case: typed ones, `KEY=VALUE` a line, and a JSON object of values, as Python gives
//! them.
#![no_main]

use supine_flow::Spec;

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let Ok(text) = std::str::from_utf8(input) else { return };
    let mut spec = Spec::new("/nowhere");
    if let Ok(given) = serde_json::from_str(text) {
        let _ = spec.merge(&given);
    } else {
        for (key, value) in text.lines().filter_map(|line| line.split_once('=')) {
            let _ = spec.change(key, value);
        }
    }
    let Ok(case) = spec.case().map(|case| case.canonical()) else { return };
    // What a case says of its values gives the same values again.
    let all = spec.edits().into_iter().map(|edit| (edit.key, edit.value)).collect();
    let mut again = Spec::new("/nowhere");
    again.merge(&all).expect("values that were taken are taken again");
    assert_eq!(again.case().map(|case| case.canonical()).ok(), Some(case));
});
