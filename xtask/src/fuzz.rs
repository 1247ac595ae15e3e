//! `cargo xtask fuzz`: every reader of foreign files is fed bytes that nobody wrote (see
//! fuzz/README.md).

use crate::House;
use crate::steps::run;
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// What an input may cost: memory at once and in all, MB, and time, s.
const LIMITS: [&str; 3] = ["-malloc_limit_mb=512", "-rss_limit_mb=1024", "-timeout=60"];

#[derive(clap::Args)]
pub(crate) struct Options {
    /// Only these targets
    targets: Vec<String>,
    /// How long each runs, s
    #[arg(long, default_value_t = 3600)]
    seconds: u32,
    /// How many run beside each other
    #[arg(long, default_value_t = 2)]
    at_once: usize,
}

/// Runs targets; what they say is added to `target/fuzz/TARGET.log`, from which `cargo xtask verify
/// fuzz` makes its table.
///
/// # Errors
/// When one cannot be built, does not exist or finds something.
pub(crate) fn fuzz(house: &House, options: &Options) -> Result<()> {
    let folder = house.root.join("fuzz");
    let all = targets(&folder)?;
    let unknown = options.targets.iter().find(|t| !all.contains(t));
    ensure!(unknown.is_none(), "no such target; there are {}", all.join(", "));
    let wanted = if options.targets.is_empty() { &all } else { &options.targets };
    let built = house.target.join("fuzz-build");
    let build = ["+nightly", "fuzz", "build"];
    run(Command::new("cargo").args(build).env("CARGO_TARGET_DIR", &built).current_dir(&folder))?;
    let mut failures = Vec::new();
    for group in wanted.chunks(options.at_once.max(1)) {
        let mut running = Vec::new();
        for target in group {
            println!("{target}: {} s", options.seconds);
            running.push((target, start(house, &built, target, options.seconds)?));
        }
        for (target, mut child) in running {
            let status: ExitStatus = child.wait()?;
            if !status.success() {
                failures.push(format!("{target} ({status})"));
            }
        }
    }
    if !failures.is_empty() {
        bail!("found something: {}; see fuzz/artifacts and target/fuzz", failures.join(", "));
    }
    Ok(())
}

/// The names of the targets.
pub(crate) fn targets(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder.join("targets"))? {
        let path = entry?.path();
        names.extend(path.file_stem().map(|name| name.to_string_lossy().into_owned()));
    }
    names.sort();
    Ok(names)
}

/// Where a target's log lies.
pub(crate) fn log(house: &House, target: &str) -> PathBuf {
    house.target.join("fuzz").join(format!("{target}.log"))
}

/// Starts a target on its corpus; new inputs go to `target/fuzz/corpus`, so that the one of the
/// repository stays small.
fn start(house: &House, built: &Path, target: &str, seconds: u32) -> Result<std::process::Child> {
    let folder = house.root.join("fuzz");
    let [grown, findings] =
        ["corpus", "artifacts"].map(|n| house.target.join("fuzz").join(n).join(target));
    for made in [&grown, &findings] {
        std::fs::create_dir_all(made)?;
    }
    let path = log(house, target);
    let out = std::fs::OpenOptions::new().create(true).append(true).open(&path)?;
    // The shell says how much processor time was had: whatever else this session runs goes before.
    let mut command = Command::new("bash");
    command.args(["-c", "time chrt --idle 0 \"$@\"", "bash"]);
    command.arg(built.join("x86_64-unknown-linux-gnu/release").join(target));
    command.args([&grown, &folder.join("corpus").join(target)]).args(LIMITS);
    command.arg(format!("-artifact_prefix={}/", findings.display()));
    command.arg(format!("-max_total_time={seconds}")).arg("-print_final_stats=1");
    command.arg(if target.starts_with("dicom") { "-max_len=65536" } else { "-max_len=16384" });
    if target == "table" {
        // A session's meter of memory lives as long as the process, on purpose: sixteen bytes.
        command.env("ASAN_OPTIONS", "detect_leaks=0");
    }
    let words = folder.join("dictionaries").join(target);
    if words.is_file() {
        command.arg(format!("-dict={}", words.display()));
    }
    command.env("RAYON_NUM_THREADS", "1").stdin(Stdio::null());
    command.stdout(out.try_clone()?).stderr(out);
    command.spawn().with_context(|| format!("cannot start {target}"))
}
