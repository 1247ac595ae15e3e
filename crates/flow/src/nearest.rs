//! The known name that someone may have meant.

/// The known name nearest to a typed one, whatever the case: one that begins with it, one that has
/// it within, else the one that the fewest slips of the keyboard lead to.
pub(crate) fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let plain = |text: &str| text.trim().to_lowercase();
    let typed = plain(typed);
    known.into_iter().min_by_key(|name| {
        let name = plain(name);
        let unlike = match name.find(&typed) {
            Some(0) => 0,
            Some(_) => 1,
            None => 2,
        };
        (unlike, strsim::damerau_levenshtein(&name, &typed))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_holds_the_typed_word_goes_before_a_short_one() {
        for (typed, known, meant) in [
            ("GTV", ["iso", "PTV_boost", "GTV Left"], "GTV Left"),
            ("gtv", ["iso", "old gtv", "GTV Left"], "GTV Left"),
            ("boost", ["iso", "PTV_Boost", "BODY"], "PTV_Boost"),
            ("GTV ", ["GTV Right 2", "GTV R", "iso"], "GTV R"),
            ("GVT", ["iso", "GTV", "PTV_boost"], "GTV"),
        ] {
            assert_eq!(nearest(typed, known), Some(meant), "{typed}");
        }
        assert_eq!(nearest("GTV", []), None);
    }
}
