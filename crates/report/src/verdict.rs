//! The one line a planner reads first.

use crate::{Summary, words};

/// What to think of the result at first sight.
#[derive(Debug, PartialEq)]
pub(crate) struct Verdict {
    /// `good`, `check` or `stop`: the class that colours it.
    pub(crate) class: &'static str,
    /// In three words.
    pub(crate) headline: String,
    /// Why.
    pub(crate) text: String,
}

impl Verdict {
    /// The verdict on a run: `stop` when the map folds or the exported files fail a check, `check`
    /// when there are warnings or nothing was checked.
    pub(crate) fn new(summary: &Summary) -> Self {
        let folded = summary.warp.folded_voxels;
        if folded > 0 {
            let text = format!(
                "The simulated tissue folds over itself in {} voxels.",
                words::count(folded)
            );
            return Self { class: "stop", headline: "Do not use".into(), text };
        }
        let checks = summary.export.as_ref().map(|e| &e.verified);
        if let Some(checks) = checks.filter(|c| c.passed < c.total) {
            let failed = checks.total - checks.passed;
            let text = format!("{failed} of {} checks of the exported files failed.", checks.total);
            return Self { class: "stop", headline: "Do not use".into(), text };
        }
        let checked = match checks {
            None => "No DICOM series was exported.".into(),
            Some(c) if c.total == 0 => "The exported files were not checked.".into(),
            Some(c) => format!("All {} checks of the exported files passed.", c.total),
        };
        let unchecked = checks.is_none_or(|c| c.total == 0);
        match summary.warnings.len() {
            0 if unchecked => {
                Self { class: "check", headline: "Not checked".into(), text: checked }
            }
            0 => Self { class: "good", headline: "No warnings".into(), text: checked },
            1 => Self { class: "check", headline: "Read the warning".into(), text: checked },
            n => Self { class: "check", headline: format!("Read the {n} warnings"), text: checked },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    #[test]
    fn folds_and_failed_checks_stop_and_warnings_are_named() {
        let mut summary = example();
        assert_eq!(Verdict::new(&summary).class, "check");
        summary.warnings.clear();
        assert_eq!(Verdict::new(&summary).class, "good");
        summary.warp.folded_voxels = 3;
        assert_eq!(Verdict::new(&summary).class, "stop");
        summary.warp.folded_voxels = 0;
        if let Some(export) = &mut summary.export {
            export.verified.passed -= 1;
        }
        let verdict = Verdict::new(&summary);
        assert_eq!((verdict.class, &verdict.text[..4]), ("stop", "1 of"));
        if let Some(export) = &mut summary.export {
            (export.verified.passed, export.verified.total) = (0, 0);
        }
        assert_eq!(Verdict::new(&summary).class, "check");
        summary.export = None;
        assert_eq!(Verdict::new(&summary).class, "check");
    }
}
