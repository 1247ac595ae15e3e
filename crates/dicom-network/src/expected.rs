//! Whose objects are meant: what was asked for and what the archive listed, to hold against what
//! comes.

use crate::find::{PADDING, may_be_of};
use std::collections::BTreeMap;
use supine_dicom::{Owner, is_uid};

/// Where the objects belong that are meant.
#[derive(Default)]
pub(crate) struct Expected {
    /// Patient ID; none when neither the user nor the archive said it: then the first object's is
    /// that of all.
    pub(crate) patient: Option<String>,
    /// Study Instance UID.
    pub(crate) study: String,
    /// Study Date or a range, where it was asked for.
    pub(crate) date: Option<String>,
    /// The series in which each instance was listed.
    pub(crate) series: BTreeMap<String, Vec<String>>,
}

/// Objects that came and belong elsewhere; none of them was kept.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Strangers {
    /// To what they belong, in words.
    pub of: &'static str,
    /// Their Series Instance UID; empty when they have none.
    pub series: String,
    /// Their SOP Instance UIDs.
    pub instances: Vec<String>,
}

impl std::fmt::Debug for Expected {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // The Patient ID is for comparing alone.
        f.write_str("Expected(..)")
    }
}

impl Expected {
    /// To what an object belongs instead; nothing when it belongs where it was listed.
    pub(crate) fn elsewhere(&self, instance: &str, owner: &Owner) -> Option<&'static str> {
        let patient = self.patient.as_ref();
        if patient.is_some_and(|patient| patient.trim_matches(PADDING) != owner.patient) {
            return Some("another patient");
        }
        if self.study != owner.study {
            return Some("another study");
        }
        if !self.series.get(instance).is_some_and(|listed| listed.contains(&owner.series)) {
            return Some("another series");
        }
        let dated = self.date.as_ref().is_none_or(|asked| may_be_of(asked, &owner.date));
        (!dated).then_some("another Study Date")
    }

    /// An object of these was kept: what nobody said before is known by it.
    pub(crate) fn kept(&mut self, owner: &Owner) {
        self.patient.get_or_insert_with(|| owner.patient.clone());
    }
}

impl Strangers {
    /// Counts an object among others like it.
    pub(crate) fn count(all: &mut Vec<Self>, of: &'static str, instance: &str, owner: &Owner) {
        let series = if is_uid(&owner.series) { owner.series.as_str() } else { "" };
        let like = all.iter_mut().find(|one| one.of == of && one.series == series);
        let instance = instance.to_owned();
        match like {
            Some(one) => one.instances.push(instance),
            None => all.push(Self { of, series: series.into(), instances: vec![instance] }),
        }
    }
}

impl std::fmt::Display for Strangers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (count, of) = (self.instances.len(), self.of);
        let objects = if count == 1 { "object" } else { "objects" };
        write!(f, "{count} {objects} of {of} than was asked for, refused and not kept")?;
        if self.series.is_empty() { Ok(()) } else { write!(f, ": series {}", self.series) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owner(patient: &str, study: &str, series: &str, date: &str) -> Owner {
        let [patient, study, series, date] = [patient, study, series, date].map(String::from);
        Owner { patient, study, date, series, ..Owner::default() }
    }

    fn expected(patient: Option<&str>) -> Expected {
        Expected {
            patient: patient.map(String::from),
            study: "1.2".into(),
            date: Some("20260101-20260131".into()),
            series: [("1.2.3.4".to_owned(), vec!["1.2.3".to_owned()])].into(),
        }
    }

    #[test]
    fn an_object_is_held_against_all_that_was_asked_for() {
        let of = |owner: &Owner| expected(Some("ZZ9 ")).elsewhere("1.2.3.4", owner);
        assert_eq!(of(&owner("ZZ9", "1.2", "1.2.3", "20260110")), None);
        assert_eq!(of(&owner("ZZ9", "1.2", "1.2.3", "")), None);
        for other in ["zz9", "ZZ", "ZZ91", ""] {
            assert_eq!(of(&owner(other, "1.2", "1.2.3", "20260110")), Some("another patient"));
        }
        assert_eq!(of(&owner("ZZ9", "1.3", "1.2.3", "20260110")), Some("another study"));
        assert_eq!(of(&owner("ZZ9", "1.2", "1.2.4", "20260110")), Some("another series"));
        assert_eq!(of(&owner("ZZ9", "1.2", "1.2.3", "20260210")), Some("another Study Date"));
    }

    #[test]
    fn where_nobody_says_whose_they_are_all_are_of_one_patient() {
        let mut expected = expected(None);
        let first = owner("A", "1.2", "1.2.3", "20260110");
        assert_eq!(expected.elsewhere("1.2.3.4", &first), None);
        expected.kept(&first);
        let other = owner("B", "1.2", "1.2.3", "20260110");
        assert_eq!(expected.elsewhere("1.2.3.4", &other), Some("another patient"));
    }
}
