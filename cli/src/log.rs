//! `--log json`: what is said on stderr as one JSON object a line, for what gathers logs.

use chrono::{Local, SecondsFormat};
use serde_json::{Map, Value, json};
use supine_flow::{NodeId, Warning};

/// How grave a line is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    Debug,
    Info,
    Warning,
    Error,
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// A line: when (with the zone of the place), how grave, what happened, and what belongs to it.
pub(crate) fn line(level: Level, event: &str, more: Value) -> String {
    let time = Local::now().to_rfc3339_opts(SecondsFormat::Millis, false);
    let mut line = Map::new();
    line.insert("time".into(), time.into());
    line.insert("level".into(), level.name().into());
    line.insert("event".into(), event.into());
    if let Value::Object(more) = more {
        line.extend(more);
    }
    Value::Object(line).to_string()
}

/// A stage begins.
pub(crate) fn begin(node: NodeId) -> String {
    line(Level::Debug, "begin", json!({ "stage": node.name() }))
}

/// A stage tells what it found.
pub(crate) fn found(node: NodeId, text: &str) -> String {
    line(Level::Debug, "found", json!({ "stage": node.name(), "message": text }))
}

/// A stage warns.
pub(crate) fn warning(node: NodeId, warning: &Warning) -> String {
    let more = json!({
        "stage": node.name(), "code": warning.code, "message": warning.message, "values": warning.values,
    });
    line(Level::Warning, "warning", more)
}

/// A stage is done.
pub(crate) fn end(node: NodeId, seconds: f64, cached: bool) -> String {
    let more = json!({
        "stage": node.name(), "seconds": seconds, "cached": cached, "resident_mb": crate::resident::mb(),
    });
    line(Level::Info, "end", more)
}

/// What is said to people.
pub(crate) fn say(text: &str) -> String {
    line(Level::Info, "message", json!({ "message": text }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_one_object_whatever_it_says() {
        let text = say("two\nlines and \"quotes\"");
        assert!(!text.contains('\n'));
        let read: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(read["message"], "two\nlines and \"quotes\"");
        assert_eq!((&read["level"], &read["event"]), (&json!("info"), &json!("message")));
        let time = read["time"].as_str().unwrap();
        assert!(chrono::DateTime::parse_from_rfc3339(time).is_ok(), "{time}");
    }
}
