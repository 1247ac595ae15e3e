//! Whichever packages cargo is asked for, a foreign crate has the same features: each is compiled
//! once.

use std::collections::{BTreeMap, BTreeSet};
use supine_tests::{Outcome, metadata, root};

/// The features of each crate in one role (crates that are linked and those that run while
/// compiling may differ), as cargo resolves them for some packages.
fn resolved(packages: &[&str], edges: &str) -> BTreeMap<String, BTreeSet<String>> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let tree = Outcome::of(
        std::process::Command::new(cargo)
            .args(["tree", "--locked", "--prefix", "none", "--no-dedupe", "--format", "{p}\t{f}"])
            .args(["--edges", edges])
            .args(packages)
            .current_dir(root()),
    )
    .success("cargo tree");
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in tree.stdout.lines() {
        let Some((package, features)) = line.split_once('\t') else { continue };
        // Name and version; where it lies, and that it is a derive macro, follow in brackets.
        let name = package.split(" (").next().unwrap_or(package);
        let features = features.trim_end_matches(" (*)");
        found.entry(name.to_owned()).or_default().insert(features.to_owned());
    }
    found
}

/// Crates whose features in one selection are none of those in the whole workspace.
fn differing(
    some: &BTreeMap<String, BTreeSet<String>>,
    all: &BTreeMap<String, BTreeSet<String>>,
) -> Vec<String> {
    let mut faults = Vec::new();
    for (name, choices) in some.iter().filter(|(name, _)| !name.starts_with("supine")) {
        for features in choices {
            if !all.get(name).is_some_and(|known| known.contains(features)) {
                let wanted: Vec<_> = all.get(name).into_iter().flatten().collect();
                faults.push(format!("{name} with [{features}]; the workspace has {wanted:?}"));
            }
        }
    }
    faults
}

#[test]
fn every_selection_of_packages_resolves_alike() {
    let all = resolved(&["--workspace"], "normal,build,dev");
    assert!(all.len() > 200, "the tree was read: {} crates", all.len());
    let mut faults = BTreeSet::new();
    let mut selections: Vec<(Vec<&str>, &str)> = Vec::new();
    for package in metadata().workspace_packages() {
        selections.push((vec!["--package", &package.name], "normal,build"));
        selections.push((vec!["--package", &package.name], "normal,build,dev"));
    }
    // The other meshers bring crates of their own; all others stay as they are.
    let meshers = ["--package", "supine", "--features", "cgal,tetgen"];
    let with_meshers = resolved(&meshers, "normal,build,dev");
    let shared = with_meshers.into_iter().filter(|(name, _)| all.contains_key(name)).collect();
    faults.extend(differing(&shared, &all));
    for (packages, edges) in selections {
        faults.extend(differing(&resolved(&packages, edges), &all));
    }
    let faults: Vec<String> = faults.into_iter().collect();
    assert!(
        faults.is_empty(),
        "compiled twice; name the features in crates/features/Cargo.toml:\n{}",
        faults.join("\n")
    );
}

#[test]
fn the_rule_sees_what_it_forbids() {
    let of = |name: &str, features: &[&str]| {
        (name.to_owned(), features.iter().map(|f| (*f).to_owned()).collect::<BTreeSet<_>>())
    };
    let all = BTreeMap::from([of("serde v1", &["std", "derive,std"]), of("rand v1", &["std"])]);
    let same = BTreeMap::from([of("serde v1", &["derive,std"]), of("supine v1", &["other"])]);
    assert!(differing(&same, &all).is_empty());
    let other = BTreeMap::from([of("serde v1", &["std"]), of("rand v1", &["alloc"])]);
    assert_eq!(differing(&other, &all), ["rand v1 with [alloc]; the workspace has [\"std\"]"]);
}
