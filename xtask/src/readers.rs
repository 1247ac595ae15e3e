//! The independent readers: DICOM validators, an archive, a solver, a library of OpenIGTLink and a cluster's engine from Debian, Python packages in
//! `target/readers`.
//!
//! Both are installed once: what is there already is left alone, and what is installed is said.

use crate::House;
use crate::steps::run;
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

/// Files of libraries that a client is compiled against, each with the Debian package that brings it.
const LIBRARIES: [(&str, &str); 1] =
    [("/usr/include/openigtlink/igtlClientSocket.h", "libopenigtlink-dev")];

/// Installs what is missing.
///
/// # Errors
/// When a package is missing and cannot be installed; the message says what to do by hand.
pub(crate) fn install(house: &House) -> Result<()> {
    let mut packages: Vec<&str> = BINARIES
        .iter()
        .filter(|(binary, _)| !on_path(binary) && !Path::new("/usr/sbin").join(binary).is_file())
        .map(|(_, package)| *package)
        .collect();
    packages.dedup();
    let missing = LIBRARIES.iter().filter(|(file, _)| !Path::new(file).is_file());
    packages.extend(missing.map(|(_, package)| *package));
    if !python_makes_environments() {
        packages.push("python3-venv");
    }
    if packages.is_empty() {
        println!("the Debian packages of the readers are installed");
    } else {
        install_debian(&packages)?;
    }
    install_python(house)
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
fn succeeds(command: &mut Command) -> bool {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Installs Debian packages and says so.
///
/// # Errors
/// When that is not possible; the message says what to do by hand.
pub(crate) fn install_debian(packages: &[&str]) -> Result<()> {
    let names = packages.join(" ");
    println!("installing Debian packages, once: {names}");
    let by_hand = || format!("install by hand: apt-get install {names}");
    if !on_path("apt-get") {
        bail!("this machine has no apt-get; {}", by_hand());
    }
    let root = succeeds(Command::new("sh").args(["-c", "test $(id -u) = 0"]));
    if !root && !succeeds(Command::new("sudo").args(["-n", "true"])) {
        bail!("neither root nor sudo without a password; {}", by_hand());
    }
    let apt = |arguments: &[&str]| {
        let mut command = if root {
            Command::new("env")
        } else {
            let mut sudo = Command::new("sudo");
            sudo.args(["-n", "env"]);
            sudo
        };
        command.args(["DEBIAN_FRONTEND=noninteractive", "apt-get"]).args(arguments);
        run(&mut command)
    };
    apt(&["update", "--quiet"]).with_context(by_hand)?;
    let install = ["install", "--yes", "--quiet", "--no-install-recommends"];
    apt(&[&install[..], packages].concat()).with_context(by_hand)
}

/// Makes `target/readers`; see [`environment`].
fn install_python(house: &House) -> Result<()> {
    environment(house, "readers", "SimpleITK, highdicom, meshio, pydicom, pyigtl").map(drop)
}

/// Makes `target/NAME`, a virtual environment with the packages of `xtask/NAME.txt`, unless it was made from the same list;
/// its Python. The copy of the list inside is written last, so that a broken installation is made anew.
///
/// # Errors
/// When the packages cannot be had, or its Python cannot import `modules`.
pub(crate) fn environment(house: &House, name: &str, modules: &str) -> Result<PathBuf> {
    let list = house.root.join(format!("xtask/{name}.txt"));
    let wanted = std::fs::read_to_string(&list).with_context(|| list.display().to_string())?;
    let environment = house.target.join(name);
    let made_from = environment.join("packages.txt");
    let python = environment.join("bin/python");
    let works = || succeeds(Command::new(&python).args(["-c", &format!("import {modules}")]));
    if std::fs::read_to_string(&made_from).is_ok_and(|made| made == wanted) && works() {
        println!("the Python packages in {} are up to date", environment.display());
        return Ok(python);
    }
    println!("installing Python packages, once: {}", environment.display());
    if environment.exists() {
        std::fs::remove_dir_all(&environment).context("cannot remove the old Python packages")?;
    }
    run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    run(Command::new(&python).args(pip).arg("--requirement").arg(&list)).context(
        "the Python packages come from the index that pip is set up for: is it reachable?",
    )?;
    if !works() {
        bail!("the packages were installed but cannot be imported by {}", python.display());
    }
    std::fs::write(&made_from, wanted).with_context(|| made_from.display().to_string())?;
    Ok(python)
}
