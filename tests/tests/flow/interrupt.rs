//! Ctrl-C while a run is at work, and what it still does then.

use std::io::Read;
use std::process::{Child, Command};
use std::time::Duration;
use supine_tests::Outcome;

/// A run gets to any of its stages in this time: the longest way takes ten seconds, and much longer
/// where a machine has other work.
pub(crate) const PATIENCE: Duration = Duration::from_secs(600);

/// Most time of processors that it may still take, s. Work that is stopped looks for it several
/// times a second; how long one waits for it depends on what else the machine does.
const MOST_S: f64 = 3.0;

/// Sends Ctrl-C to a program that is at work and waits for its end; what it answered.
pub(crate) fn interrupt(mut child: Child) -> Outcome {
    let before = worked_s(&child);
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).output();
    kill.expect("kill can be started");
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    let (stdout, stderr) = std::thread::scope(|scope| {
        let stderr = scope.spawn(|| text(stderr));
        (text(stdout), stderr.join().expect("stderr is read"))
    });
    // Until somebody waits for its end, the system knows what it took.
    let after = worked_s(&child);
    let status = child.wait().expect("it ends");
    if let (Some(before), Some(after)) = (before, after) {
        assert!(after - before < MOST_S, "it worked on for {:.1} s", after - before);
    }
    Outcome { code: status.code(), stdout, stderr }
}

/// Time of processors that a program took so far, s; none where the system does not tell it so.
fn worked_s(child: &Child) -> Option<f64> {
    let told = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
    // After the name, which may hold anything: in the program and in the system, in hundredths of a
    // second.
    let (_, fields) = told.rsplit_once(')')?;
    let times = fields.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
    times.sum::<Result<f64, _>>().ok().map(|hundredths| hundredths / 100.0)
}

fn text(pipe: Option<impl Read>) -> String {
    let mut bytes = vec![];
    pipe.expect("it is piped").read_to_end(&mut bytes).expect("it can be read");
    String::from_utf8_lossy(&bytes).into_owned()
}
