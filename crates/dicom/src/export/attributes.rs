//! The attributes of a derived CT image (PS3.3 A.3), from the source and the export's parameters.

use super::encoding::Encoding;
use super::params::ExportParams;
use crate::clock::Clock;
use crate::data_set::{DataSet, Value};
use crate::deformed::{MANUFACTURER, MODEL};
use crate::derived::{
    PATIENT_AND_STUDY, REQUIRED_OF_ALL, check_clock, check_text, code, copy, image_reference,
    put_lossy, put_missing,
};
use crate::error::Error;
use crate::number::format_ds;
use crate::policy::{Policy, SAME_FRAME};
use crate::source::Source;
use crate::{series, uid};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};
use supine_space::{Grid, Side, Warning};

/// Copied from the first slice beside patient and study: the same scan for the whole series.
pub(crate) const SCAN: &[Tag] = &[
    tags::BODY_PART_EXAMINED,
    tags::PATIENT_POSITION,
    tags::SLICE_THICKNESS,
    tags::KVP,
    tags::DATA_COLLECTION_DIAMETER,
    tags::RECONSTRUCTION_DIAMETER,
    tags::ROTATION_DIRECTION,
    tags::FILTER_TYPE,
    tags::CONVOLUTION_KERNEL,
    tags::CONTRAST_BOLUS_AGENT,
    tags::CONTRAST_BOLUS_ROUTE,
    tags::CONTRAST_BOLUS_AGENT_SEQUENCE,
];

/// Copied slice by slice.
pub(crate) const COPIED_PER_SLICE: &[Tag] = &[
    tags::ACQUISITION_DATE,
    tags::ACQUISITION_TIME,
    tags::ACQUISITION_NUMBER,
    tags::TABLE_HEIGHT,
    tags::WINDOW_CENTER,
    tags::WINDOW_WIDTH,
    tags::WINDOW_CENTER_WIDTH_EXPLANATION,
];

/// Required of a CT image, if need be without a value (type 2).
const REQUIRED: &[(Tag, VR)] = &[
    (tags::KVP, VR::DS),
    (tags::SLICE_THICKNESS, VR::DS),
    (tags::PATIENT_POSITION, VR::CS),
    (tags::ACQUISITION_NUMBER, VR::IS),
];

/// What the scanner says about itself, for Contributing Equipment.
pub(crate) const EQUIPMENT: &[Tag] = &[
    tags::MANUFACTURER,
    tags::INSTITUTION_NAME,
    tags::STATION_NAME,
    tags::MANUFACTURER_MODEL_NAME,
    tags::DEVICE_SERIAL_NUMBER,
    tags::SOFTWARE_VERSIONS,
];

/// The identifiers of one export.
pub(super) struct Names {
    pub(super) series: String,
    pub(super) frame_of_reference: String,
    study: String,
    instances: [u8; 32],
}

impl Names {
    /// Identifiers from the hash of all that is written, but for those of the source that are asked
    /// for.
    pub(super) fn new(hash: &[u8; 32], source: &Source, policy: Policy) -> Self {
        let header = &source.slices[0].header;
        Self {
            series: uid::from_content("series", hash),
            frame_of_reference: if policy.same_frame {
                source.frame_of_reference_uid()
            } else {
                uid::from_content("frame of reference", hash)
            },
            study: if policy.new_study {
                uid::from_content("study", hash)
            } else {
                header.text(tags::STUDY_INSTANCE_UID)
            },
            instances: *hash,
        }
    }

    fn instance(&self, number: usize) -> String {
        uid::from_content(&format!("instance {number}"), &self.instances)
    }
}

/// The attributes of a whole export.
pub(super) struct Attributes<'a> {
    source: &'a Source,
    common: DataSet,
    places: Vec<f64>,
    reach_mm: f64,
    /// Whether Instance Number grows along the normal, as in the source.
    ascending: bool,
    series_number: i64,
    implementation_version: String,
    warnings: Vec<Warning>,
}

impl<'a> Attributes<'a> {
    /// Checks the texts and collects what all slices share.
    pub(super) fn new(
        source: &'a Source,
        params: &ExportParams,
        grid: &Grid,
        encoding: &Encoding,
    ) -> Result<Self, Error> {
        check_texts(params)?;
        let first = &source.slices[0].header;
        let series_number = series::of_run(&params.identity, source);
        let mut warnings = Vec::new();
        for (tag, name) in
            [(tags::PATIENT_ID, "Patient ID"), (tags::PATIENT_NAME, "Patient's Name")]
        {
            if first.text(tag).is_empty() {
                let text = format!("the source has no {name}; some planning systems refuse that");
                warnings.push(Warning::new("patient-not-identified", text));
            }
        }
        let mut common = DataSet::default();
        for &tag in PATIENT_AND_STUDY.iter().chain(SCAN) {
            copy(&mut common, tag, first);
        }
        put_series(&mut common, params, series_number, first);
        put_derivation(&mut common, params, source);
        put_lossy(&mut common, source);
        put_grid(&mut common, first);
        put_pixel_format(&mut common, source, encoding, params.policy.clip_padding);
        put_missing(&mut common, REQUIRED_OF_ALL);
        put_missing(&mut common, REQUIRED);
        let instance = |n: usize| source.slices[n].slice.instance_number;
        let ascending = match (instance(0), instance(source.slices.len() - 1)) {
            (Some(a), Some(b)) => a <= b,
            _ => true,
        };
        let normal = grid.direction().column(2);
        let place = |k: usize| source.slices[k].slice.position.coords.dot(&normal);
        let version: String = params.software_version.chars().take(9).collect();
        Ok(Self {
            source,
            common,
            places: (0..source.slices.len()).map(place).collect(),
            reach_mm: params.reach_mm.max(0.0) + 1.01 * grid.spacing().z,
            ascending,
            series_number,
            implementation_version: format!("SUPINE_{version}"),
            warnings,
        })
    }

    pub(super) fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    pub(super) fn series_number(&self) -> i64 {
        self.series_number
    }

    pub(super) fn implementation_version(&self) -> &str {
        &self.implementation_version
    }

    /// Instance Number of slice k along the normal.
    fn instance_number(&self, k: usize) -> usize {
        if self.ascending { k + 1 } else { self.source.slices.len() - k }
    }

    /// Name of the file of slice k along the normal.
    pub(super) fn file_name(&self, k: usize) -> String {
        format!("CT{:04}.dcm", self.instance_number(k))
    }

    /// The data set of slice k; without `names` it lacks what has to be derived from its content.
    pub(super) fn slice(&self, k: usize, names: Option<&Names>, pixels: Vec<u8>) -> DataSet {
        let header = &self.source.slices[k].header;
        let mut set = self.common.clone();
        for &tag in COPIED_PER_SLICE {
            copy(&mut set, tag, header);
        }
        let number = self.instance_number(k);
        if let Some(names) = names {
            set.put_text(tags::SOP_INSTANCE_UID, VR::UI, &names.instance(number));
            set.put_text(tags::STUDY_INSTANCE_UID, VR::UI, &names.study);
            set.put_text(tags::SERIES_INSTANCE_UID, VR::UI, &names.series);
            set.put_text(tags::FRAME_OF_REFERENCE_UID, VR::UI, &names.frame_of_reference);
        }
        set.put_text(tags::INSTANCE_NUMBER, VR::IS, &number.to_string());
        copy(&mut set, tags::IMAGE_POSITION_PATIENT, header);
        set.put_text(tags::SLICE_LOCATION, VR::DS, &format_ds(self.places[k]));
        set.put_items(tags::SOURCE_IMAGE_SEQUENCE, self.source_images(k));
        set.put(tags::PIXEL_DATA, VR::OW, Value::Bytes(pixels));
        set
    }

    /// The source slices that slice k may have taken from (PS3.3 C.12.4): "do not overlay".
    fn source_images(&self, k: usize) -> Vec<DataSet> {
        let near = |n: &usize| (self.places[*n] - self.places[k]).abs() <= self.reach_mm;
        let item = |n: usize| {
            let mut item = image_reference(&self.source.slices[n]);
            item.put_text(tags::SPATIAL_LOCATIONS_PRESERVED, VR::CS, "NO");
            let purpose = code("DCM", "121322", "Source image for image processing operation");
            item.put_items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, vec![purpose]);
            item
        };
        (0..self.places.len()).filter(near).map(item).collect()
    }
}

/// Series, equipment and times (PS3.3 C.7.3.1, C.7.5.1, C.12.1).
fn put_series(set: &mut DataSet, params: &ExportParams, series_number: i64, first: &DataSet) {
    let Clock { date, time } = &params.clock;
    set.put_text(tags::SOP_CLASS_UID, VR::UI, uids::CT_IMAGE_STORAGE);
    set.put_text(tags::MODALITY, VR::CS, "CT");
    for tag in [tags::INSTANCE_CREATION_DATE, tags::SERIES_DATE, tags::CONTENT_DATE] {
        set.put_text(tag, VR::DA, date);
    }
    for tag in [tags::INSTANCE_CREATION_TIME, tags::SERIES_TIME, tags::CONTENT_TIME] {
        set.put_text(tag, VR::TM, time);
    }
    set.put_text(tags::SERIES_DESCRIPTION, VR::LO, &params.series_description);
    set.put_text(tags::SERIES_NUMBER, VR::IS, &series_number.to_string());
    if params.policy.keep_equipment {
        EQUIPMENT.iter().for_each(|&tag| copy(set, tag, first));
    } else {
        set.put_text(tags::MANUFACTURER, VR::LO, MANUFACTURER);
        set.put_text(tags::MANUFACTURER_MODEL_NAME, VR::LO, MODEL);
        set.put_text(tags::SOFTWARE_VERSIONS, VR::LO, &params.software_version);
    }
    if params.policy.new_study {
        set.remove(tags::STUDY_INSTANCE_UID);
        set.remove(tags::STUDY_ID);
    }
    // Type 2C of paired parts; of an unpaired part it would say that half of it was imaged.
    if matches!(set.text(tags::BODY_PART_EXAMINED).as_str(), "" | "BREAST") {
        let side = match params.laterality {
            Side::Left => "L",
            Side::Right => "R",
        };
        set.put_text(tags::LATERALITY, VR::CS, side);
    }
}

/// What says that this is no acquired image (PS3.3 C.7.6.1, C.12.1).
fn put_derivation(set: &mut DataSet, params: &ExportParams, source: &Source) {
    let first = &source.slices[0].header;
    set.put_text(tags::IMAGE_TYPE, VR::CS, "DERIVED\\SECONDARY\\AXIAL");
    set.put_text(tags::DERIVATION_DESCRIPTION, VR::ST, &params.derivation);
    let resampling = code("DCM", "113085", "Spatial resampling");
    set.put_items(tags::DERIVATION_CODE_SEQUENCE, vec![resampling]);
    set.put_text(tags::IMAGE_COMMENTS, VR::LT, &params.image_comments);
    let burned_in = if source.has_burned_in_text() { "YES" } else { "NO" };
    set.put_text(tags::BURNED_IN_ANNOTATION, VR::CS, burned_in);

    let mut scanner = DataSet::default();
    for &tag in EQUIPMENT {
        copy(&mut scanner, tag, first);
    }
    if scanner.get(tags::MANUFACTURER).is_none() {
        scanner.put_text(tags::MANUFACTURER, VR::LO, "unknown");
    }
    let purpose = code("DCM", "109101", "Acquisition Equipment");
    scanner.put_items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, vec![purpose]);

    let mut processing = DataSet::default();
    processing.put_text(tags::MANUFACTURER, VR::LO, MANUFACTURER);
    processing.put_text(tags::MANUFACTURER_MODEL_NAME, VR::LO, MODEL);
    processing.put_text(tags::SOFTWARE_VERSIONS, VR::LO, &params.software_version);
    // Where dates were removed, this one has to go too (PS3.15 table E.1-1).
    if first.text(tags::LONGITUDINAL_TEMPORAL_INFORMATION_MODIFIED) != "REMOVED" {
        let now = format!("{}{}", params.clock.date, params.clock.time);
        processing.put_text(tags::CONTRIBUTION_DATE_TIME, VR::DT, &now);
    }
    processing.put_text(tags::CONTRIBUTION_DESCRIPTION, VR::ST, "Simulated deformation of the CT");
    let purpose = code("DCM", "109102", "Processing Equipment");
    processing.put_items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, vec![purpose]);

    let mut equipment = first.items(tags::CONTRIBUTING_EQUIPMENT_SEQUENCE).to_vec();
    equipment.extend([scanner, processing]);
    set.put_items(tags::CONTRIBUTING_EQUIPMENT_SEQUENCE, equipment);
}

/// Geometry, in the source's own strings.
fn put_grid(set: &mut DataSet, first: &DataSet) {
    for tag in [tags::IMAGE_ORIENTATION_PATIENT, tags::PIXEL_SPACING, tags::ROWS, tags::COLUMNS] {
        copy(set, tag, first);
    }
}

fn put_pixel_format(set: &mut DataSet, source: &Source, encoding: &Encoding, clipped: bool) {
    set.put_u16(tags::SAMPLES_PER_PIXEL, VR::US, 1);
    set.put_text(tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2");
    set.put_u16(tags::BITS_ALLOCATED, VR::US, 16);
    set.put_u16(tags::BITS_STORED, VR::US, encoding.bits_stored);
    set.put_u16(tags::HIGH_BIT, VR::US, encoding.bits_stored - 1);
    set.put_u16(tags::PIXEL_REPRESENTATION, VR::US, encoding.signed.into());
    set.put_text(tags::RESCALE_SLOPE, VR::DS, "1");
    set.put_text(tags::RESCALE_INTERCEPT, VR::DS, &encoding.intercept.to_string());
    set.put_text(tags::RESCALE_TYPE, VR::LO, "HU");
    if encoding.inherited && !clipped {
        let vr = if encoding.signed { VR::SS } else { VR::US };
        for tag in [tags::PIXEL_PADDING_VALUE, tags::PIXEL_PADDING_RANGE_LIMIT] {
            if let Some(value) = source.slices[0].header.u16(tag) {
                set.put_u16(tag, vr, value);
            }
        }
    }
}

fn check_texts(params: &ExportParams) -> Result<(), Error> {
    let one_value = |text: &str| !text.contains('\\');
    let ExportParams { series_description, derivation, image_comments, .. } = params;
    let version = &params.software_version;
    let marked = one_value(series_description)
        && series_description.contains("DEFORMED")
        && series_description.contains(SAME_FRAME) == params.policy.same_frame;
    check_text("Series Description", series_description, 64, marked)?;
    check_text("Derivation Description", derivation, 1024, !derivation.is_empty())?;
    check_text("Image Comments", image_comments, 10240, true)?;
    check_text("Software Versions", version, 64, one_value(version) && !version.is_empty())?;
    check_clock(&params.clock)
}
