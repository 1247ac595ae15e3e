//! The file around a data set (PS3.10 section 7): preamble, marker, header, transfer syntax.

use super::parse::{Encoding, Fault, Parsed, Until, parse};
use super::{DataSet, TransferSyntax};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Bytes read at first when only the head is wanted; most CT headers fit.
const HEAD_BYTES: usize = 32 << 10;
/// Largest file that is read as a whole.
const MAX_FILE_BYTES: usize = 1 << 30;
/// Largest inflated data set: a single-frame CT of 4096 x 4096 has 32 MiB.
const MAX_INFLATED_BYTES: usize = 64 << 20;

/// Why a file gives no data set.
#[derive(Debug)]
pub(crate) enum OpenError {
    /// The system could not read it.
    Io(std::io::Error),
    /// It is not a DICOM file.
    NotDicom(&'static str),
    /// It is one, but damaged or made to deceive; the Series Instance UID if it could be read.
    Malformed { reason: String, series: Option<String> },
}

impl OpenError {
    fn malformed(reason: impl Into<String>) -> Self {
        Self::Malformed { reason: reason.into(), series: None }
    }
}

impl From<Fault> for OpenError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::NeedMore => Self::malformed("it ends inside its header"),
            Fault::Bad { reason, series } => Self::Malformed { reason, series },
        }
    }
}

/// A DICOM file whose header is read and whose data set waits.
#[derive(Debug)]
pub(crate) struct Container {
    path: PathBuf,
    bytes: Vec<u8>,
    total: usize,
    data_start: usize,
    inflated: bool,
    /// Whether the 128 bytes before the marker are there (PS3.10 7.1).
    pub(crate) preamble: bool,
    /// The file header, group 0002.
    pub(crate) meta: DataSet,
    /// The transfer syntax the header names.
    pub(crate) syntax: TransferSyntax,
}

impl Container {
    /// Opens a file of which only the head is wanted.
    pub(crate) fn open_head(path: &Path) -> Result<Self, OpenError> {
        Self::open_bytes(path, HEAD_BYTES)
    }

    /// Opens a whole file.
    pub(crate) fn open(path: &Path) -> Result<Self, OpenError> {
        Self::open_bytes(path, MAX_FILE_BYTES)
    }

    fn open_bytes(path: &Path, limit: usize) -> Result<Self, OpenError> {
        let (bytes, total) = read(path, limit)?;
        if bytes.is_empty() {
            return Err(if may_be_dicom(path) {
                OpenError::malformed("the file is empty")
            } else {
                OpenError::NotDicom("an empty file")
            });
        }
        let (at, preamble) = match marker(&bytes) {
            Ok(found) => found,
            Err(reason) => return Err(OpenError::NotDicom(reason)),
        };
        let encoding = Encoding { explicit: true, big_endian: false };
        let header = parse(&bytes, total, at, encoding, Until::GroupEnds(2))?;
        let uid = header.set.text(tags::TRANSFER_SYNTAX_UID);
        if uid.is_empty() {
            return Err(OpenError::malformed("its header names no Transfer Syntax UID"));
        }
        Ok(Self {
            path: path.to_owned(),
            bytes,
            total,
            data_start: header.end,
            inflated: false,
            preamble,
            meta: header.set,
            syntax: TransferSyntax::new(uid),
        })
    }

    /// Where the data set begins in the file, and the file's length, bytes; before it is inflated.
    pub(crate) fn extent(&self) -> (usize, usize) {
        (self.data_start, self.total)
    }

    /// The data set; reads the rest of the file when it is needed.
    pub(crate) fn data(&mut self, until: Until) -> Result<Parsed, OpenError> {
        if self.syntax.deflated() && !self.inflated {
            self.inflate()?;
        }
        let encoding = self.syntax.encoding();
        match parse(&self.bytes, self.total, self.data_start, encoding, until) {
            Err(Fault::NeedMore) => {
                self.read_rest()?;
                Ok(parse(&self.bytes, self.total, self.data_start, encoding, until)?)
            }
            parsed => Ok(parsed?),
        }
    }

    /// Gives a data set the class and instance that the file header names when it has none itself,
    /// as some anonymisers leave it (PS3.10 7.1: both name the same object); whether it had to.
    pub(crate) fn identify(&self, set: &mut DataSet) -> bool {
        let mut had_to = false;
        for (in_header, tag) in [
            (tags::MEDIA_STORAGE_SOP_CLASS_UID, tags::SOP_CLASS_UID),
            (tags::MEDIA_STORAGE_SOP_INSTANCE_UID, tags::SOP_INSTANCE_UID),
        ] {
            let uid = self.meta.text(in_header);
            if set.text(tag).is_empty() && !uid.is_empty() {
                set.put_text(tag, VR::UI, &uid);
                had_to = true;
            }
        }
        had_to
    }

    fn read_rest(&mut self) -> Result<(), OpenError> {
        if self.bytes.len() < self.total {
            (self.bytes, self.total) = read(&self.path, MAX_FILE_BYTES)?;
        }
        if self.bytes.len() < self.total {
            return Err(OpenError::malformed(format!("larger than {} MiB", MAX_FILE_BYTES >> 20)));
        }
        Ok(())
    }

    fn inflate(&mut self) -> Result<(), OpenError> {
        self.read_rest()?;
        let mut data = Vec::new();
        flate2::read::DeflateDecoder::new(&self.bytes[self.data_start..])
            .take(MAX_INFLATED_BYTES as u64 + 1)
            .read_to_end(&mut data)
            .map_err(|e| OpenError::malformed(format!("its data set does not inflate: {e}")))?;
        if data.len() > MAX_INFLATED_BYTES {
            let limit = MAX_INFLATED_BYTES >> 20;
            return Err(OpenError::malformed(format!("its data set inflates past {limit} MiB")));
        }
        // The deflated stream is padded to an even length; so may be what it holds.
        if data.len() % 2 == 1 {
            data.pop();
        }
        (self.bytes, self.data_start, self.inflated) = (data, 0, true);
        self.total = self.bytes.len();
        Ok(())
    }
}

/// Endings that DICOM files have, besides numbers and none.
const ENDINGS: [&str; 8] = ["dcm", "dicom", "dic", "ima", "img", "ct", "acr", "v2"];

/// Whether the name of an empty file may be that of a slice that was lost: not `Thumbs.db` and its
/// like, which file managers leave.
fn may_be_dicom(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase());
    let name = name.unwrap_or_default();
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    let word = !ending.is_empty() && ending.bytes().all(|b| b.is_ascii_alphabetic());
    (!word || ENDINGS.contains(&ending)) && name != "icon\r"
}

/// Up to `limit` bytes of a regular file, and its length.
fn read(path: &Path, limit: usize) -> Result<(Vec<u8>, usize), OpenError> {
    let file = File::open(path).map_err(OpenError::Io)?;
    let meta = file.metadata().map_err(OpenError::Io)?;
    if !meta.is_file() {
        return Err(OpenError::NotDicom("not a regular file"));
    }
    let total =
        usize::try_from(meta.len()).map_err(|_| OpenError::malformed("larger than memory"))?;
    let wanted = total.min(limit);
    let mut bytes = Vec::with_capacity(wanted);
    file.take(wanted as u64).read_to_end(&mut bytes).map_err(OpenError::Io)?;
    if bytes.len() < wanted {
        return Err(OpenError::malformed("it changed while it was read"));
    }
    Ok((bytes, total))
}

/// Where the file header starts, and whether the preamble is there.
fn marker(bytes: &[u8]) -> Result<(usize, bool), &'static str> {
    if bytes.get(128..132) == Some(b"DICM") {
        return Ok((132, true));
    }
    if bytes.starts_with(b"DICM") {
        return Ok((4, false));
    }
    match bytes.first_chunk::<8>() {
        Some([2, 0, 0, 0, b'U', b'L', 4, 0]) => Ok((0, false)),
        Some([8, 0, 0 | 1 | 5 | 8 | 0x12 | 0x16, 0, ..]) => Err(
            "a DICOM data set without file header (PS3.10); convert it with a DICOM toolkit first",
        ),
        _ => Err("not a DICOM file"),
    }
}
