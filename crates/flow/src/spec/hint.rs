//! What may have happened where a value or a text is not what it should be.

use super::table::Kind;
use serde_json::Value as Json;
use std::path::PathBuf;

const COMMA: &str = "; numbers have a decimal point: 7.0, not 7,0";
const BACKSLASH: &str = "; in \"...\" a backslash begins an escape: write the path in single quotation marks, 'C:\\data\\ct'";

/// What may have happened to a value that does not fit.
pub(super) fn of_value(kind: Kind, given: &Json) -> &'static str {
    let numbers = given.as_array().map_or(0, Vec::len);
    match kind {
        Kind::Number { .. } if given.as_str().is_some_and(has_comma) => COMMA,
        Kind::Point if numbers == 6 => COMMA,
        Kind::Point if given.as_str().is_some_and(|text| text.matches(',').count() == 5) => COMMA,
        Kind::File | Kind::Files if texts(given).any(|t| t.chars().any(char::is_control)) => {
            BACKSLASH
        }
        Kind::File | Kind::Files if texts(given).any(of_windows) => {
            "; that is a path of Windows and this program runs elsewhere: write it as this machine knows it, such as \
             '/mnt/c/data/ct'"
        }
        Kind::File | Kind::Files if texts(given).any(|t| t.starts_with('~')) => {
            "; write the whole path: only `~/` stands for your home"
        }
        _ => "",
    }
}

/// What may have happened in a text that is not TOML, by the line of the mistake.
pub(super) fn of_text(text: &str, line: usize) -> &'static str {
    let line = text.lines().nth(line).unwrap_or_default();
    let line = line.split('#').next().unwrap_or_default();
    match () {
        () if line.contains('\\') => BACKSLASH,
        () if has_comma(line) => COMMA,
        () => "",
    }
}

/// Whether a path can be used on this machine.
pub(super) fn usable(path: &str) -> bool {
    let foreign = cfg!(not(windows)) && of_windows(path);
    !path.is_empty() && !path.chars().any(char::is_control) && !foreign && !path.starts_with('~')
}

/// A path, `~/` at its beginning being the home of who runs the program.
pub(super) fn path(text: &str) -> PathBuf {
    path_of(text, std::env::var_os("HOME").map(PathBuf::from))
}

/// The same for a given home.
pub(super) fn path_of(text: &str, home: Option<PathBuf>) -> PathBuf {
    let home = home.filter(|home| !home.as_os_str().is_empty());
    match (text.strip_prefix("~/"), home) {
        (Some(rest), Some(home)) => home.join(rest),
        _ => text.into(),
    }
}

/// `C:\data`, `C:/data`, `\\server\share`.
fn of_windows(path: &str) -> bool {
    let bytes = path.as_bytes();
    let drive = bytes.len() > 2
        && bytes[0].is_ascii_alphabetic()
        && bytes[1] == b':'
        && matches!(bytes[2], b'\\' | b'/');
    drive || path.starts_with("\\\\")
}

/// A digit, a comma and a digit in a row.
fn has_comma(text: &str) -> bool {
    let is = |b: u8| b.is_ascii_digit();
    text.as_bytes().windows(3).any(|w| is(w[0]) && w[1] == b',' && is(w[2]))
}

fn texts(given: &Json) -> impl Iterator<Item = &str> {
    let list = given.as_array().into_iter().flatten().filter_map(Json::as_str);
    given.as_str().into_iter().chain(list)
}
