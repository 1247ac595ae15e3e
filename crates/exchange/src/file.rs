//! Whole files in and out, and bounded decompression.

use crate::{Error, Problem};
use flate2::{
    Compression,
    read::{MultiGzDecoder, ZlibDecoder},
};
use std::{
    fs::File,
    io::{self, BufWriter, Read},
    path::Path,
};
use supine_space::{Progress, Stopped};

/// Level of compression of volumes.
pub(crate) const COMPRESSION: Compression = Compression::new(3);

/// The bytes of a file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(path).map_err(|cause| Error::Read { path: path.into(), cause })
}

/// Writes a file under a temporary name in its folder and gives it its name when it is complete.
pub(crate) fn write(
    path: &Path,
    contents: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), Error> {
    // A callback that answered stop ends the writing as any fault of the disk does.
    let failed = |cause: io::Error| match cause.get_ref().and_then(|e| e.downcast_ref()) {
        Some(&stopped @ Stopped) => Error::Stopped(stopped),
        None => Error::Write { path: path.into(), cause },
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".supine-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The user's umask decides, as for any other file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let temporary = builder.tempfile_in(folder).map_err(failed)?;
    let mut out = BufWriter::with_capacity(1 << 18, temporary.as_file());
    contents(&mut out).map_err(failed)?;
    out.into_inner().map_err(|e| failed(e.into_error()))?;
    temporary.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// Whether the file's name ends so, whatever the case.
pub(crate) fn has_suffix(path: &Path, suffix: &str) -> bool {
    let name = path.file_name().map(|n| n.to_string_lossy().to_ascii_lowercase());
    name.is_some_and(|n| n.ends_with(suffix))
}

/// Whether the bytes are a gzip stream.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// The first `limit` bytes of a gzip stream, or fewer; what follows is not looked at.
pub(crate) fn gunzip_start(bytes: &[u8], limit: usize) -> Result<Vec<u8>, Problem> {
    inflate(&mut MultiGzDecoder::new(bytes), bytes.len(), limit, Progress::none())
}

/// The first `limit` bytes of a gzip stream, or fewer, and how many more there are; its checksums
/// were found right to the end.
pub(crate) fn gunzip(
    bytes: &[u8],
    limit: usize,
    progress: Progress<'_>,
) -> Result<(Vec<u8>, u64), Problem> {
    let mut decoder = MultiGzDecoder::new(bytes);
    let start = inflate(&mut decoder, bytes.len(), limit, progress)?;
    let more = io::copy(&mut decoder, &mut io::sink()).map_err(Problem::Damaged)?;
    Ok((start, more))
}

/// The first `limit` bytes of a zlib stream, or fewer.
pub(crate) fn zlib(bytes: &[u8], limit: usize, progress: Progress<'_>) -> Result<Vec<u8>, Problem> {
    inflate(&mut ZlibDecoder::new(bytes), bytes.len(), limit, progress)
}

/// Deflate cannot shrink data further than this (258 bytes in 2 bits).
const LARGEST_RATIO: usize = 1032;

/// Bytes between two steps of the progress.
const STEP: u64 = 1 << 22;

fn inflate(
    decoder: &mut impl Read,
    compressed: usize,
    limit: usize,
    progress: Progress<'_>,
) -> Result<Vec<u8>, Problem> {
    // What the header asks for, but no more than the data can hold.
    let bound = compressed.saturating_mul(LARGEST_RATIO).saturating_add(64).min(limit);
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(bound).map_err(|_| Problem::Memory(bound))?;
    while bytes.len() < limit {
        let step = STEP.min((limit - bytes.len()) as u64);
        let read = decoder.take(step).read_to_end(&mut bytes);
        let read = read.map_err(|cause| match cause.kind() {
            io::ErrorKind::UnexpectedEof => {
                Problem::Truncated { wanted: limit as u128, found: bytes.len() as u128 }
            }
            _ => Problem::Damaged(cause),
        })?;
        if read == 0 {
            break;
        }
        progress.at(bytes.len() as f64 / limit as f64)?;
    }
    Ok(bytes)
}
