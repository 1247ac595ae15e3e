//! `--profile FILE`: the stages over time, as a trace that Perfetto and chrome://tracing open.

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;
use supine_flow::NodeId;

/// What happened so far. Stages that run side by side stand in rows of their own.
pub(crate) struct Profile {
    file: PathBuf,
    begun: Instant,
    trace: Mutex<Trace>,
}

#[derive(Default)]
struct Trace {
    events: Vec<Value>,
    /// What is under way in each row, and since when, µs.
    rows: Vec<Option<(NodeId, f64)>>,
    /// When the memory was looked at last, µs.
    looked: f64,
}

/// Time between two looks at the memory while a stage is at work, µs.
const BETWEEN_LOOKS: f64 = 50_000.0;

impl Profile {
    pub(crate) fn new(file: &Path) -> Self {
        Self { file: file.into(), begun: Instant::now(), trace: Mutex::default() }
    }

    /// That no other file is where it is to be written.
    ///
    /// # Errors
    /// When there is one.
    pub(crate) fn check(&self) -> Result<(), supine_flow::Error> {
        let is_trace = |text: &str| {
            let all: Option<Value> = serde_json::from_str(text).ok();
            all.is_some_and(|all| all["traceEvents"].is_array())
        };
        supine_flow::check_text("--profile", &self.file, is_trace)
    }

    /// Now, µs since the start.
    fn now(&self) -> f64 {
        self.begun.elapsed().as_secs_f64() * 1e6
    }

    fn change(&self, change: impl FnOnce(&mut Trace, f64)) {
        let now = self.now();
        let mut trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner);
        trace.look_at_memory(now);
        change(&mut trace, now);
    }

    /// Looks at the memory in the middle of a stage, unless that was done a moment ago.
    pub(crate) fn look(&self) {
        let now = self.now();
        let mut trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner);
        if now - trace.looked >= BETWEEN_LOOKS {
            trace.look_at_memory(now);
        }
    }

    pub(crate) fn begin(&self, node: NodeId) {
        self.change(|trace, now| match trace.rows.iter_mut().find(|row| row.is_none()) {
            Some(free) => *free = Some((node, now)),
            None => trace.rows.push(Some((node, now))),
        });
    }

    pub(crate) fn end(&self, node: NodeId, cached: bool) {
        self.change(|trace, now| {
            let row = trace.rows.iter().position(|row| row.is_some_and(|(of, _)| of == node));
            // What was there already never began.
            let Some((row, (_, since))) = row.and_then(|row| Some((row, trace.rows[row].take()?)))
            else {
                return;
            };
            trace.events.push(json!({
                "name": node.name(), "cat": "stage", "ph": "X", "ts": since, "dur": now - since,
                "pid": 1, "tid": row + 1, "args": { "cached": cached },
            }));
        });
    }

    pub(crate) fn warning(&self, node: NodeId, code: &str) {
        self.change(|trace, now| {
            let row = trace.rows.iter().position(|row| row.is_some_and(|(of, _)| of == node));
            trace.events.push(json!({
                "name": code, "cat": "warning", "ph": "i", "s": "t", "ts": now,
                "pid": 1, "tid": row.map_or(1, |row| row + 1),
            }));
        });
    }

    /// Writes the trace, also of a command that failed: that of a stage that did not end goes up to
    /// now.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn write(&self) -> Result<(), supine_flow::Error> {
        let open: Vec<NodeId> = {
            let trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner);
            trace.rows.iter().flatten().map(|(node, _)| *node).collect()
        };
        open.into_iter().for_each(|node| self.end(node, false));
        let mut trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner);
        let mut events = vec![json!({
            "name": "process_name", "ph": "M", "pid": 1, "args": { "name": "supine" },
        })];
        // Perfetto adds the number of the row.
        events.extend((1..=trace.rows.len()).map(|row| {
            json!({
                "name": "thread_name", "ph": "M", "pid": 1, "tid": row, "args": { "name": "stages" },
            })
        }));
        events.append(&mut trace.events);
        let all = json!({
            "displayTimeUnit": "ms", "traceEvents": events,
            "otherData": { "version": env!("CARGO_PKG_VERSION") },
        });
        supine_flow::write_text(&self.file, &format!("{all:#}\n"))
    }
}

impl Trace {
    fn look_at_memory(&mut self, now: f64) {
        self.looked = now;
        if let Some(mb) = crate::resident::mb() {
            self.events.push(json!({
                "name": "memory", "ph": "C", "ts": now, "pid": 1, "args": { "resident MB": mb },
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_side_by_side_have_rows_of_their_own() {
        let file = std::env::temp_dir().join(format!("supine-trace-{}.json", std::process::id()));
        let profile = Profile::new(&file);
        profile.begin(NodeId::Import);
        profile.begin(NodeId::Segment);
        profile.end(NodeId::Import, false);
        profile.begin(NodeId::Region);
        profile.warning(NodeId::Segment, "wall-uncertain");
        profile.end(NodeId::Segment, true);
        profile.write().unwrap();
        let read: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
        std::fs::remove_file(file).unwrap();
        let events = read["traceEvents"].as_array().unwrap();
        let row = |name: &str| {
            let one = events.iter().find(|e| e["name"] == name && e["ph"] == "X").unwrap();
            assert!(one["dur"].as_f64().unwrap() >= 0.0);
            one["tid"].as_u64().unwrap()
        };
        assert_eq!((row("import"), row("segment"), row("region")), (1, 2, 1));
        let warning = events.iter().find(|e| e["ph"] == "i").unwrap();
        assert_eq!((&warning["name"], &warning["tid"]), (&json!("wall-uncertain"), &json!(2)));
    }
}
