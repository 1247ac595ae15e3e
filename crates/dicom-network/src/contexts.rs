//! Presentation contexts of an association (PS3.8 9.3.2.2).

/// A presentation context that is proposed.
#[derive(Clone, Debug)]
pub(crate) struct Proposal {
    pub(crate) class: String,
    pub(crate) syntaxes: Vec<String>,
    /// Whether we, who ask for the association, are to receive objects of this class.
    pub(crate) receives: bool,
}

impl Proposal {
    pub(crate) fn new(class: &str, syntaxes: &[&str]) -> Self {
        let syntaxes = syntaxes.iter().map(|&s| s.to_owned()).collect();
        Self { class: class.to_owned(), syntaxes, receives: false }
    }
}

/// Most presentation contexts of an association: their numbers are odd and end at 255.
pub(crate) const MAX_CONTEXTS: usize = 128;

/// A presentation context both sides agreed on.
#[derive(Clone, Debug)]
pub(crate) struct Context {
    pub(crate) class: String,
    pub(crate) syntax: String,
}
