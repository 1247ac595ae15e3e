//! What an export inherits from the series a volume was read from.

use crate::clock::Clock;
use crate::data_set::DataSet;
use crate::padding::Padding;
use crate::slice::Slice;
use dicom_dictionary_std::tags;
use supine_space::Grid;
use supine_volume::Field;

/// What an export inherits from the series a volume was read from.
///
/// Holds the headers of all slices as they were written, the patient's name among them: not for
/// logs, hence no content in its `Debug`.
#[derive(Clone)]
pub struct Source {
    /// Ascending along the normal, as the volume's slices.
    pub(crate) slices: Vec<SourceSlice>,
    pub(crate) padding: Padding,
}

/// One slice without its pixels.
#[derive(Clone)]
pub(crate) struct SourceSlice {
    pub(crate) header: DataSet,
    pub(crate) slice: Slice,
}

impl std::fmt::Debug for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Source({} slices)", self.slices.len())
    }
}

impl Source {
    /// Whether the series is a result of this software: a CT that was deformed by simulation.
    pub fn is_deformed(&self) -> bool {
        self.slices.iter().any(|source| source.slice.deformed)
    }

    /// Date and time of the source series; of its study or 19000101 000000 when it has none.
    pub fn clock(&self) -> Clock {
        let header = &self.slices[0].header;
        let text = |wanted: [_; 3], digits: usize| {
            wanted.iter().map(|&tag| header.text(tag)).find_map(|text| {
                let part = text.get(..digits)?;
                part.bytes().all(|b| b.is_ascii_digit()).then(|| part.to_owned())
            })
        };
        let dates = [tags::SERIES_DATE, tags::ACQUISITION_DATE, tags::STUDY_DATE];
        let times = [tags::SERIES_TIME, tags::ACQUISITION_TIME, tags::STUDY_TIME];
        Clock {
            date: text(dates, 8).unwrap_or_else(|| "19000101".to_owned()),
            time: text(times, 6).unwrap_or_else(|| "000000".to_owned()),
        }
    }

    /// What was measured of the CT on `grid` that was read from this series, when its padding
    /// tells.
    pub fn field(&self, grid: &Grid) -> Option<Field> {
        Field::of_padding(grid, self.padding.runs())
    }

    /// Series Instance UID of the source.
    pub fn series_uid(&self) -> String {
        self.slices[0].header.text(tags::SERIES_INSTANCE_UID)
    }

    /// Frame of Reference UID of the source; empty when it has none.
    pub fn frame_of_reference_uid(&self) -> String {
        self.slices[0].header.text(tags::FRAME_OF_REFERENCE_UID)
    }

    /// The files of the slices, ascending along the normal.
    pub fn files(&self) -> Vec<&str> {
        self.slices.iter().map(|s| s.slice.file.as_str()).collect()
    }
}
