//! Contours that were carried along, as a structure set of the exported CT.

use super::thin::thinned;
use super::{Line, LineKind, Structures, read_structures};
use crate::companion::{
    CompanionParams, Kind, ObjectReference, characters, common, derivation, plain, put_texts,
    same_patient, write,
};
use crate::data_set::DataSet;
use crate::derived::{copy, instance_reference};
use crate::error::Error;
use crate::geometry::grid_of;
use crate::number::{ROUNDING_MM, format_ds, parse_is};
use crate::series::Place;
use crate::source::{Source, SourceSlice};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};
use std::path::Path;
use supine_space::{Grid, Point, Warning};

const KIND: Kind =
    Kind { class: uids::RT_STRUCTURE_SET_STORAGE, modality: "RTSTRUCT", role: "structures" };
/// Coordinates within a slice are rounded to this share of 1 mm.
const PER_MM: f64 = 1e4;
/// Longest Contour Data: beyond it the element would lose its VR (PS3.5 6.2.2), which some readers
/// do not take.
const MAX_BYTES: usize = 65_534;
/// Points of which the decimal strings always fit it: three of 16 characters each, and what lies
/// between.
const MOST_POINTS: usize = 1280;
/// Where it would be longer, corners this near to the line of their neighbours are left out, mm;
/// twice as much until it fits.
const THIN_MM: f64 = 0.01;
/// What says which region it is.
const NAMED: &[Tag] = &[tags::ROI_NUMBER, tags::ROI_NAME, tags::ROI_DESCRIPTION];
const NAMES: &[Tag] = &[tags::STRUCTURE_SET_ROI_SEQUENCE, tags::RTROI_OBSERVATIONS_SEQUENCE];
const OBSERVED: &[Tag] = &[
    tags::OBSERVATION_NUMBER,
    tags::REFERENCED_ROI_NUMBER,
    tags::RTROI_INTERPRETED_TYPE,
    tags::ROI_INTERPRETER,
];

/// What is drawn of a region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Closed contours, LPS, mm.
    pub contours: Vec<Vec<Point>>,
    /// Points and open lines.
    pub lines: Vec<Line>,
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct StructuresInfo {
    /// The object.
    pub object: ObjectReference,
    /// Closed contours written.
    pub contours: usize,
    /// Points and open lines written.
    pub lines: usize,
    /// What a user must know before trusting it.
    #[serde(serialize_with = "crate::warnings::texts")]
    pub warnings: Vec<Warning>,
}

/// Writes the regions of a structure set after deformation into the file `path`, as one of the
/// exported CT.
///
/// `carried` is what is drawn of the regions of `from`, in its order. Numbers, names, colours and
/// interpreted types are kept, and a region without contours stays one. A contour in a slice of the
/// CT names that slice and has its very position string (readers compare by equality); one between
/// slices names none. An open line with more than 1,280 points becomes several that meet. A hole is
/// a contour of its own. UIDs are 2.25 from the hash of all that is written. The file appears only
/// when it was read back equal.
///
/// # Errors
/// When the structures are of another patient than the CT, a text does not fit its attribute, or
/// the file cannot be written or does not read back. Nothing is left then.
pub fn write_structures(
    carried: &[Drawing],
    from: &Structures,
    ct: &Source,
    params: &CompanionParams,
    path: &Path,
) -> Result<StructuresInfo, Error> {
    same_patient(&from.file, &from.header, ct)?;
    let slices = Slices { ct, grid: grid_of(ct)? };
    let mut warnings = Vec::new();
    let mut set = common(ct, params, (&KIND, Place::Structures(params.before)))?;
    let ascii_only = characters(&mut set, &from.header, NAMES, &mut warnings);
    put_texts(
        &mut set,
        &[
            (tags::OPERATORS_NAME, VR::PN, ""),
            (tags::STRUCTURE_SET_LABEL, VR::SH, "DEFORMED"),
            (tags::STRUCTURE_SET_DESCRIPTION, VR::ST, &derivation(params, ct)),
            (tags::STRUCTURE_SET_DATE, VR::DA, &params.clock.date),
            (tags::STRUCTURE_SET_TIME, VR::TM, &params.clock.time),
            (tags::APPROVAL_STATUS, VR::CS, "UNAPPROVED"),
        ],
    );
    put_frame(&mut set, &slices);
    let regions = Regions { carried, from, slices: &slices, ascii_only };
    let drawn = regions.put(&mut set);
    if drawn.between > 0 {
        let text = "contour(s) that did not move lie between the slices of the CT and name none";
        let text = format!("{} {text}", drawn.between);
        warnings.push(Warning::new("contours-between-slices", text));
    }
    if drawn.thinned > 0 {
        let text = format!(
            "{} contour(s) with more corners than fit were thinned, by {:.3} mm at most",
            drawn.thinned, drawn.thinned_mm
        );
        warnings.push(Warning::new("contours-thinned", text));
    }
    let object = write(set, params, &KIND, path, |written| {
        let read = read_structures(written).map_err(|e| e.to_string())?;
        compare(&read, &drawn.regions, from, ascii_only)
    })?;
    let contours = drawn.regions.iter().map(|r| r.contours.len()).sum();
    let lines = drawn.regions.iter().map(|r| r.lines.len()).sum();
    Ok(StructuresInfo { object, contours, lines, warnings })
}

/// The frame of reference and the images of the exported CT (PS3.3 C.8.8.5).
fn put_frame(set: &mut DataSet, slices: &Slices<'_>) {
    let ct = slices.ct;
    let mut series = DataSet::default();
    series.put_text(tags::SERIES_INSTANCE_UID, VR::UI, &ct.series_uid());
    series.put_items(tags::CONTOUR_IMAGE_SEQUENCE, crate::companion::slices(ct));
    let mut study = DataSet::default();
    // Detached Study Management, retired, is what this attribute is still given (C.8.8.5.4).
    study.put_text(tags::REFERENCED_SOP_CLASS_UID, VR::UI, "1.2.840.10008.3.1.2.3.1");
    let uid = ct.slices[0].header.text(tags::STUDY_INSTANCE_UID);
    study.put_text(tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, &uid);
    study.put_items(tags::RT_REFERENCED_SERIES_SEQUENCE, vec![series]);
    let mut frame = DataSet::default();
    frame.put_text(tags::FRAME_OF_REFERENCE_UID, VR::UI, &ct.frame_of_reference_uid());
    frame.put_items(tags::RT_REFERENCED_STUDY_SEQUENCE, vec![study]);
    set.put_items(tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE, vec![frame]);
}

/// The slices of the exported CT.
struct Slices<'a> {
    ct: &'a Source,
    grid: Grid,
}

impl Slices<'_> {
    /// The slice in which all corners lie.
    fn of(&self, contour: &[Point]) -> Option<usize> {
        let step = self.grid.spacing().z;
        let levels: Vec<f64> = contour.iter().map(|p| self.grid.index_from_patient(p)[2]).collect();
        let slice = levels.first()?.round();
        let near = levels.iter().all(|l| (l - slice).abs() * step <= ROUNDING_MM);
        let known = slice >= 0.0 && slice < self.grid.size()[2] as f64;
        (near && known).then_some(slice as usize)
    }

    /// The corner as decimal strings, in the plane of its slice.
    fn texts(&self, corner: &Point, slice: Option<usize>) -> [String; 3] {
        let rounded = |mm: f64| format_ds((mm * PER_MM).round() / PER_MM);
        let Some(k) = slice else { return [corner.x, corner.y, corner.z].map(rounded) };
        let normal = self.grid.direction().column(2).into_owned();
        let SourceSlice { header, slice } = &self.ct.slices[k];
        if normal.x == 0.0 && normal.y == 0.0 {
            let position = header.texts(tags::IMAGE_POSITION_PATIENT);
            let z = position.get(2).cloned().unwrap_or_else(|| format_ds(slice.position.z));
            return [rounded(corner.x), rounded(corner.y), z];
        }
        // Rounding would leave an oblique plane.
        let flat = corner - normal * (corner - slice.position).dot(&normal);
        [flat.x, flat.y, flat.z].map(format_ds)
    }
}

/// The regions and their contours.
struct Regions<'a> {
    carried: &'a [Drawing],
    from: &'a Structures,
    slices: &'a Slices<'a>,
    ascii_only: bool,
}

/// What became of the contours.
#[derive(Default)]
struct Drawn {
    /// What is written, by region.
    regions: Vec<Drawing>,
    between: usize,
    thinned: usize,
    thinned_mm: f64,
}

impl Regions<'_> {
    fn put(&self, set: &mut DataSet) -> Drawn {
        let mut drawn = Drawn::default();
        let (mut named, mut contours, mut observed) = (Vec::new(), Vec::new(), Vec::new());
        let frame = self.slices.ct.frame_of_reference_uid();
        for (n, roi) in self.from.rois.iter().enumerate() {
            let number = roi.number.to_string();
            let mut item = self.copied(tags::STRUCTURE_SET_ROI_SEQUENCE, n, roi.number, NAMED);
            item.put_text(tags::ROI_NUMBER, VR::IS, &number);
            if item.get(tags::ROI_NAME).is_none() {
                item.put_text(tags::ROI_NAME, VR::LO, "");
            }
            item.put_text(tags::REFERENCED_FRAME_OF_REFERENCE_UID, VR::UI, &frame);
            item.put_text(tags::ROI_GENERATION_ALGORITHM, VR::CS, "AUTOMATIC");
            named.push(item);

            let mut item = DataSet::default();
            item.put_text(tags::REFERENCED_ROI_NUMBER, VR::IS, &number);
            if let Some(rgb) = roi.colour {
                let text = rgb.map(|c| c.to_string()).join("\\");
                item.put_text(tags::ROI_DISPLAY_COLOR, VR::IS, &text);
            }
            drawn.regions.push(Drawing::default());
            let none = Drawing::default();
            let given = self.carried.get(n).unwrap_or(&none);
            let mut items: Vec<DataSet> =
                given.contours.iter().filter_map(|c| self.contour(c, &mut drawn)).collect();
            items.extend(given.lines.iter().flat_map(|l| self.line(l, &mut drawn)));
            let empty = || self.source_item(tags::ROI_CONTOUR_SEQUENCE, n, roi.number);
            if !items.is_empty()
                || empty().is_some_and(|own| own.get(tags::CONTOUR_SEQUENCE).is_some())
            {
                item.put_items(tags::CONTOUR_SEQUENCE, items);
            }
            contours.push(item);

            let mut item = self.copied(tags::RTROI_OBSERVATIONS_SEQUENCE, n, roi.number, OBSERVED);
            item.put_text(tags::REFERENCED_ROI_NUMBER, VR::IS, &number);
            if parse_is(&item.text(tags::OBSERVATION_NUMBER)).is_none() {
                item.put_text(tags::OBSERVATION_NUMBER, VR::IS, &(n + 1).to_string());
            }
            for (tag, vr) in
                [(tags::RTROI_INTERPRETED_TYPE, VR::CS), (tags::ROI_INTERPRETER, VR::PN)]
            {
                if item.get(tag).is_none() {
                    item.put_text(tag, vr, "");
                }
            }
            observed.push(item);
        }
        set.put_items(tags::STRUCTURE_SET_ROI_SEQUENCE, named);
        set.put_items(tags::ROI_CONTOUR_SEQUENCE, contours);
        set.put_items(tags::RTROI_OBSERVATIONS_SEQUENCE, observed);
        drawn
    }

    /// The item of the source about a region.
    fn source_item(&self, sequence: Tag, n: usize, number: i64) -> Option<&DataSet> {
        let items = self.from.header.items(sequence);
        if sequence == tags::STRUCTURE_SET_ROI_SEQUENCE {
            return items.get(n);
        }
        let of = |i: &&DataSet| parse_is(&i.text(tags::REFERENCED_ROI_NUMBER)) == Some(number);
        items.iter().find(of)
    }

    /// What the source says of a region: the item of its number.
    fn copied(&self, sequence: Tag, n: usize, number: i64, wanted: &[Tag]) -> DataSet {
        let own = self.source_item(sequence, n, number);
        let mut item = DataSet::default();
        for &tag in wanted {
            let Some(own) = own else { break };
            copy(&mut item, tag, own);
        }
        if self.ascii_only {
            plain(&mut item);
        }
        item
    }

    /// A contour; none when it has fewer than three corners.
    fn contour(&self, given: &[Point], drawn: &mut Drawn) -> Option<DataSet> {
        let slice = self.slices.of(given);
        let (mut corners, mut tolerance) = (given.to_vec(), THIN_MM);
        let mut texts = self.corners(&corners, slice);
        while texts.join("\\").len() > MAX_BYTES {
            corners = thinned(given, tolerance);
            texts = self.corners(&corners, slice);
            drawn.thinned_mm = drawn.thinned_mm.max(tolerance);
            tolerance *= 2.0;
        }
        if texts.len() < 3 {
            return None;
        }
        drawn.thinned += usize::from(tolerance > THIN_MM);
        drawn.between += usize::from(slice.is_none());
        let mut item = DataSet::default();
        if let Some(k) = slice {
            let image = instance_reference(&self.slices.ct.slices[k].header);
            item.put_items(tags::CONTOUR_IMAGE_SEQUENCE, vec![image]);
        }
        item.put_text(tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, "CLOSED_PLANAR");
        item.put_text(tags::NUMBER_OF_CONTOUR_POINTS, VR::IS, &texts.len().to_string());
        item.put_text(tags::CONTOUR_DATA, VR::DS, &texts.join("\\"));
        if let Some(region) = drawn.regions.last_mut() {
            region.contours.push(corners);
        }
        Some(item)
    }

    /// Points, or an open line, in as many pieces as it takes; one that lies in a slice names it.
    fn line(&self, line: &Line, drawn: &mut Drawn) -> Vec<DataSet> {
        // Pieces of a line meet in a point.
        let step = if line.kind == LineKind::Point { MOST_POINTS } else { MOST_POINTS - 1 };
        let last = line.points.len().saturating_sub(usize::from(line.kind != LineKind::Point));
        let starts = (0..last.max(line.points.len().min(1))).step_by(step);
        let piece = |from: usize| {
            let end = (from + MOST_POINTS).min(line.points.len());
            let points = line.points[from..end].to_vec();
            let slice = self.slices.of(&points);
            let mut item = DataSet::default();
            if let Some(k) = slice {
                let image = instance_reference(&self.slices.ct.slices[k].header);
                item.put_items(tags::CONTOUR_IMAGE_SEQUENCE, vec![image]);
            }
            let texts = points.iter().map(|p| self.slices.texts(p, slice).join("\\"));
            let texts: Vec<String> = texts.collect();
            item.put_text(tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, line.kind.term());
            item.put_text(tags::NUMBER_OF_CONTOUR_POINTS, VR::IS, &texts.len().to_string());
            item.put_text(tags::CONTOUR_DATA, VR::DS, &texts.join("\\"));
            if let Some(region) = drawn.regions.last_mut() {
                region.lines.push(Line { kind: line.kind, points });
            }
            item
        };
        starts.map(piece).collect()
    }

    /// The corners as written, without one that repeats its neighbour; the first is not repeated at
    /// the end.
    fn corners(&self, corners: &[Point], slice: Option<usize>) -> Vec<String> {
        let mut texts: Vec<String> =
            corners.iter().map(|p| self.slices.texts(p, slice).join("\\")).collect();
        texts.dedup();
        while texts.len() > 1 && texts.first() == texts.last() {
            texts.pop();
        }
        texts
    }
}

/// What another reading finds must be what was meant.
fn compare(
    read: &Structures,
    drawn: &[Drawing],
    from: &Structures,
    ascii_only: bool,
) -> Result<(), String> {
    if read.rois.len() != from.rois.len() {
        return Err("a region is missing".into());
    }
    for ((found, meant), Drawing { contours, lines }) in read.rois.iter().zip(&from.rois).zip(drawn)
    {
        let name = &meant.name;
        let same = (found.name == *name || ascii_only)
            && (found.number, found.colour) == (meant.number, meant.colour)
            && found.interpreted_type == meant.interpreted_type
            && found.contours.len() == contours.len()
            && found.lines.len() == lines.len();
        if !same {
            return Err(format!("the region {name:?} differs"));
        }
        for (a, b) in found.lines.iter().zip(lines) {
            let near = |(p, q): (&Point, &Point)| (p - q).norm() < 2.0 * ROUNDING_MM;
            let same = a.kind == b.kind && a.points.len() == b.points.len();
            if !same || !a.points.iter().zip(&b.points).all(near) {
                return Err(format!("a line of the region {name:?} differs"));
            }
        }
        for (a, b) in found.contours.iter().zip(contours) {
            // The corners in their order; those that repeat a neighbour were left out.
            let mut rest = b.iter();
            let known = |p: &Point| rest.any(|q| (p - q).norm() < 2.0 * ROUNDING_MM);
            if !a.iter().all(known) {
                return Err(format!("a contour of the region {name:?} differs"));
            }
        }
    }
    Ok(())
}
