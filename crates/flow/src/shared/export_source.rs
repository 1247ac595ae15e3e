//! The CT's series as what leaves in DICOM may name it.

use crate::Error;
use supine_dicom::{Anonymiser, Source};

/// The series that objects for other systems are made from, with or without the patient.
#[derive(Clone, Debug)]
pub struct ExportSource {
    /// What exports inherit.
    pub source: Source,
    /// What took the patient out, when she was.
    pub anonymiser: Option<Anonymiser>,
}

impl ExportSource {
    /// With the patient as she is in the source.
    pub fn named(source: &Source) -> Self {
        Self { source: source.clone(), anonymiser: None }
    }

    /// Without the patient (PS3.15 E.1).
    pub fn anonymised(source: &Source, anonymiser: Anonymiser) -> Self {
        Self { source: source.anonymised(&anonymiser), anonymiser: Some(anonymiser) }
    }
}

/// De-identification with a key that nobody keeps.
///
/// # Errors
/// When the system gives no random numbers.
pub fn forgetful_anonymiser() -> Result<Anonymiser, Error> {
    Ok(Anonymiser::new(random()?))
}

/// 32 random bytes.
///
/// # Errors
/// When the system gives none.
pub(crate) fn random() -> Result<[u8; 32], Error> {
    let mut key = [0; 32];
    getrandom::fill(&mut key).map_err(|error| Error::Random(error.to_string()))?;
    Ok(key)
}
