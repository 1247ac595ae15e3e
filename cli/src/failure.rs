//! How a command ends without its result, or with one that is not what was hoped for.

use serde_json::{Value, json};
use std::path::Path;
use supine_flow::{RunError, RunPlace};
use supine_space::Failure as Kind;

/// A message for people and a kind, which has the exit code for scripts.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) kind: Kind,
    pub(crate) message: String,
    status: &'static str,
    code: &'static str,
    // Failures are rare and results small: it does not weigh on them.
    place: Box<RunPlace>,
    advice: Option<String>,
}

impl Failure {
    /// The kind alone is its code.
    pub(crate) fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self::coded(kind, kind.name(), message)
    }

    /// A failure with a code: a word that stays the same from version to version.
    pub(crate) fn coded(kind: Kind, code: &'static str, message: impl Into<String>) -> Self {
        let message = message.into();
        let advice = supine_flow::advice(&message);
        Self { kind, message, status: "failed", code, place: Box::default(), advice }
    }

    /// The same with the file or folder that it is about.
    #[must_use]
    pub(crate) fn at(mut self, file: &Path) -> Self {
        self.place.file = Some(file.into());
        self
    }

    /// The same with what to do, where the message does not say it.
    #[must_use]
    pub(crate) fn advised(mut self, advice: Option<String>) -> Self {
        self.advice = self.advice.or(advice);
        self
    }

    /// The same with another word for how the command ended.
    #[must_use]
    pub(crate) fn with_status(mut self, status: &'static str) -> Self {
        self.status = status;
        self
    }

    /// What `--json` prints in place of a result.
    pub(crate) fn json(&self) -> Value {
        let (message, advice) = (self.message.clone(), self.advice.clone());
        let mut error = RunError::new(self.kind, self.code, message, advice);
        error.place = (*self.place).clone();
        json!({ "status": self.status, "error": error })
    }

    /// A result with what failed in it; in place of one that has no names.
    pub(crate) fn added_to(&self, result: &impl serde::Serialize) -> serde_json::Result<Value> {
        let mut all = serde_json::to_value(result)?;
        let mut own = self.json();
        if let (Value::Object(all), Value::Object(own)) = (&mut all, &mut own) {
            all.append(own);
            return Ok(Value::Object(std::mem::take(all)));
        }
        Ok(own)
    }
}

impl From<supine_flow::Error> for Failure {
    fn from(error: supine_flow::Error) -> Self {
        let place = Box::new(error.place());
        Self { place, ..Self::coded(error.kind(), error.code(), error.to_string()) }
    }
}

impl From<supine_dicom_network::Error> for Failure {
    fn from(error: supine_dicom_network::Error) -> Self {
        Self::coded(error.kind(), "network", error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_with_names_takes_the_error_in_and_a_list_gives_way() {
        let failure = Failure::coded(Kind::Retry, "network", "broken; go on").at(Path::new("out"));
        let all = failure.added_to(&json!({ "stored": 3 })).unwrap();
        assert_eq!((&all["stored"], &all["status"]), (&json!(3), &json!("failed")));
        assert_eq!(all["error"]["exit"], 75);
        assert_eq!(all["error"]["place"]["file"], "out");
        assert_eq!(all["error"]["advice"], "go on");
        assert_eq!(failure.added_to(&json!([])).unwrap(), failure.json());
    }
}
