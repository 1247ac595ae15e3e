//! Labels in a sphere to a tagged tetrahedral mesh of an asked size.
//!
//! The way: smooth level functions of skin and chest wall from the uncropped labels and the
//! analytic sphere (`fields`); a lattice cut by them (`start`); coarsening and rounds of split,
//! collapse, swap and smooth (`remesh`); the exact count (`count`); fitting the boundary in the
//! mean (`fit`); betterment without change of the count. Knows no files and no mechanics.
//!
//! All work is done in the mesher's frame: millimetres along the voxel grid's axes from the
//! sphere's centre. The result is in LPS, mm.

mod collapse;
mod complex;
mod count;
mod error;
mod fields;
mod finish;
mod fit;
mod labels;
mod mesher;
mod patches;
mod remesh;
mod shape;
mod sizing;
mod smooth;
mod split;
mod start;
#[cfg(test)]
mod surface_tests;
mod swap;
#[cfg(test)]
mod tests;

pub use error::Error;

use fields::{Fields, Smoothing};
use mesher::Mesher;
use sizing::Sizing;
use supine_mesh::{BoundaryTag, Quality, TetMesh, quality};
use supine_space::Progress;
use supine_volume::Region;

/// Settings of the mesher.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Tetrahedra asked for.
    pub tetrahedra: usize,
    /// Standard deviation of the Gaussian that smooths the labels where their surfaces are not
    /// known between the voxels, mm; never below 0.9 of the largest voxel spacing.
    pub smoothing_mm: f64,
    /// Standard deviation of the Gaussian that smooths the distances to known surfaces, mm.
    pub surface_smoothing_mm: f64,
    /// Growth of the edge length with depth below the boundary, mm per mm.
    pub growth: f64,
    /// Largest edge length inside, in units of that at the boundary; 1 or more.
    pub growth_limit: f64,
    /// Edge length on the rims in units of that on the surfaces; above 0, at most 1.
    pub rim_refinement: f64,
    /// Soft tissue between chest wall and skin that is thinner than this counts as chest wall,
    /// mm: wedges end in a face of this height with the tag of the chest wall.
    pub least_thickness_mm: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            tetrahedra: 5000,
            smoothing_mm: 1.5,
            surface_smoothing_mm: 1.0,
            growth: 0.4,
            growth_limit: 1.7,
            rim_refinement: 0.62,
            least_thickness_mm: 1.0,
        }
    }
}

/// How far the faces of one tag lie from the smoothed labels they follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// The tag.
    pub tag: BoundaryTag,
    /// Area of its faces, mm².
    pub area_mm2: f64,
    /// Mean distance over the area, mm.
    pub mean_mm: f64,
    /// Largest distance, mm.
    pub max_mm: f64,
}

/// What happened.
#[derive(Clone, Debug)]
pub struct Info {
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Tetrahedra asked for.
    pub asked: usize,
    /// Tetrahedra made.
    pub tetrahedra: usize,
    /// Points made.
    pub points: usize,
    /// Shape of the mesh.
    pub quality: Quality,
    /// Edge length wanted at the surface, mm.
    pub edge_mm: f64,
    /// Separate pieces of soft tissue in the region that were left out.
    pub dropped_components: usize,
    /// Their volume, mm³.
    pub dropped_volume_mm3: f64,
    /// Patches of skin, chest wall or cut smaller than a face that took their neighbour's tag.
    pub joined_patches: usize,
    /// Distance of the boundary to the smoothed labels, for each tag that there is.
    pub deviation: Vec<Deviation>,
    /// Length of the rims, where two tags meet, mm.
    pub rim_mm: f64,
    /// Volume of the mesh, mm³.
    pub volume_mm3: f64,
    /// Volume of the voxels of soft tissue in the sphere, without dropped pieces, mm³.
    pub label_volume_mm3: f64,
}

/// Fewer tetrahedra than this hold no breast.
const LEAST: usize = 200;
/// More than this are not numbered.
const MOST: usize = 5_000_000;
/// Volume of a tetrahedron with edges of length L is about L³ / 8.5 in a good mesh.
const CUBE_SHARE: f64 = 8.5;
/// The start lattice is no coarser than this, mm, or small shapes are lost.
const COARSEST_MM: f64 = 6.0;
/// The margin of labels around the sphere that the smoothing needs, in its standard deviations.
const MARGIN: f64 = 5.0;
/// Rounds of split, collapse, swap and smooth.
const ROUNDS: usize = 6;
/// Tetrahedra worse than this (sine of 34.2°) are worked on to the end.
const GOAL: f64 = 0.562;
/// A volume this far off the labels' (share) is worth a warning.
const VOLUME_OFF: f64 = 0.03;
/// A count this far off (share) is an error.
const OFF: f64 = 0.05;

/// Meshes the soft tissue inside the region's sphere with the asked number of tetrahedra.
///
/// Boundary faces are tagged skin, chest wall or cut; where tags meet, edges of the mesh follow
/// the rim. Deterministic: the same bits for any number of threads.
///
/// # Errors
/// When the number cannot be reached, a setting or a label is not usable, there is nothing to
/// mesh, or the progress callback says stop.
pub fn tetrahedralise(
    region: &Region<'_>,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(TetMesh, Info), Error> {
    check(params)?;
    let mut info = Info::new(params.tetrahedra);
    progress.at(0.0)?;
    let spacing = region.labels().grid().spacing();
    let sigma = params.smoothing_mm.max(0.9 * spacing.max());
    let kinds = labels::kinds(region, MARGIN * sigma, &mut info)?;
    progress.at(0.08)?;
    let smoothing = match region.surfaces() {
        Some(surfaces) => Smoothing::Known(surfaces, params.surface_smoothing_mm),
        None => Smoothing::Labels(sigma),
    };
    let fields = Fields::new(&kinds, region.sphere(), smoothing, params.least_thickness_mm)?;
    drop(kinds);
    progress.at(0.2)?;
    let mut mesher = first_mesh(&fields, params, &mut info, progress.part(0.2, 0.3))?;
    let edge = mesher.sizing.base;
    if edge < spacing.min() {
        info.warnings.push(format!(
            "{} tetrahedra make edges of {edge:.2} mm, shorter than a voxel: the surface gains \
             nothing from them",
            params.tetrahedra
        ));
    }
    work(&mut mesher, params.tetrahedra, progress.part(0.3, 1.0))?;
    let reached = mesher.mesh.count();
    let off = reached as f64 / params.tetrahedra as f64 - 1.0;
    if off.abs() > OFF {
        let advice = if off > 0.0 { reached + reached / 5 } else { reached };
        return Err(Error::Count { asked: params.tetrahedra, reached, advice });
    }
    if reached != params.tetrahedra {
        info.warnings.push(format!(
            "the mesh has {reached} tetrahedra where {} were asked for",
            params.tetrahedra
        ));
    }
    let complex = mesher.mesh.compact();
    let mesh = finish::to_patient(&complex, &fields)?;
    info.describe(&complex, &mesh, &fields, mesher.sizing.base);
    progress.at(1.0)?;
    Ok((mesh, info))
}

fn check(params: &Params) -> Result<(), Error> {
    let asked = params.tetrahedra;
    if asked < LEAST {
        return Err(Error::TooFew { asked, least: LEAST });
    }
    if asked > MOST {
        return Err(Error::TooMany { asked, most: MOST });
    }
    let settings = [
        ("smoothing_mm", params.smoothing_mm, 0.0..=20.0, "0 to 20"),
        ("surface_smoothing_mm", params.surface_smoothing_mm, 0.0..=20.0, "0 to 20"),
        ("growth", params.growth, 0.0..=2.0, "0 to 2"),
        ("growth_limit", params.growth_limit, 1.0..=5.0, "1 to 5"),
        ("rim_refinement", params.rim_refinement, 0.2..=1.0, "0.2 to 1"),
        ("least_thickness_mm", params.least_thickness_mm, 0.1..=10.0, "0.1 to 10"),
    ];
    for (name, value, allowed, range) in settings {
        if !allowed.contains(&value) {
            return Err(Error::Setting { name, value, range });
        }
    }
    Ok(())
}

/// The cut lattice, and the base length that should give the asked count.
fn first_mesh<'a>(
    fields: &'a Fields,
    params: &Params,
    info: &mut Info,
    progress: Progress<'_>,
) -> Result<Mesher<'a>, Error> {
    let nothing = Error::NothingToMesh { thickness_mm: params.least_thickness_mm };
    let edge = (CUBE_SHARE * fields.volume / params.tetrahedra as f64).cbrt();
    if edge.is_nan() || edge <= 0.0 {
        return Err(nothing);
    }
    let cell = edge.min(COARSEST_MM.max(0.4 * edge));
    let Some((mesh, parts, lost)) = start::start(fields, cell, progress)? else {
        return Err(nothing);
    };
    info.dropped_components += parts;
    info.dropped_volume_mm3 += lost;
    let sizing = Sizing::new(fields, params, edge);
    let mut mesher = Mesher { mesh, sizing };
    info.joined_patches = mesher.join_small_patches();
    mesher.settle();
    mesher.settle();
    mesher.coarsen(cell.min(edge), progress.part(0.5, 1.0))?;
    Ok(mesher)
}

/// From the first mesh to the last.
fn work(mesher: &mut Mesher<'_>, goal: usize, progress: Progress<'_>) -> Result<(), Error> {
    mesher.rounds(ROUNDS, goal, progress.part(0.0, 0.5))?;
    if !mesher.reach(goal, progress.part(0.5, 0.6))? {
        return Ok(());
    }
    mesher.polish(GOAL, 4, progress.part(0.6, 0.7))?;
    mesher.fit(GOAL, progress.part(0.7, 0.8))?;
    mesher.polish(GOAL, 12, progress.part(0.8, 0.9))?;
    mesher.trade(goal, GOAL, 12, progress.part(0.9, 1.0))?;
    Ok(())
}

impl Info {
    fn new(asked: usize) -> Self {
        let quality = Quality {
            min_dihedral_deg: 0.0,
            max_dihedral_deg: 0.0,
            min_radius_ratio: 0.0,
            mean_radius_ratio: 0.0,
            worst: 0,
            mean_edge: 0.0,
        };
        Self {
            warnings: Vec::new(),
            asked,
            tetrahedra: 0,
            points: 0,
            quality,
            edge_mm: 0.0,
            dropped_components: 0,
            dropped_volume_mm3: 0.0,
            joined_patches: 0,
            deviation: Vec::new(),
            rim_mm: 0.0,
            volume_mm3: 0.0,
            label_volume_mm3: 0.0,
        }
    }

    fn describe(
        &mut self,
        complex: &complex::Complex,
        mesh: &TetMesh,
        fields: &Fields,
        edge_mm: f64,
    ) {
        self.tetrahedra = mesh.tets().len();
        self.points = mesh.points().len();
        self.quality = quality(mesh);
        self.edge_mm = edge_mm;
        self.deviation = finish::deviations(complex, fields);
        self.rim_mm = finish::rim_length(complex);
        (self.volume_mm3, self.label_volume_mm3) = (mesh.total_volume(), fields.volume);
        let gain = self.volume_mm3 / self.label_volume_mm3 - 1.0;
        if gain.abs() > VOLUME_OFF {
            self.warnings.push(format!(
                "the volume of the mesh is {:+.1} % off that of the labelled soft tissue: thin parts or \
                 narrow gaps are lost at this number of tetrahedra",
                100.0 * gain
            ));
        }
        for tag in BoundaryTag::ALL {
            if self.deviation.iter().all(|d| d.tag != tag) {
                let what = match tag {
                    BoundaryTag::ChestWall => ": nothing holds the tissue there",
                    BoundaryTag::Skin => ": the region lies inside the body",
                    BoundaryTag::Cut => ": the region holds a whole piece of tissue",
                };
                self.warnings.push(format!("the mesh has no {} faces{what}", tag.name()));
            }
        }
        if self.quality.min_dihedral_deg < 10.0 {
            self.warnings.push(format!(
                "the worst tetrahedron has a dihedral angle of {:.1}°",
                self.quality.min_dihedral_deg
            ));
        }
    }
}
