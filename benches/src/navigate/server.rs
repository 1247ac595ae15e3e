//! A session of the binary as a process.

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};

/// What a session says once peers can connect; the address follows.
const LISTENS: &str = "OpenIGTLink on ";

/// A session that listens; killed when it is dropped.
pub(crate) struct Server {
    child: Child,
    pub(crate) address: SocketAddr,
}

impl Server {
    /// Starts one on a free port.
    pub(crate) fn start(supine: &Path, run: &Path, words: &[String]) -> Result<Self> {
        let mut command = Command::new(supine);
        command.arg("navigate").arg(run).args(["--port", "0", "--json", "--no-progress"]);
        command.args(words).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().with_context(|| format!("{command:?}"))?;
        let mut stderr = BufReader::new(child.stderr.take().context("no stderr")?);
        let address = address(&mut stderr);
        let server = |address| Self { child, address };
        // To the end: who writes into a pipe that nobody reads waits for ever.
        std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
        Ok(server(address?))
    }

    /// Memory that it holds, MB.
    pub(crate) fn memory_mb(&self) -> Result<f64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id()))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib: f64 = line.context("no VmRSS")?.trim().trim_end_matches("kB").trim().parse()?;
        Ok(kib * 1.024e-3)
    }

    /// Ends it as Ctrl-C does, and gives its counts.
    pub(crate) fn end(mut self) -> Result<Value> {
        let pid = self.child.id().to_string();
        ensure!(Command::new("kill").args(["-INT", &pid]).status()?.success(), "it had ended");
        let mut told = String::new();
        self.child.stdout.as_mut().context("no stdout")?.read_to_string(&mut told)?;
        let status = self.child.wait()?;
        ensure!(status.success(), "the session: {status}");
        Ok(serde_json::from_str(&told)?)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It has ended, unless something failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The address that a session says it listens on.
fn address(stderr: &mut BufReader<ChildStderr>) -> Result<SocketAddr> {
    let mut before = String::new();
    loop {
        let mut line = String::new();
        let read = stderr.read_line(&mut line)?;
        ensure!(read > 0, "the session does not listen:\n{before}");
        let address = line.strip_prefix(LISTENS).and_then(|rest| rest.split(';').next());
        if let Some(address) = address {
            return Ok(address.trim().parse()?);
        }
        before += &line;
    }
}

/// A process of this program that keeps a core busy as long as this is held.
pub(crate) struct Hog(Child);

impl Hog {
    pub(crate) fn start() -> Result<Self> {
        let own = std::env::current_exe()?;
        Ok(Self(Command::new(own).arg("hog").stdin(Stdio::piped()).spawn()?))
    }
}

impl Drop for Hog {
    fn drop(&mut self) {
        // Nothing is to be saved.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
