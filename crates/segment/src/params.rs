//! What the user decides.

use crate::{Error, Weights};
use supine_space::Posture;
use supine_volume::Seeds;

/// How to segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// What the user knows. Never overruled.
    ///
    /// A chest-wall point lies at least 1 mm inside the wall, a soft-tissue point 1 mm outside it;
    /// painted voxels keep their label to the voxel. 3 mm round an exclude point are taken off the
    /// patient, of painted maps the painted voxels alone, and what hung on her by them.
    pub seeds: Seeds,
    /// How the patient lay: table and lungs are held against it.
    pub posture: Posture,
    /// Level between air and skin, HU. Default -450: half-way is -490 on phantoms, readers draw the
    /// skin at about -400; the two lie 0.1 to 0.3 mm apart.
    pub skin_hu: f64,
    /// Level above which smoothed tissue is bone, HU. Default 130, so that costal cartilage counts.
    pub bone_hu: f64,
    /// How far outside the ribs the wall is looked for, mm. Default 45.
    pub reach_mm: f64,
    /// What the search for the wall weighs.
    pub weights: Weights,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            seeds: Seeds::default(),
            posture: Posture::Supine,
            skin_hu: -450.0,
            bone_hu: 130.0,
            reach_mm: 45.0,
            weights: Weights::default(),
        }
    }
}

impl Params {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let between = |name, value: f64, low: f64, high: f64, why| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(Error::Parameter { name, value, why })
            }
        };
        between("skin_hu", self.skin_hu, -900.0, -200.0, "it must lie within -900..-200 HU")?;
        between("bone_hu", self.bone_hu, 90.0, 400.0, "it must lie within 90..400 HU")?;
        between("reach_mm", self.reach_mm, 20.0, 80.0, "it must lie within 20..80 mm")
    }
}
