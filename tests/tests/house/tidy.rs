//! Small rules that keep the tree readable.

use std::path::{Path, PathBuf};
use supine_tests::{files_below, metadata, root};

/// Longest Rust file, lines.
const LONGEST_FILE: usize = 600;

/// Packages that may touch files or a clock; see docs/ARCHITECTURE.md.
const EDGES: [&str; 11] = [
    "supine-dicom",
    "supine-dicom-network",
    "supine-exchange",
    "supine-report",
    "supine-flow",
    "supine",
    "supine-tests",
    "supine-benches",
    "xtask",
    "supine-navigate",
    "supine-workstation",
];

/// The folders and files in the root that are not the project's own: those that .gitignore names
/// (build folder, results of the demo), and the history.
fn foreign() -> Vec<String> {
    let ignored = read(Path::new(".gitignore"));
    let named = ignored.lines().filter(|line| !line.contains('*'));
    named.map(|line| line.trim_matches('/').to_string()).chain([".git".to_string()]).collect()
}

/// The project's own files with one of these endings, relative to the root.
fn sources(endings: &[&str]) -> Vec<PathBuf> {
    let foreign = foreign();
    let mut found = Vec::new();
    for entry in std::fs::read_dir(root()).expect("the root can be listed") {
        let path = entry.expect("the root can be listed").path();
        let name = path.file_name().expect("an entry has a name").to_string_lossy().into_owned();
        if foreign.contains(&name) {
            continue;
        }
        if path.is_dir() {
            found.extend(files_below(&path).into_iter().map(|below| Path::new(&name).join(below)));
        } else {
            found.push(PathBuf::from(name));
        }
    }
    found.retain(|path| endings.iter().any(|e| path.extension().is_some_and(|x| x == *e)));
    assert!(!found.is_empty(), "files ending in {endings:?} were found");
    found
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Fails with one line per fault.
fn assert_none(faults: &[String]) {
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn every_crate_says_what_it_is() {
    let mut faults = Vec::new();
    for package in metadata().workspace_packages() {
        for target in package.targets.iter().filter(|t| !t.is_custom_build()) {
            let text = read(target.src_path.as_std_path());
            if !text.starts_with("//!") {
                faults.push(format!("{} does not begin with //!", target.src_path));
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn no_file_is_too_long() {
    let mut faults = Vec::new();
    for path in sources(&["rs", "py"]) {
        let lines = read(&path).lines().count();
        if lines > LONGEST_FILE {
            faults.push(format!("{} has {lines} lines, {LONGEST_FILE} allowed", path.display()));
        }
    }
    assert_none(&faults);
}

#[test]
fn folder_and_package_share_their_name() {
    let mut faults = Vec::new();
    for package in metadata().workspace_packages() {
        let folder = package.manifest_path.parent().and_then(|f| f.file_name()).unwrap_or_default();
        let name = package.name.as_str();
        // The binary is called as users call it.
        let expected = if name == "supine" { "cli" } else { name.trim_start_matches("supine-") };
        if folder != expected {
            faults.push(format!("package {name} lies in the folder {folder}, not {expected}"));
        }
    }
    assert_none(&faults);
}

#[test]
fn every_crate_stands_in_the_architecture() {
    let page = read(Path::new("docs/ARCHITECTURE.md"));
    let mut faults = Vec::new();
    for package in metadata().workspace_packages() {
        let folder = package.manifest_path.parent().expect("a manifest lies in a folder");
        let folder = folder.strip_prefix(root()).expect("a package lies in the repository");
        if !page.contains(&format!("### `{folder}`")) {
            faults.push(format!("docs/ARCHITECTURE.md has no heading ### `{folder}`"));
        }
    }
    assert_none(&faults);
}

#[test]
fn every_fixture_names_its_licence() {
    let mut faults = Vec::new();
    for entry in std::fs::read_dir(root().join("fixtures")).expect("there are fixtures") {
        let folder = entry.expect("the fixtures can be listed").path();
        let readme = folder.join("README.md");
        let text = std::fs::read_to_string(&readme).unwrap_or_default().to_lowercase();
        if folder.is_dir() && !text.contains("licence") && !text.contains("license") {
            faults.push(format!("{} does not name the licence of the data", readme.display()));
        }
    }
    assert_none(&faults);
}

#[test]
fn no_trace_of_one_machine_and_nothing_unfinished() {
    let endings = ["rs", "py", "md", "toml", "txt", "json", "html", "css", "csv", "svg"];
    // Put together here, so that this file does not hold them.
    let folders = ["work", "root", "home"].map(|folder| format!("/{folder}/"));
    let macros = ["todo", "unimplemented", "dbg"].map(|name| format!("{name}!("));
    let notes = ["TO", "FIX"].iter().zip(["DO", "ME"]).map(|(a, b)| format!("{a}{b}"));
    let forbidden: Vec<String> = folders.into_iter().chain(macros).chain(notes).collect();
    let mut faults = Vec::new();
    for path in sources(&endings) {
        for (number, line) in read(&path).lines().enumerate() {
            for word in forbidden.iter().filter(|word| line.contains(word.as_str())) {
                faults.push(format!("{}:{}: {word}", path.display(), number + 1));
            }
        }
    }
    assert_none(&faults);
}

/// Where `unsafe` may stand: each says why, and beside each stands what checks it.
const UNSAFE: [&str; 6] = [
    "cli/src/elementary.rs",
    "cli/src/out_of_memory.rs",
    "crates/flow/src/memory.rs",
    "crates/python/src/arrays.rs",
    "crates/tetrahedralise-cgal/src/mesher.rs",
    "crates/warp/src/kernel/avx2.rs",
];

#[test]
fn unsafe_stands_in_named_modules_only() {
    let word = ["unsafe", "code"].join("_");
    let mut faults = Vec::new();
    for path in sources(&["rs"]) {
        let named = UNSAFE.iter().any(|allowed| path == Path::new(allowed));
        let text = read(&path);
        let waives =
            ["allow", "expect"].iter().any(|lint| text.contains(&format!("{lint}({word}")));
        if waives && !named {
            faults.push(format!("{} allows itself `unsafe`", path.display()));
        }
    }
    assert_none(&faults);
}

#[test]
fn only_the_edges_touch_files() {
    let mut faults = Vec::new();
    let lint = ["disallowed", "methods"].join("_");
    for package in metadata().workspace_packages() {
        if EDGES.contains(&package.name.as_str()) {
            continue;
        }
        let folder = package.manifest_path.parent().expect("a manifest lies in a folder");
        // The library itself: its tests and examples may read fixtures.
        let source = folder.as_std_path().join("src");
        for path in files_below(&source) {
            let whole = source.join(&path);
            let test = path.components().any(|c| c.as_os_str().to_string_lossy().contains("tests"));
            if !test && whole.extension().is_some_and(|e| e == "rs") && read(&whole).contains(&lint)
            {
                faults.push(format!(
                    "{} waives the rule that {} is no edge",
                    path.display(),
                    package.name
                ));
            }
        }
    }
    assert_none(&faults);
}

/// A library whose documentation holds no example says `doctest = false`: looking for examples
/// takes as long as documenting it. One that holds an example must not, or nobody runs it.
#[test]
fn examples_of_the_documentation_are_run() {
    let mut faults = Vec::new();
    let mut examples = 0;
    for package in metadata().workspace_packages() {
        let Some(target) = package.targets.iter().find(|t| t.is_lib()) else { continue };
        let source = target.src_path.parent().expect("a source lies in a folder").as_std_path();
        let files = files_below(source);
        let files = files.iter().filter(|file| file.extension().is_some_and(|e| e == "rs"));
        let fenced = |file: &PathBuf| {
            let text = read(&source.join(file));
            let mut lines = text.lines().map(str::trim_start);
            lines.any(|l| ["///", "//!"].iter().any(|c| l.starts_with(c)) && l.contains("```"))
        };
        let holds = files.filter(|file| fenced(file)).count() > 0;
        examples += usize::from(holds);
        if holds != target.doctest {
            let word = if holds { "must not say" } else { "should say" };
            faults.push(format!("{} {word} doctest = false", package.manifest_path));
        }
    }
    assert!(examples > 0, "there is an example somewhere");
    assert_none(&faults);
}

#[test]
fn links_between_the_pages_lead_somewhere() {
    let mut faults = Vec::new();
    for path in sources(&["md"]) {
        let folder = root().join(path.parent().unwrap_or(Path::new("")));
        for link in read(&path).split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            let elsewhere = file.is_empty() || file.contains("://") || file.starts_with("mailto:");
            if !elsewhere && !folder.join(file).exists() {
                faults.push(format!("{} links to {file}, which is not there", path.display()));
            }
        }
    }
    assert_none(&faults);
}

/// The names in back quotes that end the rows of a page's tables.
fn last_cells(page: &str) -> Vec<&str> {
    let rows = page.lines().filter(|line| line.starts_with("| ") && line.ends_with("` |"));
    rows.filter_map(|row| row.rsplit('`').nth(1)).collect()
}

/// What the files of some folders say.
fn code_of(folders: &[&str]) -> String {
    let of = |folder: &&str| -> String {
        let files = files_below(&root().join(folder)).into_iter();
        let files = files.filter(|f| f.extension().is_some_and(|e| e == "rs" || e == "py"));
        files.map(|f| read(&Path::new(folder).join(f))).collect()
    };
    folders.iter().map(of).collect()
}

#[test]
fn the_hazards_name_tests_that_exist() {
    let page = read(Path::new("docs/HAZARDS.md"));
    let tests = code_of(&["crates/dicom/tests/series", "tests/tests/flow"]);
    let named = last_cells(&page);
    assert!(named.len() > 30, "the table was found: {named:?}");
    for test in named {
        assert!(tests.contains(&format!("fn {test}()")), "docs/HAZARDS.md names {test}");
    }
}

#[test]
fn the_faults_found_by_use_name_tests_that_exist() {
    let page = read(Path::new("docs/VERIFICATION.md"));
    let (_, faults) = page.split_once("## Faults found by use").expect("the part is there");
    let tests = code_of(&["crates", "tests", "cli"]);
    let named = last_cells(faults);
    assert!(named.len() > 40, "the table was found: {named:?}");
    for test in named {
        let found = ["fn", "def"].iter().any(|word| tests.contains(&format!("{word} {test}(")));
        assert!(found, "docs/VERIFICATION.md names {test}");
    }
}
