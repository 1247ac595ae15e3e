//! What the header of one CT slice says, checked value by value.

use crate::accept::Accept;
use crate::data_set::{DataSet, PixelCoding, TransferSyntax};
use crate::deformed::is_deformed;
use crate::error::Error;
use crate::number::{parse_ds, parse_ds_list, parse_is};
use crate::pixel_format::{Frame, PixelFormat, Rescale};
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use supine_space::{Point, Vector, Warning};

/// Smallest and largest Rows and Columns that are read; scanners make 256 to 1024.
const MATRIX: std::ops::RangeInclusive<u16> = 16..=4096;
/// Pixel spacings that are believed, mm; those of CT lie between 0.1 and 2.
const SPACING_MM: std::ops::RangeInclusive<f64> = 0.05..=10.0;

/// Values of Image Type that say that an image shows no attenuation (PS3.3 C.8.15.3.1.1 and usage).
const MATERIAL_MAPS: [&str; 5] =
    ["MAT_SPECIFIC", "MAT_FRACTIONAL", "EFF_ATOMIC_NUM", "ELECTRON_DENSITY", "IODINE"];

/// Everything about a slice but its pixels.
#[derive(Clone, Debug)]
pub(crate) struct Slice {
    /// Its file and, if that holds several, its frame.
    pub(crate) file: String,
    pub(crate) frame: Frame,
    pub(crate) instance: String,
    pub(crate) frame_of_reference: String,
    pub(crate) position: Point,
    /// Direction of a row (of growing column index) and of a column (of growing row index).
    pub(crate) row_direction: Vector,
    pub(crate) column_direction: Vector,
    /// Distance of rows and of columns, mm: the order of Pixel Spacing.
    pub(crate) row_spacing: f64,
    pub(crate) column_spacing: f64,
    pub(crate) pixels: PixelFormat,
    pub(crate) rescale: Rescale,
    pub(crate) padding: Option<[i32; 2]>,
    pub(crate) instance_number: Option<i64>,
    pub(crate) patient_position: String,
    /// What tells acquisitions, phases and energies apart: name of the attribute and its value.
    pub(crate) acquisition: [(&'static str, String); 4],
    /// What must not differ within a series but must not be shown either.
    pub(crate) identity: [(&'static str, String); 4],
    pub(crate) lossy: bool,
    /// Whether it is of a CT that this software deformed.
    pub(crate) deformed: bool,
    pub(crate) warnings: Vec<Warning>,
}

/// Reads values of one header, naming the file in every error.
struct Reader<'a> {
    file: &'a str,
    set: &'a DataSet,
}

impl Reader<'_> {
    fn fail<T>(&self, attribute: &'static str, reason: impl Into<String>) -> Result<T, Error> {
        Err(Error::attribute(self.file, attribute, reason))
    }

    fn u16(&self, tag: Tag, attribute: &'static str) -> Result<u16, Error> {
        self.set.u16(tag).map_or_else(|| self.fail(attribute, "is missing"), Ok)
    }

    fn numbers<const N: usize>(&self, tag: Tag, name: &'static str) -> Result<[f64; N], Error> {
        let texts = self.set.texts(tag);
        if texts.is_empty() {
            return self.fail(name, "is missing");
        }
        let text = texts.join("\\");
        parse_ds_list(&texts)
            .map_or_else(|| self.fail(name, format!("is {text:?}, not {N} decimal number(s)")), Ok)
    }
}

impl Slice {
    /// The header of a CT image, checked.
    ///
    /// `pixel_bytes` is the length of native Pixel Data where it is known.
    pub(crate) fn new(
        file: &str,
        set: &DataSet,
        syntax: &TransferSyntax,
        pixel_bytes: Option<usize>,
        accept: Accept,
    ) -> Result<Self, Error> {
        let r = Reader { file, set };
        let mut warnings = Vec::new();
        let modality = set.text(tags::MODALITY);
        if !modality.is_empty() && modality != "CT" {
            return r.fail("Modality", format!("is {modality:?}, that of a CT image is CT"));
        }
        let pixels = pixel_format(&r, syntax, pixel_bytes, &mut warnings)?;
        let rescale = rescale(&r, accept, &mut warnings)?;
        let padding = padding(set, pixels, &mut warnings);
        let position: [f64; 3] =
            r.numbers(tags::IMAGE_POSITION_PATIENT, "Image Position (Patient)")?;
        let [a, b, c, d, e, f] =
            r.numbers(tags::IMAGE_ORIENTATION_PATIENT, "Image Orientation (Patient)")?;
        let (row_direction, column_direction) = (Vector::new(a, b, c), Vector::new(d, e, f));
        let skew = row_direction.dot(&column_direction).abs();
        let stretch = (row_direction.norm() - 1.0).abs().max((column_direction.norm() - 1.0).abs());
        if skew.max(stretch) > 1e-4 {
            let reason =
                format!("are not unit vectors at right angles (off by {:.2e})", skew.max(stretch));
            return r.fail("Image Orientation (Patient)", reason);
        }
        let [row_spacing, column_spacing] = r.numbers(tags::PIXEL_SPACING, "Pixel Spacing")?;
        if !SPACING_MM.contains(&row_spacing) || !SPACING_MM.contains(&column_spacing) {
            let reason = format!("is {row_spacing} x {column_spacing} mm, outside 0.05 to 10 mm");
            return r.fail("Pixel Spacing", reason);
        }
        if position.iter().any(|c| c.abs() > 1e4) {
            let text = "positions lie more than 10 m from the origin";
            warnings.push(Warning::new("far-from-origin", text));
        }
        let text = |tag| set.text(tag);
        let temporal = text(tags::TEMPORAL_POSITION_IDENTIFIER);
        let lossy = text(tags::LOSSY_IMAGE_COMPRESSION) == "01";
        if lossy {
            let text = "the images were compressed with loss";
            warnings.push(Warning::new("lossy-compression", text));
        }
        Ok(Self {
            file: file.to_owned(),
            frame: Frame::ONLY,
            instance: text(tags::SOP_INSTANCE_UID),
            frame_of_reference: text(tags::FRAME_OF_REFERENCE_UID),
            position: Point::from(position),
            row_direction,
            column_direction,
            row_spacing,
            column_spacing,
            pixels,
            rescale,
            padding,
            instance_number: parse_is(&text(tags::INSTANCE_NUMBER)),
            patient_position: text(tags::PATIENT_POSITION),
            acquisition: [
                ("Acquisition Number", text(tags::ACQUISITION_NUMBER)),
                ("Temporal Position Identifier", temporal),
                ("KVP", text(tags::KVP)),
                ("Convolution Kernel", text(tags::CONVOLUTION_KERNEL)),
            ],
            identity: [
                ("Study Instance UID", text(tags::STUDY_INSTANCE_UID)),
                ("Patient ID", text(tags::PATIENT_ID)),
                ("Patient's Name", text(tags::PATIENT_NAME)),
                ("Patient's Birth Date", text(tags::PATIENT_BIRTH_DATE)),
            ],
            lossy,
            deformed: is_deformed(set),
            warnings,
        })
    }
}

fn pixel_format(
    r: &Reader<'_>,
    syntax: &TransferSyntax,
    pixel_bytes: Option<usize>,
    warnings: &mut Vec<Warning>,
) -> Result<PixelFormat, Error> {
    if syntax.pixel_coding() == PixelCoding::Unknown {
        let what = format!(
            "the pixels are coded as {} ({}), which is not read; convert the series to an \
             uncompressed transfer syntax first",
            syntax.name(),
            syntax.uid()
        );
        return Err(Error::Unsupported { file: r.file.to_owned(), what });
    }
    let rows = r.u16(tags::ROWS, "Rows")?;
    let columns = r.u16(tags::COLUMNS, "Columns")?;
    if !MATRIX.contains(&rows) || !MATRIX.contains(&columns) {
        return r.fail("Rows x Columns", format!("is {rows} x {columns}, outside 16 to 4096"));
    }
    let samples = r.u16(tags::SAMPLES_PER_PIXEL, "Samples per Pixel")?;
    let photometric = r.set.text(tags::PHOTOMETRIC_INTERPRETATION);
    if samples != 1 || photometric != "MONOCHROME2" {
        let reason =
            format!("is {photometric:?} with {samples} sample(s); CT must be MONOCHROME2 with 1");
        return r.fail("Photometric Interpretation", reason);
    }
    let frames = r.set.text(tags::NUMBER_OF_FRAMES);
    if !frames.is_empty() && parse_is(&frames) != Some(1) {
        return r.fail("Number of Frames", format!("is {frames}; multi-frame images are not read"));
    }
    let bits_allocated = r.u16(tags::BITS_ALLOCATED, "Bits Allocated")?;
    let bits_stored = r.u16(tags::BITS_STORED, "Bits Stored")?;
    let high_bit = r.u16(tags::HIGH_BIT, "High Bit")?;
    let representation = r.u16(tags::PIXEL_REPRESENTATION, "Pixel Representation")?;
    if !matches!(bits_allocated, 8 | 16) {
        let what = format!(
            "the values have {bits_allocated} bits (Bits Allocated); those of a CT have 8 or 16 and no others are \
             read: export the series with 16"
        );
        return Err(Error::Unsupported { file: r.file.to_owned(), what });
    }
    let sound = (1..=bits_allocated).contains(&bits_stored)
        && high_bit == bits_stored - 1
        && representation < 2;
    if !sound {
        let reason = format!(
            "{bits_allocated}, Bits Stored {bits_stored}, High Bit {high_bit}, Pixel Representation \
             {representation} do not go together"
        );
        return r.fail("Bits Allocated", reason);
    }
    let signed = representation == 1;
    let format = PixelFormat { rows, columns, bits_allocated, bits_stored, signed };
    if let (Some(found), PixelCoding::Native) = (pixel_bytes, syntax.pixel_coding()) {
        if found < format.bytes() {
            let reason =
                format!("has {found} bytes, the image needs {}: cut short", format.bytes());
            return r.fail("Pixel Data", reason);
        }
        if found > format.bytes() + 1 {
            let text = "Pixel Data is longer than the images need; the rest is ignored";
            warnings.push(Warning::new("pixel-data-too-long", text));
        }
    }
    Ok(format)
}

fn rescale(r: &Reader<'_>, accept: Accept, warnings: &mut Vec<Warning>) -> Result<Rescale, Error> {
    if r.set.get(tags::MODALITY_LUT_SEQUENCE).is_some() {
        return r
            .fail("Modality LUT Sequence", "is not read; a CT needs Rescale Slope and Intercept");
    }
    let given = [tags::RESCALE_SLOPE, tags::RESCALE_INTERCEPT].map(|t| !r.set.text(t).is_empty());
    let assumed = accept.assume_hu && given == [false, false];
    let one = |tag, name: &'static str| -> Result<f64, Error> {
        let text = r.set.text(tag);
        if text.is_empty() {
            return r.fail(name, "is missing: stored values are taken for HU only when that is asked for (`assume_hu = true` \
                        in the case file, --assume-hu)");
        }
        parse_ds(&text)
            .map_or_else(|| r.fail(name, format!("is {text:?}, not one decimal number")), Ok)
    };
    let rescale = if assumed {
        warnings.push(Warning::new("hu-assumed", ASSUMED));
        Rescale { slope: 1.0, intercept: 0.0 }
    } else {
        let slope = one(tags::RESCALE_SLOPE, "Rescale Slope")?;
        Rescale { slope, intercept: one(tags::RESCALE_INTERCEPT, "Rescale Intercept")? }
    };
    let slope = rescale.slope;
    if slope <= 0.0 {
        return r.fail("Rescale Slope", format!("is {slope}; it must be above 0"));
    }
    let image_type = r.set.texts(tags::IMAGE_TYPE);
    if let Some(map) = image_type.iter().find(|v| MATERIAL_MAPS.contains(&v.as_str())) {
        return r
            .fail("Image Type", format!("names a material map ({map}): the values are not HU"));
    }
    match r.set.text(tags::RESCALE_TYPE).as_str() {
        "" | "HU" => {}
        "US" => {
            let text = "Rescale Type is unspecified (US); the values are taken for HU";
            warnings.push(Warning::new("rescale-type-unspecified", text));
        }
        other => return r.fail("Rescale Type", format!("is {other:?}: the values are not HU")),
    }
    Ok(rescale)
}

/// Said of a CT whose stored values were taken for HU.
const ASSUMED: &str =
    "Rescale Slope and Intercept are missing: the stored values were taken for HU, as was asked";

/// Stored values that mean "no data": Pixel Padding Value, up to the Range Limit if that is given.
/// What Bits Stored cannot hold no pixel has, whatever its lower bits are.
fn padding(set: &DataSet, pixels: PixelFormat, warnings: &mut Vec<Warning>) -> Option<[i32; 2]> {
    let held = |tag: Tag, name: &str, warnings: &mut Vec<Warning>| {
        let value = pixels.as_number(set.u16(tag)?);
        if pixels.range().contains(&value) {
            return Some(value);
        }
        let bits = pixels.bits_stored;
        let text = format!(
            "{name} is {value}, which no pixel of {bits} bits can have: it is taken for missing"
        );
        warnings.push(Warning::new("padding-out-of-range", text));
        None
    };
    let value = held(tags::PIXEL_PADDING_VALUE, "Pixel Padding Value", warnings)?;
    let limit = held(tags::PIXEL_PADDING_RANGE_LIMIT, "Pixel Padding Range Limit", warnings);
    let limit = limit.unwrap_or(value);
    Some([value.min(limit), value.max(limit)])
}
