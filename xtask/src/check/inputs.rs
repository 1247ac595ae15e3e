//! What a test's outcome rests on, as digests: the executable, the program, files that tests read,
//! the machine.
//!
//! Rust's sources count by what they were compiled to. What lies in a folder that few tests read
//! counts for those alone, so that a word in a guide or a script of one test makes nobody run the
//! rest again. What is read from beside the project counts by names and sizes: it is read-only.

use crate::House;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Who reads a file while it runs; the first row that its path begins with counts. A name that ends
/// in `/` stands for all executables of a package. A file of no row counts for all; a Rust source
/// or a page of no row for [`READS_ALL`] alone.
const READ_BY: [(&str, &[&str]); 17] = [
    ("docs/FIRST_TRIES.md", &["supine-tests/first_tries"]),
    ("docs/HAZARDS.md", &["supine-tests/flow"]),
    ("docs/PLANNERS_GUIDE.md", &["supine-flow"]),
    ("docs/ARCHITECTURE.md", &["supine-flow"]),
    ("docs/SCRIPTING.md", &["package"]),
    ("docs/", &[]),
    ("crates/python/", &["package"]),
    ("fixtures/fem/", &["supine-fem/reference"]),
    ("fixtures/warp/", &["supine-warp"]),
    ("fixtures/versions/", &["package"]),
    ("tests/readers/", &["supine-tests/", "workflow"]),
    ("workflow/", &["supine-tests/", "supine-flow", "package", "workflow"]),
    ("fuzz/", &[]),
    ("benches/", &[]),
    ("xtask/study/", &[]),
    ("xtask/release/", &[]),
    ("xtask/test-times.txt", &[]),
];
/// Reads every file, Rust's sources too.
const READS_ALL: &str = "supine-tests/house";
/// So many paths are handed to one process.
const AT_ONCE: usize = 500;

/// Digests of all that counts but the executables.
pub(crate) struct Inputs {
    /// The files of the project by their paths from its root.
    files: BTreeMap<String, String>,
    /// What lies beside the project, and the machine: they count for every test.
    common: u64,
    root: PathBuf,
    /// Sizes and times of the files when their digests were taken.
    stamp: u64,
}

impl Inputs {
    /// Takes the digests of what lies there now.
    ///
    /// # Errors
    /// When the project is no clone of git, or something cannot be read.
    pub(crate) fn of(house: &House) -> Result<Self> {
        let files = files(&house.root)?;
        let stamp = stamp(&house.root, files.keys());
        let mut common = DefaultHasher::new();
        beside(&house.root.join("../shared"), &mut common);
        machine(&mut common)?;
        Ok(Self { files, common: common.finish(), root: house.root.clone(), stamp })
    }

    /// Whether the files of the project are still those whose digests were taken.
    pub(crate) fn are_as_they_were(&self) -> bool {
        stamp(&self.root, self.files.keys()) == self.stamp
    }

    /// The key of what is run under a name, with these files of the target folder.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub(crate) fn key(&self, name: &str, with: &[&Path]) -> Result<String> {
        let mut hasher = DefaultHasher::new();
        (name, self.common, digests(with)?).hash(&mut hasher);
        self.files.iter().filter(|(path, _)| counts(path, name)).for_each(|f| f.hash(&mut hasher));
        Ok(format!("{:016x}", hasher.finish()))
    }

    /// The key of what rests on all sources.
    pub(crate) fn sources(&self) -> String {
        let mut hasher = DefaultHasher::new();
        self.common.hash(&mut hasher);
        self.files.iter().filter(|(path, _)| !is_page(path)).for_each(|f| f.hash(&mut hasher));
        format!("{:016x}", hasher.finish())
    }
}

/// Whether a file is for people.
fn is_page(path: &str) -> bool {
    path.starts_with("docs/") || path.ends_with(".md")
}

/// Whether the outcome of what is run under a name rests on a file.
fn counts(path: &str, name: &str) -> bool {
    let is_one = |who: &&str| *who == name || who.ends_with('/') && name.starts_with(who);
    name == READS_ALL
        || match READ_BY.iter().find(|(beginning, _)| path.starts_with(beginning)) {
            Some((_, readers)) => readers.iter().any(is_one),
            None => !is_page(path) && !path.ends_with(".rs"),
        }
}

/// All files that git knows or would take up, with their digests.
fn files(root: &Path) -> Result<BTreeMap<String, String>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root);
    let output = git.output().context("git cannot be started")?;
    ensure!(output.status.success(), "git does not list the files of {}", root.display());
    let text = String::from_utf8(output.stdout)?;
    // What was deleted and not yet said so is still listed.
    let names: Vec<&str> = text.split('\0').filter(|name| root.join(name).is_file()).collect();
    let paths: Vec<PathBuf> = names.iter().map(|name| root.join(name)).collect();
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    Ok(names.into_iter().map(String::from).zip(digests(&paths)?).collect())
}

/// Sizes and times of files.
fn stamp<'a>(root: &Path, files: impl Iterator<Item = &'a String>) -> u64 {
    let mut hasher = DefaultHasher::new();
    for file in files {
        let metadata = std::fs::metadata(root.join(file)).ok();
        metadata.map(|metadata| (metadata.len(), metadata.modified().ok())).hash(&mut hasher);
    }
    hasher.finish()
}

/// The digests of files, in their order.
fn digests(paths: &[&Path]) -> Result<Vec<String>> {
    let mut digests = Vec::with_capacity(paths.len());
    for some in paths.chunks(AT_ONCE) {
        let output = Command::new("sha256sum").arg("--zero").args(some).output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "files cannot be read: {said}");
        let lines = String::from_utf8(output.stdout)?;
        digests.extend(lines.split_terminator('\0').map(|l| l.chars().take(64).collect()));
    }
    ensure!(digests.len() == paths.len(), "sha256sum left files out");
    Ok(digests)
}

/// Names and sizes of what lies in a folder, if it is there.
fn beside(folder: &Path, hasher: &mut DefaultHasher) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut entries: Vec<_> = entries.flatten().collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let Ok(kind) = entry.file_type() else { continue };
        entry.file_name().hash(hasher);
        if kind.is_dir() {
            beside(&entry.path(), hasher);
        } else {
            entry.metadata().map_or(0, |found| found.len()).hash(hasher);
        }
    }
}

/// The processor's abilities, by which results differ in their last bits, the installed packages of
/// Debian, and this program.
fn machine(hasher: &mut DefaultHasher) -> Result<()> {
    let processor = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    processor.lines().find(|line| line.starts_with("flags")).hash(hasher);
    let this = std::env::current_exe()?;
    digests(&[&this, Path::new("/var/lib/dpkg/status")])?.hash(hasher);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The root of the project.
    fn root() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
    }

    /// The name under which a source is run, without what tells executables of the workflow and the
    /// package apart.
    fn runs_as(source: &str) -> String {
        let parts: Vec<&str> = source.split(['/', '.']).collect();
        match parts[..] {
            ["crates", "python", ..] => "package".into(),
            ["crates", part, "tests", test, ..] => format!("supine-{part}/{test}"),
            ["crates", part, ..] => format!("supine-{part}"),
            ["tests", "readers", "workflow", ..] => "workflow".into(),
            ["tests", "tests", test, ..] => format!("supine-tests/{test}"),
            ["tests", ..] => "supine-tests/any".into(),
            _ => source.into(),
        }
    }

    /// The lines of a source that a machine reads, but for what is compiled in.
    fn code(source: &str) -> Vec<String> {
        let text = std::fs::read_to_string(root().join(source)).expect("it is listed");
        let lines = text.lines().map(|line| line.trim_start().replace("\" / \"", "/"));
        let is_read = |line: &String| {
            !["//", "#", "\"\"\""].iter().any(|mark| line.starts_with(mark))
                && !["include_str!", "http"].iter().any(|mark| line.contains(mark))
        };
        lines.filter(is_read).collect()
    }

    #[test]
    fn whoever_reads_a_file_while_it_runs_is_in_its_row() {
        let files = files(&root()).expect("this is a clone");
        let is_source = |f: &&String| {
            ["crates/", "cli/", "tests/", "workflow/"].iter().any(|folder| f.starts_with(folder))
                && (f.ends_with(".rs") || f.ends_with(".py"))
        };
        let mut seen = 0;
        for source in files.keys().filter(is_source) {
            for line in code(source) {
                for (beginning, _) in READ_BY {
                    let path = beginning.trim_end_matches('/');
                    let quoted = [format!("\"{path}"), format!("/{path}")];
                    if beginning != "docs/" && quoted.iter().any(|path| line.contains(path)) {
                        seen += 1;
                        let who = runs_as(source);
                        assert!(counts(beginning, &who), "{source} ({who}) reads {beginning}");
                    }
                }
                for (at, _) in line.match_indices("docs/") {
                    let page: String =
                        line[at..].chars().take_while(|c| !"\"'` )#".contains(*c)).collect();
                    if line[..at].ends_with(['"', '/']) && page.ends_with(".md") {
                        seen += 1;
                        let who = runs_as(source);
                        assert!(counts(&page, &who), "{source} ({who}) reads {page}");
                    }
                }
            }
        }
        assert!(seen >= 12, "the search finds nothing any more: {seen}");
    }

    #[test]
    fn a_file_counts_for_who_reads_it_and_one_of_no_row_for_all() {
        for (path, name, expected) in [
            ("docs/HAZARDS.md", "supine-tests/flow", true),
            ("docs/HAZARDS.md", "supine-mesh", false),
            ("docs/HAZARDS.md", "supine-tests/house", true),
            ("tests/readers/dose.py", "supine-tests/flow", true),
            ("tests/readers/dose.py", "supine-tests", false),
            ("tests/readers/dose.py", "supine-flow/session", false),
            ("fixtures/patient/case.toml", "supine-mesh", true),
            ("crates/mesh/src/lib.rs", "supine-mesh", false),
            ("crates/python/src/lib.rs", "package", true),
            ("README.md", "package", false),
        ] {
            assert_eq!(counts(path, name), expected, "{path} {name}");
        }
    }

    #[test]
    fn a_file_that_was_written_meanwhile_shows() {
        let root = std::env::temp_dir().join(format!("supine-stamp-{}", std::process::id()));
        std::fs::create_dir_all(&root).expect("a folder for tests");
        std::fs::write(root.join("a"), "one").expect("it can be written");
        let files = BTreeMap::from([("a".to_owned(), String::new())]);
        let stamp = stamp(&root, files.keys());
        let inputs = Inputs { files, common: 0, root, stamp };
        assert!(inputs.are_as_they_were());
        std::fs::write(inputs.root.join("a"), "more").expect("it can be written");
        assert!(!inputs.are_as_they_were());
        std::fs::remove_dir_all(&inputs.root).expect("it was made here");
        assert!(!inputs.are_as_they_were());
    }

    #[test]
    fn a_file_is_told_by_its_bytes() {
        let folder = std::env::temp_dir().join(format!("supine-inputs-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for tests");
        let file = folder.join("a");
        let digest = |text: &str| {
            std::fs::write(&file, text).expect("it can be written");
            digests(&[&file]).expect("it can be read")
        };
        let (one, other, again) = (digest("one"), digest("other"), digest("one"));
        std::fs::remove_dir_all(&folder).expect("it was made here");
        assert_eq!(one, again);
        assert_ne!(one, other);
        assert!(digests(&[&file]).is_err(), "a file that is not there has no digest");
    }
}
