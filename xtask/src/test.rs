//! `cargo xtask test`: everything that must hold, cheap steps first.

use crate::steps::{Steps, cargo, run};
use crate::{House, meshers, python, readers};
use anyhow::Result;

#[derive(clap::Args)]
pub(crate) struct Options {
    /// Leaves out the lints and the documentation.
    #[arg(long)]
    fast: bool,
}

/// # Errors
/// When a step failed; every step was run.
pub(crate) fn run_steps(house: &House, options: &Options) -> Result<()> {
    let mut steps = Steps::new();
    steps.run("independent readers", || readers::install(house));
    steps.run("format", || run(cargo(&house.root).args(["fmt", "--all", "--check"])));
    if options.fast {
        steps.skip("lints", "--fast");
        steps.skip("documentation", "--fast");
    } else {
        let lints =
            ["clippy", "--workspace", "--all-targets", "--keep-going", "--", "-D", "warnings"];
        steps.run("lints", || run(cargo(&house.root).args(lints)));
        steps.run("documentation", || {
            let doc = ["doc", "--workspace", "--no-deps", "--keep-going"];
            run(cargo(&house.root).args(doc).env("RUSTDOCFLAGS", "-D warnings"))
        });
    }
    if readers::on_path("cargo-deny") {
        let deny = ["deny", "check", "bans", "licenses", "sources"];
        steps.run("cargo-deny", || run(cargo(&house.root).args(deny)));
    } else {
        steps
            .skip("cargo-deny", "not installed; the test house::licences reads the same deny.toml");
    }
    // The tests run the binary; built here, its compilation does not count as a test's time. They build it in the
    // same words, so that cargo chooses the same features of other crates and finds it made.
    let build = ["build", "--workspace", "--bin", "supine"];
    steps.run("binary", || run(cargo(&house.root).args(build)));
    steps.run("tests", || run(cargo(&house.root).args(["test", "--workspace", "--no-fail-fast"])));
    let binary = house.target.join("debug/supine");
    steps.run("Python package", || python::test(house, &binary));
    steps.run("workflow", || python::workflow(house, &binary));
    // Last: it leaves a binary with the features behind, which the tests above must not judge.
    match meshers::install() {
        Ok(()) => {
            steps.run("other meshers", || meshers::test(|| cargo(&house.root), !options.fast))
        }
        Err(why) => {
            println!("{why:#}");
            steps.skip("other meshers", "libcgal-dev and libtet1.5-dev cannot be installed");
        }
    }
    steps.finish()
}
