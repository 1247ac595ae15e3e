//! The law of the tissue: one modulus, or moduli that differ from tissue to tissue.

use super::case::{FitScans, ScansSpec, Stiffness, StiffnessMap};
use super::error::{CaseError, value};
use super::given::{Given, missing};
use super::value::Value;
use supine_fem::{Cut, Law, RestState, Tissue};

/// Young's moduli of fat, gland, skin and tumour in proportion to that of fat, when nothing else is
/// said.
///
/// Only the proportions are taken from samples: cut out and squeezed, fat has some 3 kPa (Samani,
/// Zubovits and Plewes, Phys. Med. Biol. 52, 2007) to 18 kPa (Krouskop et al., Ultrasonic Imaging
/// 20, 1998), several times what breasts show that move under their weight, 0.3 to 2 kPa. The level
/// is therefore the modulus of the case, kept as the mean over the mesh.
///
/// * Gland 1.5: as stiff as fat in Samani's samples, 1.6 times in Krouskop's at 5 % compression and
///   2.4 times at 20 %.
/// * Tumour 6: malignant tumours were 3 to 6 times as stiff as gland (Samani), so 4 times 1.5.
/// * Skin 16: 4 kPa beside 0.2 to 0.3 kPa in breasts fitted to several poses (Mira et al., Clin.
///   Biomech. 60, 2018), 56 beside 3 kPa by suction on volunteers (Briot et al., Clin. Biomech.
///   2022).
const PROPORTIONS: [f64; 4] = [1.0, 1.5, 16.0, 6.0];

impl Stiffness {
    /// The moduli of the tissues that are taken for likely, in proportion to that of fat.
    pub(crate) fn likely() -> Self {
        Self { map: StiffnessMap::Labels, kpa: PROPORTIONS, mean_kpa: None, given: false }
    }
}

pub(super) const KEYS: [&str; 4] = ["tissue.fat", "tissue.gland", "tissue.skin", "tissue.tumour"];

/// The interval that holds the modulus; it has to hold the one that the run is made with.
pub(super) fn young_interval(given: Given<'_>) -> Result<Option<[f64; 2]>, CaseError> {
    const KEY: &str = "tissue.young_interval";
    let Some(Value::Interval(ends @ [low, high])) = given.get(KEY) else { return Ok(None) };
    let young = law(given).young_kpa;
    // Moduli of several tissues have a mean that the mesh decides.
    let single = given.word("tissue.map") == "none";
    if single && !(*low..=*high).contains(&young) {
        return Err(value(
            KEY,
            format!(
                "[{low}, {high}] does not hold `tissue.young`, {young} kPa: the run is made with a modulus that is known to be \
                 wrong; correct one of them"
            ),
        ));
    }
    Ok(Some(*ends))
}

/// How much a law stiffens when nothing else is said. Assumed: curves of fat outside the body are
/// steeper, and no breast was measured in place.
pub(super) const STIFFENING: f64 = 1.5;

/// The law with one modulus.
pub(super) fn law(given: Given<'_>) -> Tissue {
    let default = Tissue::default();
    let word = given.word("tissue.law");
    let law = Law::ALL.into_iter().find(|law| law.name() == word).unwrap_or_default();
    let stiffening = given.number("tissue.stiffening").unwrap_or(STIFFENING);
    Tissue {
        law,
        fibres: given.number("tissue.fibres").unwrap_or(default.fibres),
        fibre_stiffening: given
            .number("tissue.fibre_stiffening")
            .unwrap_or(default.fibre_stiffening),
        fibre_direction: match given.get("tissue.fibre_direction") {
            Some(Value::Point(along)) => Some(*along),
            _ => None,
        },
        stiffening: if law.is_default() { default.stiffening } else { stiffening },
        young_kpa: given.number("tissue.young").unwrap_or(default.young_kpa),
        poisson: given.number("tissue.poisson").unwrap_or(default.poisson),
        density_kg_m3: given.number("tissue.density").unwrap_or(default.density_kg_m3),
    }
}

/// That a law which stiffens, or fibres, are asked for where it is said how much they stiffen.
///
/// # Errors
/// [`CaseError::Value`].
pub(super) fn check_stiffening(given: Given<'_>) -> Result<(), CaseError> {
    match given.number("tissue.stiffening") {
        Some(_) if law(given).law.is_default() => {
            Err(value("tissue.stiffening", "only with a law that stiffens: law = \"exponential\""))
        }
        _ => Ok(()),
    }?;
    let fibred = law(given).fibres > 0.0;
    let keys = ["tissue.fibre_stiffening", "tissue.fibre_direction"];
    match keys.into_iter().find(|key| !fibred && given.get(key).is_some()) {
        Some(key) => Err(value(key, "only with fibres above 0")),
        None => Ok(()),
    }?;
    match given.get("tissue.fibre_direction") {
        Some(Value::Point([0.0, 0.0, 0.0])) => {
            Err(value("tissue.fibre_direction", "0, 0, 0 is no direction"))
        }
        _ => Ok(()),
    }
}

/// The moduli by tissue that a case asks for.
///
/// # Errors
/// [`CaseError::Value`] when keys contradict each other.
pub(super) fn stiffness(given: Given<'_>) -> Result<Option<Stiffness>, CaseError> {
    let moduli = KEYS.map(|key| given.number(key));
    let any = moduli.iter().any(Option::is_some);
    let map = match given.word("tissue.map") {
        "labels" => StiffnessMap::Labels,
        "hu" => StiffnessMap::Hounsfield,
        _ if any => {
            return Err(value("tissue.map", "say \"labels\" or \"hu\" to use moduli by tissue"));
        }
        _ => return Ok(None),
    };
    let alone = given.get("tissue.young").is_some();
    let Some(fat) = moduli[0] else {
        if any {
            return Err(value(KEYS[0], "give the modulus of fat too (kPa), or none of them"));
        }
        let mean_kpa = Some(law(given).young_kpa);
        return Ok(Some(Stiffness { map, kpa: PROPORTIONS, mean_kpa, given: false }));
    };
    if alone {
        let reason = "leave it out where the moduli of the tissues are given, or give it alone: then \
                      theirs are in proportion and it is their mean";
        return Err(value("tissue.young", reason));
    }
    let kpa = [0, 1, 2, 3].map(|n| moduli[n].unwrap_or(fat * PROPORTIONS[n]));
    // A modulus that is fitted is the mean: those of the tissues then say their proportions.
    let fitted = given.file("scans.sitting").is_some();
    let mean_kpa = fitted.then_some(law(given).young_kpa);
    Ok(Some(Stiffness { map, kpa, mean_kpa, given: true }))
}

/// The scans of a case.
///
/// # Errors
/// [`CaseError::Missing`] without any scan where landmarks or a unit are given, and as
/// [`fit_scans`].
pub(super) fn scans(given: Given<'_>) -> Result<Option<ScansSpec>, CaseError> {
    let (intraop, fit) = (given.file("scans.intraop"), fit_scans(given)?);
    if fit.is_none() && intraop.is_none() {
        let any = ["scans.landmarks", "scans.unit"].iter().any(|key| given.get(key).is_some());
        return if any { Err(missing("scans.sitting")) } else { Ok(None) };
    }
    let unit = Some(given.word("scans.unit")).filter(|unit| *unit != "auto");
    Ok(Some(ScansSpec { fit, intraop, landmarks: given.file("scans.landmarks"), unit }))
}

/// The scans to which the modulus is fitted.
///
/// # Errors
/// [`CaseError::Value`] when a modulus is given beside them, [`CaseError::Missing`] without that of
/// the sitting patient where that of the lying one or a lean is given.
fn fit_scans(given: Given<'_>) -> Result<Option<FitScans>, CaseError> {
    let supine = given.file("scans.supine");
    let Some(sitting) = given.file("scans.sitting") else {
        let beside = supine.is_some() || given.get("scans.lean").is_some();
        return if beside { Err(missing("scans.sitting")) } else { Ok(None) };
    };
    for key in ["tissue.young", "tissue.young_interval"] {
        if given.get(key).is_some() {
            let reason = "the modulus is fitted to `scans.sitting`: leave one of the two out";
            return Err(value(key, reason));
        }
    }
    let states = match given.get("tissue.rest") {
        None => RestState::ALL.to_vec(),
        Some(_) if given.word("tissue.rest") == "net" => vec![RestState::Net],
        Some(_) => vec![RestState::Unloaded],
    };
    let plain = given.word("tissue.law") == Law::default().name()
        && given.number("tissue.fibres").is_none_or(|ratio| ratio <= 0.0)
        && given.word("tissue.map") == "none"
        && given.word("wall.hold") != "sliding"
        && given.number("skin.young").is_none();
    let laws = plain && given.switch("scans.laws");
    let lean_deg = given.number("scans.lean").unwrap_or(0.0);
    Ok(Some(FitScans { sitting, lean_deg, supine, states, laws }))
}

/// What holds the cut.
pub(super) fn cut(given: Given<'_>) -> Cut {
    match given.word("tissue.cut") {
        "free" => Cut::Free,
        "fixed" => Cut::Fixed,
        _ => Cut::Spring,
    }
}

/// The stiffness of the springs at the cut, kPa/mm.
///
/// # Errors
/// [`CaseError::Value`] when there are no springs.
pub(super) fn spring(given: Given<'_>) -> Result<Option<f64>, CaseError> {
    match given.get("tissue.spring") {
        Some(_) if cut(given) != Cut::Spring => {
            Err(value("tissue.spring", "only with cut = \"spring\""))
        }
        Some(Value::Number(k)) => Ok(Some(*k)),
        _ => Ok(None),
    }
}
