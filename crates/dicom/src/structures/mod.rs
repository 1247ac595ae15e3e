//! RT structure sets (PS3.3 A.19): regions of interest drawn as contours, in and out.

mod made;
mod thin;
mod write;

pub use made::Named;
pub use write::{Drawing, StructuresInfo, write_structures};

use crate::character_set::readable_in;
use crate::data_set::{DataSet, text_of};
use crate::error::Error;
use crate::number::{parse_ds, parse_is};
use crate::object::Object;
use crate::segmentation::{Meaning, not_compared, same_frame_of_reference};
use dicom_core::Tag;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;
use supine_space::{Grid, Point, Vector, Warning};
use supine_volume::{
    ContourError, Enclosed, Overlap, Rule, Stray, Volume, enclosed, fill_contours, overlap, stray,
    undrawn,
};

/// What is drawn without an inside (Contour Geometric Type, PS3.3 C.8.8.6.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineKind {
    /// Points by themselves.
    Point,
    /// An open line in one plane.
    OpenPlanar,
    /// An open line.
    OpenNonplanar,
}

impl LineKind {
    const ALL: [(Self, &'static str); 3] = [
        (Self::Point, "POINT"),
        (Self::OpenPlanar, "OPEN_PLANAR"),
        (Self::OpenNonplanar, "OPEN_NONPLANAR"),
    ];

    /// The defined term.
    fn term(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, term)| term)
    }
}

/// Points or an open line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// What they are.
    pub kind: LineKind,
    /// LPS, mm.
    pub points: Vec<Point>,
}

/// A region of interest.
#[derive(Clone, Debug, PartialEq)]
pub struct Roi {
    /// ROI Number, unique in its structure set.
    pub number: i64,
    /// ROI Name.
    pub name: String,
    /// RT ROI Interpreted Type (EXTERNAL, ORGAN, ...); empty when it has none.
    pub interpreted_type: String,
    /// ROI Display Color, if it has one.
    pub colour: Option<[u8; 3]>,
    /// UID of the frame of reference it was drawn in.
    pub frame_of_reference: String,
    /// Closed contours in one plane each (CLOSED_PLANAR, CLOSEDPLANAR_XOR), LPS, mm.
    pub contours: Vec<Vec<Point>>,
    /// How contours of one plane go together: exclusive where they are CLOSEDPLANAR_XOR, which then
    /// all have to be.
    pub rule: Rule,
    /// Points and open lines, which enclose nothing.
    pub lines: Vec<Line>,
    /// Contours of types that are not known, which were left out.
    pub unknown_contours: usize,
}

impl Roi {
    /// What its type says, when it is one that matters here.
    pub fn meaning(&self) -> Option<Meaning> {
        (self.interpreted_type == "EXTERNAL").then_some(Meaning::Body)
    }

    /// That some of what is drawn of it encloses nothing, where it has an inside at all.
    pub fn partly_open(&self) -> Option<Warning> {
        enclose_nothing(&self.name, self.lines.len() + self.unknown_contours)
    }

    /// What a user must know of how it is drawn: contours of one plane that cross or lie upon each
    /// other, corners that stray, planes that are left out.
    pub fn oddly_drawn(&self) -> Vec<Warning> {
        oddly_drawn(&self.name, &self.contours, self.rule)
    }
}

/// What a user must know of how a region is drawn: contours of one plane that cross or lie upon
/// each other, corners that stray, planes that are left out.
pub fn oddly_drawn(name: &str, contours: &[Vec<Point>], rule: Rule) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(Overlap { planes, at }) = overlap(contours, rule) {
        let taken = match rule {
            Rule::Joined => "they are taken together; only a contour well within another is a hole",
            Rule::Exclusive => "what two of them hold is taken out (CLOSEDPLANAR_XOR)",
        };
        let text = format!(
            " has contours that cross or lie upon each other in {planes} plane(s), the first through \
             {}: {taken}",
            place(at)
        );
        warnings.push(Warning::new("contours-overlap", "the region ").name(name).text(text));
    }
    if let Some(Stray { number, at, from }) = stray(contours) {
        let text = format!(
            " has a corner at {}, far from the others of its contour {number} about {}: was a \
             coordinate mistyped?",
            place(at),
            place(from)
        );
        warnings.push(Warning::new("contour-strays", "the region ").name(name).text(text));
    }
    if let Some(gap) = undrawn(contours) {
        let made = match gap.is_bridged() {
            true => "filled from the planes beside them",
            false => "too far apart to be filled from the planes beside them",
        };
        let text = format!(
            " is not drawn in {} plane(s) between others (up to {:.1} mm apart, elsewhere {:.1} mm), the \
             first above {}, which are {made}: is a contour missing?",
            gap.planes,
            gap.widest_mm,
            gap.usual_mm,
            place(gap.below)
        );
        warnings.push(Warning::new("contours-gap", "the region ").name(name).text(text));
    }
    warnings
}

fn place([x, y, z]: [f64; 3]) -> String {
    format!("({x:.1}, {y:.1}, {z:.1}) mm")
}

/// The regions of a structure set. It names the patient: not for logs, hence only the regions in
/// its `Debug`.
#[derive(Clone)]
pub struct Structures {
    pub(crate) file: String,
    pub(crate) rois: Vec<Roi>,
    /// All but the contours.
    pub(crate) header: DataSet,
    warnings: Vec<Warning>,
}

impl std::fmt::Debug for Structures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Structures({} regions)", self.rois.len())
    }
}

impl Structures {
    /// The regions, in the order of the file.
    pub fn rois(&self) -> &[Roi] {
        &self.rois
    }

    /// What a user must know of the set as a whole.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Volume and centroid of a region, LPS, mm.
    ///
    /// # Errors
    /// When its contours enclose no volume.
    pub fn enclosed(&self, roi: &Roi) -> Result<Enclosed, Error> {
        enclosed(&roi.contours, roi.rule).map_err(|source| self.contours_of(roi, source))
    }

    /// That a region has a closed contour.
    ///
    /// # Errors
    /// When none has; the first one is named with what it holds instead.
    pub fn refuse_open(&self) -> Result<(), Error> {
        let is_closed = |roi: &Roi| roi.contours.iter().any(|contour| contour.len() >= 3);
        let first = self.rois.iter().find(|roi| !roi.lines.is_empty()).or(self.rois.first());
        match first {
            Some(roi) if !self.rois.iter().any(is_closed) => {
                Err(self.contours_of(roi, ContourError::Empty))
            }
            _ => Ok(()),
        }
    }

    /// That something of a set whose contours have unknown types is left to carry.
    ///
    /// # Errors
    /// When nothing is; the first such region is named.
    pub fn refuse_unknown(&self) -> Result<(), Error> {
        let is_drawn = |roi: &Roi| !(roi.contours.is_empty() && roi.lines.is_empty());
        match self.rois.iter().find(|roi| roi.unknown_contours > 0) {
            Some(roi) if !self.rois.iter().any(is_drawn) => {
                Err(self.contours_of(roi, ContourError::Empty))
            }
            _ => Ok(()),
        }
    }

    fn contours_of(&self, roi: &Roi, source: ContourError) -> Error {
        let lines = roi.lines.len() + roi.unknown_contours;
        let (file, name) = (self.file.clone(), roi.name.clone());
        match source {
            ContourError::Empty if lines > 0 => Error::OpenContours { file, name, lines },
            source => Error::Contours { file, name, source },
        }
    }

    /// The voxels whose centres lie within a region, and what a user must know before trusting
    /// them.
    ///
    /// See [`fill_contours`] for planes between slices and slices between planes.
    /// `frame_of_reference` is that of the CT; a CT that did not come as DICOM has none.
    ///
    /// # Errors
    /// When the region belongs to another frame of reference, or its contours enclose nothing, are
    /// not parallel to the slices or leave a gap.
    pub fn mask(
        &self,
        roi: &Roi,
        grid: &Grid,
        frame_of_reference: Option<&str>,
    ) -> Result<(Volume<bool>, Vec<Warning>), Error> {
        same_frame_of_reference(&self.file, &roi.frame_of_reference, frame_of_reference)?;
        let (mask, filled) = fill_contours(grid, &roi.contours, roi.rule)
            .map_err(|source| self.contours_of(roi, source))?;
        let mut warnings = self.warnings.clone();
        let nothing = filled.degenerate + roi.lines.len() + roi.unknown_contours;
        warnings.extend(enclose_nothing(&roi.name, nothing));
        warnings.extend(roi.oddly_drawn());
        if frame_of_reference.is_none() {
            warnings.push(not_compared());
        }
        Ok((mask, warnings))
    }
}

/// That so many contours of a region enclose nothing.
fn enclose_nothing(name: &str, contours: usize) -> Option<Warning> {
    let count = format!("{contours} contour(s) of the region ");
    let text = " enclose nothing (points, open lines, no known type, or fewer than three corners) and were left out";
    (contours > 0).then(|| Warning::new("contours-enclose-nothing", count).name(name).text(text))
}

/// Reads the regions of a structure set.
///
/// # Errors
/// When the file is no sound structure set, or a contour is not a list of positions.
pub fn read_structures(path: &Path) -> Result<Structures, Error> {
    let mut object = Object::open(path)?;
    let class = object.set.text(tags::SOP_CLASS_UID);
    if class != uids::RT_STRUCTURE_SET_STORAGE {
        return object.unsupported(format!("not a structure set: {}", crate::folder::kind(&class)));
    }
    let sets = object.set.text(tags::SPECIFIC_CHARACTER_SET);
    let (frames, mut nameless) = (frames(&object.set), 0);
    let only_frame = match frames.as_slice() {
        [only] => only.clone(),
        _ => String::new(),
    };
    let mut rois: Vec<Roi> = Vec::new();
    for item in object.set.items(tags::STRUCTURE_SET_ROI_SEQUENCE) {
        let Some(number) = parse_is(&item.text(tags::ROI_NUMBER)) else {
            return object.fail("ROI Number", "is missing or no number");
        };
        if rois.iter().any(|r| r.number == number) {
            return object.fail("ROI Number", format!("{number} is there twice"));
        }
        let frame = item.text(tags::REFERENCED_FRAME_OF_REFERENCE_UID);
        rois.push(Roi {
            number,
            name: readable_in(&sets, item, tags::ROI_NAME),
            interpreted_type: String::new(),
            colour: None,
            frame_of_reference: if frame.is_empty() { only_frame.clone() } else { frame },
            contours: Vec::new(),
            rule: Rule::default(),
            lines: Vec::new(),
            unknown_contours: 0,
        });
    }
    if rois.is_empty() {
        return object.fail("Structure Set ROI Sequence", "holds no region");
    }
    for item in object.set.items(tags::RTROI_OBSERVATIONS_SEQUENCE) {
        if let Some(roi) = referenced(&mut rois, item) {
            roi.interpreted_type = item.text(tags::RTROI_INTERPRETED_TYPE);
        }
    }
    for item in object.set.items(tags::ROI_CONTOUR_SEQUENCE) {
        let Some(roi) = referenced(&mut rois, item) else {
            nameless += item.items(tags::CONTOUR_SEQUENCE).len();
            continue;
        };
        roi.colour = colour(item);
        for contour in item.items(tags::CONTOUR_SEQUENCE) {
            let kind = contour.text(tags::CONTOUR_GEOMETRIC_TYPE);
            let open = LineKind::ALL.iter().find(|(_, term)| *term == kind);
            match (kind.as_str(), open) {
                ("CLOSED_PLANAR" | "CLOSEDPLANAR_XOR", _) => {
                    if kind == "CLOSEDPLANAR_XOR" {
                        roi.rule = Rule::Exclusive;
                    }
                    roi.contours.push(points(&object, &roi.name, contour)?);
                }
                (_, Some(&(kind, _))) => {
                    let points = points(&object, &roi.name, contour)?;
                    roi.lines.push(Line { kind, points });
                }
                (_, None) => roi.unknown_contours += 1,
            }
        }
    }
    object.set.remove(tags::ROI_CONTOUR_SEQUENCE);
    let mut warnings = of_the_set(&rois, nameless, &frames);
    warnings.extend(object.told_behind());
    Ok(Structures { file: object.file, rois, header: object.set, warnings })
}

/// The frames of reference that a structure set names as a whole: in its Referenced Frame of
/// Reference Sequence, else as its own. Where it is one, regions were drawn there that do not say
/// so themselves.
fn frames(set: &DataSet) -> Vec<String> {
    let named = set.items(tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE);
    let mut all: Vec<String> =
        named.iter().map(|item| item.text(tags::FRAME_OF_REFERENCE_UID)).collect();
    if all.is_empty() {
        all.push(set.text(tags::FRAME_OF_REFERENCE_UID));
    }
    all.retain(|uid| !uid.is_empty());
    all.sort();
    all.dedup();
    all
}

/// What a user must know of a structure set as a whole: `nameless` of its contours name a region
/// that it does not have, and it names `frames`.
fn of_the_set(rois: &[Roi], nameless: usize, frames: &[String]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if nameless > 0 {
        let text = format!(
            "{nameless} contour(s) name a region that the structure set does not have; they are left out"
        );
        warnings.push(Warning::new("contours-of-no-region", text));
    }
    let contradicts = |roi: &&Roi| {
        let frame = &roi.frame_of_reference;
        !frames.is_empty() && !frame.is_empty() && !frames.contains(frame)
    };
    if let Some(roi) = rois.iter().find(contradicts) {
        warnings.push(Warning::new("frame-contradicts", "the region ").name(&roi.name).text(
            " names a frame of reference that its structure set does not: it is taken where the region says",
        ));
    }
    warnings
}

/// The region that an item belongs to.
fn referenced<'a>(rois: &'a mut [Roi], item: &DataSet) -> Option<&'a mut Roi> {
    let number = parse_is(&item.text(tags::REFERENCED_ROI_NUMBER))?;
    rois.iter_mut().find(|r| r.number == number)
}

fn colour(item: &DataSet) -> Option<[u8; 3]> {
    let texts = item.texts(tags::ROI_DISPLAY_COLOR);
    let values: Option<Vec<u8>> =
        texts.iter().map(|t| parse_is(t).and_then(|v| u8::try_from(v).ok())).collect();
    values?.try_into().ok()
}

/// The corners of a contour.
fn points(object: &Object, name: &str, contour: &DataSet) -> Result<Vec<Point>, Error> {
    let text = text_of(contour.bytes(tags::CONTOUR_DATA).unwrap_or_default());
    let values = text.split('\\').filter(|_| !text.is_empty());
    let numbers: Option<Vec<f64>> = values.map(parse_ds).collect();
    match numbers {
        Some(numbers) if numbers.len() % 3 == 0 => {
            let offset = offset(object, name, contour)?;
            let corner = |p: &[f64]| Point::new(p[0], p[1], p[2]) + offset;
            Ok(numbers.chunks_exact(3).map(corner).collect())
        }
        Some(numbers) => {
            let reason = format!(
                "of the region {name:?} holds {} numbers, not three per point",
                numbers.len()
            );
            object.fail("Contour Data", reason)
        }
        None => {
            object.fail("Contour Data", format!("of the region {name:?} is not a list of numbers"))
        }
    }
}

/// Contour Offset Vector, retired but read.
const CONTOUR_OFFSET_VECTOR: Tag = Tag(0x3006, 0x0045);

/// What a contour is moved by from where its corners are written (Contour Offset Vector, PS3.3
/// C.8.8.6.2), mm.
fn offset(object: &Object, name: &str, contour: &DataSet) -> Result<Vector, Error> {
    let texts = contour.texts(CONTOUR_OFFSET_VECTOR);
    let numbers: Option<Vec<f64>> = texts.iter().map(|text| parse_ds(text)).collect();
    match numbers.as_deref() {
        Some([]) => Ok(Vector::zeros()),
        Some(&[x, y, z]) => Ok(Vector::new(x, y, z)),
        _ => object
            .fail("Contour Offset Vector", format!("of the region {name:?} is not three numbers")),
    }
}
