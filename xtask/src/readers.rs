//! What others provide for the check: DICOM validators, an archive, a solver, a browser, libraries
//! and a cluster's engine from Debian, Python packages in environments under `target/`.
//!
//! All is installed once: what is there already is left alone, and what is installed is said.

use crate::House;
use crate::debian;
use crate::steps::run;
use crate::{meshers, python};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Binaries that must be on the path, each with the Debian package that brings it.
const BINARIES: [(&str, &str); 18] = [
    ("dciodvfy", "dicom3tools"),
    ("dcentvfy", "dicom3tools"),
    ("dcmdump", "dcmtk"),
    ("dcmftest", "dcmtk"),
    ("storescp", "dcmtk"),
    ("Orthanc", "orthanc"),
    ("ip", "iproute2"),
    ("openssl", "openssl"),
    ("unshare", "util-linux"),
    ("ccx", "calculix-ccx"),
    ("plastimatch", "plastimatch"),
    ("python3", "python3"),
    ("zstd", "zstd"),
    ("chromium", "chromium"),
    ("g++", "g++"),
    ("slurmctld", "slurm-wlm"),
    ("munged", "munge"),
    ("rsync", "rsync"),
];

/// Files of libraries that a client is compiled against, each with the Debian package that brings
/// it.
const LIBRARIES: [(&str, &str); 1] =
    [("/usr/include/openigtlink/igtlClientSocket.h", "libopenigtlink-dev")];

/// The Python of the conformance tests.
pub(crate) const READERS: Environment =
    Environment { name: "readers", modules: "SimpleITK, highdicom, meshio, pydicom, pyigtl" };

/// Installs what is missing.
///
/// # Errors
/// When something is missing and cannot be installed; the message says what to do by hand.
pub(crate) fn install(house: &House) -> Result<()> {
    install_packages()?;
    install_environments(house)
}

/// Installs the packages of Debian that are missing.
///
/// # Errors
/// As [`install`].
pub(crate) fn install_packages() -> Result<()> {
    let mut packages: Vec<&str> = BINARIES
        .iter()
        .filter(|(binary, _)| !on_path(binary) && !Path::new("/usr/sbin").join(binary).is_file())
        .map(|(_, package)| *package)
        .collect();
    packages.dedup();
    let files = LIBRARIES.iter().chain(&meshers::HEADERS);
    packages.extend(files.filter(|(file, _)| !Path::new(file).is_file()).map(|(_, name)| *name));
    if !python_makes_environments() {
        packages.push("python3-venv");
    }
    if packages.is_empty() {
        println!("the Debian packages are installed");
    } else {
        debian::install(&packages)?;
    }
    Ok(())
}

/// Installs the Python packages that are missing.
///
/// # Errors
/// As [`install`].
pub(crate) fn install_environments(house: &House) -> Result<()> {
    // What they wait for is the network, each for its own files.
    std::thread::scope(|scope| {
        let environments = [READERS, python::PACKAGE, python::WORKFLOW];
        let installing: Vec<_> = environments
            .into_iter()
            .map(|environment| scope.spawn(move || environment.install(house)))
            .collect();
        installing.into_iter().try_for_each(|thread| match thread.join() {
            Ok(installed) => installed,
            Err(_) => bail!("installing Python packages broke off"),
        })
    })
}

/// Whether a program of this name is on the path.
pub(crate) fn on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

/// Whether `python3 -m venv` can work: Debian ships Python without the module it needs.
fn python_makes_environments() -> bool {
    succeeds(Command::new("python3").args(["-c", "import ensurepip, venv"]))
}

/// Whether a command can be started and ends with 0; its output is dropped.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// A virtual environment under `target/` with the packages of a list.
#[derive(Clone, Copy)]
pub(crate) struct Environment {
    /// It is made in `target/NAME` from `xtask/NAME.txt`.
    pub(crate) name: &'static str,
    /// What must be importable, separated by commas.
    pub(crate) modules: &'static str,
}

impl Environment {
    /// Its Python.
    pub(crate) fn python(&self, house: &House) -> PathBuf {
        house.target.join(self.name).join("bin/python")
    }

    /// Makes it, unless it was made from the same list. The copy of the list inside is written
    /// last, so that a broken installation is made anew.
    ///
    /// # Errors
    /// When the packages cannot be had, or its Python cannot import the modules.
    pub(crate) fn install(&self, house: &House) -> Result<()> {
        let list = house.root.join(format!("xtask/{}.txt", self.name));
        let wanted = std::fs::read_to_string(&list).with_context(|| list.display().to_string())?;
        let folder = house.target.join(self.name);
        let made_from = folder.join("packages.txt");
        let python = self.python(house);
        let import = format!("import {}", self.modules);
        let works = || succeeds(Command::new(&python).args(["-c", &import]));
        if std::fs::read_to_string(&made_from).is_ok_and(|made| made == wanted) && works() {
            println!("the Python packages in {} are up to date", folder.display());
            return Ok(());
        }
        println!("installing Python packages, once: {}", folder.display());
        if folder.exists() {
            std::fs::remove_dir_all(&folder).context("cannot remove the old Python packages")?;
        }
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
        let mut pip = Command::new(&python);
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]);
        // A download that breaks off is tried again.
        pip.args(["--retries", "8", "--timeout", "60", "--requirement"]).arg(&list);
        run(&mut pip).context(
            "the Python packages come from the index that pip is set up for: is it reachable?",
        )?;
        if !works() {
            bail!("the packages were installed but cannot be imported by {}", python.display());
        }
        std::fs::write(&made_from, wanted).with_context(|| made_from.display().to_string())
    }
}
