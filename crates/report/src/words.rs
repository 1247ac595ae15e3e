//! Numbers as people read them.

/// So many decimals, a true minus sign, no negative zero.
pub(crate) fn fixed(x: f64, decimals: usize) -> String {
    minus(&plain(x, decimals))
}

/// The same with a hyphen, for programs.
pub(crate) fn plain(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    let bare = text.trim_start_matches('-');
    if bare.chars().all(|c| c == '0' || c == '.') { bare.into() } else { text }
}

/// Hyphens before digits become minus signs.
pub(crate) fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

/// A number in as few digits as it needs, at most three decimals; for lettering in pictures.
pub(crate) fn trimmed(x: f64) -> String {
    let text = format!("{x:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// `(1.6, 0.8, −2.3)`.
pub(crate) fn triple(v: [f64; 3], decimals: usize) -> String {
    format!("({})", v.map(|x| fixed(x, decimals)).join(", "))
}

/// A count with its thousands apart.
pub(crate) fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// A displacement (LPS, mm) in words: `1.6 mm to the patient's left, 2.3 mm towards the feet`.
pub fn directions(v: [f64; 3]) -> String {
    let names = [
        ["to the patient's left", "to the patient's right"],
        ["towards the back", "towards the front"],
        ["towards the head", "towards the feet"],
    ];
    let parts: Vec<String> = (0..3)
        .filter(|&a| v[a].abs() >= 0.05)
        .map(|a| format!("{:.1} mm {}", v[a].abs(), names[a][usize::from(v[a] < 0.0)]))
        .collect();
    if parts.is_empty() { "less than 0.1 mm".into() } else { parts.join(", ") }
}

/// The text with its first letter large.
pub(crate) fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(fixed(-2.34, 1), "\u{2212}2.3");
        assert_eq!(trimmed(1.500), "1.5");
        assert_eq!(trimmed(20.0), "20");
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(count(12), "12");
        assert_eq!(triple([1.0, -2.0, 0.0], 1), "(1.0, \u{2212}2.0, 0.0)");
    }

    #[test]
    fn directions_are_the_patients() {
        let text = directions([1.56, -0.78, -2.33]);
        assert_eq!(
            text,
            "1.6 mm to the patient's left, 0.8 mm towards the front, 2.3 mm towards the feet"
        );
        assert_eq!(directions([0.0, 0.01, 0.0]), "less than 0.1 mm");
    }
}
