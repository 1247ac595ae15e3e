//! The moduli of the tissues, as typed and by default.

use super::{CaseError, TissueFile, one_of, value};
use supine_fem::Tissue;

/// What a modulus that differs from place to place is read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StiffnessMap {
    /// The finer labels.
    Labels,
    /// The CT: from fat to gland as the HU go from the level of the one to that of the other.
    Hounsfield,
}

impl StiffnessMap {
    /// Name in case files and in the summary.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Labels => "labels",
            Self::Hounsfield => "hu",
        }
    }
}

/// Moduli that differ from tissue to tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffnessWish {
    /// What decides the tissue.
    pub map: StiffnessMap,
    /// Young's moduli of fat, gland, skin and tumour: kPa, or proportions when `mean_kpa` is given.
    pub kpa: [f64; 4],
    /// The mean over the mesh to which the proportions are scaled, kPa.
    pub mean_kpa: Option<f64>,
}

/// Young's moduli of fat, gland, skin and tumour in proportion to that of fat, when nothing else is said.
///
/// Only the proportions are taken from samples: cut out and squeezed, fat has some 3 kPa (Samani, Zubovits
/// and Plewes, Phys. Med. Biol. 52, 2007) to 18 kPa (Krouskop et al., Ultrasonic Imaging 20, 1998), several
/// times what breasts show that move under their weight, 0.3 to 2 kPa. The level is therefore the modulus
/// of the case, kept as the mean over the mesh.
///
/// * Gland 1.5: as stiff as fat in Samani's samples, 1.6 times in Krouskop's at 5 % compression and 2.4
///   times at 20 %.
/// * Tumour 6: malignant tumours were 3 to 6 times as stiff as gland (Samani), so 4 times 1.5.
/// * Skin 16: 4 kPa beside 0.2 to 0.3 kPa in breasts fitted to several poses (Mira et al., Clin. Biomech.
///   60, 2018), 56 beside 3 kPa by suction on volunteers (Briot et al., Clin. Biomech. 2022).
const PROPORTIONS: [f64; 4] = [1.0, 1.5, 16.0, 6.0];
const KEYS: [&str; 4] = ["tissue.fat", "tissue.gland", "tissue.skin", "tissue.tumour"];

/// The moduli by tissue that a case asks for.
///
/// # Errors
/// [`CaseError::Value`] when keys contradict each other or a modulus is none.
pub(super) fn wish(file: &TissueFile) -> Result<Option<StiffnessWish>, CaseError> {
    let choices = [
        ("none", None),
        ("labels", Some(StiffnessMap::Labels)),
        ("hu", Some(StiffnessMap::Hounsfield)),
    ];
    let map = one_of("tissue.map", file.map.as_deref(), &choices)?;
    let given = [file.fat, file.gland, file.skin, file.tumour];
    let Some(map) = map else {
        return match given.iter().any(Option::is_some) {
            true => Err(value("tissue.map", "say \"labels\" or \"hu\" to use moduli by tissue")),
            false => Ok(None),
        };
    };
    for (key, kpa) in KEYS.into_iter().zip(given) {
        let tissue = kpa.map(|young_kpa| Tissue { young_kpa, ..Tissue::default() });
        tissue.map_or(Ok(()), |t| t.check()).map_err(|e| value(key, e.to_string()))?;
    }
    let Some(fat) = file.fat else {
        if given.iter().any(Option::is_some) {
            return Err(value(KEYS[0], "give the modulus of fat too (kPa), or none of them"));
        }
        let mean = file.young.unwrap_or(Tissue::default().young_kpa);
        return Ok(Some(StiffnessWish { map, kpa: PROPORTIONS, mean_kpa: Some(mean) }));
    };
    if file.young.is_some() {
        let reason = "leave it out where the moduli of the tissues are given, or give it alone: then \
                      theirs are in proportion and it is their mean";
        return Err(value("tissue.young", reason));
    }
    let kpa = [0, 1, 2, 3].map(|n| given[n].unwrap_or(fat * PROPORTIONS[n]));
    Ok(Some(StiffnessWish { map, kpa, mean_kpa: None }))
}

/// The moduli between which the tissue's may lie, kPa.
///
/// # Errors
/// [`CaseError::Value`] when they are none or not in ascending order.
pub(super) fn interval(file: &TissueFile) -> Result<Option<[f64; 2]>, CaseError> {
    const KEY: &str = "tissue.young_interval";
    let Some(ends) = file.young_interval else { return Ok(None) };
    for young_kpa in ends {
        let tissue = Tissue { young_kpa, ..Tissue::default() };
        tissue.check().map_err(|e| value(KEY, e.to_string()))?;
    }
    if ends[0] >= ends[1] {
        return Err(value(KEY, format!("{} is not below {}", ends[0], ends[1])));
    }
    Ok(Some(ends))
}
