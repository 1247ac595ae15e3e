//! Texts that others chose (names of patients, structures, points, files), where people or
//! spreadsheets read them.

use std::borrow::Cow;

/// Characters that turn the direction of the text about them (Unicode Standard Annex 9): with them
/// a name reads as another.
const TURNING: [char; 12] = [
    '\u{061c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}',
    '\u{2066}', '\u{2067}', '\u{2068}', '\u{2069}',
];
/// What a spreadsheet takes for the beginning of a formula.
const FORMULA: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];
/// What makes it take a cell as text.
const AS_TEXT: char = '\'';

/// The text of a file; that it begins with a byte order mark is no part of it.
///
/// # Errors
/// Where it is no UTF-8: what it seems to be, and where.
pub fn from_file(bytes: &[u8]) -> Result<&str, String> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err("it is UTF-16 and not UTF-8".into());
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.trim_start_matches('\u{feff}')),
        Err(error) => {
            let wrong = error.valid_up_to();
            let line = 1 + bytes[..wrong].iter().filter(|&&byte| byte == b'\n').count();
            let byte = bytes.get(wrong).copied().unwrap_or_default();
            let what = "is no UTF-8; Windows-1252 or Latin-1 perhaps";
            Err(format!("the byte {byte:02X} in line {line} {what}"))
        }
    }
}

/// What parts the cells of a table, by its head: commas, or semicolons or tabs where it has those
/// alone, as spreadsheets write where the comma is a decimal point.
pub fn separator(head: &str) -> u8 {
    let others = [b';', b'\t'].into_iter().filter(|_| !head.contains(','));
    others.into_iter().find(|&c| head.contains(char::from(c))).unwrap_or(b',')
}

/// Whether people are not to be shown a character as it is: it turns the text, or a terminal obeys
/// it.
fn is_hidden(c: char) -> bool {
    TURNING.contains(&c) || c.is_control() && !matches!(c, '\n' | '\r' | '\t')
}

/// A text as it is shown to people: characters that turn its direction, or that a terminal obeys,
/// by their numbers, as in `⟨U+202E⟩`. Ends of lines and tabs stay.
pub fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_hidden(c) {
            shown.push_str(&format!("\u{27e8}U+{:04X}\u{27e9}", u32::from(c)));
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// A text as it stands in a table for spreadsheets: with a `'` before it where they would take it
/// for a formula. [`from_cell`] takes that away.
pub fn to_cell(text: &str) -> Cow<'_, str> {
    let is_number = text.parse::<f64>().is_ok();
    let guarded = text.starts_with(FORMULA) && !is_number || begins_guarded(text);
    if guarded { Cow::Owned(format!("{AS_TEXT}{text}")) } else { Cow::Borrowed(text) }
}

/// The text of a cell that [`to_cell`] wrote.
pub fn from_cell(cell: &str) -> &str {
    match cell.strip_prefix(AS_TEXT) {
        Some(text) if text.starts_with(FORMULA) || begins_guarded(text) => text,
        _ => cell,
    }
}

/// Whether a text itself begins as a guarded cell does.
fn begins_guarded(text: &str) -> bool {
    text.strip_prefix(AS_TEXT)
        .is_some_and(|rest| rest.trim_start_matches(AS_TEXT).starts_with(FORMULA))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_utf_8_is_told_by_what_it_seems_to_be() {
        assert_eq!(from_file("\u{feff}ct = 'M\u{fc}ller'".as_bytes()), Ok("ct = 'M\u{fc}ller'"));
        assert_eq!(from_file(b"\xff\xfec\0t\0"), Err("it is UTF-16 and not UTF-8".into()));
        let latin = from_file(b"# mine\nct = 'M\xfcller'\n").unwrap_err();
        assert!(latin.starts_with("the byte FC in line 2 is no UTF-8"), "{latin}");
    }

    #[test]
    fn what_parts_cells_is_told_by_the_head() {
        let of = |head: &str| char::from(separator(head));
        assert_eq!(
            (of("name;x"), of("name\tx"), of("name,x;y"), of("name")),
            (';', '\t', ',', ',')
        );
    }

    #[test]
    fn what_turns_a_text_is_shown_by_its_number() {
        assert_eq!(visible("Doe^Jane"), "Doe^Jane");
        assert_eq!(
            visible("PTV\u{202e}left\u{2069}"),
            "PTV\u{27e8}U+202E\u{27e9}left\u{27e8}U+2069\u{27e9}"
        );
        assert_eq!(visible("a\u{1b}[2J\tb\n"), "a\u{27e8}U+001B\u{27e9}[2J\tb\n");
        // A name in a script from right to left needs none of them.
        assert_eq!(visible("\u{5d0}\u{5d1}"), "\u{5d0}\u{5d1}");
    }

    #[test]
    fn no_cell_is_a_formula_and_every_text_comes_back() {
        for text in [
            "=1+1", "+x", "-cmd", "@SUM", "\tx", "'=1", "''=1", "it's", "'quoted'", "-4.5", "", "'",
        ] {
            let cell = to_cell(text);
            let is_number = cell.parse::<f64>().is_ok();
            assert!(is_number || !cell.starts_with(FORMULA), "{cell}");
            assert_eq!(from_cell(&cell), text);
        }
    }
}
