//! C-FIND: what an archive holds (PS3.4 C.4.1, Study Root).

use crate::Call;
use crate::cancel::GoOn;
use crate::command::{Command, element, field};
use crate::contexts::Proposal;
use crate::error::Error;
use crate::link::Link;
use crate::message::{Payload, Talk};
use crate::node::Node;
use crate::patience::patiently;
use crate::{status, syntaxes};
use dicom_core::Tag;
use dicom_dictionary_std::{tags, uids};
use std::cmp::Reverse;
use std::collections::BTreeSet;
use supine_dicom::{Identifier, is_uid};
use supine_space::Progress;

/// Study Root Query/Retrieve Information Model - FIND.
const MODEL: &str = uids::STUDY_ROOT_QUERY_RETRIEVE_INFORMATION_MODEL_FIND;
/// Most matches of one query that are taken.
const MAX_MATCHES: usize = 100_000;
/// Longest identifier that is taken, bytes.
const MAX_IDENTIFIER: u64 = 1 << 20;
/// Most bytes of all matches of one query; a real one has some hundred.
const MAX_ALL: usize = 64 << 20;

/// What is no part of a Patient ID at its ends (PS3.5 6.2, LO).
pub(crate) const PADDING: [char; 2] = [' ', '\0'];

/// What is looked for. All that is given has to fit.
#[derive(Clone, Debug, Default)]
pub struct QuerySpec {
    /// Study Instance UID.
    pub study: Option<String>,
    /// Series Instance UID.
    pub series: Option<String>,
    /// Patient ID.
    pub patient_id: Option<String>,
    /// Study Date: `YYYYMMDD`, or two with `-` between.
    pub date: Option<String>,
}

impl QuerySpec {
    /// That an archive lists nothing of this, and what to do.
    pub fn nothing_listed(&self, archive: &Node) -> String {
        let alone = self.series.is_some() && self.study.is_none() && self.patient_id.is_none();
        let advice = if alone { format!("; {NAME_STUDY}") } else { String::new() };
        format!("{archive} lists nothing of that{advice}")
    }
}

/// A study in an archive. What would tell the patient is not kept.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct StudyEntry {
    /// Study Instance UID.
    pub study: String,
    /// Study Date, as the archive says it.
    pub date: String,
    /// Study Description.
    pub description: String,
    /// Its series, in the order of their UIDs.
    pub series: Vec<SeriesEntry>,
}

/// A series in an archive.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct SeriesEntry {
    /// Series Instance UID.
    pub series: String,
    /// Modality.
    pub modality: String,
    /// Series Number.
    pub number: String,
    /// Series Description.
    pub description: String,
    /// Number of instances, where the archive says it.
    pub instances: Option<usize>,
}

/// A study that is meant, with what tells the patient apart from others: for comparing alone.
pub(crate) struct Found {
    pub(crate) entry: StudyEntry,
    /// Patient ID; empty where the archive does not say it.
    pub(crate) patient: String,
}

/// An instance in an archive.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct InstanceEntry {
    pub(crate) instance: String,
    /// SOP Class UID, where the archive says it.
    pub(crate) class: String,
}

/// The studies and series of an archive that are meant.
///
/// # Errors
/// When nothing is asked for or what is asked for is no UID, when the peer cannot be reached or
/// does not answer, or when the user asked to stop.
pub fn list(
    call: &Call,
    spec: &QuerySpec,
    progress: Progress<'_>,
) -> Result<Vec<StudyEntry>, Error> {
    let go_on = || -> Result<(), Error> { Ok(progress.at(0.0)?) };
    patiently(call, &go_on, || {
        let mut finder = Finder::open(call, &go_on)?;
        let studies = finder.studies(spec)?;
        finder.close();
        Ok(studies.into_iter().map(|found| found.entry).collect())
    })
}

/// An association for queries.
pub(crate) struct Finder<'a> {
    talk: Talk<'a>,
    context: u8,
    explicit: bool,
    call: &'a Call,
}

impl<'a> Finder<'a> {
    pub(crate) fn open(call: &'a Call, go_on: GoOn<'a>) -> Result<Self, Error> {
        let link = Link::open(call, &[Proposal::new(MODEL, &syntaxes::IDENTIFIER)], go_on)?;
        let Some((context, agreed)) = link.context(MODEL, None) else {
            let what = "C-FIND in the Study Root model".into();
            return Err(Error::NotOffered { node: call.peer.clone(), what });
        };
        let explicit = agreed.syntax == uids::EXPLICIT_VR_LITTLE_ENDIAN;
        Ok(Self { talk: Talk::new(link), context, explicit, call })
    }

    pub(crate) fn close(self) {
        // All is answered: how the association ends is no matter.
        let _best_effort = self.talk.link.release();
    }

    /// The studies that are meant, with their series.
    pub(crate) fn studies(&mut self, spec: &QuerySpec) -> Result<Vec<Found>, Error> {
        check(spec)?;
        let mut studies = self.studies_alone(spec)?;
        let uids: Vec<String> = studies.iter().map(|found| found.entry.study.clone()).collect();
        for Found { entry, patient } in &mut studies {
            let listed = uids.iter().filter(|uid| **uid == entry.study).count();
            let named = spec.patient_id.is_some();
            let shared = listed > 1 || (named && self.is_of_others_too(&entry.study, patient)?);
            let of = shared.then_some(patient.as_str()).filter(|patient| !patient.is_empty());
            entry.series = self.series(&entry.study, spec.series.as_deref(), of)?;
        }
        studies.retain(|found| spec.series.is_none() || !found.entry.series.is_empty());
        Ok(studies)
    }

    /// The studies that may be meant, each once, by their dates, without their series.
    fn studies_alone(&mut self, spec: &QuerySpec) -> Result<Vec<Found>, Error> {
        let mut study = spec.study.clone();
        let patient_id = spec.patient_id.as_deref().map(|id| id.trim_matches(PADDING));
        if let (None, None, Some(series)) = (&study, patient_id, &spec.series) {
            // Which study it is of: a query across levels, which most archives answer though the
            // standard leaves it to them (PS3.4 C.4.1.2.2). Of a named patient every study is asked
            // instead.
            let keys = [(tags::STUDY_INSTANCE_UID, ""), (tags::SERIES_INSTANCE_UID, series)];
            let matches = self.find("SERIES", &keys).map_err(with_study)?;
            let uids = matches.iter().map(|f| f.text(tags::STUDY_INSTANCE_UID));
            let uids: BTreeSet<String> = uids.filter(|uid| is_uid(uid)).collect();
            if uids.len() > 1 {
                return Err(Error::Query(format!(
                    "{} lists that series in {} studies: name the one that is meant with --study",
                    self.call.peer,
                    uids.len()
                )));
            }
            let Some(only) = uids.into_iter().next() else { return Ok(Vec::new()) };
            study = Some(only);
        }
        let keys = [
            (tags::STUDY_INSTANCE_UID, study.as_deref().unwrap_or_default()),
            (tags::PATIENT_ID, patient_id.unwrap_or_default()),
            (tags::STUDY_DATE, spec.date.as_deref().unwrap_or_default()),
            (tags::STUDY_DESCRIPTION, ""),
        ];
        let mut studies: Vec<Found> = self
            .find("STUDY", &keys)?
            .iter()
            .map(|one| Found {
                patient: one.readable(tags::PATIENT_ID),
                entry: StudyEntry {
                    study: one.text(tags::STUDY_INSTANCE_UID),
                    date: one.text(tags::STUDY_DATE),
                    description: one.readable(tags::STUDY_DESCRIPTION),
                    series: Vec::new(),
                },
            })
            .filter(|found| is_meant(found, study.as_deref(), spec))
            .collect();
        // Archives list a study more than once, not always with the same date, or a Patient ID each
        // time: of two the one that says more is kept.
        let said = |found: &Found| {
            let StudyEntry { date, description, .. } = &found.entry;
            (found.patient.clone(), date.clone(), description.clone())
        };
        studies.sort_by_cached_key(|found| Reverse((found.entry.study.clone(), said(found))));
        studies.dedup_by(|later, kept| {
            later.entry.study == kept.entry.study
                && (later.patient == kept.patient || later.patient.is_empty())
        });
        studies.sort_by_cached_key(|found| {
            let StudyEntry { study, date, .. } = &found.entry;
            (date.clone(), study.clone(), found.patient.clone())
        });
        Ok(studies)
    }

    /// Whether the archive lists a study for other patients than this one too.
    fn is_of_others_too(&mut self, study: &str, patient: &str) -> Result<bool, Error> {
        let keys = [(tags::STUDY_INSTANCE_UID, study), (tags::PATIENT_ID, "")];
        let matches = self.find("STUDY", &keys)?;
        let of_study = matches.iter().filter(|one| one.text(tags::STUDY_INSTANCE_UID) == study);
        Ok(of_study.map(|one| one.readable(tags::PATIENT_ID)).any(|id| is_another(&id, patient)))
    }

    /// The series of a study, or one of them, in the order of their UIDs; `of` is the patient who
    /// is meant where the study is that of several: those of the others are left out where the
    /// archive says whose they are.
    fn series(
        &mut self,
        study: &str,
        series: Option<&str>,
        of: Option<&str>,
    ) -> Result<Vec<SeriesEntry>, Error> {
        let mut keys = vec![
            (tags::STUDY_INSTANCE_UID, study),
            (tags::SERIES_INSTANCE_UID, series.unwrap_or_default()),
            (tags::MODALITY, ""),
            (tags::SERIES_NUMBER, ""),
            (tags::SERIES_DESCRIPTION, ""),
            (tags::NUMBER_OF_SERIES_RELATED_INSTANCES, ""),
        ];
        let matches = match of {
            None => self.find("SERIES", &keys)?,
            Some(_) => {
                keys.push((tags::PATIENT_ID, ""));
                match self.find("SERIES", &keys) {
                    // A key of the level above, which an archive may refuse.
                    Err(Error::Failed { transient: false, .. }) => {
                        keys.pop();
                        self.find("SERIES", &keys)?
                    }
                    matches => matches?,
                }
            }
        };
        let meant = |found: &&Identifier| {
            of.is_none_or(|of| !is_another(&found.readable(tags::PATIENT_ID), of))
        };
        let mut entries: Vec<SeriesEntry> = matches
            .iter()
            .filter(meant)
            .map(|found| SeriesEntry {
                series: found.text(tags::SERIES_INSTANCE_UID),
                modality: found.text(tags::MODALITY),
                number: found.text(tags::SERIES_NUMBER),
                description: found.readable(tags::SERIES_DESCRIPTION),
                instances: found.text(tags::NUMBER_OF_SERIES_RELATED_INSTANCES).parse().ok(),
            })
            .filter(|entry| is_uid(&entry.series) && series.is_none_or(|s| s == entry.series))
            .collect();
        entries.sort_by(|a, b| a.series.cmp(&b.series));
        entries.dedup_by(|a, b| a.series == b.series);
        Ok(entries)
    }

    /// The instances of a series, in the order of their UIDs.
    pub(crate) fn instances(
        &mut self,
        study: &str,
        series: &str,
    ) -> Result<Vec<InstanceEntry>, Error> {
        let keys = [
            (tags::STUDY_INSTANCE_UID, study),
            (tags::SERIES_INSTANCE_UID, series),
            (tags::SOP_INSTANCE_UID, ""),
            (tags::SOP_CLASS_UID, ""),
        ];
        let mut entries: Vec<InstanceEntry> = self
            .find("IMAGE", &keys)?
            .iter()
            .map(|found| InstanceEntry {
                instance: found.text(tags::SOP_INSTANCE_UID),
                class: found.text(tags::SOP_CLASS_UID),
            })
            .filter(|entry| is_uid(&entry.instance))
            .collect();
        entries.sort();
        entries.dedup_by(|a, b| a.instance == b.instance);
        Ok(entries)
    }

    /// All matches of a query.
    fn find(&mut self, level: &str, keys: &[(Tag, &str)]) -> Result<Vec<Identifier>, Error> {
        let mut query = Identifier::default().with(tags::QUERY_RETRIEVE_LEVEL, level);
        if keys.iter().any(|(_, value)| !value.is_ascii()) {
            query = query.with(tags::SPECIFIC_CHARACTER_SET, "ISO_IR 192");
        }
        for (tag, value) in keys {
            query = query.with(*tag, value);
        }
        let bytes = query.to_bytes(self.explicit);
        let id = self.talk.next_id();
        let request = Command::request(field::FIND, id, MODEL, true).number(element::PRIORITY, 0);
        self.talk.send(self.context, &request, Some(Payload::of(&mut &bytes[..])))?;
        let (mut matches, mut all) = (Vec::new(), 0);
        loop {
            let message = self.talk.answer()?;
            let answer = message.command.get_number(element::STATUS);
            let of = message.command.get_number(element::MESSAGE_ID_RESPONDED_TO);
            let (true, Some(answer)) =
                (message.command.field() == field::FIND | field::ANSWER && of == Some(id), answer)
            else {
                return Err(self.talk.link.protocol("an answer to something else than was asked"));
            };
            let mut bytes = Vec::new();
            if message.command.has_data_set() {
                self.talk.data(&message, MAX_IDENTIFIER, &mut |piece| bytes.extend(piece))?;
            }
            if status::PENDING.contains(&answer) {
                let identifier = Identifier::from_bytes(&bytes, self.explicit);
                // Why it cannot be read may repeat what it says.
                let identifier = identifier
                    .map_err(|_| self.talk.link.protocol("a match that is no sound data set"))?;
                matches.push(identifier);
                all += bytes.len();
                if matches.len() > MAX_MATCHES || all > MAX_ALL {
                    let most = format!("{MAX_MATCHES} matches or {} MiB of them", MAX_ALL >> 20);
                    return Err(Error::Query(format!("more than {most}: ask for less")));
                }
            } else if answer == status::SUCCESS {
                return Ok(matches);
            } else {
                return Err(Error::Failed {
                    node: self.call.peer.clone(),
                    what: "answer a query",
                    status: status::words(answer),
                    transient: status::is_transient(answer),
                });
            }
        }
    }
}

/// What to do where an archive finds no series by itself.
const NAME_STUDY: &str = "archives that look for a series only within a study or of a patient want --study or \
                          --patient-id too";

/// A refusal to find a series without its study, with what to do.
fn with_study(error: Error) -> Error {
    match error {
        Error::Failed { node, what, status, transient: false } => {
            Error::Query(format!("{node} fails to {what}: {status}; {NAME_STUDY}"))
        }
        error => error,
    }
}

/// Whether a Patient ID that an archive says is another than this one; one that it does not say is
/// not.
fn is_another(said: &str, patient: &str) -> bool {
    let said = said.trim_matches(PADDING);
    !said.is_empty() && said != patient.trim_matches(PADDING)
}

/// Whether an answer is what was asked for: an archive may pass over a key.
fn is_meant(found: &Found, study: Option<&str>, spec: &QuerySpec) -> bool {
    let Found { entry, patient } = found;
    is_uid(&entry.study)
        && study.is_none_or(|study| study == entry.study)
        && spec.patient_id.as_ref().is_none_or(|id| id.trim_matches(PADDING) == patient)
        && spec.date.as_ref().is_none_or(|asked| may_be_of(asked, &entry.date))
}

/// Whether a date is the one, or within the range, that was asked for; one that is not known may
/// be.
pub(crate) fn may_be_of(asked: &str, date: &str) -> bool {
    let (from, to) = asked.split_once('-').unwrap_or((asked, asked));
    let date = date.replace('.', "");
    date.is_empty() || (*date >= *from && (to.is_empty() || *date <= *to))
}

/// Whether what is looked for can be asked: no wild cards, which would ask for other patients'
/// data.
fn check(spec: &QuerySpec) -> Result<(), Error> {
    let QuerySpec { study, series, patient_id, date } = spec;
    let wrong = |what: &str| Err(Error::Query(what.to_owned()));
    if study.is_none() && series.is_none() && patient_id.is_none() {
        return wrong("say which study, series or patient");
    }
    if [study, series].into_iter().flatten().any(|uid| !is_uid(uid)) {
        return wrong("a study or series is named by its UID: digits and dots, 64 at most");
    }
    // An empty one would ask for every patient (PS3.4 C.2.2.2.3).
    let wild = |id: &str| {
        id.is_empty()
            || id.chars().count() > 64
            || id.contains(['*', '?', '\\'])
            || id.contains(char::is_control)
    };
    if patient_id.as_ref().is_some_and(|id| wild(id.trim_matches(PADDING))) {
        return wrong("a Patient ID has 1 to 64 characters, none of them * ? or \\");
    }
    let day = |d: &str| d.is_empty() || (d.len() == 8 && d.bytes().all(|b| b.is_ascii_digit()));
    let dates = |text: &String| match text.split_once('-') {
        None => text.len() == 8 && day(text),
        Some((from, to)) => day(from) && day(to) && text.len() > 1,
    };
    if date.as_ref().is_some_and(|date| !dates(date)) {
        return wrong("a date is YYYYMMDD, a range YYYYMMDD-YYYYMMDD");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_held_against_a_day_or_a_range() {
        for asked in ["20260105", "20260101-20260201", "20260101-", "-20260105"] {
            assert!(may_be_of(asked, "20260105") && may_be_of(asked, ""), "{asked}");
        }
        for asked in ["20260106", "20260106-", "-20260104", "20260106-20260201"] {
            assert!(!may_be_of(asked, "20260105"), "{asked}");
        }
    }

    #[test]
    fn a_query_names_what_it_wants() {
        let patient = |id: &str| QuerySpec { patient_id: Some(id.into()), ..QuerySpec::default() };
        for id in ["A 17", " A 17 ", &"é".repeat(64)] {
            assert!(check(&patient(id)).is_ok(), "{id}");
        }
        for id in ["", "  ", "*", "A?", "A\\B"] {
            assert!(check(&patient(id)).is_err(), "{id}");
        }
        assert!(check(&QuerySpec::default()).is_err());
        assert!(check(&QuerySpec { study: Some("1.*".into()), ..QuerySpec::default() }).is_err());
        let dated = |d: &str| QuerySpec { date: Some(d.into()), ..patient("A") };
        for date in ["20260101", "20260101-20260201", "20260101-", "-20260101"] {
            assert!(check(&dated(date)).is_ok(), "{date}");
        }
        for date in ["", "-", "2026", "2026-01-01", "20260101-1"] {
            assert!(check(&dated(date)).is_err(), "{date}");
        }
    }
}
