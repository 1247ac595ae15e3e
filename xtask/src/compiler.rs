//! The compiler as the check calls it: cargo starts this program in its place for the packages of
//! the workspace (`RUSTC_WORKSPACE_WRAPPER`). Clippy's driver compiles and lints; how each library
//! and program was compiled is kept beside it, so that rustdoc can read the same compiled crates.
//! Cargo's own `doc` would read every foreign crate once more.

use anyhow::{Context, Result};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How cargo called the compiler for one crate.
pub(crate) struct Call {
    arguments: Vec<String>,
    variables: BTreeMap<String, String>,
    folder: PathBuf,
}

/// Does what cargo asks of the compiler, when it is cargo that started this program in the
/// compiler's place. Comes back only when it is not, or when that cannot be done.
///
/// # Errors
/// When the call cannot be kept or clippy's driver cannot be started.
pub(crate) fn stand_in() -> Result<()> {
    let mut words = std::env::args_os().skip(1);
    let Some(compiler) = words.next() else { return Ok(()) };
    if Path::new(&compiler).file_name() != Some("rustc".as_ref()) {
        return Ok(());
    }
    let mut words: Vec<OsString> = words.collect();
    let texts: Option<Vec<String>> = words.iter().cloned().map(|w| w.into_string().ok()).collect();
    if let Some(arguments) = texts {
        let plainly = is_not_worth_optimising(&arguments);
        keep(arguments)?;
        words.extend(
            plainly.then(|| ["-C", "opt-level=0"].map(OsString::from)).into_iter().flatten(),
        );
    }
    let failed = Command::new("clippy-driver").arg(compiler).args(words).exec();
    Err(failed).context("clippy-driver cannot be started; `rustup component add clippy`")
}

/// Libraries whose unit tests take as long without optimisation: a second each or less, or time on
/// the network.
const LIGHT: [&str; 4] =
    ["supine_dicom", "supine_dicom_network", "supine_flow", "supine_workstation"];

/// Whether tests are not worth optimising, as that takes several times as long as it saves: those
/// beside a library, which only call what is compiled already, and unit tests of [`LIGHT`]. Of two
/// levels the compiler takes the last.
fn is_not_worth_optimising(arguments: &[String]) -> bool {
    let beside = |word: &String| word.ends_with(".rs") && word.contains("/tests/");
    let light = after(arguments, "--crate-name").is_some_and(|name| LIGHT.contains(&name));
    arguments.iter().any(|word| word == "--test") && (light || arguments.iter().any(beside))
}

/// Keeps a call that compiles a crate of a package without features. No package of the workspace
/// has any by default, and the other meshers' are no part of the pages.
fn keep(arguments: Vec<String>) -> Result<()> {
    let (Some(name), Some(out)) =
        (after(&arguments, "--crate-name"), after(&arguments, "--out-dir"))
    else {
        return Ok(());
    };
    if arguments.iter().any(|word| word.starts_with("feature=")) {
        return Ok(());
    }
    let tests = arguments.iter().any(|word| word == "--test");
    let is_of_cargo =
        |name: &str| name == "OUT_DIR" || name.starts_with("CARGO_") && name != "CARGO_MAKEFLAGS";
    let variables: BTreeMap<String, String> =
        std::env::vars().filter(|(name, _)| is_of_cargo(name)).collect();
    let file = path(Path::new(out), name, tests);
    let call = json!({
        "arguments": arguments, "variables": variables, "folder": std::env::current_dir()?,
    });
    std::fs::write(&file, call.to_string()).with_context(|| file.display().to_string())
}

/// Where the call for a crate is kept.
fn path(out: &Path, name: &str, tests: bool) -> PathBuf {
    out.join(format!("{name}.{}.json", if tests { "tests" } else { "compiled" }))
}

/// The word after another.
fn after<'a>(words: &'a [String], first: &str) -> Option<&'a str> {
    let at = words.iter().position(|word| word == first)?;
    words.get(at + 1).map(String::as_str)
}

impl Call {
    /// The last call that compiled a crate into a folder: a program of which only the tests are
    /// compiled goes by these.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn last(out: &Path, name: &str) -> Result<Self> {
        let files = [path(out, name, false), path(out, name, true)];
        let file = files.iter().find(|file| file.is_file());
        let file = file.with_context(|| format!("nothing tells how {name} was compiled"))?;
        let kept: Value = serde_json::from_slice(&std::fs::read(file)?)?;
        let part = |key: &str| kept.get(key).cloned().unwrap_or_default();
        Ok(Self {
            arguments: serde_json::from_value(part("arguments"))?,
            variables: serde_json::from_value(part("variables"))?,
            folder: serde_json::from_value(part("folder"))?,
        })
    }

    /// The command that makes the pages of the crate of what was compiled. A program's pages show
    /// what is private, as cargo's do: nothing of it is public.
    pub(crate) fn documentation(&self, pages: &Path, program: bool) -> Command {
        let mut command = Command::new("rustdoc");
        command.current_dir(&self.folder).envs(&self.variables);
        command.args(for_documentation(&self.arguments)).arg("--out-dir").arg(pages);
        command.args(["-D", "warnings"]);
        if program {
            command.arg("--document-private-items");
        }
        command
    }
}

/// The words of a call that say what the crate is and what it rests on, without those that say how
/// it is compiled.
fn for_documentation(arguments: &[String]) -> Vec<&str> {
    let mut words = arguments.iter().map(String::as_str);
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        match word {
            "-C" | "--out-dir" => drop(words.next()),
            "--test" => {}
            _ if ["--error-format", "--json", "--emit", "--diagnostic-width"]
                .iter()
                .any(|option| word.starts_with(option)) => {}
            _ => kept.push(word),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::{after, for_documentation, is_not_worth_optimising};

    #[test]
    fn tests_beside_a_library_are_told_from_those_in_it() {
        let of = |said: &str| {
            is_not_worth_optimising(&said.split(' ').map(String::from).collect::<Vec<_>>())
        };
        assert!(of("--crate-name series crates/dicom/tests/series/main.rs --test"));
        assert!(of("--crate-name supine_flow crates/flow/src/lib.rs --test"));
        assert!(!of("--crate-name supine_flow crates/flow/src/lib.rs --crate-type lib"));
        assert!(!of("--crate-name supine_warp crates/warp/src/lib.rs --test"));
        assert!(!of("--crate-name supine_tests tests/src/lib.rs --crate-type lib"));
    }

    #[test]
    fn what_the_crate_is_stays_and_how_it_is_compiled_goes() {
        let said = "--crate-name a --edition=2024 src/lib.rs --error-format=json --json=artifacts --crate-type lib \
                    --emit=link -C opt-level=2 --test --cfg x --out-dir o -L dependency=d --extern b=b.rlib";
        let words: Vec<String> = said.split_whitespace().map(String::from).collect();
        let kept = "--crate-name a --edition=2024 src/lib.rs --crate-type lib --cfg x -L dependency=d --extern b=b.rlib";
        assert_eq!(for_documentation(&words).join(" "), kept);
        assert_eq!(after(&words, "--out-dir"), Some("o"));
    }
}
