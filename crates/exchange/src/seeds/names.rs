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
            "bone",
            "lung",
        ],
    ),
    (SeedKind::SoftTissue, &["soft", "gland", "fat", "breast", "skin", "tumour", "tumor"]),
    (SeedKind::Exclude, &["exclude", "wire", "table", "lead", "electrode"]),
];

/// The words that stand for a tissue among the masks of a segmentation of the whole body, where
/// `gland`, `fat` or `muscle` may be any.
const MASKS: [&str; 7] =
    ["rib", "sternum", "costal", "intercostal", "pectoral", "chest wall", "breast"];

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

/// The tissue a mask among others stands for.
pub(super) fn mask_kind(name: &str) -> Option<SeedKind> {
    let plain = plain(name);
    MASKS.iter().any(|w| plain.starts_with(w)).then(|| kind(name)).flatten()
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
    fn among_masks_only_those_of_the_breast_and_its_wall_count() {
        for (name, expected) in [
            ("rib_left_4.nii.gz", Some(SeedKind::ChestWall)),
            ("costal_cartilages.nii.gz", Some(SeedKind::ChestWall)),
            ("breast.nii.gz", Some(SeedKind::SoftTissue)),
            ("adrenal_gland_left.nii.gz", None),
            ("lung_upper_lobe_left.nii.gz", None),
        ] {
            assert_eq!(mask_kind(name), expected, "{name}");
        }
    }
}
