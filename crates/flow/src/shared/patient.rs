//! Whether an object is of the patient of the CT.
//!
//! Objects of another patient may bear the CT's frame of reference after a merge or a copy, and two
//! patients may have been given one Patient ID.

use crate::Error;
use std::collections::BTreeSet;
use std::path::Path;
use supine_dicom::{Owner, Source, object_files};
use supine_report::PatientIdentity;
use supine_space::{Progress, Warning};

/// What became of holding an object against the patient of the CT.
#[derive(Debug, Default)]
pub(crate) struct PatientCompared {
    /// Both name a Patient ID, which is the same.
    pub(crate) by_id: bool,
    /// Name or date of birth differ, or the object bears no Patient ID.
    pub(crate) warning: Option<Warning>,
}

/// Holds an object against the patient of the CT; without one nothing is compared.
///
/// # Errors
/// [`Error::OtherPatient`] where both name a Patient ID and these differ, and when the object
/// cannot be read.
pub(crate) fn of_the_patient(path: &Path, ct: Option<&Source>) -> Result<Option<Warning>, Error> {
    let own = ct.map(Source::whose).unwrap_or_default();
    Ok(compare_patient(path, &own)?.warning)
}

/// The same for a patient who is known by what a CT said of her.
///
/// # Errors
/// As [`of_the_patient`].
pub(crate) fn compare_patient(
    path: &Path,
    own: &PatientIdentity,
) -> Result<PatientCompared, Error> {
    let mut compared = PatientCompared { by_id: !own.id.is_empty(), warning: None };
    for owner in owners(path)? {
        let named = !owner.patient.is_empty() && !own.id.is_empty();
        compared.by_id &= named;
        if named && owner.patient != own.id {
            return Err(Error::OtherPatient { path: path.into() });
        }
        if compared.warning.is_none() {
            compared.warning = differs(&owner, own).map(|what| doubtful(path, named, what));
        }
        if compared.warning.is_none() && owner.patient.is_empty() && !own.id.is_empty() {
            compared.warning = Some(unnamed(path));
        }
    }
    Ok(compared)
}

/// Whether every object of a file names a patient.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn names_a_patient(path: &Path) -> Result<bool, Error> {
    Ok(owners(path)?.iter().all(|owner| !owner.patient.is_empty()))
}

fn owners(path: &Path) -> Result<Vec<Owner>, Error> {
    let files = object_files(path, Progress::none()).map_err(Error::Carried)?;
    Ok(files.objects.into_iter().map(|object| object.owner).collect())
}

/// What differs although the Patient ID does not. What one of them leaves out does not differ:
/// planning systems drop middle names.
fn differs(owner: &Owner, own: &PatientIdentity) -> Option<&'static str> {
    let [a, b] = [&owner.name, &own.name].map(|name| words(name));
    if !a.is_subset(&b) && !b.is_subset(&a) {
        return Some("name");
    }
    let born = [&owner.born, &own.born];
    let differ = born.iter().all(|date| !date.is_empty()) && born[0] != born[1];
    differ.then_some("date of birth")
}

/// The words of a name, in small letters.
fn words(name: &str) -> BTreeSet<String> {
    let parts = name.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty());
    parts.map(str::to_lowercase).collect()
}

fn unnamed(path: &Path) -> Warning {
    let text = " bears no Patient ID: make sure that it is of the patient of the CT";
    Warning::new("patient-unnamed", "").name(path.display().to_string()).text(text)
}

fn doubtful(path: &Path, named: bool, what: &str) -> Warning {
    let id = if named { "the Patient ID of the CT" } else { "no Patient ID to compare" };
    let text =
        format!(": it bears {id} and another {what}: make sure that it is of the same patient");
    Warning::new("patient-doubtful", "").name(path.display().to_string()).text(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patient_is_another_by_name_or_birth_not_by_how_these_are_written() {
        let differ = |[name, born]: [&str; 2], [own, own_born]: [&str; 2]| {
            let owner = Owner { name: name.into(), born: born.into(), ..Owner::default() };
            let own = PatientIdentity {
                name: own.into(),
                born: own_born.into(),
                ..PatientIdentity::default()
            };
            differs(&owner, &own)
        };
        let own = ["Doe, Jane Mary", "1960-05-17"];
        assert_eq!(differ(["DOE Jane", "1960-05-17"], own), None);
        assert_eq!(differ(["", ""], own), None);
        assert_eq!(differ(["Roe, Jane", "1960-05-17"], own), Some("name"));
        assert_eq!(differ(["Doe, Jane", "1961-05-17"], own), Some("date of birth"));
    }
}
