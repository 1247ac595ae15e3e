//! What a user must know before trusting a result.

use crate::Point;

/// What a user must know before trusting a result: a code for programs, a text for people.
///
/// The text is made of pieces, so that what a site may have named after a patient (regions, files,
/// series) can be left out where she must not be named, without reading the text again.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    code: &'static str,
    pieces: Vec<Piece>,
    values: Vec<(&'static str, f64)>,
    place: Option<[f64; 3]>,
}

// Its numbers are finite.
impl Eq for Warning {}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    /// A name that a site chose.
    Name(String),
}

impl Warning {
    /// A warning of a kind, with the beginning of its text. The code is stable: lower-case words
    /// joined by `-`, the same for every occurrence of the same doubt.
    pub fn new(code: &'static str, text: impl Into<String>) -> Self {
        Self { code, pieces: vec![Piece::Text(text.into())], values: vec![], place: None }
    }

    /// Goes on with more text.
    #[must_use]
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.pieces.push(Piece::Text(text.into()));
        self
    }

    /// Goes on with a name that a site chose and that may be a patient's; it is shown in quotation
    /// marks.
    #[must_use]
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.pieces.push(Piece::Name(name.into()));
        self
    }

    /// Goes on with names, with commas between.
    #[must_use]
    pub fn names<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        for (n, name) in names.into_iter().enumerate() {
            if n > 0 {
                self = self.text(", ");
            }
            self = self.name(name);
        }
        self
    }

    /// Adds a number that was measured, for programs, by a name that says its unit: `mm`,
    /// `area_cm2`, `voxels`. One that is not finite is no measurement and left out.
    #[must_use]
    pub fn value(mut self, name: &'static str, value: f64) -> Self {
        self.values.extend(value.is_finite().then_some((name, value)));
        self
    }

    /// Adds the place that it is about, LPS, mm in the CT.
    #[must_use]
    pub fn at(mut self, place: &Point) -> Self {
        self.place = place.iter().all(|c| c.is_finite()).then(|| place.coords.into());
        self
    }

    /// Begins with more text, such as the file that it is about.
    #[must_use]
    pub fn of(mut self, text: impl Into<String>) -> Self {
        self.pieces.insert(0, Piece::Text(text.into()));
        self
    }

    /// The kind of doubt, for programs.
    pub fn code(&self) -> &'static str {
        self.code
    }

    /// The numbers that were measured, by name.
    pub fn values(&self) -> &[(&'static str, f64)] {
        &self.values
    }

    /// The place that it is about, LPS, mm in the CT.
    pub fn place(&self) -> Option<[f64; 3]> {
        self.place
    }

    /// The text without the names that a site chose.
    pub fn without_names(&self) -> String {
        self.join(|_| "\"...\"".into())
    }

    fn join(&self, name: impl Fn(&str) -> String) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) => text.clone(),
            Piece::Name(given) => name(given),
        };
        self.pieces.iter().map(piece).collect()
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.join(|name| format!("{name:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_can_be_left_out_and_are_quoted_else() {
        let names = ["CTV Doe", "a \"b\""];
        let warning = Warning::new("unused-regions", "regions ").names(names).text(": not used");
        assert_eq!(warning.to_string(), r#"regions "CTV Doe", "a \"b\"": not used"#);
        assert_eq!(warning.without_names(), r#"regions "...", "...": not used"#);
        assert_eq!(warning.code(), "unused-regions");
        let warning = warning.value("area_cm2", 8.5).value("mm", f64::NAN);
        assert_eq!(warning.values(), [("area_cm2", 8.5)]);
        let placed = warning.clone().at(&Point::new(1.0, 2.0, 3.0));
        assert_eq!((placed.place(), warning.place()), (Some([1.0, 2.0, 3.0]), None));
        assert_eq!(warning.of("rt/dose-1.dcm: ").to_string().find("regions"), Some(15));
    }
}
