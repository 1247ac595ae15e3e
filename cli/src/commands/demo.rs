//! `supine demo`: the patient inside the program.

use super::run::case_into;
use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::start::start;
use include_dir::{Dir, include_dir};
use std::path::Path;
use supine_flow::Options;
use supine_flow::commands::Colour;
use supine_flow::commands::run::Run;
use supine_space::Failure as Kind;

/// The synthetic patient: `fixtures/patient`, which no person ever was.
static CT: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../fixtures/patient/ct");
const CASE: &str = include_str!("../../../fixtures/patient/case.toml");

pub(crate) fn demo(args: &args::Demo, screen: &Screen) -> Result<End, Failure> {
    let folder = args.out.join("case");
    unpack(&folder).map_err(|e| {
        let text = format!("the demo's case cannot be written to {}: {e}", folder.display());
        Failure::new(Kind::of_output(&e), text)
    })?;
    let case = folder.join("case.toml");
    screen.say(&format!("a synthetic patient: {}", case.display()));
    let (out, start) = (args.out.clone(), Some(start()?));
    let given =
        Run { case, changes: vec![], anonymise: false, out, options: Options::default(), start };
    case_into(&given, Colour::Amber, screen)
}

fn unpack(folder: &Path) -> std::io::Result<()> {
    let ct = folder.join("ct");
    std::fs::create_dir_all(&ct)?;
    for file in CT.files() {
        std::fs::write(ct.join(file.path()), file.contents())?;
    }
    std::fs::write(folder.join("case.toml"), CASE)
}
