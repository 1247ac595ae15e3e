//! The labels of a [`crate::LabelMap`].
//!
//! 1 and 2 are what the mesher and the mechanics need; the finer labels are optional and lie
//! within them: lung, bone and muscle within the chest wall, fat, gland, skin, tumour and implant
//! within the soft tissue.

use crate::{LabelMap, Volume};
use supine_space::Grid;

/// Air, table, clothes, wires: not the patient.
pub const OUTSIDE: u8 = 0;
/// All between skin and chest wall, skin included.
pub const SOFT_TISSUE: u8 = 1;
/// Ribs, intercostals, pectoralis major and minor and all they enclose: one rigid body.
pub const CHEST_WALL: u8 = 2;
/// Lung, within the chest wall.
pub const LUNG: u8 = 3;
/// Bone, within the chest wall.
pub const BONE: u8 = 4;
/// Muscle, within the chest wall.
pub const MUSCLE: u8 = 5;
/// Fat, within the soft tissue.
pub const FAT: u8 = 6;
/// Gland, within the soft tissue.
pub const GLAND: u8 = 7;
/// Skin, within the soft tissue.
pub const SKIN: u8 = 8;
/// Tumour, within the soft tissue.
pub const TUMOUR: u8 = 9;
/// Breast implant, within the soft tissue.
pub const IMPLANT: u8 = 10;

/// Every label with its name, as files and reports show it, and its colour (sRGB).
pub const ALL: [(u8, &str, [u8; 3]); 10] = [
    (SOFT_TISSUE, "soft tissue", [232, 170, 120]),
    (CHEST_WALL, "chest wall", [178, 64, 64]),
    (LUNG, "lung", [120, 170, 220]),
    (BONE, "bone", [240, 230, 200]),
    (MUSCLE, "muscle", [150, 50, 60]),
    (FAT, "fat", [250, 220, 120]),
    (GLAND, "gland", [240, 160, 190]),
    (SKIN, "skin", [210, 150, 110]),
    (TUMOUR, "tumour", [220, 40, 160]),
    (IMPLANT, "implant", [90, 200, 170]),
];

/// A term of SNOMED CT: its code and what that means.
pub type Term = (&'static str, &'static str);

const TISSUE: Term = ("85756007", "Tissue");
const STRUCTURE: Term = ("91723000", "Anatomical Structure");
const OBJECT: Term = ("260787004", "Physical object");
const ABNORMAL: Term = ("49755003", "Morphologically Abnormal Structure");

/// Category and type of every label, as DICOM lists them for segmentations (PS3.16 CID 7150
/// categories, CID 7151 and 7163 types).
const TERMS: [(u8, Term, Term); 10] = [
    (SOFT_TISSUE, TISSUE, ("87784001", "Soft tissue")),
    (CHEST_WALL, STRUCTURE, ("78904004", "Chest wall")),
    (LUNG, STRUCTURE, ("39607008", "Lung")),
    (BONE, TISSUE, ("3138006", "Bone")),
    (MUSCLE, TISSUE, ("91727004", "Muscle")),
    (FAT, TISSUE, ("55603005", "Fat")),
    (GLAND, TISSUE, ("279009002", "Glandular structure of breast")),
    (SKIN, TISSUE, ("39937001", "Skin")),
    (TUMOUR, ABNORMAL, ("108369006", "Neoplasm")),
    (IMPLANT, OBJECT, ("2282003", "Breast implant, type not specified")),
];

/// Category and type of a label as SNOMED CT has them; `None` for what is no part of the patient or
/// no label.
pub fn terms(label: u8) -> Option<[Term; 2]> {
    TERMS.iter().find(|(of, ..)| *of == label).map(|&(_, category, kind)| [category, kind])
}

/// A label map with [`OUTSIDE`] everywhere: memory that the system gives zeroed and nobody has
/// touched.
pub fn empty(grid: &Grid) -> LabelMap {
    Volume::from_parts(grid.clone(), vec![OUTSIDE; grid.len()])
}

/// Whether the label belongs to the soft tissue (1, 6, 7, 8, 9, 10).
pub fn is_soft_tissue(label: u8) -> bool {
    matches!(label, SOFT_TISSUE | FAT | GLAND | SKIN | TUMOUR | IMPLANT)
}

/// Whether the label belongs to the chest wall (2, 3, 4, 5).
pub fn is_chest_wall(label: u8) -> bool {
    matches!(label, CHEST_WALL | LUNG | BONE | MUSCLE)
}
