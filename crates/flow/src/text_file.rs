//! Texts that people write: case files and tables.

use std::io::{Error, ErrorKind};
use std::path::Path;

/// The text of a file.
///
/// # Errors
/// When it cannot be read, or is no UTF-8: with what it seems to be.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path)?;
    String::from_utf8(bytes)
        .map_err(|error| Error::new(ErrorKind::InvalidData, told(error.as_bytes())))
}

/// What a text seems to be that is no UTF-8.
fn told(bytes: &[u8]) -> String {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return "it is UTF-16 and not UTF-8".into();
    }
    let wrong = std::str::from_utf8(bytes).map_or_else(|error| error.valid_up_to(), str::len);
    let line = 1 + bytes[..wrong].iter().filter(|&&byte| byte == b'\n').count();
    let text = "is no UTF-8; Windows-1252 or Latin-1 perhaps";
    bytes
        .get(wrong)
        .map_or(text.into(), |byte| format!("the byte {byte:02X} in line {line} {text}"))
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn what_is_no_utf_8_is_told_by_what_it_seems_to_be() {
        assert_eq!(told(b"\xff\xfec\0t\0"), "it is UTF-16 and not UTF-8");
        let latin = told(b"# mine\nct = 'M\xfcller'\n");
        assert!(latin.starts_with("the byte FC in line 2 is no UTF-8"), "{latin}");
    }
}
