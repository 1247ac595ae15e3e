//! What several nodes and commands use.

pub(crate) mod carry;
mod coarse;
mod ct;
mod export_source;
mod facts;
mod labels;
mod mesher;
mod moduli;
pub(crate) mod own_model;
mod own_regions;
mod patient;
mod readings;
mod refine;
mod registration;
mod scans;
mod search;
mod skin;
mod statics;
mod surfaces;
mod texts;
mod tumour;

pub use carry::{CarriedFile, CarriedKind};
pub use coarse::coarsen_run;
pub use ct::{CtInput, read_ct};
pub(crate) use export_source::random;
pub use export_source::{ExportSource, forgetful_anonymiser};
pub use facts::{mesh_facts, warning_id};
pub(crate) use facts::{movement, told};
pub use labels::{
    LabelOrigin, RegionNameError, RegionNames, SuppliedLabels, read_supplied, write_dicom_labels,
};
pub use mesher::{Fill, Filled, Mesher, Solid, mesh_region};
pub(crate) use moduli::{Map as TissueMap, moduli, shares};
pub(crate) use own_regions::{OwnRegions, write_own_regions};
pub(crate) use patient::{compare_patient, names_a_patient, of_the_patient};
pub(crate) use readings::{bounds, contours_placed, would_lie_in};
pub use refine::{Goal, Refine};
pub(crate) use registration::DEFORMABLE;
pub use registration::{REGISTRATIONS, RegisteredSeries, write_registration};
pub(crate) use scans::{PosedScan, SeenScan, landmarks, read_scans};
pub use search::{Effort, Found, Try, by_edge_length};
pub(crate) use skin::{other_breast, skin_distance};
pub use statics::statics;
pub(crate) use supine_exchange::is_volume_name as is_volume;
pub use surfaces::{SURFACES, read_surfaces, write_surfaces};
pub(crate) use texts::{IMAGE_COMMENTS, derivation, series_description};
pub(crate) use tumour::{PlacedTumour, TumourCache, drawn, of_the_ct};
pub use tumour::{tumour_centre, tumour_regions};
