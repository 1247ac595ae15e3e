//! Objects that contradict each other: an archive takes them for one patient, one series, one
//! object.

use crate::error::Error;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufReader, Read, Seek as _, SeekFrom};
use supine_dicom::ObjectFile;
use supine_space::Warning;

/// Holds all that is to be sent against each other before the first byte leaves.
///
/// # Errors
/// When objects of one study are of two patients, or of one series in two studies.
pub(crate) fn check<'a>(
    objects: impl Iterator<Item = &'a ObjectFile>,
) -> Result<Option<Warning>, Error> {
    let (mut studies, mut series) = (BTreeMap::new(), BTreeMap::new());
    let mut patients = BTreeSet::new();
    for object in objects {
        let owner = &object.owner;
        patients.insert(&owner.patient);
        let first = *studies.entry(&owner.study).or_insert(object);
        if first.owner.patient != owner.patient {
            return Err(two(first, object, "one Study Instance UID and two Patient IDs"));
        }
        let first = *series.entry(&owner.series).or_insert(object);
        if first.owner.study != owner.study {
            return Err(two(first, object, "one Series Instance UID and two Study Instance UIDs"));
        }
    }
    let count = patients.len();
    let text = || format!("these are objects of {count} patients");
    Ok((count > 1).then(|| Warning::new("several-patients", text())))
}

/// Whether two objects of one SOP Instance UID are the same one twice.
///
/// # Errors
/// When they are not, or a file cannot be read.
pub(crate) fn same(first: &ObjectFile, second: &ObjectFile) -> Result<(), Error> {
    let equal = first.data_bytes == second.data_bytes
        && first.syntax == second.syntax
        && equal_bytes(data_set(first)?, data_set(second)?)
            .map_err(|source| Error::Read { path: second.path.clone(), source })?;
    if equal {
        Ok(())
    } else {
        Err(two(first, second, "one SOP Instance UID and are not the same"))
    }
}

/// The data set of an object as it stands in its file.
fn data_set(object: &ObjectFile) -> Result<BufReader<File>, Error> {
    let read = |source| Error::Read { path: object.path.clone(), source };
    let mut file = File::open(&object.path).map_err(read)?;
    file.seek(SeekFrom::Start(object.data_start)).map_err(read)?;
    Ok(BufReader::new(file))
}

fn equal_bytes(first: BufReader<File>, second: BufReader<File>) -> std::io::Result<bool> {
    for (a, b) in first.bytes().zip(second.bytes()) {
        if a? != b? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn two(first: &ObjectFile, second: &ObjectFile, what: &str) -> Error {
    let (first, second) = (first.name.clone(), second.name.clone());
    Error::Mixed { first, second, what: what.into() }
}
