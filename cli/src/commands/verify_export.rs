//! `supine verify-export`.

use crate::args;
use crate::failure::Failure;
use crate::screen::{Screen, data};
use supine_dicom::{Expected, Policy};
use supine_space::Progress;

pub(crate) fn verify_export(args: &args::VerifyExport, screen: &Screen) -> Result<u8, Failure> {
    let watch = |share| screen.share("verify", share);
    let policy = Policy {
        new_study: args.new_study,
        keep_equipment: args.keep_equipment,
        same_frame: args.same_frame,
    };
    let expected = Expected { policy, anonymiser: None, accept: args.accept.into() };
    let (source, progress) = (args.source.as_deref(), Progress::new(&watch));
    let found = supine_dicom::verify_export(&args.dir, source, expected, progress)?;
    if screen.json {
        screen.result(&found, "");
    } else {
        for check in &found.checks {
            let verdict = match check.passed {
                Some(true) => "PASS",
                Some(false) => "FAIL",
                None => "----",
            };
            data(&format!("{verdict}  {}  {}\n", check.rule, check.detail));
        }
    }
    let failed = found.checks.iter().filter(|c| c.passed == Some(false)).count();
    let open = found.checks.iter().filter(|c| c.passed.is_none()).count();
    screen
        .say(&format!("{} checks: {failed} failed, {open} could not be made", found.checks.len()));
    Ok(if failed == 0 { 0 } else { 4 })
}
