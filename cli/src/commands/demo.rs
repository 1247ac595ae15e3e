//! `supine demo`: the patient inside the program.

use super::run::case_into;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use include_dir::{Dir, include_dir};
use std::path::Path;
use supine_pipeline::{Case, Options, RunError};

/// The synthetic patient: `fixtures/patient`, which no person ever was.
static CT: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../fixtures/patient/ct");
const CASE: &str = include_str!("../../../fixtures/patient/case.toml");

pub(crate) fn demo(args: &args::Demo, screen: &Screen) -> Result<u8, Failure> {
    let folder = args.out.join("case");
    unpack(&folder).map_err(|e| {
        Failure::output(format!("the demo's case cannot be written to {}: {e}", folder.display()))
    })?;
    screen.say(&format!("a synthetic patient: {}", folder.join("case.toml").display()));
    let case = Case::read(&folder.join("case.toml")).map_err(RunError::from)?;
    case_into(&case, &args.out, Options::default(), screen)
}

fn unpack(folder: &Path) -> std::io::Result<()> {
    let ct = folder.join("ct");
    std::fs::create_dir_all(&ct)?;
    for file in CT.files() {
        std::fs::write(ct.join(file.path()), file.contents())?;
    }
    std::fs::write(folder.join("case.toml"), CASE)
}
