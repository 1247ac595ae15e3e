//! Commands of the check: bound to the processors that they have, what they print kept in a file.
//!
//! Cargo compiles the packages of the workspace through this program ([`crate::compiler`]), that is
//! by clippy's driver, which compiles as the compiler does and lints on the way.

use super::pool::Seat;
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A folder for what the jobs print, one file each.
pub(crate) struct Logs {
    folder: PathBuf,
}

impl Logs {
    /// The folder, empty.
    ///
    /// # Errors
    /// When it cannot be made.
    pub(crate) fn new(folder: PathBuf) -> Result<Self> {
        if folder.exists() {
            std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
        }
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(Self { folder })
    }

    /// The file of a job.
    pub(crate) fn path(&self, job: &str) -> PathBuf {
        let name: String =
            job.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        self.folder.join(format!("{name}.log"))
    }
}

/// The same command with no more processors than it was given: whatever asks how many there are,
/// compilers' and rayon's pools as well as `supine` itself, is told these.
pub(crate) fn seated(command: &Command, seat: &Seat) -> Command {
    let list: Vec<String> = seat.processors.iter().map(ToString::to_string).collect();
    let mut bound = Command::new("taskset");
    bound.arg("--cpu-list").arg(list.join(",")).arg(command.get_program());
    bound.args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => bound.env(name, value),
            None => bound.env_remove(name),
        };
    }
    if let Some(folder) = command.get_current_dir() {
        bound.current_dir(folder);
    }
    bound
}

/// The same command, with which cargo compiles and lints the packages of the workspace. All
/// commands of the check that compile have it, so that they share what they compile.
///
/// # Errors
/// When nobody knows where this program lies.
pub(crate) fn linting(command: &mut Command) -> Result<&mut Command> {
    let program = std::env::current_exe().context("this program's own path is not known")?;
    Ok(command.env("RUSTC_WORKSPACE_WRAPPER", program))
}

/// Holds that cargo warned of nothing, in what it printed. Of crates from elsewhere it shows no
/// warnings.
///
/// # Errors
/// With every warning.
pub(crate) fn no_warnings(log: &Path) -> Result<()> {
    let said = std::fs::read(log).with_context(|| log.display().to_string())?;
    let warned = warnings(&String::from_utf8_lossy(&said));
    if warned.is_empty() { Ok(()) } else { bail!("{warned}") }
}

/// The paragraphs that begin with a warning.
fn warnings(said: &str) -> String {
    let is_warning = |paragraph: &&str| {
        paragraph.lines().any(|line| line.starts_with("warning: ") || line.starts_with("warning["))
    };
    said.split_inclusive("\n\n").filter(is_warning).collect()
}

/// Runs a command to its end; all that it prints goes into the file.
///
/// # Errors
/// When it cannot be started or does not end with 0: with what it printed.
pub(crate) fn run_quietly(command: &mut Command, log: &Path) -> Result<()> {
    let file = File::options().create(true).append(true).open(log);
    let file = file.with_context(|| log.display().to_string())?;
    command.stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file);
    let status = command.status().with_context(|| format!("cannot start {command:?}"))?;
    if !status.success() {
        let said = std::fs::read(log).unwrap_or_default();
        bail!("{}\n{command:?} ended with {status}", String::from_utf8_lossy(&said));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::warnings;

    #[test]
    fn warnings_are_told_from_the_rest() {
        let said = "   Compiling a v0.1.0\nwarning: unused variable: `x`\n --> src/lib.rs:1:1\n\nwarning: `a` (lib) \
                    generated 1 warning\n   Compiling b v0.1.0\n\n    Finished `dev` profile\n";
        assert!(warnings(said).contains("src/lib.rs:1:1") && !warnings(said).contains("Finished"));
        assert_eq!(warnings("   Compiling warning: v0.1.0\n    Finished `dev` profile\n"), "");
    }
}
