//! Programs the tests run: the binary `supine`, the readers' Python, the DICOM validators.

use crate::workspace::{root, target};
use cargo_metadata::Message;
use std::ffi::OsStr;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// What a program answered.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code; none when a signal ended it.
    pub code: Option<i32>,
    /// Data.
    pub stdout: String,
    /// For people.
    pub stderr: String,
}

impl Outcome {
    /// Runs a command to its end, without a keyboard.
    pub fn of(command: &mut Command) -> Self {
        let output = command
            .stdin(Stdio::null())
            .output()
            .unwrap_or_else(|e| panic!("cannot start {command:?}: {e}"));
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// The same, when it ended with 0; anything else fails the test with all it said.
    pub fn success(self, what: &str) -> Self {
        assert_eq!(
            self.code,
            Some(0),
            "{what} failed\n-- stdout\n{}\n-- stderr\n{}",
            self.stdout,
            self.stderr
        );
        self
    }
}

/// Runs `supine` with these arguments: words and paths, as they come.
pub fn supine(arguments: &[&dyn AsRef<OsStr>]) -> Outcome {
    Outcome::of(supine_command().args(arguments.iter().map(|argument| argument.as_ref())))
}

/// Noon of 2026-03-01 UTC: what the binary writes as the time of the run.
const RUN: &str = "1772366400";

/// `supine`, given or freshly built, in the folder of the repository, at one time of all runs.
pub fn supine_command() -> Command {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    let mut command = Command::new(BINARY.get_or_init(|| given().unwrap_or_else(build)));
    command.current_dir(root()).env_remove("RUST_LOG").env_remove("RUST_BACKTRACE");
    command.env("SOURCE_DATE_EPOCH", RUN);
    command
}

/// The binary that whoever runs the tests has built for them.
fn given() -> Option<PathBuf> {
    std::env::var_os("SUPINE").map(PathBuf::from)
}

/// Builds the binary, so that no test judges yesterday's, and tells where cargo put it.
fn build() -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    // What cargo told us of ourselves: else a build script that heeds it runs anew, with all that
    // follows.
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if text.starts_with("CARGO_PKG_") || text.starts_with("CARGO_MANIFEST_") {
            build.env_remove(name);
        }
    }
    let mut build = build
        // From the whole workspace, as `cargo xtask test` does: cargo then chooses the same
        // features of other crates.
        .args(["build", "--workspace", "--bin", "supine"])
        .arg("--message-format=json-render-diagnostics")
        .current_dir(root())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("cargo can be started");
    let messages = BufReader::new(build.stdout.take().expect("cargo's output is piped"));
    // To the last message: cargo fails when nobody listens any more.
    let binary = Message::parse_stream(messages)
        .filter_map(|message| match message {
            Ok(Message::CompilerArtifact(artifact)) if artifact.target.name == "supine" => {
                artifact.executable
            }
            _ => None,
        })
        .last();
    let status = build.wait().expect("cargo ends");
    assert!(status.success(), "`cargo build --workspace --bin supine` failed; see above");
    binary.expect("cargo names the binary it built").into_std_path_buf()
}

/// Runs a script of `tests/readers` with the Python of the independent readers.
pub fn readers_python<S: AsRef<OsStr>>(
    script: &str,
    arguments: impl IntoIterator<Item = S>,
) -> Outcome {
    let script = root().join("tests/readers").join(script);
    python(&script, arguments)
}

/// Runs any script with the Python of the independent readers.
pub fn python<S: AsRef<OsStr>>(script: &Path, arguments: impl IntoIterator<Item = S>) -> Outcome {
    let python = target().join("readers/bin/python");
    assert!(
        python.is_file(),
        "the independent readers are missing ({}): run `cargo xtask readers` once",
        python.display()
    );
    // Compiled Python next to the scripts would dirty the checkout.
    Outcome::of(Command::new(python).arg("-B").arg(script).args(arguments))
}

/// Runs a program of the system, such as a DICOM validator.
pub fn tool<S: AsRef<OsStr>>(program: &str, arguments: impl IntoIterator<Item = S>) -> Outcome {
    let found = std::env::var_os("PATH")
        .is_some_and(|path| std::env::split_paths(&path).any(|p| p.join(program).is_file()));
    assert!(found, "`{program}` is not installed: run `cargo xtask readers` once");
    Outcome::of(Command::new(program).args(arguments))
}
