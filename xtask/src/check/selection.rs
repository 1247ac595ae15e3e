//! What a change of one crate can break: the crate, and all that rests on it.

use anyhow::{Result, bail};
use cargo_metadata::Metadata;
use std::collections::{BTreeMap, BTreeSet};

/// The package of the program, and what runs it although no manifest says so.
const PROGRAM: &str = "supine";
const RUN_IT: [&str; 2] = ["supine-tests", "supine-python"];

/// Whether the tests of a package run the program.
pub(crate) fn runs_program(package: &str) -> bool {
    package == PROGRAM || RUN_IT.contains(&package)
}

/// Packages of the workspace that are looked at.
pub(crate) struct Selection {
    packages: BTreeSet<String>,
    whole: bool,
}

impl Selection {
    /// Everything.
    pub(crate) fn whole(metadata: &Metadata) -> Self {
        let all = metadata.workspace_packages();
        Self { packages: all.iter().map(|p| p.name.to_string()).collect(), whole: true }
    }

    /// A package, by its name or that of its folder, with all that rests on it.
    ///
    /// # Errors
    /// When there is no such package: with the names of all.
    pub(crate) fn of(metadata: &Metadata, asked: &str) -> Result<Self> {
        let all = Self::whole(metadata).packages;
        let folder = |name: &str| name.trim_start_matches("supine-").to_owned();
        let asked = if asked == "cli" { "supine" } else { asked };
        let Some(first) = all.iter().find(|name| *name == asked || folder(name) == asked) else {
            let names: Vec<String> = all.iter().map(|name| folder(name)).collect();
            bail!("no crate is called {asked}; there are {}", names.join(", "));
        };
        let mut users: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for package in metadata.workspace_packages() {
            for used in package.dependencies.iter().filter(|used| all.contains(&used.name)) {
                users.entry(used.name.clone()).or_default().push(package.name.to_string());
            }
        }
        users.entry(PROGRAM.into()).or_default().extend(RUN_IT.map(String::from));
        Ok(Self { packages: resting_on(first, &users), whole: false })
    }

    /// Whether everything is looked at.
    pub(crate) fn is_whole(&self) -> bool {
        self.whole
    }

    /// Whether a package is looked at.
    pub(crate) fn has(&self, package: &str) -> bool {
        self.packages.contains(package)
    }

    /// Whether the program is run.
    pub(crate) fn runs_program(&self) -> bool {
        self.has(PROGRAM) || RUN_IT.iter().any(|package| self.has(package))
    }

    /// The packages as arguments of cargo.
    pub(crate) fn arguments(&self) -> Vec<String> {
        if self.whole {
            return vec!["--workspace".into()];
        }
        self.packages.iter().flat_map(|name| ["--package".into(), name.clone()]).collect()
    }

    /// The same, and the program where it is run.
    pub(crate) fn to_be_built(&self) -> Vec<String> {
        let mut arguments = self.arguments();
        if !self.whole && self.runs_program() && !self.has(PROGRAM) {
            arguments.extend(["--package".into(), PROGRAM.into()]);
        }
        arguments
    }

    /// Their names.
    pub(crate) fn names(&self) -> String {
        self.packages.iter().cloned().collect::<Vec<_>>().join(", ")
    }
}

/// A package and all that uses it, directly or not.
fn resting_on(first: &str, users: &BTreeMap<String, Vec<String>>) -> BTreeSet<String> {
    let mut dependents = BTreeSet::from([first.to_owned()]);
    let mut open = vec![first.to_owned()];
    while let Some(next) = open.pop() {
        for user in users.get(&next).into_iter().flatten() {
            if dependents.insert(user.clone()) {
                open.push(user.clone());
            }
        }
    }
    dependents
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_rests_on_a_crate_is_found_once() {
        let of = |name: &str, users: &[&str]| {
            (name.to_owned(), users.iter().map(|user| (*user).to_owned()).collect::<Vec<_>>())
        };
        let users = BTreeMap::from([
            of("space", &["mesh", "fem"]),
            of("mesh", &["fem"]),
            of("fem", &["flow", "mesh"]),
            of("flow", &["cli"]),
            of("warp", &["flow"]),
        ]);
        let found = resting_on("mesh", &users);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), ["cli", "fem", "flow", "mesh"]);
    }
}
