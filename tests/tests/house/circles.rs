//! The files of a package do not depend on each other in circles.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use supine_tests::root;

/// A file by its path within `src`, without its ending.
type File = String;

/// The paths of a tree of `use`, as in `a::{b, c::d}`.
fn leaves(tree: &str) -> Vec<Vec<String>> {
    let (mut parts, mut depth, mut begun) = (Vec::new(), 0, 0);
    for (at, c) in tree.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[begun..at]);
                begun = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[begun..]);
    let words = |path: &str| -> Vec<String> {
        path.split("::").map(|word| word.trim().to_owned()).filter(|w| !w.is_empty()).collect()
    };
    let of = |part: &str| match part.split_once('{') {
        None => vec![words(part)],
        Some((path, rest)) => {
            let inner = rest.rsplit_once('}').map_or(rest, |(inner, _)| inner);
            let all = leaves(inner).into_iter();
            all.map(|leaf| [words(path), leaf].concat()).collect()
        }
    };
    parts.into_iter().flat_map(of).filter(|path| !path.is_empty()).collect()
}

/// The paths that a source names from `crate` or `super` on, without comments and unit tests.
fn named(source: &str) -> Vec<Vec<String>> {
    let code = source.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    let code: String = lines.flat_map(|line| [line, "\n"]).collect();
    let mut paths = Vec::new();
    for statement in code.split("use ").skip(1) {
        let tree = statement.split(';').next().unwrap_or_default();
        if tree.starts_with("crate::") || tree.starts_with("super::") {
            paths.extend(leaves(tree));
        }
    }
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let path: String = code[at..]
                .chars()
                .take_while(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | ':'))
                .collect();
            paths.extend(leaves(&path));
        }
    }
    paths
}

/// The file that a path named in a file leads to, if it is another one of these.
fn leads_to(from: &str, path: &[String], files: &BTreeSet<File>) -> Option<File> {
    let mut here: Vec<&str> = from.split('/').filter(|word| !word.is_empty()).collect();
    for word in path {
        match word.as_str() {
            "crate" => here.clear(),
            "super" => drop(here.pop()),
            "self" => {}
            word => here.push(word),
        }
    }
    while !here.is_empty() {
        let file = here.join("/");
        if files.contains(&file) {
            return Some(file).filter(|file| file != from);
        }
        here.pop();
    }
    None
}

/// Which files of a package each of them names.
fn arrows(sources: &BTreeMap<File, String>) -> BTreeMap<File, BTreeSet<File>> {
    let files: BTreeSet<File> = sources.keys().cloned().collect();
    let named = |(file, source): (&File, &String)| {
        let led = named(source).into_iter().filter_map(|path| leads_to(file, &path, &files));
        (file.clone(), led.collect())
    };
    sources.iter().map(named).collect()
}

/// All files that a file leads to, over others too.
fn reached<'a>(from: &'a str, arrows: &'a BTreeMap<File, BTreeSet<File>>) -> BTreeSet<&'a str> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(file) = open.pop() {
        for next in arrows.get(file).into_iter().flatten() {
            if seen.insert(next.as_str()) {
                open.push(next);
            }
        }
    }
    seen
}

/// The files that lead back to themselves, by circle.
fn circles(arrows: &BTreeMap<File, BTreeSet<File>>) -> BTreeSet<BTreeSet<&str>> {
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        arrows.keys().map(|file| (file.as_str(), reached(file, arrows))).collect();
    let in_one = reached.iter().filter(|(file, to)| to.contains(*file));
    in_one
        .map(|(file, to)| {
            to.iter().copied().filter(|other| reached[other].contains(file)).collect()
        })
        .collect()
}

/// The sources of a package by their files; tests are left out.
fn sources(folder: &Path, within: &str, sources: &mut BTreeMap<File, String>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        let at =
            |name: &str| if within.is_empty() { name.into() } else { format!("{within}/{name}") };
        if path.is_dir() {
            if name != "tests" {
                self::sources(&path, &at(&name), sources);
            }
        } else if let Some(stem) = name.strip_suffix(".rs")
            && !stem.ends_with("tests")
        {
            let file = match stem {
                "lib" | "main" => String::new(),
                "mod" => within.into(),
                stem => at(stem),
            };
            sources.insert(file, std::fs::read_to_string(&path).expect("a source"));
        }
    }
}

#[test]
fn files_do_not_depend_on_each_other_in_circles() {
    let mut found = Vec::new();
    let mut seen = 0;
    for package in std::fs::read_dir(root().join("crates")).expect("packages").flatten() {
        let name = package.file_name().to_string_lossy().into_owned();
        let mut all = BTreeMap::new();
        sources(&package.path().join("src"), "", &mut all);
        // The root of a package names all parts, and every part may name what it hands on.
        all.remove("");
        let arrows = arrows(&all);
        seen += arrows.values().map(BTreeSet::len).sum::<usize>();
        found.extend(circles(&arrows).iter().map(|circle| format!("{name}: {circle:?}")));
    }
    assert!(seen > 1000, "the search finds nothing any more: {seen}");
    assert!(found.is_empty(), "circles of files:\n{}", found.join("\n"));
}

#[test]
fn a_circle_is_found_over_trees_of_use_and_over_paths() {
    let of = |files: &[(&str, &str)]| {
        let sources = files.iter().map(|(f, s)| ((*f).to_owned(), (*s).to_owned())).collect();
        let arrows = arrows(&sources);
        let found = circles(&arrows);
        found.into_iter().map(|circle| circle.into_iter().collect::<Vec<_>>().join(" ")).collect()
    };
    let found: Vec<String> = of(&[
        ("a", "use crate::{Error, b::{C, D}};"),
        ("b", "fn f() { crate::c::g() }"),
        ("c", "// crate::d\nuse super::a;\n#[cfg(test)]\nmod tests { use crate::d; }"),
        ("d", "use crate::a::A;"),
        ("e/mod", ""),
        ("e/f", "use super::g::G;"),
        ("e/g", "use crate::e::f;"),
    ]);
    assert_eq!(found, ["a b c", "e/f e/g"]);
}
