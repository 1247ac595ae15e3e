//! Decimal and integer strings (PS3.5 6.2, VR DS and IS).

/// Longest value of a decimal string, bytes.
pub(crate) const DS_LENGTH: usize = 16;
/// Positions are written with one decimal by some scanners, and are then off by half of it, mm.
pub(crate) const ROUNDING_MM: f64 = 0.05;

/// The number a decimal string says; `None` for anything the standard does not allow but length.
pub(crate) fn parse_ds(text: &str) -> Option<f64> {
    let text = text.trim_matches([' ', '\0']);
    let allowed = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    if text.is_empty() || !text.chars().all(allowed) {
        return None;
    }
    text.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// The number an integer string says.
pub(crate) fn parse_is(text: &str) -> Option<i64> {
    let text = text.trim_matches([' ', '\0']);
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    if digits.is_empty() || digits.len() > 12 || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    text.parse().ok()
}

/// Exactly `N` decimal strings.
pub(crate) fn parse_ds_list<const N: usize>(texts: &[String]) -> Option<[f64; N]> {
    let numbers: Vec<f64> = texts.iter().map(|t| parse_ds(t)).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// The decimal string nearest to a finite number: the shortest that is exact, else the most digits
/// that fit 16 bytes.
pub(crate) fn format_ds(value: f64) -> String {
    let value = if value == 0.0 { 0.0 } else { value };
    let shortest = format!("{value}");
    if shortest.len() <= DS_LENGTH {
        return shortest;
    }
    let candidates = (0..DS_LENGTH)
        .rev()
        .flat_map(|digits| [format!("{value:.digits$}"), format!("{value:.digits$e}")])
        .filter(|text| text.len() <= DS_LENGTH);
    let error = |text: &String| text.parse::<f64>().map_or(f64::INFINITY, |v| (v - value).abs());
    candidates
        .min_by(|a, b| error(a).total_cmp(&error(b)).then(a.len().cmp(&b.len())))
        .unwrap_or_else(|| format!("{value:.5e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_the_standard_allows_is_a_number() {
        for (text, value) in [("1.5", 1.5), (" -741 ", -741.0), ("+2.5E-3", 0.0025), (".5", 0.5)] {
            assert_eq!(parse_ds(text), Some(value), "{text}");
        }
        for text in ["", " ", "1,5", "abc", "nan", "inf", "1 5", "--1", "1e999"] {
            assert_eq!(parse_ds(text), None, "{text}");
        }
        assert_eq!(parse_is(" -12 "), Some(-12));
        assert_eq!(parse_is("1.0"), None);
        assert_eq!(parse_is("1234567890123"), None);
    }

    #[test]
    fn formatted_numbers_fit_and_are_as_near_as_sixteen_bytes_allow() {
        assert_eq!(format_ds(-741.0), "-741");
        assert_eq!(format_ds(-0.0), "0");
        assert_eq!(format_ds(0.1), "0.1");
        assert_eq!(format_ds(1.0 / 3.0), "0.33333333333333");
        let mut x = 0.123_456_789_f64;
        for n in 0..2000 {
            x = (x * 997.13).fract();
            for scale in [1e-9, 1e-4, 1.0, 1e3, 1e5, 1e12] {
                let value = (x - 0.5) * scale;
                let text = format_ds(value);
                assert!(text.len() <= DS_LENGTH, "{n} {text}");
                let error = (parse_ds(&text).unwrap() - value).abs();
                assert!(error <= value.abs() * 2e-8, "{value} {text}");
                if (0.05..0.5).contains(&value.abs()) {
                    assert!(error < 5.1e-14, "{value} {text}");
                }
            }
        }
    }
}
