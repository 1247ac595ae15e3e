//! `cargo xtask site`: the pages of `docs/` as a site, by mdBook; no link in it leads nowhere.

use crate::House;
use crate::release::tools::MDBOOK;
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::process::{Command, Stdio};

/// # Errors
/// When mdBook warns of anything, when a page of docs/ is in no list, or when a link leads nowhere.
pub(crate) fn build(house: &House) -> Result<()> {
    let docs = house.root.join("docs");
    let site = house.target.join("site");
    all_pages_are_listed(&docs)?;
    let mut book = Command::new(MDBOOK.installed(house)?);
    book.arg("build").arg(&docs).arg("--dest-dir").arg(&site).stdin(Stdio::null());
    let out = book.output().context("cannot start mdbook")?;
    let said = String::from_utf8_lossy(&out.stderr);
    print!("{said}");
    ensure!(out.status.success(), "mdbook ended with {}", out.status);
    ensure!(!said.contains("WARN") && !said.contains("ERROR"), "mdbook warns");
    // mdBook takes all that is no page for a picture.
    std::fs::remove_file(site.join("book.toml"))?;
    let pages = pages(&site)?;
    let faults = faults(&site, &pages);
    if !faults.is_empty() {
        bail!("links lead nowhere:\n{}", faults.join("\n"));
    }
    println!("{} pages: {}", pages.len(), site.join("index.html").display());
    Ok(())
}

/// A page that is in no list would be left out, and links to it would be broken.
fn all_pages_are_listed(docs: &Path) -> Result<()> {
    let list = std::fs::read_to_string(docs.join("SUMMARY.md")).context("docs/SUMMARY.md")?;
    for entry in std::fs::read_dir(docs)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let page = name.ends_with(".md") && name != "SUMMARY.md";
        ensure!(!page || list.contains(&format!("]({name})")), "{name} is not in docs/SUMMARY.md");
    }
    Ok(())
}

/// The HTML of every page, by its path in the site.
fn pages(site: &Path) -> Result<BTreeMap<PathBuf, String>> {
    let mut pages = BTreeMap::new();
    for entry in std::fs::read_dir(site)? {
        let path = entry?.path();
        let name = PathBuf::from(path.file_name().unwrap_or_default());
        // The page of errors is served from anywhere; the list of pages is a frame for browsers
        // without scripts.
        let own = !["404.html", "toc.html"].iter().any(|other| name == Path::new(other));
        if own && name.extension().is_some_and(|extension| extension == "html") {
            pages.insert(name, std::fs::read_to_string(&path)?);
        }
    }
    Ok(pages)
}

/// One line for each link to a file of the site, or to a place in a page, that is not there.
fn faults(site: &Path, pages: &BTreeMap<PathBuf, String>) -> Vec<String> {
    let mut faults = Vec::new();
    for (name, html) in pages {
        let links =
            ["href=\"", "src=\""].map(|begin| html.split(begin).skip(1)).into_iter().flatten();
        for link in links.filter_map(|rest| rest.split('"').next()) {
            if link.contains("://") || link.starts_with("mailto:") || link.starts_with("data:") {
                continue;
            }
            let (file, place) = link.split_once('#').unwrap_or((link, ""));
            let file =
                if file.is_empty() { name.clone() } else { flat(&name.with_file_name(file)) };
            let there = match pages.get(&file) {
                Some(page) => place.is_empty() || page.contains(&format!("id=\"{place}\"")),
                None => site.join(&file).is_file(),
            };
            if !there {
                faults.push(format!("{}: {link}", name.display()));
            }
        }
    }
    faults
}

/// A path without `.` and `..`.
fn flat(path: &Path) -> PathBuf {
    let mut flat = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(flat.pop()),
            Component::CurDir => {}
            other => flat.push(other),
        }
    }
    flat
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_to_nowhere_is_found() {
        let a = r##"<a href="b.html#here">, <a href="#top">, <a href="https://a.example/x"> <p id="top">"##;
        let b = r##"<h1 id="here"> <a href="./a.html#gone"> <img src="none.png">"##;
        let pages = [("a.html", a), ("b.html", b)].map(|(n, t)| (PathBuf::from(n), t.to_owned()));
        let found = faults(Path::new("nowhere"), &pages.into_iter().collect());
        assert_eq!(found, ["b.html: ./a.html#gone", "b.html: none.png"]);
    }
}
