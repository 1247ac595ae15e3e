//! The licences of all crates and fonts that the programs hold, as their authors wrote them.
//!
//! Taken from the sources that cargo has: cargo-about does the same with more care for headers of
//! single files, but searches each for many minutes. Which licences are allowed, deny.toml decides
//! and a test of the house checks.

use super::Release;
use super::build::Platform;
use super::said;
use crate::steps::cargo;
use anyhow::{Context, Result, ensure};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What the name of a file with a licence begins with.
const NAMES: [&str; 6] = ["license", "licence", "copying", "copyright", "notice", "unlicense"];

/// A crate: name with version, licence, folder.
struct Package {
    name: String,
    licence: String,
    folder: PathBuf,
}

/// Writes them to a file: each text once, with the crates that bear it.
pub(super) fn write(release: &Release<'_>, file: &Path) -> Result<()> {
    let forms = release.house.root.join("xtask/release");
    let mut texts: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut without = Vec::new();
    for package in packages(release)? {
        let name = format!("{} ({})", package.name, package.licence);
        let own_texts = licences(&package.folder)?;
        if own_texts.is_empty() {
            without.push(name.clone());
        }
        for text in own_texts {
            texts.entry(text).or_default().insert(name.clone());
        }
    }
    let mut out = std::fs::read_to_string(forms.join("third-party.txt"))?;
    let line = "=".repeat(80);
    // The licences that most crates share come first.
    let mut sorted: Vec<_> = texts.into_iter().collect();
    sorted.sort_by_key(|(_, names)| std::cmp::Reverse(names.len()));
    for (text, names) in &sorted {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        writeln!(out, "{line}\n{}\n{}\n{text}\n", names.join("\n"), "-".repeat(80))?;
    }
    if !without.is_empty() {
        writeln!(
            out,
            "{line}\nWithout a text of their own, under the standard one of their licence:"
        )?;
        writeln!(out, "{}\n", without.join("\n"))?;
    }
    writeln!(out, "{line}\n{}", std::fs::read_to_string(forms.join("musl.txt"))?)?;
    let of_fonts = release.house.root.join("crates/report/fonts/LICENSE");
    writeln!(out, "{line}\nDejaVu fonts\n{}", std::fs::read_to_string(of_fonts)?)?;
    println!("{} texts of licences; without a text: {}", sorted.len(), without.len());
    std::fs::write(file, out)?;
    Ok(())
}

/// The crates of other people in the programs.
fn packages(release: &Release<'_>) -> Result<Vec<Package>> {
    let root = &release.house.root;
    let mut wanted = BTreeSet::new();
    for platform in [Platform::Linux, Platform::Windows] {
        let mut tree = cargo(root);
        tree.args(["tree", "--locked", "--package", "supine", "--edges", "normal"]);
        tree.args(["--prefix", "none", "--no-dedupe", "--target", platform.triple()]);
        wanted.extend(said(&mut tree, root)?.lines().filter_map(key));
    }
    let mut metadata = cargo_metadata::MetadataCommand::new();
    let metadata = metadata.current_dir(root).other_options(["--locked".to_owned()]).exec()?;
    let mut packages = Vec::new();
    for package in &metadata.packages {
        let name = format!("{} {}", package.name, package.version);
        if package.source.is_some() && wanted.contains(&name) {
            let licence = package.license.clone().with_context(|| format!("{name}: no licence"))?;
            let folder = package.manifest_path.parent().context("a manifest lies in a folder")?;
            packages.push(Package { name, licence, folder: folder.into() });
        }
    }
    ensure!(packages.len() > 100, "{} crates were found only", packages.len());
    Ok(packages)
}

/// `name version` of a line of cargo tree: `name vVERSION (more)`.
fn key(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    Some(format!("{} {}", words.next()?, words.next()?.strip_prefix('v')?))
}

/// The texts of licences at the top of a crate.
fn licences(folder: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let source =
            path.extension().is_some_and(|e| ["rs", "html", "toml"].iter().any(|x| e == *x));
        if path.is_file() && !source && NAMES.iter().any(|begin| name.starts_with(begin)) {
            files.push(path);
        }
    }
    files.sort();
    let read = |path: &PathBuf| -> Result<String> {
        let text = String::from_utf8_lossy(&std::fs::read(path)?).replace('\r', "");
        Ok(text.trim_matches('\n').to_owned())
    };
    files.iter().map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::key;

    #[test]
    fn a_line_of_the_tree_names_a_crate() {
        assert_eq!(key("faer v0.24.4").as_deref(), Some("faer 0.24.4"));
        assert_eq!(key("paste v1.0.15 (proc-macro)").as_deref(), Some("paste 1.0.15"));
        assert_eq!(key(""), None);
    }
}
