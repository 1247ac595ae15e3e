//! Doses carried along with the tissue, and what they sum to.

use crate::air::{continued, is_tissue};
use crate::{Origin, Origins, origins::there};
use supine_space::{Grid, Point, Progress, Stopped};
use supine_volume::{Ct, Volume, sample_trilinear_at};

/// A dose before and after deformation, Gy.
#[derive(Clone, Debug)]
pub struct CarriedDose {
    /// As it was given; in the air beside moving tissue as it goes on from there, where no such
    /// dose was given.
    pub planned: Volume<f32>,
    /// On the grid of the origins: what the tissue that lies in a voxel had received. Outside the
    /// skin, as far as the origins have a layer there, it goes on from the tissue, so that who
    /// interpolates it has the dose of tissue up to the skin.
    pub carried: Volume<f32>,
    /// Where the grid of the dose is too small for the movement; only where it was carried on its
    /// own grid.
    pub beyond: BeyondGrid,
}

/// What is lost because the tissue crosses the edge of the grid of a dose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeyondGrid {
    /// Volume within the grid of tissue that lay outside it, for which no dose was given, mL. Not
    /// counted where the dose at the edge is next to none.
    pub entered_ml: f64,
    /// Largest dose at the edge beside that, Gy.
    pub edge_gy: f64,
    /// Largest dose of tissue that left the grid, Gy; 0 when none did.
    pub left_gy: f64,
}

/// A dose after deformation, on the grid of `origins`.
///
/// A deformed dose, not one that is computed anew on the deformed anatomy. Trilinear; 0 where the
/// tissue left and outside the grid of the dose. `ct`, before deformation, tells tissue from air;
/// without it all that lies outside the mesh and beside its skin is taken for air, and the dose
/// there for one of tissue.
///
/// # Errors
/// [`Stopped`].
pub fn carry_dose(
    dose: &Volume<f32>,
    ct: Option<&Ct>,
    origins: &Origins,
    progress: Progress<'_>,
) -> Result<CarriedDose, Stopped> {
    let same = dose.grid() == origins.grid();
    let planned = match (ct, origins.moving()) {
        (Some(ct), Some((start, part))) if same => {
            continued(dose, ct, (*start, part.grid().size()))
        }
        _ => dose.clone(),
    };
    let sample = |of: &Volume<f32>, p: Point| {
        if of.grid().voxel_at(&p).is_some() { sample_trilinear_at(of, &p) } else { 0.0 }
    };
    let carried = origins.volume(progress, |voxel, origin| {
        let centre = origins.grid().centre(voxel);
        let stays = || if same { planned.at(voxel) } else { sample(&planned, centre) };
        match origin {
            Origin::Here => stays(),
            Origin::Beside(_) if ct.is_some_and(|ct| is_tissue(ct, &centre)) => stays(),
            Origin::Vacated => 0.0,
            Origin::Tissue(to) | Origin::Beside(to) | Origin::BesideVacated(to) => {
                sample(&planned, there(centre, to))
            }
        }
    })?;
    let beyond = if same { beyond(&planned, origins) } else { BeyondGrid::default() };
    Ok(CarriedDose { planned, carried, beyond })
}

/// A dose below this share of the largest one is next to none: planning systems cut their grids
/// where it is.
const NEXT_TO_NONE: f32 = 0.01;

/// What of a dose on the grid of `origins` crosses its edge.
fn beyond(dose: &Volume<f32>, origins: &Origins) -> BeyondGrid {
    let grid = dose.grid();
    let least = NEXT_TO_NONE * dose.data().iter().copied().fold(0.0, f32::max);
    let mut beyond = BeyondGrid::default();
    for voxel in (0..grid.len()).map(|n| grid.voxel(n)) {
        let Origin::Tissue(to) = origins.at(voxel) else { continue };
        let source = there(grid.centre(voxel), to);
        let (gy, outside) = (sample_trilinear_at(dose, &source), grid.voxel_at(&source).is_none());
        if gy <= least {
            continue;
        }
        if outside {
            beyond.entered_ml += grid.voxel_volume() / 1000.0;
            beyond.edge_gy = beyond.edge_gy.max(gy.into());
        } else if moves_out(grid, voxel, &source) {
            beyond.left_gy = beyond.left_gy.max(gy.into());
        }
    }
    beyond
}

/// Whether a voxel lies at the edge of a grid, and its tissue comes from further within by half a
/// voxel or more: as much of what was here has left the grid.
fn moves_out(grid: &Grid, voxel: [usize; 3], source: &Point) -> bool {
    let (index, size) = (grid.index_from_patient(source), grid.size());
    (0..3).any(|a| {
        let outwards = voxel[a] as f64 - index[a];
        (voxel[a] == 0 && outwards <= -0.5) || (voxel[a] + 1 == size[a] && outwards >= 0.5)
    })
}

/// Density of tissue of a CT number, g/mL: 1 + HU / 1000, 0 below -1000 HU.
///
/// The definition of the Hounsfield scale, HU = 1000 (μ / μ_water - 1), with attenuation in
/// proportion to density. Within some percent for soft tissue, too high for bone by up to half, for
/// which planning systems have a calibrated curve (Schneider, Pedroni and Lomax, Phys. Med. Biol.
/// 41, 1996).
pub fn density(hu: f32) -> f64 {
    (1.0 + f64::from(hu) / 1000.0).max(0.0)
}

/// Sums of a dose before and after deformation over its whole grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoseTotals {
    /// Σ dose x volume of a voxel, Gy mL.
    pub volume_gy_ml: [f64; 2],
    /// The same after deformation over all that is written, Gy mL: with the dose that goes on from
    /// the tissue into the air beside it.
    pub written_gy_ml: f64,
    /// Σ dose x density x volume of a voxel, Gy g = mJ: the energy imparted.
    pub energy_mj: Option<[f64; 2]>,
    /// Mass of what the grid holds of the CT, g.
    pub mass_g: Option<[f64; 2]>,
}

/// Sums of a dose, before (as given, on its grid) and after ([`carry_dose`], on the grid of
/// `origins`), weighted with the [`density`] of the CT's tissue at the centres of the voxels. HU
/// are carried unchanged, so that mass goes with volume. What goes on from the tissue into the air
/// beside it is not counted.
pub fn dose_totals(
    [before, after]: [&Volume<f32>; 2],
    origins: &Origins,
    ct: Option<&Ct>,
) -> DoseTotals {
    let outside = |voxel| match origins.at(voxel) {
        Origin::Beside(_) => Some(sample_trilinear_at(before, &origins.grid().centre(voxel))),
        Origin::BesideVacated(_) => Some(0.0),
        _ => None,
    };
    let integral = |dose: &Volume<f32>| {
        let sum: f64 = dose.data().iter().map(|&d| f64::from(d)).sum();
        sum * dose.grid().voxel_volume() / 1000.0
    };
    let written_gy_ml = integral(after);
    let counted = |voxel| outside(voxel).unwrap_or_else(|| after.at(voxel));
    let after = &Volume::par_from_fn(after.grid().clone(), counted);
    let volume_gy_ml = [before, after].map(integral);
    let Some(ct) = ct else {
        return DoseTotals { volume_gy_ml, written_gy_ml, energy_mj: None, mass_g: None };
    };
    let at =
        |p: Point| ct.grid().voxel_at(&p).map_or(0.0, |_| density(sample_trilinear_at(ct, &p)));
    let rest = |voxel| at(before.grid().centre(voxel));
    let deformed = |voxel| {
        let centre = origins.grid().centre(voxel);
        match origins.at(voxel) {
            Origin::Here | Origin::Beside(_) => at(centre),
            Origin::Vacated | Origin::BesideVacated(_) => 0.0,
            Origin::Tissue(to) => at(there(centre, to)),
        }
    };
    let sums = [weighed(before, rest), weighed(after, deformed)];
    DoseTotals {
        volume_gy_ml,
        written_gy_ml,
        energy_mj: Some(sums.map(|s| s.0)),
        mass_g: Some(sums.map(|s| s.1)),
    }
}

/// Dose x mass (Gy g) and mass (g).
fn weighed(dose: &Volume<f32>, density: impl Fn([usize; 3]) -> f64) -> (f64, f64) {
    let (mut energy, mut mass) = (0.0, 0.0);
    for (n, &d) in dose.data().iter().enumerate() {
        let grams = density(dose.grid().voxel(n)) * dose.grid().voxel_volume() / 1000.0;
        energy += grams * f64::from(d);
        mass += grams;
    }
    (energy, mass)
}
