//! A whole motion with all that goes wrong with trackers, and its replay.

use crate::session::{run_in, scratch};
use serde_json::Value;
use supine_tests::supine;

/// Rows of the short motion by what is to be done with them: 1,158 to take, 4 that are not finite,
/// 5 not rigid and 1 far off to refuse, 8 duplicates and 5 old ones to drop.
const COUNTS: [(&str, u64); 4] =
    [("received", 1181), ("accepted", 1158), ("refused", 10), ("dropped", 13)];

#[test]
fn a_simulated_motion_is_counted_row_by_row_and_its_replay_is_the_same_to_the_bit() {
    let folder = scratch();
    let (run, record) = (run_in(folder.path()), folder.path().join("motion.jsonl"));
    let said = supine(&[
        &"navigate",
        &run,
        &"--simulate",
        &"--port",
        &"0",
        &"--renewal",
        &"between",
        &"--record",
        &record,
        &"--json",
        &"--quiet",
    ])
    .success("a simulated session");
    let told: Value = serde_json::from_str(&said.stdout).expect("one JSON value and nothing else");
    for (key, wanted) in COUNTS {
        assert_eq!(told["poses"][key].as_u64(), Some(wanted), "{key}: {told}");
    }
    let number =
        |part: &str, key: &str| told[part][key].as_u64().unwrap_or_else(|| panic!("{key}"));
    let (followed, overtaken) = (number("answers", "followed"), number("poses", "overtaken"));
    let predicted = number("answers", "predicted");
    // A prediction is followed again unless a newer pose comes.
    assert!((1158..=1158 + predicted).contains(&(followed + overtaken)), "{told}");
    let lines = std::fs::read_to_string(&record).expect("a recording").lines().count() as u64;
    // A head and a line for each answer: one for each pose, and those of predictions that were
    // followed again.
    let recorded = lines - 1;
    let fits = if predicted == 0 { recorded == followed } else { recorded >= followed };
    assert!(fits, "{recorded} recorded: {told}");
    let replayed = supine(&[&"replay", &record, &"--json", &"--quiet"]).success("replay");
    let replayed: Value = serde_json::from_str(&replayed.stdout).expect("JSON");
    assert_eq!(replayed["answers"].as_u64(), Some(recorded), "{replayed}");
    assert_eq!((&replayed["identical"], &replayed["promised"]), (&true.into(), &true.into()));
    assert_eq!(replayed["largest_mm"], 0.0);
    assert_tampering_shows(&record, &folder.path().join("tampered.jsonl"));
}

/// A place that is off by a micrometre is found.
fn assert_tampering_shows(record: &std::path::Path, tampered: &std::path::Path) {
    let text = std::fs::read_to_string(record).expect("a recording");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut line: Value = serde_json::from_str(&lines[40]).expect("JSON");
    let x = line["target"][0].as_f64().expect("a coordinate");
    line["target"][0] = (x + 1e-3).into();
    lines[40] = line.to_string();
    // What follows is not needed.
    lines.truncate(60);
    std::fs::write(tampered, lines.join("\n") + "\n").expect("it can be written");
    let said = supine(&[&"replay", &tampered, &"--quiet"]);
    assert_eq!(said.code, Some(4), "{}\n{}", said.stdout, said.stderr);
    assert!(said.stderr.contains("is not the recording"), "{}", said.stderr);
}
