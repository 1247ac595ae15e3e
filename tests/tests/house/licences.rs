//! Every dependency of the binary is under a permissive licence: those allowed in deny.toml.

use spdx::{Expression, LicenseItem, LicenseReq, ParseMode};
use supine_tests::{Outcome, metadata, root};

/// The licences that deny.toml allows.
fn allowed() -> Vec<String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).expect("deny.toml is there");
    let table: toml::Table = text.parse().expect("deny.toml is TOML");
    let list = table["licenses"]["allow"].as_array().expect("[licenses] allow is a list");
    list.iter().map(|name| name.as_str().expect("a licence is a string").to_owned()).collect()
}

/// Whether a requirement of an expression is met by the list, without any exception clause.
fn met(requirement: &LicenseReq, allowed: &[String]) -> bool {
    let LicenseItem::Spdx { id, .. } = &requirement.license else { return false };
    requirement.addition.is_none() && allowed.iter().any(|name| name == id.name)
}

/// Whether a package's licence expression can be satisfied; the old `/` between two is an "or".
fn satisfiable(licence: &str, allowed: &[String]) -> bool {
    Expression::parse_mode(licence, ParseMode::LAX)
        .is_ok_and(|expression| expression.evaluate(|requirement| met(requirement, allowed)))
}

#[test]
fn the_allowed_licences_are_no_copyleft() {
    for name in allowed() {
        let id = spdx::license_id(&name).unwrap_or_else(|| panic!("{name} is no SPDX licence"));
        assert!(!id.is_copyleft(), "deny.toml allows {name}, which is copyleft");
    }
}

/// The crates that bind programs under copyleft, and their licences; all others are the house's
/// own.
const BINDINGS: [(&str, &str); 2] = [
    ("supine-tetrahedralise-cgal", "GPL-3.0-or-later"),
    ("supine-tetrahedralise-tetgen", "AGPL-3.0-or-later"),
];

#[test]
fn every_crate_states_its_licence() {
    for package in metadata().workspace_packages() {
        let bound = BINDINGS.iter().find(|(name, _)| *name == package.name.as_str());
        let licence = bound.map_or("MIT OR Apache-2.0", |(_, licence)| licence);
        assert_eq!(package.license.as_deref(), Some(licence), "{}", package.name);
    }
}

#[test]
fn every_dependency_of_the_binary_is_allowed() {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    // What the default build compiles, on any platform: the tree, not the lock file, which also
    // lists optional dependencies that nobody asked for.
    let tree = Outcome::of(
        std::process::Command::new(cargo)
            .args(["tree", "--package", "supine", "--edges", "normal,build", "--target", "all"])
            .args(["--prefix", "none", "--no-dedupe", "--format", "{p}\t{l}"])
            .current_dir(root()),
    )
    .success("cargo tree");
    let mut packages: Vec<&str> = tree.stdout.lines().filter(|line| !line.is_empty()).collect();
    packages.sort_unstable();
    packages.dedup();
    assert!(packages.len() > 50, "the tree was read: {} packages", packages.len());
    let allowed = allowed();
    let refused: Vec<&str> = packages
        .into_iter()
        .filter(|line| {
            let (_, licence) = line.split_once('\t').expect("the format has a tab");
            !satisfiable(licence, &allowed)
        })
        .collect();
    assert!(refused.is_empty(), "not allowed by deny.toml:\n{}", refused.join("\n"));
}

#[test]
fn the_rule_sees_what_it_forbids() {
    let allowed = ["MIT".to_owned(), "Apache-2.0".to_owned(), "IJG".to_owned()];
    for good in ["MIT", "MIT/GPL-3.0", "GPL-3.0-only OR Apache-2.0", "(MIT OR Zlib) AND IJG"] {
        assert!(satisfiable(good, &allowed), "{good}");
    }
    for bad in ["", "GPL-3.0-only", "MIT AND MPL-2.0", "LGPL-2.1-or-later", "Custom"] {
        assert!(!satisfiable(bad, &allowed), "{bad}");
    }
}
