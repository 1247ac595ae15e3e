//! Packages of Debian's.

use crate::readers::{on_path, succeeds};
use crate::steps::run;
use anyhow::{Context, Result, bail};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How long to wait for another program that installs packages: unattended upgrades take minutes
/// after a start.
const PATIENCE: Duration = Duration::from_secs(1200);
/// How often to ask whether it has ended.
const PAUSE: Duration = Duration::from_secs(5);

/// Installs packages and says so. Waits while another program holds the locks of the package
/// database, and tries a broken download again.
///
/// # Errors
/// When that is not possible; the message says what to do by hand.
pub(crate) fn install(packages: &[&str]) -> Result<()> {
    let names = packages.join(" ");
    println!("installing Debian packages, once: {names}");
    let by_hand = || format!("install by hand: apt-get install {names}");
    if !on_path("apt-get") {
        bail!("this machine has no apt-get; {}", by_hand());
    }
    let root = succeeds(Command::new("sh").args(["-c", "test $(id -u) = 0"]));
    if !root && !succeeds(Command::new("sudo").args(["-n", "true"])) {
        bail!("neither root nor sudo without a password; {}", by_hand());
    }
    update(root).with_context(by_hand)?;
    let install = ["install", "--yes", "--quiet", "--no-install-recommends"];
    run(&mut apt(root, &[&install[..], packages].concat())).with_context(by_hand)
}

/// `apt-get` as root.
fn apt(root: bool, arguments: &[&str]) -> Command {
    let mut command = Command::new(if root { "env" } else { "sudo" });
    if !root {
        command.args(["-n", "env"]);
    }
    // In words that `update` knows, without the bar that dpkg draws.
    command.args([
        "DEBIAN_FRONTEND=noninteractive",
        "LC_ALL=C",
        "apt-get",
        "-o",
        "Dpkg::Use-Pty=0",
    ]);
    command.args(["-o", "Acquire::Retries=5"]);
    command.arg("-o").arg(format!("DPkg::Lock::Timeout={}", PATIENCE.as_secs()));
    command.args(arguments);
    command
}

/// Reads the lists of packages. Their lock has no time-out of apt's own.
fn update(root: bool) -> Result<()> {
    let begun = Instant::now();
    loop {
        let output = apt(root, &["update", "-qq"]).stdin(Stdio::null()).output()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() {
            return Ok(());
        }
        if !said.contains("Could not get lock") || begun.elapsed() > PATIENCE {
            bail!("apt-get update failed: {}", said.trim());
        }
        println!("another program is installing packages; waiting for it: {}", said.trim());
        std::thread::sleep(PAUSE);
    }
}
