//! Files by name, and command lines as a shell takes them.

use std::path::Path;

/// The last part of a path.
pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| "/".into(), |name| name.to_string_lossy().into_owned())
}

/// Longer values are not told on the command line: the case has them.
const TELLING: usize = 60;

/// The command line of a whole run, with changes of the case that it may be made with.
pub(crate) fn run_command(case: &str, edited: &[String]) -> String {
    let mut text = format!("supine run {} --out result", quoted(case));
    for change in edited.iter().filter(|change| change.len() <= TELLING) {
        text += &format!(" --set {}", quoted(change));
    }
    text
}

/// The command line that makes a run anew from its folder.
pub(crate) fn rerun_command(path: &Path) -> String {
    let name = name_of(path);
    format!("supine run {} --out {}", quoted(&format!("{name}/summary.json")), quoted(&name))
}

/// A name as a shell takes it.
pub(crate) fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/=".contains(c);
    match name.chars().all(plain) {
        true => name.into(),
        false => format!("'{}'", name.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quoted("case.toml"), "case.toml");
        assert_eq!(quoted("Mrs X's case.toml"), r"'Mrs X'\''s case.toml'");
    }
}
