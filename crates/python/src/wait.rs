//! Work beside Python: its lock is free meanwhile, and Ctrl-C and progress are looked after twenty
//! times a second.

use crate::failure::raise;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;
use supine_flow::{Error, NodeId, Observer, Warning};

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// What the work tells while it goes on.
enum Event {
    Share(NodeId, f64),
    Warning(NodeId, Warning),
}

struct Watcher<'a> {
    events: Sender<Event>,
    stop: &'a AtomicBool,
}

impl Watcher<'_> {
    fn tell(&self, event: Event) {
        // Nobody listens any more when Python was told to stop.
        let _gone = self.events.send(event);
    }
}

impl Observer for Watcher<'_> {
    fn begin(&self, node: NodeId) {
        self.tell(Event::Share(node, 0.0));
    }

    fn share(&self, node: NodeId, share: f64) {
        self.tell(Event::Share(node, share));
    }

    fn warning(&self, node: NodeId, warning: &Warning) {
        self.tell(Event::Warning(node, warning.clone()));
    }

    fn end(&self, node: NodeId, _seconds: f64, _cached: bool) {
        self.tell(Event::Share(node, 1.0));
    }

    fn go_on(&self) -> bool {
        !self.stop.load(Ordering::Relaxed)
    }
}

/// Does work of the flow on another thread. `hear` is called as `hear(kind, stage, value, text)`:
/// kind `share` with the share that is done in `value`, or `warning` with its code in `text` before
/// the first line break and its message after.
///
/// # Errors
/// What the work ends with, what `hear` raises, or `KeyboardInterrupt`; in the two last cases the
/// work has ended too.
pub(crate) fn wait<T: Send>(
    py: Python<'_>,
    hear: &Py<PyAny>,
    work: impl FnOnce(&dyn Observer) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let (events, heard) = channel();
    let (done, told) = py.detach(|| {
        let stop = &stop;
        let heard = heard;
        std::thread::scope(|scope| {
            // The watcher is dropped with the end of the work, which ends the loop at once.
            let watcher = Watcher { events, stop };
            let worker = scope.spawn(move || work(&watcher));
            let told = listen(&heard, hear);
            if told.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            (worker.join(), told)
        })
    });
    told?;
    match done {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(raise(py, &error)),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// Passes events on until the work ends.
fn listen(heard: &Receiver<Event>, hear: &Py<PyAny>) -> PyResult<()> {
    loop {
        let first = match heard.recv_timeout(LOOK) {
            Ok(event) => Some(event),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        };
        let events: Vec<Event> = first.into_iter().chain(heard.try_iter()).collect();
        Python::attach(|py| {
            py.check_signals()?;
            newest(events).iter().try_for_each(|event| pass_on(py, event, hear))
        })?;
    }
}

/// Of several shares of a node in a row only the last: a stage may tell thousands.
fn newest(events: Vec<Event>) -> Vec<Event> {
    let mut kept: Vec<Event> = vec![];
    for event in events {
        let same = match (kept.last(), &event) {
            (Some(Event::Share(last, share)), Event::Share(node, _)) => {
                last == node && *share > 0.0
            }
            _ => false,
        };
        if same {
            kept.pop();
        }
        kept.push(event);
    }
    kept
}

fn pass_on(py: Python<'_>, event: &Event, hear: &Py<PyAny>) -> PyResult<()> {
    match event {
        Event::Share(node, share) => hear.call1(py, ("share", node.name(), *share, "")),
        Event::Warning(node, warning) => {
            let text = format!("{}\n{}", warning.code, warning.message);
            hear.call1(py, ("warning", node.name(), 0.0, text))
        }
    }
    .map(drop)
}
