//! The tumour from a region of a structure set.

use crate::Error;
use crate::inputs::InputFile;
use crate::nearest::nearest;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use supine_dicom::{Source, Structures, read_structures};
use supine_space::{Sphere, Warning};

/// Names of regions told in one message.
const TOLD: usize = 20;

/// Where the tumour is.
#[derive(Clone, Debug)]
pub(crate) struct PlacedTumour {
    /// LPS, mm.
    pub(crate) sphere: Sphere,
    /// The structure set that it came from, and the frame of reference of its region.
    pub(crate) drawn: Option<(InputFile, String)>,
    /// What is odd about how it was drawn.
    pub(crate) warnings: Vec<Warning>,
}

/// The sphere of a region, and its frame of reference.
type Drawn = (Sphere, String);

/// Tumours that were found in structure sets, by the hash of the file and the name of the region:
/// nodes ask often, and a file may hold hundreds of thousands of points.
#[derive(Debug, Default)]
pub(crate) struct TumourCache(Mutex<Known>);

/// What was found, and what is odd about how it was drawn, by the hash of the file and the name of
/// the region.
type Known = BTreeMap<(String, String), (Drawn, Vec<Warning>)>;

impl TumourCache {
    /// The tumour that a region of a structure set is: the sphere of its volume about its centroid.
    ///
    /// # Errors
    /// When the file is no structure set, has no such region, or the region encloses no volume.
    pub(crate) fn place(&self, name: &str, file: InputFile) -> Result<PlacedTumour, Error> {
        let key = (file.hash().to_owned(), name.to_owned());
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let ((sphere, frame), warnings) = match known.get(&key) {
            Some(drawn) => drawn.clone(),
            None => {
                let structures = read_structures(&file.path).map_err(Error::TumourFile)?;
                file.check_unchanged()?;
                let tumour = drawn(&structures, name)?;
                let of_it = structures.rois().iter().filter(|roi| roi.name == name);
                let odd =
                    of_it.flat_map(|roi| roi.partly_open().into_iter().chain(roi.oddly_drawn()));
                let odd = structures.warnings().iter().cloned().chain(odd).collect();
                known.entry(key).or_insert((tumour, odd)).clone()
            }
        };
        Ok(PlacedTumour { sphere, drawn: Some((file, frame)), warnings })
    }
}

/// The sphere of the volume of a region about its centroid, and the frame of reference of the
/// region.
///
/// # Errors
/// When no region or several have this name, or its contours enclose no volume.
pub(crate) fn drawn(structures: &Structures, name: &str) -> Result<Drawn, Error> {
    let named: Vec<_> = structures.rois().iter().filter(|roi| roi.name == name).collect();
    let [roi] = named.as_slice() else {
        let names: Vec<&str> = structures.rois().iter().map(|roi| roi.name.as_str()).collect();
        return Err(Error::TumourName(not_one(name, named.len(), &names)));
    };
    let enclosed = structures.enclosed(roi).map_err(Error::TumourFile)?;
    let sphere = Sphere::new(enclosed.centroid, enclosed.radius());
    let sphere = sphere.map_err(|e| Error::TumourName(format!("{name:?}: {e}")))?;
    Ok((sphere, roi.frame_of_reference.clone()))
}

/// Names of the regions of a structure set that can be the tumour: those with contours whose name
/// no other has.
///
/// # Errors
/// When the file is no structure set.
pub fn tumour_regions(path: &Path) -> Result<Vec<String>, Error> {
    let structures = read_structures(path).map_err(Error::TumourFile)?;
    let (all, same) = (structures.rois(), |name: &str| {
        structures.rois().iter().filter(|roi| roi.name == name).count()
    });
    let usable = all.iter().filter(|roi| !roi.contours.is_empty() && same(&roi.name) == 1);
    Ok(usable.map(|roi| roi.name.clone()).collect())
}

/// The centroid of a region of a structure set, LPS, mm.
///
/// # Errors
/// When the file is no structure set, has no such region, or the region encloses no volume.
pub fn tumour_centre(path: &Path, region: &str) -> Result<[f64; 3], Error> {
    let structures = read_structures(path).map_err(Error::TumourFile)?;
    let (sphere, _) = drawn(&structures, region)?;
    Ok(sphere.centre().coords.into())
}

fn not_one(name: &str, times: usize, names: &[&str]) -> String {
    if times > 1 {
        return format!(
            "{times} regions of the file are called {name:?}: give them different names"
        );
    }
    let near = nearest(name, names.iter().copied());
    let hint = near.map_or(String::new(), |near| format!(": did you mean {near:?}?"));
    let mut listed: Vec<String> = names.iter().take(TOLD).map(|n| format!("{n:?}")).collect();
    if names.len() > TOLD {
        listed.push(format!("{} more", names.len() - TOLD));
    }
    format!("no region of the file is called {name:?}{hint} There are {}", listed.join(", "))
}

/// That a region was drawn on this CT, by the frame of reference; a warning where that cannot be
/// told.
///
/// # Errors
/// When it was drawn on another scan.
pub(crate) fn of_the_ct(frame: &str, ct: Option<&Source>) -> Result<Option<Warning>, Error> {
    let text = match ct.map(Source::frame_of_reference_uid) {
        Some(of_ct) if of_ct == frame => return Ok(None),
        Some(of_ct) if !of_ct.is_empty() && frame.is_empty() => return Err(no_frame()),
        Some(of_ct) if !of_ct.is_empty() => return Err(other_scan()),
        _ => {
            "the CT has no frame of reference: that the tumour's structure set belongs to it was not checked"
        }
    };
    Ok(Some(Warning::new("tumour-frame-unknown", text)))
}

/// Said of a structure set whose region names no frame of reference.
fn no_frame() -> Error {
    Error::TumourName(
        "the structure set does not say on which scan the region was drawn (its Referenced Frame of Reference UID is empty): \
         export it again with it, or give tumour.centre and tumour.radius"
            .into(),
    )
}

/// Said of a structure set of another CT.
pub(crate) fn other_scan() -> Error {
    Error::TumourName(
        "the structure set was drawn on another scan (Frame of Reference UID is not that of the CT): take the one \
         of this CT, or register it to this CT first"
            .into(),
    )
}
