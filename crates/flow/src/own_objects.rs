//! The patient's own doses and structures that a case carries along, as they are held: for those
//! who show them.

use crate::nodes::{Moved, MovedObjects, Objects};
use crate::session::{Freshness, Request, Session};
use crate::shared::carry::{Given, GivenObject, MovedObject, NOT_ANEW, max_gy};
use crate::{Error, NodeId};
use std::sync::Arc;
use supine_dicom::Segmentation;
use supine_report::DoseVolumeHistogram;
use supine_space::Point;
use supine_volume::Volume;

/// Doses and structures as they were given and, where that is held, where the tissue carries them.
#[derive(Clone, Debug)]
pub struct OwnObjects {
    given: Arc<Vec<GivenObject>>,
    /// Names of their files.
    files: Vec<String>,
    moved: Option<Arc<Moved>>,
    /// Whether what was moved is of what is given now.
    fresh: bool,
}

/// Closed contours in planes of the CT, LPS, mm; inner ones are holes.
pub type Contours = [Vec<Point>];

/// A region of a structure set.
#[derive(Clone, Copy, Debug)]
pub struct OwnStructure<'a> {
    /// Name of its file.
    pub file: &'a str,
    /// Its name, as an exported object may have it.
    pub name: &'a str,
    /// Its colour in its file (ROI Display Color), red, green and blue.
    pub colour: Option<[u8; 3]>,
    /// As it was drawn.
    pub before: &'a Contours,
    /// Where the tissue carries it.
    pub after: Option<&'a Contours>,
    /// Before and after, ml; nothing before it was carried.
    pub volume_ml: Option<[f64; 2]>,
}

/// A dose, Gy.
#[derive(Clone, Copy, Debug)]
pub struct OwnDose<'a> {
    /// Name of its file.
    pub file: &'a str,
    /// As it was given.
    pub before: &'a Volume<f32>,
    /// Where the tissue carries it.
    pub after: Option<&'a Volume<f32>>,
}

/// A segment of a segmentation on the voxels of the CT.
#[derive(Clone, Copy, Debug)]
pub struct OwnSegment<'a> {
    /// Name of its file.
    pub file: &'a str,
    /// Its name.
    pub name: &'a str,
    given: &'a Segmentation,
    number: u16,
    /// Where the tissue carries it.
    pub after: Option<&'a Volume<bool>>,
    /// Before and after, ml; nothing before it was carried.
    pub volume_ml: Option<[f64; 2]>,
}

impl Session {
    /// The patient's own objects where the tissue carries them; nothing when the case names none.
    ///
    /// # Errors
    /// When one cannot be used, a stage fails, or the observer ends the work.
    pub fn objects(&self, request: &Request<'_>) -> Result<Option<OwnObjects>, Error> {
        let both = [NodeId::Objects, NodeId::MovedObjects];
        self.bring(&both, &both, request)?;
        Ok(self.peek_objects())
    }

    /// The patient's own objects that are held, of the files that the case names now; nothing is
    /// read or made.
    pub fn peek_objects(&self) -> Option<OwnObjects> {
        let (given, freshness) = self.peek::<Objects>()?;
        if given.is_empty() || freshness != Freshness::Fresh {
            return None;
        }
        let moved = self.peek::<MovedObjects>();
        // What was carried of other objects is nothing beside these.
        let moved = moved
            .filter(|(moved, of)| *of == Freshness::Fresh || same_objects(&given, &moved.objects));
        let fresh = moved.as_ref().is_none_or(|(_, of)| *of == Freshness::Fresh);
        let name = |file: &crate::CarriedFile| {
            file.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        let files = self.case().carried.iter().map(name).collect();
        Some(OwnObjects { given, files, moved: moved.map(|(moved, _)| moved), fresh })
    }
}

/// Whether what was moved may be these: one by one of one kind and with as many regions.
fn same_objects(given: &[GivenObject], moved: &[MovedObject]) -> bool {
    let fits = |(given, moved): (&GivenObject, &MovedObject)| match (&given.what, moved) {
        (Given::Dose(given), MovedObject::Dose(moved, _)) => {
            given.volume().grid() == moved.carried.grid()
        }
        (Given::Structures(_, closed), MovedObject::Structures(carried, _)) => {
            let names = |all: &[supine_exchange::NamedContours]| -> Vec<String> {
                all.iter().map(|one| one.name.clone()).collect()
            };
            names(closed) == names(&carried.structures)
        }
        (Given::Segmentation(_), MovedObject::Segmentation(_)) => true,
        _ => false,
    };
    given.len() == moved.len() && given.iter().zip(moved).all(fits)
}

/// Whether they are the same in memory.
impl PartialEq for OwnObjects {
    fn eq(&self, other: &Self) -> bool {
        let moved = match (&self.moved, &other.moved) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        moved && Arc::ptr_eq(&self.given, &other.given) && self.fresh == other.fresh
    }
}

impl OwnSegment<'_> {
    /// As it was given.
    pub fn before(&self) -> Volume<bool> {
        self.given.mask(self.number)
    }
}

impl OwnDose<'_> {
    /// Largest dose before and after, Gy.
    pub fn max_gy(&self) -> [Option<f64>; 2] {
        [Some(max_gy(self.before)), self.after.map(max_gy)]
    }
}

impl OwnObjects {
    /// Whether all that was carried is of what is given now; true before anything was.
    pub fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// What was given and moved, with the name of its file.
    fn all(&self) -> impl Iterator<Item = (&str, &GivenObject, Option<&MovedObject>)> {
        let moved = |n: usize| self.moved.as_ref().and_then(|moved| moved.objects.get(n));
        let file = |n: usize| self.files.get(n).map_or("", String::as_str);
        self.given.iter().enumerate().map(move |(n, given)| (file(n), given, moved(n)))
    }

    /// The regions that have contours, in their order.
    pub fn structures(&self) -> impl Iterator<Item = OwnStructure<'_>> {
        self.all().flat_map(|(file, given, moved)| {
            let (rois, closed) = match &given.what {
                Given::Structures(given, closed) => (given.rois(), closed.as_slice()),
                _ => (&[][..], &[][..]),
            };
            let carried = match moved {
                Some(MovedObject::Structures(carried, _)) => Some(carried),
                _ => None,
            };
            closed.iter().enumerate().filter(|(_, one)| !one.contours.is_empty()).map(
                move |(n, one)| OwnStructure {
                    file,
                    name: &one.name,
                    colour: rois.get(n).and_then(|roi| roi.colour),
                    before: &one.contours,
                    after: carried.map(|all| all.structures[n].contours.as_slice()),
                    volume_ml: carried.and_then(|all| {
                        all.moved.iter().find(|(of, _)| *of == n).map(|(_, facts)| facts.volume_ml)
                    }),
                },
            )
        })
    }

    /// The doses, in their order.
    pub fn doses(&self) -> impl Iterator<Item = OwnDose<'_>> {
        self.all().filter_map(|(file, given, moved)| {
            let Given::Dose(dose) = &given.what else { return None };
            let after = match moved {
                Some(MovedObject::Dose(moved, _)) => Some(&moved.carried),
                _ => None,
            };
            Some(OwnDose { file, before: dose.volume(), after })
        })
    }

    /// The segments, in their order.
    pub fn segments(&self) -> impl Iterator<Item = OwnSegment<'_>> {
        self.all().flat_map(|(file, given, moved)| {
            let carried = match moved {
                Some(MovedObject::Segmentation(carried)) => Some(carried),
                _ => None,
            };
            let given = match &given.what {
                Given::Segmentation(given) => Some(given),
                _ => None,
            };
            let all = given.into_iter().flat_map(|given| {
                given.segments().iter().map(move |one| (given, one.name.as_str(), one.number))
            });
            all.enumerate().map(move |(n, (given, name, number))| OwnSegment {
                file,
                name,
                given,
                number,
                after: carried.map(|all| &all.masks[n]),
                volume_ml: carried.map(|all| [all.regions[n].before_ml, all.regions[n].after_ml]),
            })
        })
    }

    /// Dose and volume of every structure before and after, once they were carried.
    pub fn histograms(&self) -> &[DoseVolumeHistogram] {
        self.moved.as_ref().map_or(&[], |moved| &moved.histograms)
    }

    /// What a user has to know of them. That a dose was carried is told once it was.
    pub fn notes(&self) -> Vec<String> {
        let carried = self.moved.is_some();
        let of = self.given.iter().flat_map(|given| &given.warnings);
        let of = of.filter(|warning| carried || warning.code() != NOT_ANEW);
        let more = self.moved.iter().flat_map(|moved| &moved.warnings);
        let mut all: Vec<String> = of.chain(more).map(ToString::to_string).collect();
        all.dedup();
        all
    }
}
