//! Deformable Spatial Registration (PS3.3 A.39.2, C.20.3): where the tissue of each place was.

use super::{UNIT, identity, put_content};
use crate::companion::{CompanionParams, Kind, ObjectReference, common, put_series, slices, write};
use crate::data_set::{DataSet, Value};
use crate::error::Error;
use crate::number::{format_ds, parse_ds_list};
use crate::object::Object;
use crate::series::Place;
use crate::source::Source;
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;
use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::Volume;

const KIND: Kind = Kind {
    class: uids::DEFORMABLE_SPATIAL_REGISTRATION_STORAGE,
    modality: "REG",
    role: "deformable registration",
};
const GRID: &str = "Deformable Registration Grid Sequence";

/// A deformable registration with one grid.
#[derive(Clone, Debug)]
pub struct Deformable {
    /// The object itself.
    pub object: ObjectReference,
    /// Frame of Reference UID in which the grid lies (Registered RCS): that of the deformed CT.
    pub registered_frame_uid: String,
    /// Frame of Reference UID to which the vectors lead (Source RCS): that of the CT.
    pub source_frame_uid: String,
    /// From a place in the registered frame to the place in the source frame, mm.
    pub vectors: Volume<[f32; 3]>,
}

/// Writes the map from the deformed CT to the CT into the file `path`.
///
/// `vectors` lead from a place in the deformed CT to where its tissue was (LPS, mm):
/// P_source = P_registered + D (C.20.3.1.1, both matrices the identity). Float 32, little endian.
///
/// # Errors
/// When a vector is not finite, the grid is left-handed or too large, a text does not fit its
/// attribute, or the file cannot be written or does not read back. Nothing is left then.
pub fn write_deformable(
    vectors: &Volume<[f32; 3]>,
    source: &Source,
    deformed: &Source,
    params: &CompanionParams,
    path: &Path,
) -> Result<ObjectReference, Error> {
    let mut set = common(deformed, params, (&KIND, Place::DeformableRegistration))?;
    put_content(&mut set, (deformed, params), "DEFORMED", "from the deformed CT to the CT");
    let mut item = DataSet::default();
    let frame = source.frame_of_reference_uid();
    item.put_text(tags::SOURCE_FRAME_OF_REFERENCE_UID, VR::UI, &frame);
    item.put_items(tags::REFERENCED_IMAGE_SEQUENCE, slices(source));
    item.put_items(tags::REGISTRATION_TYPE_CODE_SEQUENCE, Vec::new());
    item.put_items(tags::PRE_DEFORMATION_MATRIX_REGISTRATION_SEQUENCE, vec![identity()]);
    item.put_items(tags::POST_DEFORMATION_MATRIX_REGISTRATION_SEQUENCE, vec![identity()]);
    item.put_items(tags::DEFORMABLE_REGISTRATION_GRID_SEQUENCE, vec![grid_item(vectors)?]);
    set.put_items(tags::DEFORMABLE_REGISTRATION_SEQUENCE, vec![item]);
    put_series(&mut set, &[source]);
    write(set, params, &KIND, path, |written| {
        let read = read_deformable(written).map_err(|e| e.to_string())?;
        let (a, b) = (read.vectors.grid(), vectors.grid());
        let last = b.size().map(|n| n - 1);
        let off = |v| (a.centre(v) - b.centre(v)).norm();
        if a.size() != b.size() || off([0; 3]).max(off(last)) > 1e-6 {
            return Err("the grid differs".into());
        }
        if read.vectors.data() != vectors.data() {
            return Err("the vectors differ".into());
        }
        Ok(())
    })
}

/// The grid: sizes and resolutions by x, y, z of the grid (not row before column, as in Pixel
/// Spacing), vectors in patient axes, x of the grid fastest (C.20.3.1.2 and .3).
fn grid_item(vectors: &Volume<[f32; 3]>) -> Result<DataSet, Error> {
    let refused = |reason: &str| Err(Error::OtherGrid { reason: reason.into() });
    let (grid, [x, y, z]) = (vectors.grid(), vectors.grid().size());
    if grid.direction().determinant() < 0.0 {
        return refused("its planes do not follow each other along row x column direction");
    }
    if vectors.data().iter().flatten().any(|c| !c.is_finite()) {
        return refused("a vector is not finite");
    }
    let sizes: Result<Vec<u32>, _> = [x, y, z].iter().map(|n| u32::try_from(*n)).collect();
    // The value of an element is shorter than 2^32 bytes (PS3.5 7.1).
    let (Ok(sizes), true) = (sizes, x as u128 * y as u128 * z as u128 * 12 < 0xFFFF_FFF0) else {
        return refused("it has too many places");
    };
    let joined = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|v| format_ds(*v)).collect();
        texts.join("\\")
    };
    let [row, column] = [0, 1].map(|axis| grid.direction().column(axis).into_owned());
    let cosines = joined(&[row.as_slice(), column.as_slice()].concat());
    let origin = joined(grid.origin().coords.as_slice());
    let mut item = DataSet::default();
    item.put_text(tags::IMAGE_POSITION_PATIENT, VR::DS, &origin);
    item.put_text(tags::IMAGE_ORIENTATION_PATIENT, VR::DS, &cosines);
    let bytes = sizes.iter().flat_map(|n| n.to_le_bytes()).collect();
    item.put(tags::GRID_DIMENSIONS, VR::UL, Value::Bytes(bytes));
    let bytes = grid.spacing().iter().flat_map(|mm| mm.to_le_bytes()).collect();
    item.put(tags::GRID_RESOLUTION, VR::FD, Value::Bytes(bytes));
    let bytes = vectors.data().iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    item.put(tags::VECTOR_GRID_DATA, VR::OF, Value::Bytes(bytes));
    Ok(item)
}

/// Reads a deformable registration of one grid, without matrices besides it.
///
/// # Errors
/// When the file is no sound registration of this kind.
pub fn read_deformable(path: &Path) -> Result<Deformable, Error> {
    let object = Object::open(path)?;
    let set = &object.set;
    let class = set.text(tags::SOP_CLASS_UID);
    if class != KIND.class {
        let what = format!("not a deformable registration: {}", crate::folder::kind(&class));
        return object.unsupported(what);
    }
    let [item] = set.items(tags::DEFORMABLE_REGISTRATION_SEQUENCE) else {
        return object.fail("Deformable Registration Sequence", "does not hold one item");
    };
    for tag in [
        tags::PRE_DEFORMATION_MATRIX_REGISTRATION_SEQUENCE,
        tags::POST_DEFORMATION_MATRIX_REGISTRATION_SEQUENCE,
    ] {
        let matrices = item.items(tag).iter();
        let mut texts = matrices.map(|m| m.texts(tags::FRAME_OF_REFERENCE_TRANSFORMATION_MATRIX));
        if texts.any(|t| parse_ds_list(&t) != Some(UNIT)) {
            return object.unsupported("a registration with a matrix besides its grid");
        }
    }
    let [grid] = item.items(tags::DEFORMABLE_REGISTRATION_GRID_SEQUENCE) else {
        return object.fail(GRID, "does not hold one item");
    };
    let vectors = vectors(&object, grid)?;
    Ok(Deformable {
        object: ObjectReference {
            class_uid: class,
            instance_uid: set.text(tags::SOP_INSTANCE_UID),
            series_uid: set.text(tags::SERIES_INSTANCE_UID),
        },
        registered_frame_uid: set.text(tags::FRAME_OF_REFERENCE_UID),
        source_frame_uid: item.text(tags::SOURCE_FRAME_OF_REFERENCE_UID),
        vectors,
    })
}

fn vectors(object: &Object, item: &DataSet) -> Result<Volume<[f32; 3]>, Error> {
    let words = |tag| -> Vec<u8> { item.bytes(tag).unwrap_or_default().to_vec() };
    let (sizes, steps) = (words(tags::GRID_DIMENSIONS), words(tags::GRID_RESOLUTION));
    let position: Option<[f64; 3]> = parse_ds_list(&item.texts(tags::IMAGE_POSITION_PATIENT));
    let cosines: Option<[f64; 6]> = parse_ds_list(&item.texts(tags::IMAGE_ORIENTATION_PATIENT));
    let (12, 24, Some(position), Some([a, b, c, d, e, f])) =
        (sizes.len(), steps.len(), position, cosines)
    else {
        return object.fail(GRID, "lacks its position, orientation, sizes or resolutions");
    };
    let size = [0, 1, 2].map(|n| {
        let four = [sizes[4 * n], sizes[4 * n + 1], sizes[4 * n + 2], sizes[4 * n + 3]];
        u32::from_le_bytes(four) as usize
    });
    let mut mm = [0.0; 3];
    for (mm, bytes) in mm.iter_mut().zip(steps.chunks_exact(8)) {
        let mut eight = [0; 8];
        eight.copy_from_slice(bytes);
        *mm = f64::from_le_bytes(eight);
    }
    let bytes = item.bytes(tags::VECTOR_GRID_DATA).unwrap_or_default();
    let needed = size.iter().fold(12u128, |all, n| all.saturating_mul(*n as u128));
    if bytes.len() as u128 != needed {
        let reason = format!("has {} bytes, {size:?} vectors need {needed}", bytes.len());
        return object.fail("Vector Grid Data", reason);
    }
    let (row, column) = (Vector::new(a, b, c), Vector::new(d, e, f));
    let direction = Matrix::from_columns(&[row, column, row.cross(&column)]);
    let grid = Grid::new(size, Vector::from(mm), Point::from(position), direction)?;
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let data = bytes.chunks_exact(12).map(|v| [0, 1, 2].map(|c| number(&v[4 * c..4 * c + 4])));
    Volume::new(grid, data.collect())
        .or_else(|e| object.fail("Vector Grid Data", format!("does not fill the grid: {e}")))
}
