//! How a command ends without its result.

use serde_json::{Value, json};
use supine_flow::Place;
use supine_space::Failure as Kind;

/// A message for people and a kind, which has the exit code for scripts.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) kind: Kind,
    pub(crate) message: String,
    code: &'static str,
    place: Place,
}

impl Failure {
    pub(crate) fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), code: kind.name(), place: Place::default() }
    }

    /// What `--json` prints in place of a result.
    pub(crate) fn json(&self) -> Value {
        json!({
            "status": "failed",
            "error": {
                "code": self.code,
                "kind": self.kind.name(),
                "exit": self.kind.exit_code(),
                "message": self.message,
                "place": self.place,
                "advice": advice(&self.message),
            },
        })
    }
}

/// What to do: messages say it last, after a semicolon.
fn advice(message: &str) -> Option<&str> {
    message.rsplit_once("; ").map(|(_, advice)| advice.trim_end())
}

impl From<supine_flow::Error> for Failure {
    fn from(error: supine_flow::Error) -> Self {
        Self {
            code: error.code(),
            place: error.place(),
            ..Self::new(error.kind(), error.to_string())
        }
    }
}

impl From<supine_dicom_network::Error> for Failure {
    fn from(error: supine_dicom_network::Error) -> Self {
        Self { code: "network", ..Self::new(error.kind(), error.to_string()) }
    }
}
