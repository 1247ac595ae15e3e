//! The tissue a name stands for.

use supine_volume::SeedKind;

/// The words a name may begin with.
const WORDS: [(SeedKind, &[&str]); 3] = [
    (
        SeedKind::ChestWall,
        &[
            "chest wall",
            "muscle",
            "rib",
            "sternum",
            "costal",
            "intercostal",
            "pectoral",
            "serratus",
            "bone",
            "lung",
        ],
    ),
    (SeedKind::SoftTissue, &["soft", "gland", "fat", "breast", "skin", "tumour", "tumor"]),
    (SeedKind::Exclude, &["exclude", "wire", "table", "lead", "electrode"]),
];

/// The words that stand for a tissue among the masks of a segmentation of the whole body, where
/// `gland`, `fat` or `muscle` may be any.
const MASKS: [&str; 8] =
    ["rib", "sternum", "costal", "intercostal", "pectoral", "serratus", "chest wall", "breast"];

fn plain(name: &str) -> String {
    let name = name.trim().to_lowercase().replace(['_', '-'], " ");
    let rest = ["left ", "right "].iter().find_map(|side| name.strip_prefix(side));
    rest.map_or(name.clone(), str::to_string)
}

/// The tissue a name stands for.
pub(super) fn kind(name: &str) -> Option<SeedKind> {
    let name = plain(name);
    let begins = |words: &[&str]| words.iter().any(|w| name.starts_with(w));
    WORDS.iter().find(|(_, words)| begins(words)).map(|(kind, _)| *kind)
}

/// What a mask among others stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct MaskKind {
    pub(super) tissue: SeedKind,
    /// Whether it lies deep within its tissue. The edges of the others are where soft tissue and
    /// chest wall meet.
    pub(super) deep: bool,
}

/// What a mask among others stands for, by its name.
pub(super) fn mask_kind(name: &str) -> Option<MaskKind> {
    let plain = plain(name);
    let word = MASKS.iter().find(|w| plain.starts_with(**w))?;
    let deep = matches!(*word, "rib" | "sternum" | "costal" | "intercostal");
    kind(name).map(|tissue| MaskKind { tissue, deep })
}

/// Whether a name is one by which TotalSegmentator calls a mask of the thorax: the others of the
/// file are then those of the whole body.
pub(super) fn is_of_whole_body(name: &str) -> bool {
    let rib = name.strip_prefix("rib_left_").or_else(|| name.strip_prefix("rib_right_"));
    rib.is_some_and(|n| n.parse::<u8>().is_ok())
        || matches!(name, "sternum" | "costal_cartilages")
        || name.starts_with("vertebrae_")
        || name.starts_with("lung_") && name.contains("_lobe_")
        || name.starts_with("pectoralis_m")
}

/// All words, for messages.
pub(super) fn accepted() -> String {
    let of = |(kind, words): &(SeedKind, &[&str])| format!("{}: {}", kind.name(), words.join(", "));
    WORDS.iter().map(of).collect::<Vec<_>>().join("; ")
}

/// The words of masks, for messages.
pub(super) fn accepted_masks() -> String {
    MASKS.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_they_are() {
        for (name, expected) in [
            ("Chest_Wall", Some(SeedKind::ChestWall)),
            ("MUSCLE 2", Some(SeedKind::ChestWall)),
            ("Right-Ribs", Some(SeedKind::ChestWall)),
            ("soft_tissue-3", Some(SeedKind::SoftTissue)),
            ("left breast", Some(SeedKind::SoftTissue)),
            ("Bra", None),
            ("wire", Some(SeedKind::Exclude)),
            ("F-1", None),
            ("", None),
        ] {
            assert_eq!(kind(name), expected, "{name}");
        }
    }

    #[test]
    fn a_segmentation_of_the_whole_body_is_known_by_its_names() {
        for (name, expected) in [
            ("rib_left_4", true),
            ("costal_cartilages", true),
            ("lung_upper_lobe_left", true),
            ("pectoralis_major_left", true),
            ("rib", false),
            ("rib_left_side", false),
            ("Segment_1", false),
            ("chest wall", false),
        ] {
            assert_eq!(is_of_whole_body(name), expected, "{name}");
        }
    }

    #[test]
    fn among_masks_only_those_of_the_breast_and_its_wall_count() {
        for (name, expected) in [
            ("rib_left_4.nii.gz", Some(SeedKind::ChestWall)),
            ("costal_cartilages.nii.gz", Some(SeedKind::ChestWall)),
            ("breast.nii.gz", Some(SeedKind::SoftTissue)),
            ("pectoralis_major_left.nii.gz", Some(SeedKind::ChestWall)),
            ("serratus_anterior_right.nii.gz", Some(SeedKind::ChestWall)),
            ("skeletal_muscle.nii.gz", None),
            ("subcutaneous_fat.nii.gz", None),
            ("adrenal_gland_left.nii.gz", None),
            ("lung_upper_lobe_left.nii.gz", None),
        ] {
            assert_eq!(mask_kind(name).map(|kind| kind.tissue), expected, "{name}");
            let deep = name.starts_with("rib") || name.starts_with("costal");
            assert!(mask_kind(name).is_none_or(|kind| kind.deep == deep), "{name}");
        }
    }
}
