//! Objects as files that are handed on unchanged: what a file holds and where its data set begins.

use crate::character_set::readable;
use crate::data_set::{
    Container, DataSet, Encoding, OpenError, TransferSyntax, Until, can_be_implicit, encode,
    encode_implicit, parse, part10_head,
};
use crate::deformed::MANUFACTURER;
use crate::error::Error;
use crate::excluded::{LeftOut, LeftOutReason};
use crate::files::{Listed, MAX_FOLDER_DEPTH, below};
use crate::folder::kind;
use crate::patient_identity::patient_identity;
use crate::uid;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::Progress;

/// A DICOM object in a file (PS3.10), as far as one has to know it to hand it on unchanged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectFile {
    /// The file.
    pub path: PathBuf,
    /// Path of the file below the folder that was given.
    pub name: String,
    /// SOP Class UID.
    pub class: String,
    /// SOP Instance UID.
    pub instance: String,
    /// UID of the transfer syntax of the data set.
    pub syntax: String,
    /// Where in the file the data set begins, bytes.
    pub data_start: u64,
    /// Length of the data set as it stands in the file, bytes.
    pub data_bytes: u64,
    /// Where it belongs.
    pub owner: Owner,
    /// Instance Number, where it has one.
    pub number: Option<i64>,
    /// It was made by this program.
    pub own: bool,
    /// It is one of this program's and says that it must not be used ([`NOT_USABLE`]).
    pub not_usable: bool,
}

/// Begins the Series Description of an object that was carried from a run that must not be used.
pub const NOT_USABLE: &str = "NOT USABLE";

/// Whose an object is and where it belongs, as its data set says it; what that lacks is empty. For
/// comparing, not for logs, hence no content in its `Debug`.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct Owner {
    /// Patient ID, in its own character set.
    pub patient: String,
    /// Patient's Name, as people write it.
    pub name: String,
    /// Patient's Birth Date, as people write it.
    pub born: String,
    /// Study Instance UID.
    pub study: String,
    /// Study Date.
    pub date: String,
    /// Series Instance UID.
    pub series: String,
}

impl std::fmt::Debug for Owner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Owner(..)")
    }
}

impl Owner {
    fn of(set: &DataSet) -> Self {
        let whose = patient_identity(set);
        Self {
            patient: whose.id,
            name: whose.name,
            born: whose.born,
            study: set.text(tags::STUDY_INSTANCE_UID),
            date: set.text(tags::STUDY_DATE),
            series: set.text(tags::SERIES_INSTANCE_UID),
        }
    }
}

/// What lies below a folder, in the order of the paths.
#[derive(Debug, Default)]
pub struct ObjectFiles {
    /// Sound DICOM objects.
    pub objects: Vec<ObjectFile>,
    /// Files that are not DICOM.
    pub foreign: Vec<LeftOut>,
    /// DICOM files that are damaged or do not say what they are.
    pub damaged: Vec<LeftOut>,
}

/// The DICOM objects below a folder, or the one in a file.
///
/// # Errors
/// When the folder or a file in it cannot be read, or the user asked to stop.
pub fn object_files(path: &Path, progress: Progress<'_>) -> Result<ObjectFiles, Error> {
    let read_error = |source| Error::Read { path: path.to_owned(), source };
    let listed = if std::fs::metadata(path).map_err(read_error)?.is_dir() {
        below(path, MAX_FOLDER_DEPTH)?
    } else {
        Listed::one(path)
    };
    let paths = &listed.files;
    let done = AtomicUsize::new(0);
    let results: Vec<Result<Looked, Error>> = paths
        .par_iter()
        .map(|file| {
            let n = done.fetch_add(1, Ordering::Relaxed);
            progress.at(n as f64 / paths.len() as f64)?;
            look(file, path)
        })
        .collect();
    let foreign = listed.closed(path).collect();
    let mut files = ObjectFiles { foreign, ..ObjectFiles::default() };
    for one in results {
        match one? {
            Looked::Object(object) => files.objects.push(*object),
            Looked::Foreign(left) => files.foreign.push(left),
            Looked::Damaged(left) => files.damaged.push(left),
        }
    }
    Ok(files)
}

enum Looked {
    Object(Box<ObjectFile>),
    Foreign(LeftOut),
    Damaged(LeftOut),
}

fn look(path: &Path, root: &Path) -> Result<Looked, Error> {
    let below = path.strip_prefix(root).ok().filter(|p| !p.as_os_str().is_empty());
    let file_name = || Path::new(path.file_name().unwrap_or_default());
    let file = below.unwrap_or_else(file_name).display().to_string();
    let left = |reason: LeftOutReason| LeftOut { file: file.clone(), reason };
    let outcome = Container::open_head(path).and_then(|container| open(container, path, &file));
    match outcome {
        Ok(Ok(object)) if object.class == uids::MEDIA_STORAGE_DIRECTORY_STORAGE => {
            Ok(Looked::Foreign(left(LeftOutReason::OtherObject(kind(&object.class)))))
        }
        Ok(Ok(object)) => Ok(Looked::Object(Box::new(object))),
        Ok(Err(reason)) => Ok(Looked::Damaged(left(reason))),
        Err(OpenError::Io(source)) => Err(Error::Read { path: path.to_owned(), source }),
        Err(OpenError::NotDicom(reason)) => {
            Ok(Looked::Foreign(left(LeftOutReason::NotDicom(reason))))
        }
        Err(OpenError::Malformed { reason, .. }) => {
            Ok(Looked::Damaged(left(LeftOutReason::Damaged(reason))))
        }
    }
}

/// Classes of which every object has Pixel Data.
const IMAGES: [&str; 5] = [
    uids::CT_IMAGE_STORAGE,
    uids::ENHANCED_CT_IMAGE_STORAGE,
    uids::LEGACY_CONVERTED_ENHANCED_CT_IMAGE_STORAGE,
    uids::SEGMENTATION_STORAGE,
    uids::LABEL_MAP_SEGMENTATION_STORAGE,
];

/// Whether a SOP class is that of CT images.
pub fn is_ct(class: &str) -> bool {
    IMAGES[..3].contains(&class)
}

/// Whether a SOP class is that of spatial registrations, rigid or deformable.
pub fn is_registration(class: &str) -> bool {
    [uids::SPATIAL_REGISTRATION_STORAGE, uids::DEFORMABLE_SPATIAL_REGISTRATION_STORAGE]
        .contains(&class)
}

/// Whether so many bytes are native pixels enough for an image (PS3.5 8.1.1).
fn fills(set: &DataSet, bytes: usize) -> bool {
    let number = |tag| set.u16(tag).map_or(0, u64::from);
    let count = |tag, missing: u64| set.text(tag).trim().parse().unwrap_or(missing);
    let frames: u64 = count(tags::NUMBER_OF_FRAMES, 1);
    let samples = set.u16(tags::SAMPLES_PER_PIXEL).map_or(1, u64::from);
    let size = [number(tags::ROWS), number(tags::COLUMNS), number(tags::BITS_ALLOCATED), samples];
    let bits = size.iter().try_fold(frames, |bits, n| bits.checked_mul(*n));
    bits.is_some_and(|bits| bits > 0 && bits.div_ceil(8) <= bytes as u64)
}

/// The object of a file whose header was read: its data set is walked up to Pixel Data, whose
/// length is checked. Else why it does not say which object it is.
fn open(
    mut container: Container,
    path: &Path,
    file: &str,
) -> Result<Result<ObjectFile, LeftOutReason>, OpenError> {
    let (start, total) = container.extent();
    let parsed = container.data(Until::PixelData)?;
    let (has_pixels, native) = (parsed.has_pixels, parsed.pixel_bytes);
    let mut set = parsed.set;
    for (in_header, tag) in [
        (tags::MEDIA_STORAGE_SOP_CLASS_UID, tags::SOP_CLASS_UID),
        (tags::MEDIA_STORAGE_SOP_INSTANCE_UID, tags::SOP_INSTANCE_UID),
    ] {
        let (header, own) = (container.meta.text(in_header), set.text(tag));
        if !header.is_empty() && !own.is_empty() && header != own {
            return Ok(Err(LeftOutReason::TwoNames));
        }
    }
    container.identify(&mut set);
    let (class, instance) = (set.text(tags::SOP_CLASS_UID), set.text(tags::SOP_INSTANCE_UID));
    if !is_uid(&class) || !is_uid(&instance) {
        let reason = "it lacks its SOP Class or Instance UID";
        return Ok(Err(LeftOutReason::Damaged(reason.to_owned())));
    }
    if IMAGES.contains(&class.as_str()) && !(has_pixels && native.is_none_or(|n| fills(&set, n))) {
        let reason = "it is an image and lacks pixels";
        return Ok(Err(LeftOutReason::Damaged(reason.to_owned())));
    }
    let syntax = container.syntax.uid().to_owned();
    let own = set.text(tags::MANUFACTURER) == MANUFACTURER;
    Ok(Ok(ObjectFile {
        path: path.to_owned(),
        name: file.to_owned(),
        class,
        instance,
        syntax,
        data_start: start as u64,
        data_bytes: (total - start) as u64,
        owner: Owner::of(&set),
        number: set.text(tags::INSTANCE_NUMBER).trim().parse().ok(),
        own,
        not_usable: own && set.text(tags::SERIES_DESCRIPTION).starts_with(NOT_USABLE),
    }))
}

/// The data set of an object that is stored in Explicit VR Little Endian, in Implicit VR Little
/// Endian: every element with its bytes, in order; group lengths, which are redundant, are left
/// out.
///
/// # Errors
/// In words, when the file has changed or cannot be read, or when the data set would lose its
/// meaning.
pub fn implicit_data_set(object: &ObjectFile) -> Result<Vec<u8>, String> {
    let set = Container::open(&object.path).and_then(|mut container| {
        let syntax = container.syntax.uid().to_owned();
        Ok((syntax, container.data(Until::End)?.set))
    });
    let (syntax, set) = set.map_err(|error| match error {
        OpenError::Io(source) => format!("cannot be read: {source}"),
        OpenError::NotDicom(reason) => reason.to_owned(),
        OpenError::Malformed { reason, .. } => reason,
    })?;
    let instance = set.text(tags::SOP_INSTANCE_UID);
    if syntax != uids::EXPLICIT_VR_LITTLE_ENDIAN
        || (!instance.is_empty() && instance != object.instance)
    {
        return Err("it changed while it was read".into());
    }
    can_be_implicit(&set)?;
    Ok(encode_implicit(&set))
}

/// Whether a text has the form of a UID (PS3.5 9.1), and so is harmless as the name of a file.
pub fn is_uid(text: &str) -> bool {
    uid::is_uid(text)
}

/// Name of a SOP class, for people.
pub fn class_name(class: &str) -> String {
    kind(class)
}

/// Name of a transfer syntax, for people.
pub fn syntax_name(syntax: &str) -> String {
    match TransferSyntax::new(syntax.to_owned()).name() {
        "unknown" => format!("transfer syntax {syntax}"),
        name => name.to_owned(),
    }
}

/// The Implementation Class UID and Version Name of this software (PS3.7 D.3.3.2).
pub fn implementation() -> (&'static str, &'static str) {
    (uid::IMPLEMENTATION_CLASS, concat!("SUPINE_", env!("CARGO_PKG_VERSION")))
}

/// What stands in a file before a data set: preamble, marker and file header (PS3.10 7.1).
pub fn file_header(class: &str, instance: &str, syntax: &str) -> Vec<u8> {
    part10_head(class, instance, syntax, implementation().1)
}

/// A small data set that travels by itself: a query or an answer to one (PS3.4 C.4).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identifier {
    set: DataSet,
}

/// Longest identifier that is read, bytes; real ones have some hundred.
const MAX_IDENTIFIER_BYTES: usize = 1 << 20;

impl Identifier {
    /// With another element, of the VR the standard gives it; an empty text asks for the value.
    #[must_use]
    pub fn with(mut self, tag: Tag, text: &str) -> Self {
        let vr = match crate::data_set::dictionary_vr(tag) {
            VR::UN => VR::LO,
            vr => vr,
        };
        self.set.put_text(tag, vr, text);
        self
    }

    /// The value as text without padding; empty when missing.
    pub fn text(&self, tag: Tag) -> String {
        self.set.text(tag)
    }

    /// The value as text in the character set that the identifier names.
    pub fn readable(&self, tag: Tag) -> String {
        readable(&self.set, tag)
    }

    /// In Explicit or Implicit VR Little Endian.
    pub fn to_bytes(&self, explicit: bool) -> Vec<u8> {
        if explicit {
            return encode(&self.set);
        }
        encode_implicit(&self.set)
    }

    /// From Explicit or Implicit VR Little Endian.
    ///
    /// # Errors
    /// In words, when the bytes are no sound data set or too many.
    pub fn from_bytes(bytes: &[u8], explicit: bool) -> Result<Self, String> {
        if bytes.len() > MAX_IDENTIFIER_BYTES {
            return Err(format!("longer than {MAX_IDENTIFIER_BYTES} bytes"));
        }
        let encoding = Encoding { explicit, big_endian: false };
        match parse(bytes, bytes.len(), 0, encoding, Until::End) {
            Ok(parsed) => Ok(Self { set: parsed.set }),
            Err(fault) => match OpenError::from(fault) {
                OpenError::Malformed { reason, .. } => Err(reason),
                _ => Err("it ends early".into()),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identifier_comes_back() {
        let query = Identifier::default()
            .with(tags::QUERY_RETRIEVE_LEVEL, "IMAGE")
            .with(tags::SOP_INSTANCE_UID, "1.2.3\\1.2.4")
            .with(tags::SERIES_INSTANCE_UID, "");
        for explicit in [true, false] {
            let back = Identifier::from_bytes(&query.to_bytes(explicit), explicit).unwrap();
            assert_eq!(back, query);
        }
        let back = Identifier::from_bytes(&query.to_bytes(true), true).unwrap();
        assert_eq!(back.text(tags::SOP_INSTANCE_UID), "1.2.3\\1.2.4");
        assert!(Identifier::from_bytes(&query.to_bytes(true)[..19], true).is_err());
    }

    #[test]
    fn an_image_without_all_its_pixels_is_no_object() {
        let folder = tempfile::tempdir().unwrap();
        let head = Identifier::default()
            .with(tags::SOP_CLASS_UID, uids::CT_IMAGE_STORAGE)
            .with(tags::SOP_INSTANCE_UID, "1.2.3")
            .with(tags::ROWS, "\x02\0")
            .with(tags::COLUMNS, "\x02\0")
            .with(tags::BITS_ALLOCATED, "\x10\0");
        let found = |set: &Identifier| {
            let explicit = uids::EXPLICIT_VR_LITTLE_ENDIAN;
            let mut bytes = file_header(uids::CT_IMAGE_STORAGE, "1.2.3", explicit);
            bytes.extend(set.to_bytes(true));
            std::fs::write(folder.path().join("a"), bytes).unwrap();
            object_files(folder.path(), Progress::none()).unwrap()
        };
        let whole = found(&head.clone().with(tags::PIXEL_DATA, "\0\0\0\0\0\0\0\0"));
        assert_eq!((whole.objects.len(), whole.damaged.len()), (1, 0), "{whole:?}");
        for set in [head.clone(), head.clone().with(tags::PIXEL_DATA, "\0\0\0\0")] {
            let found = found(&set);
            assert!(found.objects.is_empty(), "{found:?}");
            assert!(found.damaged[0].reason.to_string().contains("lacks pixels"), "{found:?}");
        }
    }

    #[test]
    fn a_file_of_header_and_data_set_is_that_object() {
        let folder = tempfile::tempdir().unwrap();
        let data = Identifier::default()
            .with(tags::SOP_CLASS_UID, uids::RT_STRUCTURE_SET_STORAGE)
            .with(tags::SOP_INSTANCE_UID, "1.2.3")
            .to_bytes(true);
        let syntax = uids::EXPLICIT_VR_LITTLE_ENDIAN;
        let write = |name: &str, instance: &str| {
            let mut bytes = file_header(uids::RT_STRUCTURE_SET_STORAGE, instance, syntax);
            bytes.extend(&data);
            std::fs::write(folder.path().join(name), bytes).unwrap();
        };
        write("a", "1.2.3");
        write("b", "1.2.4");
        std::fs::write(folder.path().join("c"), "no DICOM").unwrap();
        let found = object_files(folder.path(), Progress::none()).unwrap();
        let [object] = &found.objects[..] else { panic!("{found:?}") };
        assert_eq!((object.name.as_str(), object.instance.as_str()), ("a", "1.2.3"));
        assert_eq!(object.data_bytes, data.len() as u64);
        assert_eq!(found.damaged[0].file, "b", "two names for one object");
        assert_eq!(found.foreign[0].file, "c");
    }
}
