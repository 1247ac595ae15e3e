//! A single object appears under its name only when another reader reads it back as it was meant.

use crate::data_set::{DataSet, Value, text_of};
use crate::error::Error;
use dicom_core::{Tag, VR};
use dicom_object::{InMemDicomObject, open_file};
use std::io::Write as _;
use std::path::Path;

/// Writes a file under a temporary name beside its own, which it gets when `check` finds no fault.
pub(crate) fn write(
    path: &Path,
    bytes: &[u8],
    check: impl FnOnce(&Path) -> Result<(), String>,
) -> Result<(), Error> {
    let fail = |source| Error::Write { path: path.to_owned(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".supine-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The mask of the process decides, as for any other file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(folder).map_err(fail)?;
    temporary.write_all(bytes).map_err(fail)?;
    temporary.flush().map_err(fail)?;
    check(temporary.path()).map_err(|reason| {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Error::ReadBack { file, reason }
    })?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Another reader (dicom-object) must see every element that was meant, with its value.
pub(crate) fn same_elements(path: &Path, meant: &DataSet) -> Result<(), String> {
    let object = open_file(path).map_err(|e| e.to_string())?;
    same_items(&object, meant)
}

fn same_items(object: &InMemDicomObject, meant: &DataSet) -> Result<(), String> {
    for element in meant.elements() {
        let tag = element.tag;
        let stored = object.element(tag).map_err(|e| e.to_string())?;
        let same = match &element.value {
            Value::Items(items) => {
                let read = stored.items().unwrap_or_default();
                if read.len() != items.len() {
                    return Err(format!("{tag} has {} items", read.len()));
                }
                read.iter().zip(items).try_for_each(|(o, m)| same_items(o, m))?;
                true
            }
            Value::Bytes(bytes) if is_text(element.vr) => {
                let read = stored.to_str().map_err(|e| e.to_string())?;
                // Other characters are decoded by the file's own character set.
                !bytes.is_ascii() || trimmed(&read) == trimmed(&text_of(bytes))
            }
            Value::Bytes(bytes) if element.vr == VR::AT => {
                let Tag(group, element) = stored.value().to_tag().map_err(|e| e.to_string())?;
                *bytes == [group.to_le_bytes(), element.to_le_bytes()].concat()
            }
            Value::Bytes(bytes) => {
                let read = stored.to_bytes().map_err(|e| e.to_string())?;
                read.starts_with(bytes) && read.len() <= bytes.len() + 1
            }
            Value::Fragments(_) => false,
        };
        if !same {
            return Err(format!("{tag} differs"));
        }
    }
    Ok(())
}

/// Each value without padding.
fn trimmed(text: &str) -> String {
    let parts: Vec<&str> = text.split('\\').map(|part| part.trim_matches([' ', '\0'])).collect();
    parts.join("\\")
}

/// Whether values of this VR are text.
pub(crate) fn is_text(vr: VR) -> bool {
    use VR::{AE, AS, CS, DA, DS, DT, IS, LO, LT, PN, SH, ST, TM, UC, UI, UR, UT};
    matches!(vr, AE | AS | CS | DA | DS | DT | IS | LO | LT | PN | SH | ST | TM | UC | UI | UR | UT)
}
