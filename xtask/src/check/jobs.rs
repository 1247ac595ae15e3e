//! What is done beside the tests, and the tests themselves, as jobs.

use super::command::{linting, no_warnings};
use super::executables::{Built, build, to_run};
use super::known::Subject;
use super::pool::{Job, Seat};
use super::{COMPILING, Check, Options, Report, cargo_job, pytest, run_quietly, seated};
use crate::compiler::Call;
use crate::steps::cargo;
use crate::{meshers, python, readers};
use anyhow::{Result, bail};
use cargo_metadata::Target;
use std::path::Path;
use std::process::Command;

/// What cargo does on one processor takes about so long where it was never measured, s.
const LONG: f64 = 300.0;

/// Tests that wait for trackers, archives and the browser half of their time or more: measured, s
/// of a processor and by the clock, 32 of 61, 15 of 33, 0.3 of 7.5 and 70 of 150.
const WAITING: [&str; 4] = [
    "supine-navigate/session",
    "supine-tests/navigate",
    "supine-dicom-network",
    "supine-tests/page",
];

/// What is left to be done.
pub(crate) struct List<'a> {
    pub(crate) jobs: Vec<Job<'a>>,
    /// How many tests passed before with the same bytes.
    pub(crate) before: usize,
}

impl List<'_> {
    /// Whether something did not pass before; counts it if it did.
    fn is_new(&mut self, check: &Check<'_>, subject: &Subject, name: &str) -> bool {
        let passed = check.known.passed(subject, name);
        self.before += passed.unwrap_or(0);
        passed.is_none()
    }
}

impl<'a> Check<'a> {
    /// All jobs after the compilation.
    ///
    /// # Errors
    /// When an executable does not list its tests, or a file cannot be read.
    pub(crate) fn jobs(&'a self, built: &'a Built, options: &Options) -> Result<List<'a>> {
        let mut list = List { jobs: Vec::new(), before: 0 };
        let mut compiled = Vec::new();
        if self.selection.has("supine-python") {
            let wheel = list.jobs.len();
            let subject = self.known.subject("package", &[&self.supine])?;
            if list.is_new(self, &subject, "package") {
                compiled.push(wheel);
                list.jobs.push(self.wheel());
                list.jobs.push(self.package(wheel, subject));
            }
        }
        if self.selection.has("supine") {
            let subject = self.known.subject("workflow", &[&self.supine])?;
            if list.is_new(self, &subject, "workflow") {
                list.jobs.push(self.workflow(subject));
            }
        }
        for executable in &built.executables {
            let tests = to_run(executable, &self.supine, &self.times, &self.known)?;
            list.before += tests.before;
            list.jobs.extend(tests.shares.into_iter().map(|share| Job {
                name: share.name(),
                step: "tests",
                processors: usize::from(!WAITING.contains(&executable.name.as_str())),
                seconds: share.seconds,
                after: vec![],
                compiles: false,
                work: Box::new(move |seat| share.run(self.house, seat, &self.logs)),
            }));
        }
        list.jobs.extend(self.examples());
        list.jobs.push(self.lints());
        if let Some(benchmarks) = self.benchmarks() {
            compiled.push(list.jobs.len());
            list.jobs.push(benchmarks);
        }
        if !options.fast {
            list.jobs.extend(self.meshers());
            let subject = self.known.sources("documentation", self.selection.is_whole());
            if list.is_new(self, &subject, "documentation") {
                list.jobs.push(self.documentation(compiled, subject));
            }
        }
        if readers::on_path("cargo-deny") {
            list.jobs.push(self.deny());
        } else {
            println!(
                "   left out          cargo-deny: not installed; the test house::licences reads the same deny.toml"
            );
        }
        Ok(list)
    }

    fn job(&'a self, step: &'static str, name: &str, compiles: bool) -> Job<'a> {
        Job {
            name: name.into(),
            step,
            processors: 1,
            seconds: self.times.job(&format!("{step}: {name}"), LONG),
            after: vec![],
            compiles,
            work: Box::new(|_| Ok(Report::default())),
        }
    }

    /// The pages of the packages that are looked at, made of what was compiled by then.
    fn documentation(&'a self, after: Vec<usize>, subject: Subject) -> Job<'a> {
        let work = move |seat: &Seat| {
            let log = self.log("documentation")?;
            let compiled = self.house.target.join("debug/deps");
            let pages = self.house.target.join("doc");
            let mut wrong = Vec::new();
            for (name, program) in self.documented() {
                let command = Call::last(&compiled, &name)?.documentation(&pages, program);
                wrong.extend(run_quietly(&mut seated(&command, seat), &log).err().map(|_| name));
            }
            if !wrong.is_empty() {
                let said = std::fs::read(&log).unwrap_or_default();
                bail!("{}\nin {}", String::from_utf8_lossy(&said), wrong.join(", "));
            }
            self.passed(&subject, "documentation", Report::default())
        };
        let job = self.job("documentation", "the packages", false);
        Job { work: Box::new(work), after, ..job }
    }

    /// The crates that have pages, and whether each is a program. What wants a feature has none, as
    /// with cargo.
    fn documented(&self) -> Vec<(String, bool)> {
        let packages = self.metadata.workspace_packages().into_iter();
        let targets = packages.filter(|p| self.selection.has(&p.name)).flat_map(|p| &p.targets);
        let has_pages = |t: &&Target| t.doc && t.required_features.is_empty();
        targets
            .filter(has_pages)
            .map(|target| (target.name.replace('-', "_"), target.is_bin()))
            .collect()
    }

    /// What the lints said of what was compiled first.
    fn lints(&'a self) -> Job<'a> {
        let work = |_: &Seat| {
            no_warnings(&self.logs.path(COMPILING))?;
            Ok(Report::default())
        };
        Job { work: Box::new(work), seconds: 0.0, ..self.job("lints", "the packages", false) }
    }

    /// The benchmarks, which have no tests: they compile, and are linted.
    fn benchmarks(&'a self) -> Option<Job<'a>> {
        const PACKAGE: &str = "supine-benches";
        let words = ["build", "--package", PACKAGE, "--bins"].map(String::from);
        let work = move |seat: &Seat| {
            let log = self.log("benchmarks")?;
            cargo_job(self.house, &words, seat, &log)?;
            no_warnings(&log)?;
            Ok(Report::default())
        };
        let job = self.job("lints", "the benchmarks", true);
        self.selection.has(PACKAGE).then(|| Job { work: Box::new(work), ..job })
    }

    /// Licences and sources of foreign crates, by cargo-deny.
    fn deny(&'a self) -> Job<'a> {
        let words = ["deny", "check", "bans", "licenses", "sources"].map(String::from);
        let work = move |seat: &Seat| {
            cargo_job(self.house, &words, seat, &self.log("cargo-deny")?)?;
            Ok(Report::default())
        };
        Job { work: Box::new(work), ..self.job("cargo-deny", "licences and sources", false) }
    }

    /// The examples in the documentation of the packages that have any.
    fn examples(&'a self) -> Option<Job<'a>> {
        let all = self.metadata.workspace_packages();
        let has_any = |package: &&&cargo_metadata::Package| {
            let mut targets = package.targets.iter();
            self.selection.has(&package.name) && targets.any(|t| t.doctest && t.is_lib())
        };
        let names: Vec<String> = all.iter().filter(has_any).map(|p| p.name.to_string()).collect();
        if names.is_empty() {
            return None;
        }
        let work = move |seat: &Seat| {
            let log = self.log("examples")?;
            let mut arguments = vec!["test".to_owned(), "--doc".to_owned()];
            arguments.extend(names.into_iter().flat_map(|name| ["--package".to_owned(), name]));
            cargo_job(self.house, &arguments, seat, &log)?;
            let said = std::fs::read_to_string(&log)?;
            let is_passed = |line: &&str| line.starts_with("test ") && line.ends_with("ok");
            let passed = said.lines().filter(is_passed).count();
            Ok(Report { passed, log: Some(log), ..Report::default() })
        };
        let job = self.job("tests", "examples of the documentation", true);
        Some(Job { work: Box::new(work), ..job })
    }

    /// Makes the wheel and installs it.
    fn wheel(&'a self) -> Job<'a> {
        let work = move |seat: &Seat| {
            let log = self.log("wheel")?;
            let run = |c: &mut Command| run_quietly(&mut seated(linting(c)?, seat), &log);
            python::installed(self.house, "dev", &run)?;
            no_warnings(&log)?;
            Ok(Report::default())
        };
        Job { work: Box::new(work), ..self.job("Python package", "wheel", true) }
    }

    /// Keeps that something passed as a whole.
    ///
    /// # Errors
    /// When that cannot be written.
    fn passed(&self, subject: &Subject, name: &str, report: Report) -> Result<Report> {
        if report.failed.is_empty() && report.skipped == 0 {
            self.known.keep(subject, [(name, report.passed)].into_iter())?;
        }
        Ok(report)
    }

    /// Tests the package that was installed.
    fn package(&'a self, wheel: usize, subject: Subject) -> Job<'a> {
        let work = move |seat: &Seat| {
            let tests = python::tests(self.house, &self.supine);
            let log = self.logs.path("package");
            let report = pytest::run(&mut seated(&tests, seat), "package", &log)?;
            self.passed(&subject, "package", report)
        };
        let job = self.job("Python package", "tests", false);
        Job { work: Box::new(work), after: vec![wheel], ..job }
    }

    /// Tests the workflow for clusters.
    fn workflow(&'a self, subject: Subject) -> Job<'a> {
        let work = move |seat: &Seat| {
            let tests = python::workflow(self.house, &self.supine);
            let log = self.logs.path("workflow");
            let report = pytest::run(&mut seated(&tests, seat), "workflow", &log)?;
            self.passed(&subject, "workflow", report)
        };
        // It waits for Slurm and for Snakemake.
        Job { work: Box::new(work), processors: 0, ..self.job("workflow", "tests", false) }
    }

    /// What the features of the other meshers compile: it is linted and tested.
    fn meshers(&'a self) -> Option<Job<'a>> {
        let packages = meshers::PACKAGES;
        if !packages.iter().any(|package| self.selection.has(package)) {
            return None;
        }
        let work = move |seat: &Seat| {
            let log = self.log("meshers")?;
            let mut report = Report::default();
            let mut command = meshers::tests(cargo(&self.house.root));
            let command = &mut seated(linting(&mut command)?, seat);
            let built = build(command, self.metadata, &log, || true)?;
            no_warnings(&log)?;
            let supine = self.supine.with_file_name("supine-meshers");
            std::fs::copy(built.supine.as_deref().unwrap_or(Path::new("")), &supine)?;
            for executable in &built.executables {
                let tests = to_run(executable, &supine, &self.times, &self.known)?;
                report.passed += tests.before;
                for share in tests.shares {
                    report.add(share.run(self.house, seat, &self.logs)?);
                }
            }
            Ok(report)
        };
        Some(Job { work: Box::new(work), ..self.job("other meshers", "CGAL and TetGen", true) })
    }
}
