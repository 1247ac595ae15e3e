//! Series Numbers and names of what is written: those of one run lie together, apart from those of
//! other runs and of the scanner.

use crate::derived::own_number;
use crate::source::Source;
use dicom_dictionary_std::tags;

/// The first number, five digits: scanners rarely count as far.
const FIRST: i64 = 10_000;
/// Numbers of one run.
const OF_RUN: i64 = 100;
/// Runs that are told apart.
const RUNS: i64 = 900;
/// Objects of one kind that are told apart.
const OF_KIND: i64 = 20;

/// Place of an object among those of its run; the exported CT has the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    DeformableRegistration,
    RigidRegistration,
    Labels,
    /// The report.
    Report,
    /// A dose, counted from 0.
    Dose(usize),
    /// A structure set, counted from 0.
    Structures(usize),
    /// A segmentation that was carried along, counted from 0.
    Segmentation(usize),
}

impl Place {
    /// What is added to the Series Number of the run's CT; from the twenty-first object of a kind
    /// on, numbers come again.
    fn offset(self) -> i64 {
        let of_kind = |n: usize| n as i64 % OF_KIND;
        match self {
            Self::DeformableRegistration => 1,
            Self::RigidRegistration => 2,
            Self::Labels => 3,
            Self::Report => 4,
            Self::Dose(n) => OF_KIND + of_kind(n),
            Self::Structures(n) => 2 * OF_KIND + of_kind(n),
            Self::Segmentation(n) => 3 * OF_KIND + of_kind(n),
        }
    }

    /// Series Number beside a CT.
    pub(crate) fn beside(self, ct: &Source) -> i64 {
        own_number(&ct.slices[0].header).unwrap_or(FIRST) + self.offset()
    }

    /// Series Number of an object that has no exported CT beside it.
    pub(crate) fn alone(self, hash: &[u8; 32], source: &Source) -> i64 {
        of_run(hash, source) + self.offset()
    }
}

/// Longest Series Description (LO).
const LONGEST: usize = 64;

/// What the series of an object is called that goes with an exported CT: the result's short name,
/// four digits that the CT's own name ends in, tells objects of two runs apart.
pub(crate) fn described(description: &str, ct: &Source) -> String {
    let own = ct.slices[0].header.text(tags::SERIES_DESCRIPTION);
    let hex = |name: &&str| {
        name.len() == 4 && name.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
    };
    let name = own.strip_prefix("DEFORMED ").and_then(|own| own.rsplit(' ').next()).filter(hex);
    let named = name.map(|name| format!("{description} {name}"));
    named.filter(|named| named.len() <= LONGEST).unwrap_or_else(|| description.into())
}

/// Series Number of the CT of a run, from the hash of what made it; not that of its source.
pub(crate) fn of_run(hash: &[u8; 32], source: &Source) -> i64 {
    let run = i64::from(u16::from_be_bytes([hash[0], hash[1]])) % RUNS;
    let number = FIRST + OF_RUN * run;
    let taken = own_number(&source.slices[0].header);
    if taken.is_some_and(|taken| (number..number + OF_RUN).contains(&taken)) {
        return FIRST + OF_RUN * ((run + 1) % RUNS);
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_objects_of_a_run_share_a_number() {
        let mut places = vec![
            Place::DeformableRegistration,
            Place::RigidRegistration,
            Place::Labels,
            Place::Report,
        ];
        for n in 0..OF_KIND as usize {
            places.extend([Place::Dose(n), Place::Structures(n), Place::Segmentation(n)]);
        }
        let offsets: BTreeSet<i64> = places.iter().map(|place| place.offset()).collect();
        assert_eq!(offsets.len(), places.len());
        assert!(offsets.iter().all(|n| (1..OF_RUN).contains(n)));
    }
}
