//! Reading MetaImage.

use super::{geometry, header::Header};
use crate::{
    Problem, file,
    raster::{NOTES, Raster},
};
use std::collections::BTreeMap;
use supine_space::Progress;

/// The value of `ElementDataFile` when the samples follow the header.
const LOCAL: &str = "LOCAL";

/// The name of the file beside this one that holds the samples; `None` when they are attached.
pub(crate) fn data_file(bytes: &[u8]) -> Result<Option<String>, Problem> {
    let (header, _) = Header::parse(bytes)?;
    let name = header.required(&["ElementDataFile"])?;
    if name.eq_ignore_ascii_case(LOCAL) {
        return Ok(None);
    }
    if name.is_empty() || name.contains(['/', '\\', '%']) || name.starts_with("LIST") {
        let shown: String = name.chars().take(40).collect();
        let what = format!("a MetaImage whose samples are in `{shown}`");
        let advice = "save it as one file (.mha), or as .mhd with one file beside it";
        return Err(Problem::Unsupported { what, advice });
    }
    Ok(Some(name.into()))
}

/// The volume of a MetaImage; `beside` are the bytes of its data file, where it has one.
pub(crate) fn parse(
    bytes: &[u8],
    beside: Option<&[u8]>,
    progress: Progress<'_>,
) -> Result<Raster, Problem> {
    let (header, attached) = Header::parse(bytes)?;
    check(&header)?;
    let (grid, scalar) = (geometry::grid(&header)?, header.scalar()?);
    let layers = header.numbers::<usize, 1>(&["ElementNumberOfChannels"])?.map_or(1, |[n]| n);
    if layers == 0 {
        return Err(Problem::field("ElementNumberOfChannels", "0 values per voxel"));
    }
    let samples = grid.len().checked_mul(layers);
    let wanted = samples.and_then(|n| n.checked_mul(scalar.size()));
    let wanted = wanted.ok_or_else(|| Problem::field("DimSize", "more samples than can be"))?;
    let data = stored(&header, beside.unwrap_or(attached), wanted)?;
    let bytes = samples_of(&header, data, wanted, progress)?;
    Ok(Raster {
        grid,
        layers,
        layers_first: true,
        scalar,
        big_endian: header.flag(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])?,
        bytes,
        slope: 1.0,
        intercept: 0.0,
        keys: BTreeMap::new(),
        note: note(&header)?,
        segments: vec![],
    })
}

/// The words of the header.
fn note(header: &Header) -> Result<String, Problem> {
    let texts: Result<Vec<_>, _> = NOTES.iter().map(|&name| header.text(&[name])).collect();
    Ok(texts?.into_iter().flatten().collect::<Vec<_>>().join("; "))
}

/// Refuses what would change the meaning of the samples.
fn check(header: &Header) -> Result<(), Problem> {
    if let Some(kind) = header.text(&["ObjectType"])?.filter(|kind| *kind != "Image") {
        let shown: String = kind.chars().take(40).collect();
        return Err(Problem::field("ObjectType", format!("`{shown}` is not Image")));
    }
    if header.text(&["BinaryData"])?.is_some() && !header.flag(&["BinaryData"])? {
        let what = "a MetaImage with samples as text".into();
        return Err(Problem::Unsupported { what, advice: "save it with BinaryData = True" });
    }
    for (name, neutral) in
        [("ElementToIntensityFunctionSlope", 1.0), ("ElementToIntensityFunctionOffset", 0.0)]
    {
        let value: Option<[f64; 1]> = header.numbers(&[name])?;
        if value.is_some_and(|[value]| value != neutral) {
            let reason =
                format!("is not {neutral}: most programs pass it over; save the values themselves");
            return Err(Problem::field(name, reason));
        }
    }
    Ok(())
}

/// The samples as they are stored, without what `HeaderSize` says lies ahead of them (-1: all but
/// the last).
fn stored<'a>(header: &Header, data: &'a [u8], wanted: usize) -> Result<&'a [u8], Problem> {
    let compressed = header.flag(&["CompressedData"])?;
    let skip = match header.numbers::<i64, 1>(&["HeaderSize"])? {
        None | Some([0]) => 0,
        Some([-1]) if !compressed => data.len().saturating_sub(wanted),
        Some([n]) => usize::try_from(n)
            .map_err(|_| Problem::field("HeaderSize", format!("{n} is no number of bytes")))?,
    };
    let beyond = || Problem::field("HeaderSize", "leads beyond the end of the data");
    let data = data.get(skip..).ok_or_else(beyond)?;
    match header.numbers::<usize, 1>(&["CompressedDataSize"])? {
        Some([size]) if compressed && size > 0 => data
            .get(..size)
            .ok_or(Problem::Truncated { wanted: size as u128, found: data.len() as u128 }),
        _ => Ok(data),
    }
}

/// Exactly `wanted` bytes of samples.
fn samples_of(
    header: &Header,
    data: &[u8],
    wanted: usize,
    progress: Progress<'_>,
) -> Result<Vec<u8>, Problem> {
    let bytes = if header.flag(&["CompressedData"])? {
        file::zlib(data, wanted.saturating_add(1), progress)?
    } else {
        data[..data.len().min(wanted.saturating_add(1))].to_vec()
    };
    match bytes.len() {
        found if found < wanted => {
            Err(Problem::Truncated { wanted: wanted as u128, found: found as u128 })
        }
        found if found > wanted => Err(Problem::Excess { wanted }),
        _ => Ok(bytes),
    }
}
