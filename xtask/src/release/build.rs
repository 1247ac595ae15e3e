//! The programs: built so that the same commit gives the same bytes in any folder.

use super::{Release, said};
use crate::steps::{cargo, run};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a program is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Platform {
    /// Any Linux on x86-64: musl's C library is part of the program.
    Linux,
    /// Windows 10 and later on x86-64, by the GNU linker.
    Windows,
}

impl Platform {
    pub(super) fn triple(self) -> &'static str {
        match self {
            Self::Linux => "x86_64-unknown-linux-musl",
            Self::Windows => "x86_64-pc-windows-gnu",
        }
    }

    pub(super) fn file(self) -> &'static str {
        match self {
            Self::Linux => "supine",
            Self::Windows => "supine.exe",
        }
    }

    /// The C compiler, and the Debian package that brings it.
    fn compiler(self) -> (&'static str, &'static str) {
        match self {
            Self::Linux => ("musl-gcc", "musl-tools"),
            Self::Windows => ("x86_64-w64-mingw32-gcc", "gcc-mingw-w64-x86-64"),
        }
    }
}

/// A copy of the sources, and where it is built.
pub(super) struct Site<'a> {
    pub(super) source: &'a Path,
    pub(super) target: &'a Path,
}

/// Builds the program and gives its path.
///
/// # Errors
/// When it cannot be built, or when a path of this machine stands in it.
pub(super) fn program(release: &Release<'_>, platform: Platform) -> Result<PathBuf> {
    let (compiler, package) = platform.compiler();
    super::tools::debian(&[(compiler, package)])?;
    let site = Site { source: &release.house.root, target: &release.house.target };
    let changed = said(Command::new("git").args(["status", "--porcelain"]), site.source)?;
    if !changed.is_empty() {
        println!("NOT OF A COMMIT: the folder has changes:\n{changed}");
    }
    build(&site, platform)
}

/// As [`program`], from any copy of the sources.
pub(super) fn build(site: &Site<'_>, platform: Platform) -> Result<PathBuf> {
    let triple = platform.triple();
    // rustup knows which targets are there; without it, cargo says what is missing.
    if crate::readers::on_path("rustup") {
        run(Command::new("rustup").args(["target", "add", triple]).current_dir(site.source))?;
    }
    run(cargo(site.source).args(["fetch", "--locked", "--target", triple]))?;
    let sources = Sources::of(site)?;
    let mut command = cargo(site.source);
    command.args(["build", "--locked", "--package", "supine", "--profile", "shipped"]);
    command.args(["--target", triple]);
    command.env("CARGO_TARGET_DIR", site.target);
    // mimalloc tells when it was compiled. Not the commit's time: one that changes no program gives
    // the same ones.
    command.env("SOURCE_DATE_EPOCH", "0");
    command.env("CARGO_ENCODED_RUSTFLAGS", sources.rust_flags(platform).join("\u{1f}"));
    command.env(format!("CFLAGS_{}", triple.replace('-', "_")), sources.c_flags().join(" "));
    run(&mut command)?;
    let program = site.target.join(triple).join("shipped").join(platform.file());
    sources.stand_not_in(&program)?;
    super::made(&program)?;
    Ok(program)
}

/// Folders whose names must not come into a program, each with what stands there in their place.
struct Sources(Vec<(PathBuf, String)>);

impl Sources {
    fn of(site: &Site<'_>) -> Result<Self> {
        let mut folders = vec![
            (site.source.to_owned(), "supine".to_owned()),
            (site.target.to_owned(), "target".to_owned()),
        ];
        let packages = cargo_home()?.join("registry/src");
        let mut registries = Vec::new();
        for entry in std::fs::read_dir(&packages).context("cargo's folder of sources")? {
            registries.push(entry?.path());
        }
        registries.sort();
        folders.extend(registries.into_iter().map(|folder| (folder, "crates".to_owned())));
        // Where the sources of the standard library are installed, rustc names them by their place.
        let rustc = |arguments: &[&str]| said(Command::new("rustc").args(arguments), site.source);
        let version = rustc(&["-vV"])?;
        let commit = version.lines().find_map(|line| line.strip_prefix("commit-hash: "));
        let library = Path::new(&rustc(&["--print", "sysroot"])?).join("lib/rustlib/src/rust");
        folders.push((library, format!("/rustc/{}", commit.context("rustc -vV has no hash")?)));
        Ok(Self(folders))
    }

    fn rust_flags(&self, platform: Platform) -> Vec<String> {
        let all = self.0.iter();
        let mut flags: Vec<String> = all
            .map(|(folder, name)| format!("--remap-path-prefix={}={name}", folder.display()))
            .collect();
        if platform == Platform::Windows {
            // The GNU linker writes the time of linking into the header of a program.
            flags.push("-Clink-arg=-Wl,--no-insert-timestamp".to_owned());
        }
        flags
    }

    fn c_flags(&self) -> Vec<String> {
        // C comes from other crates alone.
        let foreign =
            self.0.iter().filter(|(_, name)| ["target", "crates"].contains(&name.as_str()));
        foreign
            .map(|(folder, name)| format!("-ffile-prefix-map={}={name}", folder.display()))
            .collect()
    }

    fn stand_not_in(&self, program: &Path) -> Result<()> {
        let bytes = std::fs::read(program).with_context(|| program.display().to_string())?;
        let home = std::env::home_dir().context("no home folder")?;
        for folder in self.0.iter().map(|(folder, _)| folder).chain([&home]) {
            let name = format!("{}/", folder.display());
            ensure!(!holds(&bytes, name.as_bytes()), "{name} stands in {}", program.display());
        }
        Ok(())
    }
}

fn holds(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|part| part == word)
}

fn cargo_home() -> Result<PathBuf> {
    if let Some(home) = std::env::var_os("CARGO_HOME") {
        return Ok(home.into());
    }
    match std::env::home_dir() {
        Some(home) => Ok(home.join(".cargo")),
        None => bail!("no home folder"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_folder_goes_into_a_program() {
        let sources = Sources(vec![("/a/b".into(), "crates".into()), ("/c".into(), "/r".into())]);
        let flags = sources.rust_flags(Platform::Windows);
        assert_eq!(flags[..2], ["--remap-path-prefix=/a/b=crates", "--remap-path-prefix=/c=/r"]);
        assert_eq!(flags.len(), 3, "and the linker's time");
        assert_eq!(sources.c_flags(), ["-ffile-prefix-map=/a/b=crates"]);
        assert!(holds(b"xx/a/b/src", b"/a/b/") && !holds(b"xx/a/c", b"/a/b/"));
    }
}
