//! File formats beside DICOM: NRRD, NIfTI, MetaImage, meshes, Slicer markups and point lists.
//!
//! Everything handed out is in the DICOM patient frame LPS, mm, whatever the file says; a file that
//! does not say which way its axes point is refused, for left and right cannot be guessed. Only
//! scans and their landmarks stay in the frame of the scanner. What is written goes to a temporary
//! name in the same folder first and then takes its final name, so that nothing half-written is
//! ever found. The same input gives the same bytes.
//!
//! | Format | Reads | Writes |
//! |---|---|---|
//! | NRRD (`.nrrd`) | [`read_ct`], [`read_labels`], [`read_tenths`], [`read_seeds`], [`read_any_volume`] | [`write_ct_nrrd`], [`write_labels`], [`write_field`], [`write_scalar`], [`write_tenths`], [`write_label_layers`] |
//! | Slicer segmentation (`.seg.nrrd`) | [`read_labels`], [`read_seeds`], [`read_any_volume`] | [`write_labels`], [`write_label_layers`] |
//! | NIfTI-1 (`.nii`, `.nii.gz`) | [`read_ct`], [`read_labels`], [`read_seeds`], [`read_any_volume`] | [`write_ct_nifti`], [`write_labels`], [`write_label_layers`], [`write_field`], [`write_scalar`] |
//! | MetaImage (`.mha`; `.mhd` read only) | [`read_ct`], [`read_labels`], [`read_seeds`], [`read_any_volume`] | [`write_ct`], [`write_labels`], [`write_label_layers`], [`write_field`], [`write_scalar`] |
//! | ITK transform (`.mat`, MATLAB level 4) | | [`write_transform`] |
//! | VTK XML unstructured grid (`.vtu`) | [`read_vtu`] | [`write_vtu`] |
//! | Gmsh MSH 4.1 (`.msh`) | [`read_mesh`] | [`write_mesh`] |
//! | FEBio 4 (`.feb`), Abaqus and CalculiX (`.inp`) | | [`write_problem`] |
//! | Closed surfaces: STL, PLY, OBJ | [`read_surface`] | [`write_surface`] |
//! | Surface scans: STL, PLY, OBJ | [`read_scan`] | |
//! | Landmarks of scans and CT (`.json`) | [`read_landmarks`] | |
//! | Slicer markups (`.mrk.json`) | [`read_points`], [`read_seeds`] | [`write_points`] |
//! | CSV of a scan's distances | [`read_scan_distances`] | [`write_scan_distances`] |
//! | CSV `name,x,y,z` | [`read_points`], [`read_seeds`] | [`write_points`] |
//! | CSV `structure,contour,x,y,z` | [`read_contours`] | [`write_contours`] |
//!
//! # Example
//!
//! ```
//! use supine_exchange::{NamedPoint, read_points, write_points};
//! use supine_space::Point;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("points.mrk.json");
//! let clip = NamedPoint { name: "clip".into(), position: Point::new(91.4, -248.1, -594.5) };
//! write_points(&[clip], &path)?;
//! assert_eq!(read_points(&path)?[0].name, "clip");
//! # Ok(())
//! # }
//! ```

#![expect(clippy::disallowed_methods, reason = "edge crate: files")]

mod carried;
mod contours;
mod elements;
mod error;
mod feb;
mod file;
mod inp;
mod itk;
mod labels;
mod landmarks;
mod markups;
mod meshes;
mod mha;
mod msh;
mod nii;
mod nodes;
mod nrrd;
mod points;
mod raster;
mod raster_file;
mod scalar;
mod scan_distances;
mod seeds;
mod surfaces;
mod table;
mod volumes;
mod vtu;

pub use carried::{AnyVolume, LabelLayers, VolumeKind, read_any_volume, write_label_layers};
pub use contours::{NamedContours, is_contours, read_contours, write_contours};
pub use error::{Error, Problem};
pub use itk::write_transform;
pub use labels::{Segments, SuppliedLabels, read_labels, read_supplied_labels, write_labels};
pub use landmarks::{Landmarks, read_landmarks};
pub use meshes::{
    MeshFile, Spring, Statics, read_mesh, write_mesh, write_mesh_fields, write_problem,
};
pub use points::{NamedPoint, is_points_name, read_points, write_points};
pub use raster_file::{is_volume_elsewhere, is_volume_name, volume_files};
pub use scan_distances::{read_scan_distances, write_scan_distances};
pub use seeds::read_seeds;
pub use surfaces::{LengthUnit, ScanFile, SurfaceFrame, read_scan, read_surface, write_surface};
pub use volumes::{
    CtFile, FieldKind, read_ct, read_signed_distance, read_tenths, write_ct, write_ct_nifti,
    write_ct_nrrd, write_field, write_scalar, write_signed_distance, write_tenths,
};
pub use vtu::{read_vtu, write_vtu};
