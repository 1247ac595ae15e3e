//! The time of a run is that which one waits for it.

use crate::support::patient;
use std::sync::{Condvar, Mutex};
use std::time::{Duration, Instant};
use supine_flow::{NodeId, Observer, Options, RunFolder, Session, Spec};

/// Two stages that rest on the CT alone. Nothing is at work on the session's threads when they
/// begin, so that they may be held up there: a thread that waits for a share of some other stage
/// could take up one of them and would then wait for itself.
const PAIR: [NodeId; 2] = [NodeId::Source, NodeId::Tumour];
/// However busy the machine, the second of them has begun by then, if it does not wait for the
/// first to end.
const PATIENCE: Duration = Duration::from_secs(300);

/// Lets neither of the pair go on before both have begun, and then both work at once for longer
/// than the run took to come to them.
struct Together {
    begun: Instant,
    /// How many of the pair have begun.
    met: Mutex<usize>,
    both: Condvar,
    /// Begin of the first stage and end of the last, since the run began.
    span: Mutex<Option<[Duration; 2]>>,
}

impl Together {
    fn see(&self) {
        let now = self.begun.elapsed();
        let mut span = self.span.lock().unwrap();
        *span = Some([span.map_or(now, |[first, _]| first), now]);
    }
}

impl Observer for Together {
    fn begin(&self, node: NodeId) {
        self.see();
        if PAIR.contains(&node) {
            let mut met = self.met.lock().unwrap();
            *met += 1;
            self.both.notify_all();
            let alone = |met: &mut usize| *met < PAIR.len();
            drop(self.both.wait_timeout_while(met, PATIENCE, alone).unwrap());
            std::thread::sleep(self.begun.elapsed() + Duration::from_secs(1));
        }
    }

    fn end(&self, node: NodeId, _: f64, _: bool) {
        if PAIR.contains(&node) {
            let met = *self.met.lock().unwrap();
            assert_eq!(met, PAIR.len(), "{node} ended before the other of {PAIR:?} began");
        }
        self.see();
    }
}

#[test]
fn stages_side_by_side_are_not_summed() {
    let dir = tempfile::tempdir().unwrap();
    let spec = Spec::from_text(&patient(dir.path()), dir.path()).unwrap();
    let folder = RunFolder::open(&dir.path().join("out")).unwrap();
    let session = Session::new(spec, 2).unwrap().with_folder(folder).unwrap();
    let begun = Instant::now();
    let together =
        Together { begun, met: Mutex::default(), both: Condvar::new(), span: Mutex::default() };
    let summary = supine_flow::run(&session, Options::default(), &together).unwrap();
    let waited = begun.elapsed().as_secs_f64();
    let run = summary.unwrap().run;
    let sum: f64 = run.stages.iter().map(|stage| stage.seconds).sum();
    let total = run.total_seconds;
    assert!(
        sum > total,
        "{total} s of stages that took {sum} s and of which two were held together"
    );
    assert!(total <= waited, "{total} s of {waited} s");
    let [first, last] = together.span.into_inner().unwrap().unwrap();
    let stages = (last - first).as_secs_f64();
    assert!(total >= stages, "{total} s from the first stage to the last, which took {stages} s");
}
