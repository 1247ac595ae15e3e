//! What files a folder holds, and which series they make.

use crate::accept::Accept;
use crate::anonymise::Anonymiser;
use crate::character_set::readable;
use crate::data_set::{Container, DataSet, OpenError, Parsed, TransferSyntax, Until};
use crate::error::Error;
use crate::excluded::{LeftOut, LeftOutReason};
use crate::files::Place;
use crate::geometry::{MIN_SLICES, leave_out};
use crate::multi_frame;
use crate::patient_identity::patient_identity;
use crate::pixel_format::Frame;
use crate::series_summary::SeriesSummary;
use crate::slice::Slice;
use dicom_core::dictionary::UidDictionary as _;
use dicom_dictionary_std::{StandardSopClassDictionary, tags, uids};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_record::PatientIdentity;
use supine_space::{Progress, Warning};

/// A slice: a CT file, or a frame of one, with the series it belongs to.
#[derive(Debug)]
pub(crate) struct CtFile {
    pub(crate) path: PathBuf,
    /// Path of the file below the folder that was given.
    pub(crate) name: String,
    pub(crate) series: SeriesHead,
    pub(crate) syntax: &'static str,
    pub(crate) slice: Result<Slice, Error>,
}

/// What a file says about its series.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SeriesHead {
    pub(crate) uid: String,
    pub(crate) description: String,
    pub(crate) number: String,
    pub(crate) whose: PatientIdentity,
    pub(crate) localizer: bool,
}

/// A series: files in the order of their paths.
#[derive(Debug)]
pub(crate) struct Series {
    pub(crate) head: SeriesHead,
    pub(crate) files: Vec<CtFile>,
    pub(crate) localizers: Vec<String>,
}

impl Series {
    pub(crate) fn summary(&self) -> SeriesSummary {
        SeriesSummary {
            uid: self.head.uid.clone(),
            description: self.head.description.clone(),
            slices: self.files.len(),
        }
    }
}

/// A DICOM file that cannot be read.
#[derive(Debug)]
pub(crate) struct Damaged {
    pub(crate) error: Error,
    file: String,
    /// Its series, where that could still be read.
    series: Option<String>,
}

/// All files of a folder, by what they are.
#[derive(Debug)]
pub(crate) struct Folder {
    pub(crate) path: PathBuf,
    /// Number of files.
    pub(crate) files: usize,
    /// CT series, ascending by UID.
    pub(crate) series: Vec<Series>,
    /// DICOM objects of other kinds: file and kind.
    pub(crate) other: Vec<LeftOut>,
    /// Files that are not DICOM: file and why.
    pub(crate) foreign: Vec<LeftOut>,
    /// Files that are DICOM but cannot be read.
    pub(crate) damaged: Vec<Damaged>,
    /// The series of the file that was given instead of a folder.
    pub(crate) given: Option<String>,
    pub(crate) warnings: Vec<Warning>,
}

enum Found {
    /// One slice, or the frames of a file.
    Ct(Vec<CtFile>),
    Other(LeftOut),
    Foreign(LeftOut),
    Damaged(Damaged),
}

impl Found {
    fn file(&self) -> &str {
        match self {
            Self::Ct(slices) => slices.first().map_or("", |ct| &ct.name),
            Self::Other(left) | Self::Foreign(left) => &left.file,
            Self::Damaged(damaged) => &damaged.file,
        }
    }
}

impl Folder {
    /// Reads the heads of all files below a folder, or beside a file.
    pub(crate) fn scan(path: &Path, accept: Accept, progress: Progress<'_>) -> Result<Self, Error> {
        let place = Place::of(path)?;
        let listed = place.files()?;
        let paths = &listed.files;
        let done = AtomicUsize::new(0);
        let results: Vec<Result<(Found, bool), Error>> = paths
            .par_iter()
            .map(|file| {
                let n = done.fetch_add(1, Ordering::Relaxed);
                progress.at(n as f64 / paths.len() as f64)?;
                look(file, &place.root, accept)
            })
            .collect();
        let mut folder = Self {
            path: path.to_owned(),
            files: paths.len(),
            series: Vec::new(),
            other: Vec::new(),
            foreign: listed.closed(&place.root).collect(),
            damaged: Vec::new(),
            given: None,
            warnings: Vec::new(),
        };
        let given = place.one_file.then_some(path);
        folder.sort(results, given)?;
        Ok(folder)
    }

    /// Sorts what was found into series and the rest.
    fn sort(
        &mut self,
        found: Vec<Result<(Found, bool), Error>>,
        given: Option<&Path>,
    ) -> Result<(), Error> {
        let mut series: BTreeMap<String, Series> = BTreeMap::new();
        let mut bare = 0;
        for one in found {
            let (one, preamble) = one?;
            bare += usize::from(!preamble);
            if given.is_some_and(|g| g.file_name() == Path::new(one.file()).file_name()) {
                self.given = Some(series_of_given(&one)?);
            }
            match one {
                Found::Ct(slices) => slices.into_iter().for_each(|ct| add(&mut series, ct)),
                Found::Other(left) => self.other.push(left),
                Found::Foreign(left) => self.foreign.push(left),
                Found::Damaged(damaged) => self.damaged.push(damaged),
            }
        }
        if bare > 0 {
            let text = format!("{bare} file(s) lack the preamble of a DICOM file (PS3.10 7.1)");
            self.warnings.push(Warning::new("no-preamble", text));
        }
        self.series = series.into_values().collect();
        Ok(())
    }

    /// Leaves files out, named by their paths below the folder.
    ///
    /// # Errors
    /// [`Error::NothingToExclude`] for a name that no file has.
    pub(crate) fn exclude(&mut self, names: &[String]) -> Result<(), Error> {
        for asked in names {
            let mut removed = self.damaged.extract_if(.., |d| d.file == *asked).count();
            for series in &mut self.series {
                removed += series.files.extract_if(.., |file| file.name == *asked).count();
            }
            let known = self.other.iter().chain(&self.foreign).any(|left| left.file == *asked);
            if removed > 0 {
                self.other.push(LeftOut { file: asked.clone(), reason: LeftOutReason::Asked });
            } else if !known {
                return Err(Error::NothingToExclude { file: asked.clone() });
            }
        }
        Ok(())
    }

    /// The first damaged file that is, or may be, a slice of a series.
    pub(crate) fn damage_to(&mut self, series: &str) -> Option<Error> {
        let at = self.damaged_at(series)?;
        let Damaged { error, file, .. } = self.damaged.remove(at);
        Some(match error {
            Error::Malformed { reason, .. } => {
                let reason = reason + &leave_out(&file);
                Error::Malformed { file, reason }
            }
            error => error,
        })
    }

    /// What is wrong with the first damaged file that is, or may be, a slice of a series.
    pub(crate) fn told_damage_to(&self, series: &str) -> Option<String> {
        self.damaged_at(series).map(|at| self.damaged[at].error.to_string())
    }

    fn damaged_at(&self, series: &str) -> Option<usize> {
        self.damaged.iter().position(|d| d.series.as_ref().is_none_or(|s| s == series))
    }

    /// The series to read: the asked one, or the only one that can make a volume.
    pub(crate) fn choose(&mut self, asked: Option<&str>) -> Result<Series, Error> {
        let asked = asked.map(str::to_owned).or_else(|| self.given.clone());
        let at = if let Some(asked) = asked {
            let at = self.series.iter().position(|s| s.head.uid == asked && !s.files.is_empty());
            at.ok_or_else(|| Error::UnknownSeries { asked, series: self.summaries(1) })?
        } else {
            let volumes = self.summaries(MIN_SLICES);
            if volumes.len() > 1 {
                return Err(Error::SeveralSeries { series: volumes });
            }
            let most = (0..self.series.len()).max_by_key(|&n| self.series[n].files.len());
            match most {
                Some(at) if !self.series[at].files.is_empty() => at,
                _ => return Err(self.not_ct(&self.path)),
            }
        };
        Ok(self.series.remove(at))
    }

    /// The Series Instance UID of the series that holds an instance, named by its UID or what
    /// stands for it.
    pub(crate) fn series_of(
        &self,
        instance: &str,
        anonymiser: Option<&Anonymiser>,
    ) -> Option<String> {
        let is = |uid: &str| match anonymiser {
            Some(anonymiser) => anonymiser.uid(uid) == instance,
            None => uid == instance,
        };
        let holds =
            |s: &&Series| s.files.iter().any(|f| f.slice.as_ref().is_ok_and(|s| is(&s.instance)));
        self.series.iter().find(holds).map(|s| s.head.uid.clone())
    }

    fn summaries(&self, least: usize) -> Vec<SeriesSummary> {
        let enough = self.series.iter().filter(|s| s.files.len() >= least);
        enough.map(Series::summary).collect()
    }

    /// The error for a folder or file without CT: a damaged file comes first, since it may be one.
    fn not_ct(&self, path: &Path) -> Error {
        let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
        for left in self.other.iter().chain(&self.foreign) {
            *kinds.entry(left.reason.to_string()).or_default() += 1;
        }
        for series in self.series.iter().filter(|s| s.files.is_empty()) {
            *kinds.entry("CT localizer".into()).or_default() += series.localizers.len();
        }
        if !self.damaged.is_empty() {
            let first = &self.damaged[0].error;
            *kinds.entry(format!("damaged (first: {first})")).or_default() += self.damaged.len();
        }
        let listed: Vec<String> = kinds.iter().map(|(kind, n)| format!("{n} x {kind}")).collect();
        let contents =
            if listed.is_empty() { "the folder is empty".into() } else { listed.join(", ") };
        Error::NoCt { path: path.to_owned(), found: contents }
    }
}

/// Puts a slice into its series.
fn add(series: &mut BTreeMap<String, Series>, ct: CtFile) {
    let s = series.entry(ct.series.uid.clone()).or_insert_with(|| Series {
        head: ct.series.clone(),
        files: Vec::new(),
        localizers: Vec::new(),
    });
    if !ct.series.localizer {
        s.files.push(ct);
    } else if s.localizers.last() != Some(&ct.name) {
        s.localizers.push(ct.name);
    }
}

/// The series of the file that was given, which must be a slice.
fn series_of_given(found: &Found) -> Result<String, Error> {
    let unsupported =
        |what: String| Err(Error::Unsupported { file: found.file().to_owned(), what });
    match found {
        Found::Ct(slices) => match slices.iter().find(|ct| !ct.series.localizer) {
            Some(ct) => Ok(ct.series.uid.clone()),
            None => unsupported("a localizer (scout image), not a slice of a volume".into()),
        },
        Found::Other(left) => unsupported(format!("not a CT image but: {}", left.reason)),
        Found::Foreign(LeftOut { file, reason }) => {
            Err(Error::NotDicom { file: file.clone(), what: reason.to_string() })
        }
        Found::Damaged(Damaged { file, error, .. }) => {
            Err(Error::Malformed { file: file.clone(), reason: error.reason() })
        }
    }
}

/// What a file is, and whether it has its preamble (true for what is not DICOM).
fn look(path: &Path, root: &Path, accept: Accept) -> Result<(Found, bool), Error> {
    let name = path.strip_prefix(root).unwrap_or(path).display().to_string();
    let mut container = match Container::open_head(path) {
        Ok(container) => container,
        Err(error) => return opened(error, path, name).map(|found| (found, true)),
    };
    let preamble = container.preamble;
    let class = container.meta.text(tags::MEDIA_STORAGE_SOP_CLASS_UID);
    if !class.is_empty() && !is_ct(&class) {
        return Ok((
            Found::Other(LeftOut { file: name, reason: LeftOutReason::OtherObject(kind(&class)) }),
            preamble,
        ));
    }
    let mut head = match container.data(Until::PixelData) {
        Ok(head) => head,
        Err(error) => return opened(error, path, name).map(|found| (found, preamble)),
    };
    let identified = container.identify(&mut head.set);
    let class = head.set.text(tags::SOP_CLASS_UID);
    if !is_ct(&class) {
        return Ok((
            Found::Other(LeftOut { file: name, reason: LeftOutReason::OtherObject(kind(&class)) }),
            preamble,
        ));
    }
    if head.set.text(tags::SERIES_INSTANCE_UID).is_empty() {
        let error = Error::attribute(&name, "Series Instance UID", "is missing");
        return Ok((Found::Damaged(Damaged { error, file: name, series: None }), preamble));
    }
    let ill_formed = crate::form::told(&head.set);
    let ct_file = |(series, mut slice): SliceOfSeries| {
        if let (Ok(slice), true) = (&mut slice, identified) {
            slice.warnings.push(Warning::new("uids-from-file-header", IDENTIFIED));
        }
        slice.iter_mut().for_each(|slice| slice.warnings.extend(ill_formed.clone()));
        let (path, name, syntax) = (path.to_owned(), name.clone(), container.syntax.name());
        CtFile { path, name, series, syntax, slice }
    };
    let content = match slices(&name, &class, &head, &container.syntax, accept) {
        Ok(slices) => Found::Ct(slices.into_iter().map(ct_file).collect()),
        Err(error) => {
            let series = Some(head.set.text(tags::SERIES_INSTANCE_UID));
            Found::Damaged(Damaged { error, file: name, series })
        }
    };
    Ok((content, preamble))
}

/// Said of images that [`Container::identify`] had to name.
const IDENTIFIED: &str =
    "images lack their SOP Class or Instance UID, which were taken from the file header";

type SliceOfSeries = (SeriesHead, Result<Slice, Error>);

/// The slice in a file, or the frames of it, each with the header it has of its own.
fn slices(
    name: &str,
    class: &str,
    head: &Parsed,
    syntax: &TransferSyntax,
    accept: Accept,
) -> Result<Vec<SliceOfSeries>, Error> {
    if !multi_frame::is_multi_frame(class) {
        let slice = Slice::new(name, &head.set, syntax, head.pixel_bytes, accept);
        return Ok(vec![(series_head(&head.set), slice)]);
    }
    let headers = multi_frame::headers(name, &head.set)?;
    let count = headers.len();
    let pixel_bytes = head.pixel_bytes.map(|bytes| bytes / count);
    let slice = |index: usize, header: &DataSet| {
        let name = format!("{name} frame {}", index + 1);
        let slice = Slice::new(&name, header, syntax, pixel_bytes, accept)?;
        Ok(Slice { frame: Frame { index, count }, ..slice })
    };
    let frames = headers.iter().enumerate();
    Ok(frames.map(|(n, header)| (series_head(header), slice(n, header))).collect())
}

/// Whether images of a class are slices of a CT.
fn is_ct(class: &str) -> bool {
    class == uids::CT_IMAGE_STORAGE || multi_frame::is_multi_frame(class)
}

fn opened(error: OpenError, path: &Path, file: String) -> Result<Found, Error> {
    match error {
        OpenError::Io(source) => Err(Error::Read { path: path.to_owned(), source }),
        OpenError::NotDicom(reason) => {
            Ok(Found::Foreign(LeftOut { file, reason: LeftOutReason::NotDicom(reason) }))
        }
        OpenError::Malformed { reason, series } => {
            let error = Error::Malformed { file: file.clone(), reason };
            Ok(Found::Damaged(Damaged { error, file, series }))
        }
    }
}

fn series_head(set: &DataSet) -> SeriesHead {
    SeriesHead {
        uid: set.text(tags::SERIES_INSTANCE_UID),
        description: readable(set, tags::SERIES_DESCRIPTION),
        number: set.text(tags::SERIES_NUMBER),
        whose: patient_identity(set),
        localizer: set.texts(tags::IMAGE_TYPE).get(2).is_some_and(|v| v == "LOCALIZER"),
    }
}

/// Name of a SOP class.
pub(crate) fn kind(class: &str) -> String {
    match StandardSopClassDictionary.by_uid(class) {
        Some(entry) => entry.name.to_owned(),
        None if class.is_empty() => "DICOM file without SOP Class".to_owned(),
        None => format!("DICOM object of class {class}"),
    }
}
