//! `cargo xtask verify`: the figures of docs/VERIFICATION.md, from real runs.
//!
//! Runs the release binary on the fixture patient, on the cohort, on the real CTs and on the
//! mesher's reference labels, scores the results with the scripts of the shared reference folder
//! (which belongs to the developers, not to the users) and writes the page.

mod agreement;
mod applicator;
mod browser;
mod contact;
mod cut;
mod dicom;
mod fit;
mod flow;
mod fuzz;
mod hours;
mod image;
mod interval;
mod mechanics;
mod mesh;
mod navigate;
mod page;
mod path;
mod patients;
mod peers;
mod plot;
mod real;
mod refine;
mod scripting;
mod slider;
mod speed;
mod study;
mod study_tables;
mod table;
mod texture;
mod walls;
mod warp;

use crate::House;
use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;
use mechanics::Mechanics;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where the shared references lie and where the runs go.
pub(crate) struct Bench<'a> {
    pub(crate) house: &'a House,
    /// The reference data.
    pub(crate) shared: PathBuf,
    /// Work folder under target/.
    pub(crate) work: PathBuf,
    pub(crate) supine: PathBuf,
    pub(crate) python: PathBuf,
}

impl<'a> Bench<'a> {
    fn open(house: &'a House) -> Result<Self> {
        let shared = house.root.join("../shared");
        ensure!(
            shared.join("cohort/score.py").is_file(),
            "`cargo xtask verify` and `bench` need the reference data in ../shared"
        );
        let python = environment(house, "scorers")?;
        let work = house.target.join("verify");
        std::fs::create_dir_all(&work)?;
        Ok(Self { house, shared, work, supine: house.target.join("release/supine"), python })
    }

    fn with_supine(house: &'a House) -> Result<Self> {
        let bench = Self::open(house)?;
        run(Command::new("cargo").args(["build", "--release", "-p", "supine"]))?;
        Ok(bench)
    }
}

/// What `cargo xtask bench` can measure.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
pub(crate) enum Measured {
    /// Time and memory of the segmentation beside a script.
    Segment,
    /// The mesher beside CGAL, gmsh and MMG; installs them.
    Mesh,
    /// The mechanics beside dolfinx and felupe, which it installs, its convergence, its agreement
    /// with stored solutions, and an applicator's steps.
    Mechanics,
    /// What stands for the tissue beyond the sphere.
    Cut,
    /// The carried picture of the synthetic patients by interpolation: where it differs from the
    /// truth, and the texture of its noise.
    Picture,
    /// The warp beside memcpy, VTK and SimpleITK, which it installs, and against the exact
    /// reference.
    Warp,
    /// The workstation's page beside viewers, which npm installs; needs what `cargo xtask readers`
    /// installs.
    Page,
}

/// `cargo xtask bench`: ours beside the peers, on stdout; all when nothing is named.
pub(crate) fn bench(house: &House, measured: Option<Measured>) -> Result<()> {
    let wanted = |one| measured.is_none_or(|m| m == one);
    if wanted(Measured::Segment) {
        print!("{}", speed::table(&Bench::with_supine(house)?)?);
    }
    if wanted(Measured::Mesh) {
        print!("{}", peers::beside(&Bench::with_supine(house)?)?);
    }
    if wanted(Measured::Mechanics) {
        print!("{}", mechanics(&Bench::open(house)?)?);
    }
    if wanted(Measured::Cut) {
        print!("{}", cut::table(&Bench::open(house)?)?);
    }
    if wanted(Measured::Picture) {
        let patients = patients::all(&Bench::with_supine(house)?)?;
        print!("{}{}", image::table(&patients)?, texture::table(&patients)?);
    }
    if wanted(Measured::Warp) {
        print!("{}", warp::section(&Bench::open(house)?)?);
    }
    if measured == Some(Measured::Page) {
        print!("{}", browser::table(&Bench::with_supine(house)?)?);
    }
    Ok(())
}

/// A part of the page, in the order in which they stand there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub(crate) enum Part {
    /// The tumour's displacement with tissue that nobody measured, and how often its interval holds
    /// the truth.
    Interval,
    /// The modulus by surface scans, and how often its interval holds the truth.
    Fit,
    /// The synthetic patients, whole runs against their truth; writes docs/pictures too.
    Patients,
    /// Real CTs, whole runs.
    Real,
    /// Whole and repeated runs: time and memory.
    Flow,
    /// Segmentation against contours and truth, time and memory.
    Segmentation,
    /// The chest wall of real CTs against contours, each with what was chosen without it.
    Walls,
    /// Meshes of known shapes, beside CGAL and TetGen.
    Meshes,
    /// Smaller tetrahedra where they count.
    Refinement,
    /// Mechanics beside other programs, convergence, agreement, the applicator.
    Mechanics,
    /// Tissue that an applicator presses, beside another program.
    Contact,
    /// The operating table tilted live.
    Table,
    /// The same in the page, from the slider to the picture; needs what `cargo xtask readers`
    /// installs.
    Slider,
    /// An applicator's path over the tumour on coarse and fine meshes.
    Path,
    /// The tumour followed live: from a pose to its place; only when named.
    /// `SUPINE_NAVIGATE_MINUTES`: how long, else 10.
    Navigate,
    /// What stands for the tissue beyond the sphere.
    Cut,
    /// The warp beside memcpy, VTK and SimpleITK, and against the exact reference.
    Warp,
    /// The workstation's page beside viewers; only when named, for it needs npm.
    Page,
    /// The memory of server and page over hours of use; only when named; `SUPINE_HOURS_MINUTES`:
    /// how long, else 240.
    Hours,
    /// Folders of many files, time and finds of verify-export.
    Dicom,
    /// The Python package and batches beside single runs; only when named: it builds the wheel.
    Scripting,
    /// What the logs of `cargo xtask fuzz` say; only when named.
    Fuzz,
}

/// Parts that are measured only when they are named.
const SELDOM: [Part; 6] =
    [Part::Slider, Part::Navigate, Part::Page, Part::Hours, Part::Scripting, Part::Fuzz];

impl Part {
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Its text, from runs made now.
    fn measure(self, bench: &Bench<'_>) -> Result<String> {
        match self {
            Self::Interval => interval::section(bench),
            Self::Fit => fit::section(bench),
            Self::Patients => {
                let patients = patients::all(bench)?;
                pictures(bench)?;
                page::patients(&patients)
            }
            Self::Real => page::real(&real::all(bench)?),
            Self::Flow => flow::section(bench),
            Self::Segmentation => {
                let speed = speed::table(bench)?;
                page::segmentation(&study::study(bench)?, &speed)
            }
            Self::Walls => walls::section(bench),
            Self::Meshes => {
                let others = peers::chosen(bench)?;
                page::meshes(&mesh::all(bench)?, &(others + &mesh::coarsened(bench)?))
            }
            Self::Refinement => refine::table(bench),
            Self::Mechanics => mechanics(bench),
            Self::Contact => contact::section(bench),
            Self::Table => table::section(bench),
            Self::Slider => slider::section(bench),
            Self::Path => path::section(bench),
            Self::Navigate => navigate::section(bench),
            Self::Cut => cut::table(bench),
            Self::Warp => warp::section(bench),
            Self::Page => browser::section(bench),
            Self::Hours => hours::section(bench),
            Self::Dicom => dicom::section(bench),
            Self::Scripting => scripting::section(bench),
            Self::Fuzz => fuzz::section(bench),
        }
    }
}

/// Measures `parts` of the page, when none is named all that need no hours; each is written as soon
/// as it is known.
pub(crate) fn verify(house: &House, parts: &[Part]) -> Result<()> {
    let bench = Bench::with_supine(house)?;
    let mut page = page::Page::read(&bench)?;
    let all: Vec<Part> =
        Part::value_variants().iter().copied().filter(|p| !SELDOM.contains(p)).collect();
    let wanted = if parts.is_empty() { &all } else { parts };
    for part in wanted {
        let text = part.measure(&bench).with_context(|| part.name())?;
        let date = output(Command::new("date").args(["-u", "+%Y-%m-%d"]))?;
        page.put(*part, date.trim(), &text)?;
        println!("{}: written", part.name());
    }
    Ok(())
}

/// Cost, convergence and agreement of the mechanics, and the applicator.
fn mechanics(bench: &Bench<'_>) -> Result<String> {
    let mechanics = Mechanics::open(bench)?;
    Ok([
        mechanics.cost()?,
        agreement::convergence(&mechanics)?,
        agreement::agreement(&mechanics)?,
        agreement::laws(&mechanics)?,
        agreement::boundaries(&mechanics)?,
        include_str!("verify/beyond.md").to_owned(),
        applicator::table(&mechanics)?,
    ]
    .concat())
}

/// The pictures of the fixture patient's report, and of the page, that the documents show.
fn pictures(bench: &Bench<'_>) -> Result<()> {
    let shown = bench.house.root.join("docs/pictures");
    for entry in std::fs::read_dir(&shown)? {
        let name = entry?.file_name();
        // That of live navigation is drawn when it is measured.
        if name.to_str().is_some_and(|name| name.starts_with("navigate_")) {
            continue;
        }
        // Those of the page are left by the test of the page.
        let of_page = name.to_str().and_then(|name| name.strip_prefix("page_"));
        let made = match of_page {
            Some(picture) => bench.house.target.join("page").join(picture),
            None => bench.work.join("fixture/out/report").join(&name),
        };
        std::fs::copy(&made, shown.join(&name)).with_context(|| made.display().to_string())?;
    }
    Ok(())
}

/// Writes a plot to its place among the documents.
fn write_plot(bench: &Bench<'_>, place: &str, svg: &str) -> Result<()> {
    let path = bench.house.root.join("docs").join(place);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(&path, svg).with_context(|| path.display().to_string())
}

/// The Python of an environment under target/, made once from the list `xtask/NAME.txt`.
fn environment(house: &House, name: &str) -> Result<PathBuf> {
    let environment = house.target.join(name);
    let python = environment.join("bin/python");
    if !environment.join("made").is_file() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
        let mut pip = Command::new(&python);
        pip.args(["-m", "pip", "install", "--quiet", "--requirement"]);
        run(pip.arg(house.root.join(format!("xtask/{name}.txt"))))?;
        std::fs::write(environment.join("made"), "")?;
    }
    Ok(python)
}

/// Runs a command and fails with what it said.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    output(command).map(drop)
}

/// What a command prints on stdout.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    eprintln!("  {command:?}");
    let done = command.output().with_context(|| format!("{command:?}"))?;
    if !done.status.success() {
        bail!("{command:?}: {}\n{}", done.status, String::from_utf8_lossy(&done.stderr));
    }
    Ok(String::from_utf8(done.stdout)?)
}

/// One run of `supine run`, its summary.
pub(crate) fn run_case(bench: &Bench<'_>, case: &Path, out: &Path) -> Result<serde_json::Value> {
    let mut command = Command::new(&bench.supine);
    command.arg("run").arg(case).arg("--out").arg(out);
    // Redone whatever is there: the times are part of the page.
    command.args(["--json", "--no-progress", "--force", "import"]);
    Ok(serde_json::from_str(&output(&mut command)?)?)
}

/// A number deep in a JSON value.
pub(crate) fn number(json: &serde_json::Value, pointer: &str) -> Result<f64> {
    let value = json.pointer(pointer).and_then(serde_json::Value::as_f64);
    value.with_context(|| format!("no number at {pointer}"))
}
