//! The CT's series as what leaves in DICOM may name it.

use crate::RunError;
use crate::store::Store;
use std::path::Path;
use supine_dicom::{Anonymiser, Source};

/// The series that objects for other systems are made from, with or without the patient.
#[derive(Clone, Debug)]
pub struct Outward {
    /// What exports inherit.
    pub source: Source,
    /// What took the patient out, when she was.
    pub anonymiser: Option<Anonymiser>,
}

impl Outward {
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
pub fn forgetful_anonymiser() -> Result<Anonymiser, RunError> {
    Ok(Anonymiser::new(random()?))
}

/// What took the patient out of the finished run in a folder; none when its key is gone.
///
/// # Errors
/// When the key is there and cannot be read.
pub(crate) fn known_anonymiser(run: &Path) -> Result<Option<Anonymiser>, RunError> {
    Ok(read(&run.join(SECRET))?.map(Anonymiser::new))
}

/// The secret of a run's folder, made on first use: the same patient keeps her pseudonym and UIDs when the
/// run is repeated or more is carried. Whoever has it can test which patient this was.
pub(crate) fn secret(store: &Store) -> Result<[u8; 32], RunError> {
    let path = store.path(SECRET)?;
    if let Some(known) = read(&path)? {
        return Ok(known);
    }
    let made = random()?;
    crate::store::write_atomically(&path, &made)?;
    Ok(made)
}

/// Where the secret lies in a run's folder.
const SECRET: &str = ".stages/anonymise.key";

/// A message without the names of regions in it, which stand in quotation marks as Rust writes them.
pub(crate) fn unnamed(message: &str) -> String {
    let (mut out, mut within, mut escaped) = (String::new(), false, false);
    for c in message.chars() {
        if c == '"' && !escaped {
            within = !within;
            out += if within { "\"..." } else { "\"" };
        } else if !within {
            out.push(c);
        }
        escaped = within && c == '\\' && !escaped;
    }
    out
}

fn read(path: &Path) -> Result<Option<[u8; 32]>, RunError> {
    match std::fs::read(path) {
        Ok(bytes) => Ok(bytes.try_into().ok()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(RunError::Output { path: path.into(), source }),
    }
}

fn random() -> Result<[u8; 32], RunError> {
    let mut key = [0; 32];
    getrandom::fill(&mut key).map_err(|error| RunError::Random(error.to_string()))?;
    Ok(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_messages_are_left_out() {
        let names = ["CTV Doe", "a \"b\" \\", "c\\\"d"];
        let message = format!("regions {:?}, {:?} and {:?}: none", names[0], names[1], names[2]);
        assert_eq!(unnamed(&message), r#"regions "...", "..." and "...": none"#);
        assert_eq!(unnamed("nothing named"), "nothing named");
    }
}
