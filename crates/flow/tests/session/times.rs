//! The time of a run is that which one waits for it.

use crate::support::patient;
use std::time::{Duration, Instant};
use supine_flow::{NodeId, Observer, Options, RunFolder, Session, Spec};

/// Makes every stage take so long that those side by side are told from the sum.
struct Slow;

impl Observer for Slow {
    fn begin(&self, _: NodeId) {
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn stages_side_by_side_are_not_summed() {
    let dir = tempfile::tempdir().unwrap();
    let spec = Spec::from_text(&patient(dir.path()), dir.path()).unwrap();
    let folder = RunFolder::open(&dir.path().join("out")).unwrap();
    let session = Session::new(spec, 2).unwrap().with_folder(folder).unwrap();
    let begun = Instant::now();
    let summary = supine_flow::run(&session, Options::default(), &Slow).unwrap();
    let waited = begun.elapsed().as_secs_f64();
    let run = summary.unwrap().run;
    let sum: f64 = run.stages.iter().map(|stage| stage.seconds).sum();
    assert!(sum > waited, "no two stages ran side by side: {sum} s of {waited} s");
    assert!(run.total_seconds <= waited, "{} s of {waited} s", run.total_seconds);
    assert!(run.total_seconds > 0.9 * waited, "{} s of {waited} s", run.total_seconds);
}
