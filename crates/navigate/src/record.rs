//! A session as a file: one line of JSON for what was asked, then one for each answer.

use crate::Error;
use crate::answer::Answer;
use crate::settings::Settings;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use supine_space::{Point, Pose};

/// The format; another one is another file.
const FORMAT: u32 = 1;

/// The first line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Number of the format.
    pub recording: u32,
    /// Version of the program.
    pub version: String,
    /// The folder of the run.
    pub run: PathBuf,
    /// What was asked for.
    pub settings: Settings,
    /// Expected target registration error, mm.
    pub registration_mm: f64,
}

/// A line for an answer. Lengths in mm, times in s; LPS.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Number of the answer.
    pub number: u64,
    /// Stamp of the pose, as on the wire.
    pub stamp: u64,
    /// Shift of the pose, then its unit quaternion (x, y, z, w).
    pub pose: [f64; 7],
    /// Place of the target.
    pub target: [f64; 3],
    /// Error of the solver as it was told.
    pub error: f64,
    /// How good it was.
    pub state: String,
    /// Age of the pose when the answer was ready.
    pub age: f64,
    /// Time that the solver took.
    pub solve: f64,
    /// Force of the tissue on the applicator, N.
    pub force: [f64; 3],
}

impl Head {
    /// Of a session of this version.
    pub fn new(run: &Path, settings: &Settings, registration_mm: f64) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let (run, settings) = (run.to_owned(), settings.clone());
        Self { recording: FORMAT, version, run, settings, registration_mm }
    }
}

impl Line {
    fn new(answer: &Answer) -> Self {
        let Pose { rotation, translation } = answer.pose;
        let [x, y, z]: [f64; 3] = translation.vector.into();
        let q = rotation.coords;
        Self {
            number: answer.number,
            stamp: answer.stamp.0,
            pose: [x, y, z, q.x, q.y, q.z, q.w],
            target: answer.tissue.target.coords.into(),
            error: answer.tissue.error_mm,
            state: answer.state.name().to_owned(),
            age: answer.age_s,
            solve: answer.solve_s,
            force: answer.tissue.force_n.into(),
        }
    }

    /// The pose.
    pub fn pose(&self) -> Pose {
        let [x, y, z, a, b, c, w] = self.pose;
        // The bits that were recorded: normalising once more would change them.
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, a, b, c));
        Pose::from_parts(Translation3::new(x, y, z), rotation)
    }

    /// The target.
    pub fn target(&self) -> Point {
        self.target.into()
    }
}

/// Writes a recording.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Recorder {
    /// A new file; one that is there is not overwritten.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(path: &Path, head: &Head) -> Result<Self, Error> {
        let failed = |source| Error::Write { path: path.into(), source };
        let file = File::options().write(true).create_new(true).open(path).map_err(failed)?;
        let mut recorder = Self { path: path.into(), file: BufWriter::new(file) };
        recorder.line(head)?;
        Ok(recorder)
    }

    /// Adds an answer.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn answer(&mut self, answer: &Answer) -> Result<(), Error> {
        self.line(&Line::new(answer))
    }

    /// All that is there goes to the disk.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn end(mut self) -> Result<(), Error> {
        let done = self.file.flush();
        done.map_err(|source| Error::Write { path: self.path.clone(), source })
    }

    fn line(&mut self, line: &impl Serialize) -> Result<(), Error> {
        let written = serde_json::to_writer(&mut self.file, line)
            .map_err(std::io::Error::from)
            .and_then(|()| self.file.write_all(b"\n"));
        written.map_err(|source| Error::Write { path: self.path.clone(), source })
    }
}

/// A recording that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was asked for.
    pub head: Head,
    /// The answers in their order.
    pub lines: Vec<Line>,
}

impl Recording {
    /// Reads a file. A last line that was not written whole is left out.
    ///
    /// # Errors
    /// When it cannot be read or is no recording.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::Read { path: path.into(), source };
        let file = BufReader::new(File::open(path).map_err(failed)?);
        let wrong = |line: usize, why: String| Error::Recording { path: path.into(), line, why };
        let mut lines = file.lines();
        let first = lines.next().transpose().map_err(failed)?.unwrap_or_default();
        let head: Head = serde_json::from_str(&first).map_err(|e| wrong(1, e.to_string()))?;
        if head.recording != FORMAT {
            let why = format!("it has the format {}, this version reads {FORMAT}", head.recording);
            return Err(wrong(1, why));
        }
        let mut answers: Vec<Line> = vec![];
        let mut cut: Option<(usize, String)> = None;
        for (n, line) in lines.enumerate() {
            if let Some((at, why)) = cut {
                return Err(wrong(at, why));
            }
            let line = line.map_err(failed)?;
            match serde_json::from_str(&line) {
                Ok(line) => answers.push(line),
                Err(error) => cut = Some((n + 2, error.to_string())),
            }
        }
        Ok(Self { head, lines: answers })
    }
}
