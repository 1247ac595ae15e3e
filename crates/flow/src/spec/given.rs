//! Values of a specification by key, with the table's defaults.

use super::error::CaseError;
use super::read::Values;
use super::table::{Preset, TABLE, position};
use super::value::Value;
use std::path::PathBuf;
use supine_space::Point;

/// That a key is missing, with what it is for.
pub(super) fn missing(key: &'static str) -> CaseError {
    let what = position(key).map_or("", |n| TABLE[n].help);
    CaseError::Missing { key, what }
}

/// Values by key.
#[derive(Clone, Copy)]
pub(super) struct Given<'a>(pub(super) &'a Values);

impl<'a> Given<'a> {
    pub(super) fn get(self, key: &str) -> Option<&'a Value> {
        self.0.get(&position(key)?)
    }

    pub(super) fn number(self, key: &str) -> Option<f64> {
        match self.get(key) {
            Some(Value::Number(x)) => Some(*x),
            Some(_) => None,
            None => match TABLE[position(key)?].default {
                Preset::Number(x) => Some(x),
                _ => None,
            },
        }
    }

    pub(super) fn whole(self, key: &str) -> usize {
        match (self.get(key), position(key).map(|n| TABLE[n].default)) {
            (Some(Value::Whole(n)), _) => *n as usize,
            (None, Some(Preset::Whole(n))) => n as usize,
            _ => 0,
        }
    }

    pub(super) fn switch(self, key: &str) -> bool {
        match (self.get(key), position(key).map(|n| TABLE[n].default)) {
            (Some(Value::Switch(on)), _) => *on,
            (None, Some(Preset::Switch(on))) => on,
            _ => false,
        }
    }

    pub(super) fn choice(self, key: &str) -> Option<&'static str> {
        match (self.get(key), position(key).map(|n| TABLE[n].default)) {
            (Some(Value::Choice(word)), _) => Some(word),
            (None, Some(Preset::Choice(word))) => Some(word),
            _ => None,
        }
    }

    /// The word of a choice that has a default.
    pub(super) fn word(self, key: &str) -> &'static str {
        self.choice(key).unwrap_or_default()
    }

    pub(super) fn text(self, key: &str) -> Option<String> {
        match self.get(key) {
            Some(Value::Text(text)) => Some(text.clone()),
            _ => None,
        }
    }

    pub(super) fn file(self, key: &str) -> Option<PathBuf> {
        match self.get(key) {
            Some(Value::File(path)) => Some(path.clone()),
            _ => None,
        }
    }

    pub(super) fn files(self, key: &str) -> Vec<PathBuf> {
        match self.get(key) {
            Some(Value::Files(all)) => all.clone(),
            _ => Vec::new(),
        }
    }

    pub(super) fn names(self, key: &str) -> Vec<String> {
        match self.get(key) {
            Some(Value::Names(all)) => all.clone(),
            _ => Vec::new(),
        }
    }

    pub(super) fn points(self, key: &str) -> Vec<Point> {
        match self.get(key) {
            Some(Value::Points(all)) => all.iter().copied().map(Point::from).collect(),
            _ => Vec::new(),
        }
    }
}
