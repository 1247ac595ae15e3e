//! Import: the CT and the hash of what it came from.

use crate::bench::Bench;
use crate::ct::{CtInput, read_ct};
use crate::store::{form, hash_of};
use crate::{Case, RunError, Stage};
use supine_report::{CtFacts, Input, LeftOut};

/// The CT with its facts.
pub(crate) struct Imported {
    pub(crate) input: CtInput,
    pub(crate) facts: CtFacts,
    pub(crate) origin: Input,
    /// Decides everything that is made from the CT.
    pub(crate) key: String,
}

pub(crate) fn import(bench: &mut Bench<'_>, case: &Case) -> Result<Imported, RunError> {
    bench.pass(Stage::Import, |progress| {
        let input = read_ct(&case.ct, case.series.as_deref(), progress)?;
        let hashed = hash_of(&case.ct).map_err(|source| RunError::Missing {
            role: "`ct`",
            path: case.ct.clone(),
            source,
        })?;
        let origin = Input {
            role: "ct".into(),
            form: form(&case.ct),
            files: hashed.files,
            blake3: hashed.blake3,
        };
        let key = crate::store::key(&[&origin.blake3, case.series.as_deref().unwrap_or("")]);
        let warnings = input.dicom.iter().flat_map(|(_, info)| info.warnings.clone()).collect();
        let facts = facts(&input);
        Ok((Imported { input, facts, origin, key }, warnings))
    })
}

fn facts(input: &CtInput) -> CtFacts {
    let grid = input.ct.grid();
    let info = input.dicom.as_ref().map(|(_, info)| info);
    let left_out = info.into_iter().flat_map(|i| &i.left_out);
    CtFacts {
        size: grid.size(),
        spacing_mm: grid.spacing().into(),
        origin_mm: grid.origin().coords.into(),
        slices: grid.size()[2],
        patient_position: info.map(|i| i.patient_position.clone()).unwrap_or_default(),
        left_out: left_out
            .map(|l| LeftOut { file: l.file.clone(), reason: l.reason.clone() })
            .collect(),
    }
}
