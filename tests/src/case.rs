//! Case files for the fixture patient.

use crate::workspace::root;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A case of the fixture patient, small enough to run in seconds; each entry can be replaced to
/// break it.
#[derive(Clone, Debug)]
pub struct Case {
    entries: Vec<(String, String)>,
}

impl Case {
    /// The fixture patient on a table tilted by AP 7°, LAT 5°, with 1,000 linear tetrahedra.
    pub fn small() -> Self {
        let ct = source();
        let mut case = Self { entries: Vec::new() };
        case.set("ct", &toml_string(&ct));
        case.set("breast", "\"left\"");
        case.set("table", "{ ap = 7.0, lat = 5.0 }");
        case.set("tumour", "{ centre = [91.37, -248.09, -594.5], radius = 9.0 }");
        case.set("region", "{ centre = [99.0, -236.5, -612.5], radius = 96.0 }");
        case.set("mesh", "{ tetrahedra = 1000, order = 1 }");
        case
    }

    /// The small case with a tumour that the chest wall holds: nobody may use what comes of it.
    pub fn held() -> Self {
        Self::small().with("tumour", "{ centre = [81.8, -222.0, -612.5], radius = 5.0 }")
    }

    /// Sets an entry to a value, written as TOML.
    pub fn set(&mut self, key: &str, value: &str) -> &mut Self {
        self.entries.retain(|(k, _)| k != key);
        self.entries.push((key.to_owned(), value.to_owned()));
        self
    }

    /// The same case with another CT.
    #[must_use]
    pub fn with_ct(mut self, ct: &Path) -> Self {
        self.set("ct", &toml_string(ct));
        self
    }

    /// The same case with another entry.
    #[must_use]
    pub fn with(mut self, key: &str, value: &str) -> Self {
        self.set(key, value);
        self
    }

    /// As it stands in a file.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (key, value) in &self.entries {
            writeln!(text, "{key} = {value}").expect("a string takes it");
        }
        text
    }

    /// Writes `case.toml` into a folder.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let path = folder.join("case.toml");
        std::fs::write(&path, self.text()).expect("the case can be written");
        path
    }
}

/// The CT that the cases start from: the slices of the fixture patient.
pub fn source() -> PathBuf {
    root().join("fixtures/patient/ct")
}

/// A path as a TOML string.
fn toml_string(path: &Path) -> String {
    format!("'{}'", path.display())
}
