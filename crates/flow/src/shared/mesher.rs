//! The meshers a case can ask for, and one call for all.

use super::Refine;
use super::search::{Effort, by_edge_length};
use crate::Error;
use std::sync::OnceLock;
use supine_mesh::TetMesh;
use supine_space::{Progress, Sphere};
use supine_tetrahedralise::{Domain, Info, Params, Shell};
use supine_volume::Region;

/// What makes the tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mesher {
    /// Our own.
    #[default]
    Native,
    /// CGAL's Mesh_3 (GPL), bettered by our own; in programs built with the feature `cgal`.
    Cgal,
    /// TetGen (AGPL), bettered by our own; in programs built with the feature `tetgen`.
    Tetgen,
}

/// What another mesher than our own is asked to fill.
#[derive(Clone, Copy, Debug)]
pub struct Solid<'a> {
    /// Which surface a place lies beyond.
    pub domain: &'a Domain,
    /// The boundary with triangles of the size that suits the number of tetrahedra, and the rims.
    pub shell: &'a Shell,
    /// The region's sphere.
    pub sphere: Sphere,
    /// How many tetrahedra were asked for.
    pub tetrahedra: usize,
}

/// Fills a solid with tetrahedra of about an edge length, mm.
pub type Fill = fn(&Solid<'_>, f64, Progress<'_>) -> Filled;

/// What comes of it.
pub type Filled = Result<TetMesh, Error>;

/// The other meshers that this program was built with.
static CGAL: OnceLock<Fill> = OnceLock::new();
static TETGEN: OnceLock<Fill> = OnceLock::new();

impl Mesher {
    /// All, the default first.
    pub const ALL: [Self; 3] = [Self::Native, Self::Cgal, Self::Tetgen];

    /// Name in case files, on the command line, in reports; also that of the cargo feature.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Cgal => "cgal",
            Self::Tetgen => "tetgen",
        }
    }

    /// Tells what fills a solid for this mesher, once, by the program that was built with it: so
    /// that nothing here is compiled anew for a mesher, nor comes under its licence. Our own needs
    /// none.
    pub fn is_built_with(self, fill: Fill) {
        let place = match self {
            Self::Native => return,
            Self::Cgal => &CGAL,
            Self::Tetgen => &TETGEN,
        };
        place.get_or_init(|| fill);
    }

    /// What fills a solid for another mesher than our own; `None` for our own.
    ///
    /// # Errors
    /// When this program was built without the mesher: the message says how to build it.
    pub fn fill(self) -> Result<Option<Fill>, Error> {
        let built = match self {
            Self::Native => return Ok(None),
            Self::Cgal => &CGAL,
            Self::Tetgen => &TETGEN,
        };
        let mesher = self.name();
        built.get().copied().map(Some).ok_or(Error::NotBuilt { mesher })
    }

    /// Whether it can make the mesh finer where it is asked to.
    ///
    /// # Errors
    /// When not: only our own can.
    pub fn check_refines(self, refine: &Refine) -> Result<(), Error> {
        match (self, refine) {
            (Self::Native, _) | (_, Refine::Nowhere) => Ok(()),
            (Self::Cgal | Self::Tetgen, _) => Err(Error::NotRefined { mesher: self.name() }),
        }
    }
}

/// Meshes the soft tissue inside the region's sphere with the asked number of tetrahedra.
///
/// Another mesher than our own is asked for meshes of several edge lengths until one is near the
/// number; our own then improves it and reduces it to the number. Only our own can `refine`.
///
/// # Errors
/// When this program was built without the mesher or it cannot refine, the mesher fails, the number
/// cannot be reached, or the progress callback says stop.
pub fn mesh_region(
    region: &Region,
    params: &Params,
    (mesher, refine): (Mesher, &Refine),
    progress: Progress<'_>,
) -> Result<(TetMesh, Info), Error> {
    let fill = mesher.fill()?;
    mesher.check_refines(refine)?;
    let domain = Domain::new(region, params, progress.part(0.0, 0.2))?;
    let refinement = refine.of(&domain, params.tetrahedra, progress.part(0.2, 0.4))?;
    let domain = domain.refined(refinement)?;
    let progress = progress.part(0.4, 1.0);
    let Some(fill) = fill else { return Ok(domain.mesh(params.tetrahedra, progress)?) };
    let filled = filled((&domain, region), params.tetrahedra, fill, progress.part(0.0, 0.6))?;
    Ok(domain.improve(&filled, params.tetrahedra, progress.part(0.6, 1.0))?)
}

/// Another mesher's mesh with the number of tetrahedra nearest to the asked one.
fn filled(
    (domain, region): (&Domain, &Region),
    tetrahedra: usize,
    fill: Fill,
    progress: Progress<'_>,
) -> Result<TetMesh, Error> {
    let shell = domain.shell(tetrahedra, progress.part(0.0, 0.1))?;
    let solid = Solid { domain, shell: &shell, sphere: region.sphere(), tetrahedra };
    let asked = (tetrahedra, Effort::default());
    let search = by_edge_length(
        domain.volume_mm3(),
        asked,
        progress.part(0.1, 1.0),
        |edge_mm, progress| fill(&solid, edge_mm, progress),
    )?;
    Ok(search.mesh)
}
