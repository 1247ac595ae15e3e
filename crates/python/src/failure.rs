//! Errors of the flow as exceptions of Python, which carry what the command line's JSON does.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};
use supine_flow::{CaseError, Error, RunPlace};
use supine_space::Failure;

/// A class of `supine._error`. It is written in Python: the stable interface before 3.12 has no
/// subclasses of exceptions.
fn class(py: Python<'_>) -> PyResult<Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    CLASS.import(py, "supine._error", "SupineError").cloned()
}

/// The exception of an error.
pub(crate) fn raise(py: Python<'_>, error: &Error) -> PyErr {
    told(py, error.code(), error.kind(), &error.to_string(), error.place())
}

/// The same of values that make no case.
pub(crate) fn raise_case(py: Python<'_>, error: CaseError) -> PyErr {
    raise(py, &Error::Case(error))
}

/// An exception for what Python gave and nobody below saw.
pub(crate) fn refuse(py: Python<'_>, code: &str, message: &str) -> PyErr {
    told(py, code, Failure::Input, message, RunPlace::default())
}

fn told(py: Python<'_>, code: &str, kind: Failure, message: &str, place: RunPlace) -> PyErr {
    let made = || -> PyResult<Bound<'_, PyAny>> {
        let of = PyDict::new(py);
        let RunPlace { file, key, stage } = place;
        let file = file.map(|path| path.to_string_lossy().into_owned());
        for (name, value) in [("file", file), ("key", key), ("stage", stage)] {
            if let Some(value) = value {
                of.set_item(name, value)?;
            }
        }
        let advice = supine_flow::advice_of(kind, message);
        class(py)?.call1((message, code, kind.name(), kind.exit_code(), of, advice))
    };
    made().map_or_else(|error| error, PyErr::from_value)
}
