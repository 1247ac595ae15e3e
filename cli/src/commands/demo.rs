//! `supine demo`: the patient inside the program.

use super::run::case_into;
use crate::End;
use crate::args;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::start::start;
use include_dir::{Dir, include_dir};
use std::path::Path;

use supine_flow::commands::Colour;
use supine_flow::commands::run::Run;
use supine_flow::{Options, RunFolder, USERS, write_atomically};
use supine_space::Failure as Kind;

/// The synthetic patient: `fixtures/patient`, which no person ever was.
static CT: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../fixtures/patient/ct");
const CASE: &str = include_str!("../../../fixtures/patient/case.toml");

pub(crate) fn demo(args: &args::Demo, screen: &Screen) -> Result<End, Failure> {
    let folder = args.out.join("case");
    // Another demo may be at work there.
    let held = RunFolder::open(&args.out)?;
    unpack(&folder)?;
    drop(held);
    let case = folder.join("case.toml");
    screen.say(&format!("a synthetic patient: {}", case.display()));
    let (out, start) = (args.out.clone(), Some(start()?));
    let given =
        Run { case, changes: vec![], anonymise: false, out, options: Options::default(), start };
    case_into(&given, Colour::Amber, screen)
}

/// Writes the case and its CT into a folder; what is there already stays.
fn unpack(folder: &Path) -> Result<(), Failure> {
    let ct = folder.join("ct");
    std::fs::create_dir_all(&ct).map_err(|e| {
        let text = format!("the demo's case cannot be written: {}: {e}", ct.display());
        Failure::new(Kind::of_output(&e), text).at(&ct)
    })?;
    for file in CT.files() {
        keep_or_write(&ct.join(file.path()), file.contents())?;
    }
    keep_or_write(&folder.join("case.toml"), CASE.as_bytes())
}

/// Writes a file whole or not at all.
///
/// # Errors
/// When it is there with another content: somebody may have changed it.
fn keep_or_write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    match std::fs::read(path) {
        Ok(found) if found == bytes => return Ok(()),
        Ok(_) => {
            let text = format!(
                "{} is not as the demo writes it: run it by `supine run`, or name another --out",
                path.display()
            );
            return Err(Failure::coded(Kind::Usage, "output-foreign", text).at(path));
        }
        Err(_) => {}
    }
    Ok(write_atomically(path, bytes, USERS)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_somebody_changed_stays() {
        let dir = tempfile::tempdir().unwrap();
        let case = dir.path().join("case.toml");
        unpack(dir.path()).unwrap();
        unpack(dir.path()).unwrap();
        std::fs::write(&case, "# mine").unwrap();
        let refused = unpack(dir.path()).unwrap_err();
        assert!(refused.message.contains("case.toml is not as the demo writes it"));
        assert_eq!(std::fs::read_to_string(&case).unwrap(), "# mine");
    }
}
