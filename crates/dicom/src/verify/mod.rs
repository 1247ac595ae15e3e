//! What is wrong with an exported series, including what no validator notices.
//!
//! Rules A: container and value forms (PS3.5, PS3.10); B: identity; C: geometry; D: pixels;
//! E: what a derived image has to say about itself (PS3.3 C.7.6.1, C.12). Many need the source.

mod container;
mod derivation;
mod geometry;
mod histogram;
mod identity;
mod mirrors;
mod pixels;

use crate::accept::Accept;
use crate::anonymise::Anonymiser;
use crate::data_set::{Container, DataSet, OpenError, Until};
use crate::error::Error;
use crate::files::{MAX_FOLDER_DEPTH, below};
use crate::folder::Folder;
use crate::policy::Policy;
use crate::read::{ReadParams, read_folder};
use crate::source::Source;
use dicom_core::Tag;
use dicom_dictionary_std::{tags, uids};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::Progress;
use supine_volume::Ct;

/// One rule and what came of it.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Check {
    /// Number and text of the rule.
    pub rule: String,
    /// Whether the export keeps it; `None` when it could not be checked.
    pub passed: Option<bool>,
    /// What was found, or why nothing could be.
    pub detail: String,
}

/// The verdict on an export, rule by rule.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Verification {
    /// All rules in order.
    pub checks: Vec<Check>,
    /// Number of files that were checked.
    pub files: usize,
    /// Whether the source was there to compare with.
    pub with_source: bool,
}

impl Verification {
    /// Whether no rule is broken. Rules that could not be checked do not count.
    pub fn passed(&self) -> bool {
        self.failures().next().is_none()
    }

    /// The broken rules.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|c| c.passed == Some(false))
    }
}

/// One exported file, as its bytes say.
struct Image {
    file: String,
    preamble: bool,
    syntax: String,
    meta: DataSet,
    set: DataSet,
}

impl Image {
    fn text(&self, tag: Tag) -> String {
        self.set.text(tag)
    }
}

/// The source, read with all the checks of an import.
struct Reference<'a> {
    source: Cow<'a, Source>,
    ct: Cow<'a, Ct>,
}

impl Reference<'_> {
    fn header(&self, k: usize) -> &DataSet {
        &self.source.slices[k].header
    }

    fn headers(&self) -> impl Iterator<Item = &DataSet> {
        self.source.slices.iter().map(|s| &s.header)
    }
}

/// Whether the export lacks the patient that the source has, so that they cannot be compared.
fn deidentified(images: &[Image], reference: &Reference<'_>) -> bool {
    let removed = |set: &DataSet| set.text(tags::PATIENT_IDENTITY_REMOVED) == "YES";
    images.iter().all(|i| removed(&i.set)) && !reference.headers().any(removed)
}

/// Why a rule was not checked.
const DEIDENTIFIED: &str = "the export is de-identified and the source is not";

/// Gathers checks.
#[derive(Default)]
struct Checks(Vec<Check>);

impl Checks {
    /// A rule that holds when nothing was found against it; three findings are told.
    fn none_of(&mut self, rule: &str, found: &[String]) {
        let mut detail = found.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
        if found.len() > 3 {
            detail += &format!("; and {} more", found.len() - 3);
        }
        self.say(rule, found.is_empty(), detail);
    }

    fn say(&mut self, rule: &str, passed: bool, detail: impl Into<String>) {
        let (rule, detail) = (rule.to_owned(), detail.into());
        self.0.push(Check { rule, passed: Some(passed), detail });
    }

    fn skip(&mut self, rule: &str, why: &str) {
        self.0.push(Check { rule: rule.to_owned(), passed: None, detail: why.to_owned() });
    }
}

/// Why a rule was not checked.
const NEEDS_SOURCE: &str = "needs the source series";

/// The series that an export was derived from.
#[derive(Clone, Copy, Debug)]
pub enum Original<'a> {
    /// Its folder, or a file of it: it is read for the comparison. In a folder with several series
    /// the one that the export names is taken.
    Files(&'a Path),
    /// As [`crate::read_series`] gave it, before it was de-identified: it need not be read again.
    Read {
        /// Its volume.
        ct: &'a Ct,
        /// Its headers.
        source: &'a Source,
    },
}

/// What an export was asked to be.
#[derive(Clone, Copy, Debug, Default)]
pub struct Expected<'a> {
    /// Departures from what is safest.
    pub policy: Policy,
    /// What took the patient out, so that she can be compared all the same.
    pub anonymiser: Option<&'a Anonymiser>,
    /// What was accepted when the source was read.
    pub accept: Accept,
}

/// Checks an exported series against its own rules and, when given, against the series it was
/// derived from. The exported files are read from the disk, whatever is in memory.
///
/// # Errors
/// When the folder cannot be read, holds no file, or the source cannot be read as a CT series.
/// Whatever is wrong with the export itself is part of the answer.
pub fn verify_export(
    dir: &Path,
    source: Option<Original<'_>>,
    expected: Expected<'_>,
    progress: Progress<'_>,
) -> Result<Verification, Error> {
    let paths = below(dir, MAX_FOLDER_DEPTH)?.files;
    if paths.is_empty() {
        return Err(Error::NoCt { path: dir.to_owned(), found: "the folder is empty".into() });
    }
    let (images, unreadable) = load(dir, &paths, progress.part(0.0, 0.4))?;
    let reference = match source {
        Some(Original::Files(path)) => {
            let progress = progress.part(0.4, 0.8);
            Some(load_source(path, expected, &images, progress)?)
        }
        Some(Original::Read { ct, source }) => {
            let source = as_exported(Cow::Borrowed(source), expected.anonymiser);
            Some(Reference { source, ct: Cow::Borrowed(ct) })
        }
        None => None,
    };
    let mut checks = Checks::default();
    container::check(&mut checks, &images, &unreadable);
    if !images.is_empty() {
        let reference = reference.as_ref();
        identity::check(&mut checks, &images, reference, expected.policy);
        let order = geometry::check(&mut checks, &images, reference);
        progress.at(0.85)?;
        pixels::check(&mut checks, &images, &order, reference, expected.policy);
        derivation::check(&mut checks, &images, reference, expected.policy);
    }
    progress.at(1.0)?;
    Ok(Verification { checks: checks.0, files: paths.len(), with_source: source.is_some() })
}

type Loaded = Result<Result<Image, String>, Error>;

/// All images of the folder, and what is wrong with the files that are none.
fn load(
    dir: &Path,
    paths: &[PathBuf],
    progress: Progress<'_>,
) -> Result<(Vec<Image>, Vec<String>), Error> {
    let done = AtomicUsize::new(0);
    let loaded: Vec<Loaded> = paths
        .par_iter()
        .map(|path| {
            progress.at(done.fetch_add(1, Ordering::Relaxed) as f64 / paths.len() as f64)?;
            load_image(path, path.strip_prefix(dir).unwrap_or(path).display().to_string())
        })
        .collect();
    let (mut images, mut unreadable) = (Vec::new(), Vec::new());
    for one in loaded {
        match one? {
            Ok(image) => images.push(image),
            Err(reason) => unreadable.push(reason),
        }
    }
    Ok((images, unreadable))
}

fn load_image(path: &Path, file: String) -> Loaded {
    let failed = |error| match error {
        OpenError::Io(source) => Err(Error::Read { path: path.to_owned(), source }),
        OpenError::NotDicom(reason) => Ok(Err(format!("{file}: {reason}"))),
        OpenError::Malformed { reason, .. } => Ok(Err(format!("{file}: {reason}"))),
    };
    let mut container = match Container::open(path) {
        Ok(container) => container,
        Err(error) => return failed(error),
    };
    let set = match container.data(Until::End) {
        Ok(parsed) => parsed.set,
        Err(error) => return failed(error),
    };
    if set.text(tags::SOP_CLASS_UID) != uids::CT_IMAGE_STORAGE && set.text(tags::MODALITY) != "CT" {
        return Ok(Err(format!("{file}: not a CT image")));
    }
    let (preamble, syntax) = (container.preamble, container.syntax.uid().to_owned());
    Ok(Ok(Image { file, preamble, syntax, meta: container.meta, set }))
}

fn load_source(
    path: &Path,
    expected: Expected<'_>,
    images: &[Image],
    progress: Progress<'_>,
) -> Result<Reference<'static>, Error> {
    let Expected { anonymiser, accept, .. } = expected;
    let folder = Folder::scan(path, accept, progress.part(0.0, 0.2))?;
    let named = images.iter().find_map(|image| {
        let item = image.set.items(tags::SOURCE_IMAGE_SEQUENCE).first()?;
        folder.series_of(&item.text(tags::REFERENCED_SOP_INSTANCE_UID), anonymiser)
    });
    let params = ReadParams { series: named, accept, ..ReadParams::default() };
    let (ct, source, _) = read_folder(folder, &params, progress.part(0.2, 1.0))?;
    Ok(Reference { source: as_exported(Cow::Owned(source), anonymiser), ct: Cow::Owned(ct) })
}

/// The source as it is compared: without the patient where the export was made so.
fn as_exported<'a>(source: Cow<'a, Source>, anonymiser: Option<&Anonymiser>) -> Cow<'a, Source> {
    match anonymiser {
        Some(anonymiser) => Cow::Owned(source.anonymised(anonymiser)),
        None => source,
    }
}

/// The different values of an attribute in the series.
fn values<'a>(sets: impl Iterator<Item = &'a DataSet>, tag: Tag) -> BTreeSet<String> {
    sets.map(|set| set.text(tag)).collect()
}

/// The different values of a 16-bit attribute in the series.
fn numbers<'a>(sets: impl Iterator<Item = &'a DataSet>, tag: Tag) -> BTreeSet<Option<u16>> {
    sets.map(|set| set.u16(tag)).collect()
}
