//! A session that listens, and the run that it starts from.

use serde_json::Value;
use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use supine_tests::{Case, Finished, Outcome, supine_command};

/// A session is ready after this at the latest: it takes seconds, and much longer where a machine
/// has other work.
const PATIENCE: Duration = Duration::from_secs(300);
/// What a session says once peers can connect; the address follows.
const LISTENS: &str = "OpenIGTLink on ";

/// A folder that goes with the test.
pub(crate) fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a scratch folder can be made")
}

/// A copy of the run of the small case.
pub(crate) fn run_in(folder: &Path) -> PathBuf {
    let copy = folder.join("run");
    Finished::of(&Case::small()).copy_to(&copy);
    copy
}

/// `supine navigate` at work; killed when the test fails.
pub(crate) struct Session {
    child: Child,
    pub(crate) port: u16,
    /// What it says from then on.
    said: Receiver<String>,
}

impl Session {
    /// Starts one on a free port and waits until it listens.
    pub(crate) fn start(run: &Path, words: &[&dyn AsRef<OsStr>]) -> Self {
        let mut command = supine_command();
        command.arg("navigate").arg(run).args(["--port", "0", "--json", "--no-progress"]);
        // The stamps of the tests do not keep to time.
        command.args(["--late", "3600000"]);
        command.args(words.iter().map(|word| word.as_ref()));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("supine can be started");
        let (say, said) = channel();
        let stderr = BufReader::new(child.stderr.take().expect("stderr is piped"));
        std::thread::spawn(move || {
            // To the end: who writes into a pipe that nobody reads waits for ever.
            stderr.lines().map_while(Result::ok).for_each(|line| drop(say.send(line)));
        });
        let mut session = Self { child, port: 0, said };
        let mut before = String::new();
        while session.port == 0 {
            let line = session.said.recv_timeout(PATIENCE);
            let line = line.unwrap_or_else(|_| panic!("the session does not listen:\n{before}"));
            before = before + &line + "\n";
            let address = line.strip_prefix(LISTENS).and_then(|rest| rest.split(';').next());
            let port = address.and_then(|address| address.rsplit(':').next());
            session.port = port.and_then(|port| port.parse().ok()).unwrap_or(0);
        }
        session
    }

    /// Ends it as Ctrl-C does, and gives its counts.
    pub(crate) fn end(mut self) -> Value {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &pid]).status().expect("kill can be started");
        assert!(sent.success(), "the session had ended before");
        let mut stdout = String::new();
        let out = self.child.stdout.as_mut().expect("stdout is piped");
        std::io::Read::read_to_string(out, &mut stdout).expect("stdout is text");
        let status = self.child.wait().expect("the session ends");
        let said: Vec<String> = self.said.iter().collect();
        assert!(status.success(), "{status}\n{}", said.join("\n"));
        serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("stdout is no JSON: {e}\n{stdout}"))
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // It has ended, unless the test fails.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An answer of a recording.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Recorded {
    /// Stamp of the pose, s since 1970.
    pub(crate) stamp_s: f64,
    /// Place of the tumour, LPS, mm.
    pub(crate) at: [f64; 3],
}

/// The answers of a recording in their order, those that had settled.
pub(crate) fn recorded(path: &Path) -> Vec<Recorded> {
    let text = std::fs::read_to_string(path).expect("the recording can be read");
    let line = |line: &str| {
        let line: Value = serde_json::from_str(line).expect("a line of JSON");
        let stamp = line["stamp"].as_u64().expect("a stamp");
        let at = [0, 1, 2].map(|axis| line["target"][axis].as_f64().expect("a coordinate"));
        let settled = line["state"] == "ok";
        settled.then_some(Recorded { stamp_s: stamp as f64 / (1_u64 << 32) as f64, at })
    };
    text.lines().skip(1).filter_map(line).collect()
}

/// What a command that ends at once answers.
pub(crate) fn navigate(run: &Path, words: &[&dyn AsRef<OsStr>]) -> Outcome {
    let mut command = supine_command();
    command.arg("navigate").arg(run).arg("--quiet");
    Outcome::of(command.args(words.iter().map(|word| word.as_ref())))
}
