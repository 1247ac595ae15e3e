//! What a test's outcome rests on, as digests: the executable, the program, files that tests read, the machine.
//!
//! Rust's sources count by what they were compiled to. Pages of documentation count for those alone who read them, so that a
//! word in a guide makes nobody run the flow again. What is read from beside the project counts by names and sizes: it is
//! read-only.

use crate::House;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Who reads which pages while it runs; the first word of the name of a test, up to where it is told apart. `""` is every
/// file, Rust's sources too.
const READERS: [(&str, &[&str]); 5] = [
    ("supine-tests/house", &[""]),
    ("supine-tests/first_tries", &["docs/FIRST_TRIES.md"]),
    ("supine-tests/flow", &["docs/HAZARDS.md"]),
    ("supine-flow", &["docs/PLANNERS_GUIDE.md", "docs/ARCHITECTURE.md"]),
    ("package", &["docs/SCRIPTING.md", "crates/python/"]),
];
/// So many paths are handed to one process.
const AT_ONCE: usize = 500;

/// Digests of all that counts but the executables.
pub(crate) struct Inputs {
    /// The files of the project by their paths from its root.
    files: BTreeMap<String, String>,
    /// Everything that counts for every test.
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
        let counts = |path: &str| !path.ends_with(".rs") && !is_page(path);
        files.iter().filter(|(path, _)| counts(path)).for_each(|file| file.hash(&mut common));
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
        let read = READERS.iter().filter(|(who, _)| *who == name).flat_map(|(_, pages)| *pages);
        for page in read {
            self.under(page).for_each(|file| file.hash(&mut hasher));
        }
        Ok(format!("{:016x}", hasher.finish()))
    }

    /// The key of what rests on all sources.
    pub(crate) fn sources(&self) -> String {
        let mut hasher = DefaultHasher::new();
        self.common.hash(&mut hasher);
        self.under("").filter(|(path, _)| path.ends_with(".rs")).for_each(|f| f.hash(&mut hasher));
        format!("{:016x}", hasher.finish())
    }

    fn under<'a>(&'a self, beginning: &'a str) -> impl Iterator<Item = (&'a String, &'a String)> {
        self.files.iter().filter(move |(path, _)| path.starts_with(beginning))
    }
}

/// Whether a file is for people: tests that read it say so in [`READERS`].
fn is_page(path: &str) -> bool {
    path.starts_with("docs/") || path.ends_with(".md")
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
        let found = std::fs::metadata(root.join(file)).ok();
        found.map(|found| (found.len(), found.modified().ok())).hash(&mut hasher);
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

/// The processor's abilities, by which results differ in their last bits, the installed packages of Debian, and this program.
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

    /// The part of the list that a source of tests falls under.
    fn pages_of(source: &str) -> Vec<&'static str> {
        let who = match source {
            _ if source.starts_with("tests/tests/house/") => "supine-tests/house",
            "tests/tests/first_tries.rs" => "supine-tests/first_tries",
            _ if source.starts_with("tests/tests/flow/") => "supine-tests/flow",
            _ if source.starts_with("crates/flow/src/") => "supine-flow",
            _ if source.starts_with("crates/python/tests/") => "package",
            _ => return Vec::new(),
        };
        READERS
            .iter()
            .filter(|(name, _)| *name == who)
            .flat_map(|(_, pages)| *pages)
            .copied()
            .collect()
    }

    #[test]
    fn whoever_reads_a_page_while_it_runs_is_in_the_list() {
        let files = files(&root()).expect("this is a clone");
        let sources = files.keys().filter(|f| {
            (f.ends_with(".rs") && !f.starts_with("xtask/"))
                || f.starts_with("crates/python/tests/")
        });
        let mut seen = 0;
        for source in sources {
            let text = std::fs::read_to_string(root().join(source)).expect("it is listed");
            let code = text
                .lines()
                .map(str::trim_start)
                .filter(|l| !l.starts_with("//") && !l.starts_with("include_str!"));
            for line in code {
                for (at, _) in line.match_indices("docs/") {
                    let page: String =
                        line[at..].chars().take_while(|c| !"\"'` )#".contains(*c)).collect();
                    let is_read = line[..at].ends_with(['"', '/']) && page.ends_with(".md");
                    let is_compiled = line.contains("include_str!") || line.contains("http");
                    if is_read && !is_compiled {
                        seen += 1;
                        let listed = pages_of(source).iter().any(|p| page.starts_with(p));
                        assert!(listed, "{source} reads {page}: say so in READERS");
                    }
                }
            }
        }
        assert!(seen >= 4, "the search finds nothing any more");
    }

    #[test]
    fn a_page_counts_for_who_reads_it_and_a_fixture_for_all() {
        let of = |page: &str, fixture: &str| {
            let file = |name: &str, digest: &str| (name.to_owned(), digest.to_owned());
            let files = [file("docs/HAZARDS.md", page), file("fixtures/a.csv", fixture)];
            let mut common = DefaultHasher::new();
            fixture.hash(&mut common);
            let root = PathBuf::from("nowhere");
            Inputs { files: files.into(), common: common.finish(), root, stamp: 0 }
        };
        let key = |inputs: &Inputs, name: &str| inputs.key(name, &[]).expect("no file is read");
        let (before, page, fixture) = (of("1", "1"), of("2", "1"), of("1", "2"));
        for (name, reads) in
            [("supine-tests/flow", true), ("supine-tests/house", true), ("supine-mesh", false)]
        {
            assert_eq!(key(&before, name) != key(&page, name), reads, "{name}");
            assert_ne!(key(&before, name), key(&fixture, name), "{name}");
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
