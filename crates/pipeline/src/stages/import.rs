//! Import: the CT and the hash of what it came from.

use crate::bench::Bench;
use crate::ct::{CtInput, read_ct};
use crate::outward::{Outward, secret};
use crate::store::{form, hash_of};
use crate::{Case, RunError, Stage};
use supine_dicom::Anonymiser;
use supine_report::{CtFacts, Input, LeftOut};

/// The CT with its facts.
pub(crate) struct Imported {
    pub(crate) input: CtInput,
    /// Its series as exports may name it, when it came as DICOM.
    pub(crate) outward: Option<Outward>,
    pub(crate) facts: CtFacts,
    pub(crate) origin: Input,
    /// Decides everything that is made from the CT.
    pub(crate) key: String,
}

pub(crate) fn import(bench: &mut Bench<'_>, case: &Case) -> Result<Imported, RunError> {
    let secret = case.export.anonymise.then(|| secret(&bench.store)).transpose()?;
    bench.pass(Stage::Import, |progress| {
        let input = read_ct(&case.ct, &case.read_params(), progress)?;
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
        let named = secret.map_or_else(String::new, |key| blake3::hash(&key).to_string());
        let series = case.series.as_deref().unwrap_or("");
        let accepted = format!("{:?}", case.accept);
        let key = crate::store::key(&[&origin.blake3, series, &accepted, &named]);
        let warnings = input.dicom.iter().flat_map(|(_, info)| info.warnings.clone()).collect();
        let facts = facts(&input, case.export.anonymise);
        let outward = input.dicom.as_ref().map(|(source, _)| match secret {
            Some(key) => Outward::anonymised(source, Anonymiser::new(key)),
            None => Outward::named(source),
        });
        Ok((Imported { input, outward, facts, origin, key }, warnings))
    })
}

/// Files are not named where the patient must not be: sites name them after her.
fn facts(input: &CtInput, anonymise: bool) -> CtFacts {
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
            .enumerate()
            .map(|(n, l)| LeftOut {
                file: if anonymise { format!("file {}", n + 1) } else { l.file.clone() },
                reason: l.reason.clone(),
            })
            .collect(),
    }
}
