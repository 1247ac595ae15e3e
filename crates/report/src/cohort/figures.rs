//! The figures of a run that a cohort is compared by.

use crate::{SkinDistances, Summary, TumourMoved};
use supine_record::{ModulusOrigin, RestState};

/// Figures of one result, those of the tables of mesh, modulus and displacement that are printed of
/// patients.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// The short name of the result; empty where none was exported.
    pub run_id: String,
    /// Where its CT was, if the run tells that.
    pub ct: Option<std::path::PathBuf>,
    /// The patient's side.
    pub breast: String,
    /// Tilt of the table, AP and LAT, degrees.
    pub table_deg: [f64; 2],
    /// Voxels of the CT along its axes.
    pub size: [usize; 3],
    /// Distance of their centres, mm.
    pub spacing_mm: [f64; 3],
    /// Radius of the region, mm.
    pub radius_mm: f64,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Corners of tetrahedra.
    pub nodes: usize,
    /// Unknowns of the mechanics.
    pub unknowns: usize,
    /// Element order.
    pub order: u8,
    /// Smallest dihedral angle, degrees.
    pub min_dihedral_deg: f64,
    /// Mean radius ratio; 1 is best.
    pub mean_radius_ratio: f64,
    /// Volume of the mesh, ml.
    pub volume_ml: f64,
    /// Young's modulus, kPa.
    pub young_kpa: f64,
    /// The interval of the modulus and where it comes from; none where no interval of the tumour
    /// was computed.
    pub young_known: Option<([f64; 2], ModulusOrigin)>,
    /// Rest state.
    pub rest: RestState,
    /// The tumour; none where the case names none.
    pub tumour: Option<TumourMoved>,
    /// Smallest det F of the tissue, from the CT to the table.
    pub min_det_f: f64,
    /// Residual of the mechanics, relative to the load.
    pub residual: f64,
    /// Voxels where the map folds.
    pub folded_voxels: usize,
    /// Distances of a scan on the operating table from the skin near the tumour; none without a
    /// scan.
    pub scan: Option<SkinDistances>,
}

impl Figures {
    /// Those of a summary.
    pub fn of(s: &Summary) -> Self {
        let known = s.tumour_interval.as_ref().map(|interval| &interval.modulus);
        let mut surfaces = s.evaluation.iter().flat_map(|evaluation| &evaluation.surfaces);
        let run = surfaces.find(|surface| surface.name == "run");
        Self {
            breast: s.position.breast.clone(),
            table_deg: [s.position.table.ap_deg, s.position.table.lat_deg],
            size: s.ct.size,
            spacing_mm: s.ct.spacing_mm,
            radius_mm: s.parameters.region.radius_mm,
            run_id: s.id.clone().unwrap_or_default(),
            ct: ct(s),
            tetrahedra: s.mesh.tetrahedra,
            nodes: s.mesh.points,
            unknowns: s.mesh.unknowns,
            order: s.parameters.tissue.order,
            min_dihedral_deg: s.mesh.min_dihedral_deg,
            mean_radius_ratio: s.mesh.mean_radius_ratio,
            volume_ml: s.mesh.volume_ml,
            young_kpa: s.parameters.tissue.young_kpa,
            young_known: known.map(|known| (known.young_kpa, known.origin)),
            rest: s.parameters.tissue.rest,
            tumour: TumourMoved::of(s),
            min_det_f: s.local_volume().min,
            residual: s.solve.residual,
            folded_voxels: s.warp.folded_voxels,
            scan: run.map(|surface| surface.near),
        }
    }
}

/// The path of the CT, whole where the folder of the case is known.
fn ct(summary: &Summary) -> Option<std::path::PathBuf> {
    let ct = summary.case.get("ct").and_then(|ct| ct.as_str())?;
    Some(summary.run.case_folder.as_ref().map_or_else(|| ct.into(), |folder| folder.join(ct)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;
    use crate::tables;

    #[test]
    fn one_range_of_the_local_volume_is_told_of_a_patient() {
        let mut summary = example();
        (summary.solve.min_det_f, summary.solve.max_det_f) = (0.173, 2.767);
        (summary.warp.jacobian.min, summary.warp.jacobian.max) = (0.373, 4.467);
        let told = format!("{:?} {:?}", tables::key(&summary), tables::stages(&summary));
        assert!(told.contains("0.79 to 1.25"), "{told}");
        assert!(
            !["0.17", "2.77", "0.37", "4.47"].iter().any(|other| told.contains(other)),
            "{told}"
        );
        assert!((Figures::of(&summary).min_det_f - 0.79).abs() < 1e-12);
    }
}
