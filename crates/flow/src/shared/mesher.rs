//! The meshers a case can ask for, and one call for all.

use super::Refine;
#[cfg(any(feature = "cgal", feature = "tetgen"))]
use super::search::{Effort, Found, search};
use crate::Error;
use supine_mesh::TetMesh;
use supine_space::Progress;
use supine_tetrahedralise::{Domain, Info, Params};
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

/// The argument by which a program that calls [`mesh_region`] is started again as the process in which
/// TetGen runs: it must then do nothing but `tetgen_work`.
pub const TETGEN_WORKER: &str = "tetgen-worker";

#[cfg(feature = "tetgen")]
pub use supine_tetrahedralise_tetgen::work as tetgen_work;

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

    /// Whether this program was built with it.
    ///
    /// # Errors
    /// When not: the message says how to build it.
    pub fn check_built(self) -> Result<(), Error> {
        let built = match self {
            Self::Native => true,
            Self::Cgal => cfg!(feature = "cgal"),
            Self::Tetgen => cfg!(feature = "tetgen"),
        };
        let mesher = self.name();
        if built { Ok(()) } else { Err(Error::NotBuilt { mesher }) }
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
    mesher.check_built()?;
    mesher.check_refines(refine)?;
    let domain = Domain::new(region, params, progress.part(0.0, 0.2))?;
    let refinement = refine.of(&domain, params.tetrahedra, progress.part(0.2, 0.4))?;
    let domain = domain.refined(refinement)?;
    let progress = progress.part(0.4, 1.0);
    match mesher {
        Mesher::Native => Ok(domain.mesh(params.tetrahedra, progress)?),
        #[cfg(feature = "cgal")]
        Mesher::Cgal => {
            let found = by_cgal(
                &domain,
                region,
                (params.tetrahedra, Effort::default()),
                progress.part(0.0, 0.6),
            )?;
            Ok(domain.improve(&found.mesh, params.tetrahedra, progress.part(0.6, 1.0))?)
        }
        #[cfg(feature = "tetgen")]
        Mesher::Tetgen => {
            let found = by_tetgen(&domain, params.tetrahedra, progress.part(0.0, 0.6))?;
            Ok(domain.improve(&found.mesh, params.tetrahedra, progress.part(0.6, 1.0))?)
        }
        #[cfg(not(all(feature = "cgal", feature = "tetgen")))]
        other => Err(Error::NotBuilt { mesher: other.name() }),
    }
}

/// CGAL's mesh with the number of tetrahedra nearest to the asked one.
///
/// # Errors
/// When CGAL fails or the progress callback says stop.
#[cfg(feature = "cgal")]
pub fn by_cgal(
    domain: &Domain,
    region: &Region,
    (tetrahedra, effort): (usize, Effort),
    progress: Progress<'_>,
) -> Result<Found, Error> {
    use supine_tetrahedralise_cgal::{Params, Solid, tetrahedralise};
    let shell = domain.shell(tetrahedra, progress.part(0.0, 0.1))?;
    let beyond = |p: &supine_space::Point| domain.beyond(p);
    let solid = Solid { beyond: &beyond, sphere: region.sphere(), rims: &shell.rims };
    let asked = (tetrahedra, effort);
    search(domain.volume_mm3(), asked, progress.part(0.1, 1.0), |edge_mm, progress| {
        Ok(tetrahedralise(&solid, &Params { edge_mm, ..Params::default() }, progress)?)
    })
}

/// TetGen's mesh with the number of tetrahedra nearest to the asked one.
///
/// # Errors
/// When TetGen fails or the progress callback says stop.
#[cfg(feature = "tetgen")]
pub fn by_tetgen(
    domain: &Domain,
    tetrahedra: usize,
    progress: Progress<'_>,
) -> Result<Found, Error> {
    use std::process::Command;
    use supine_tetrahedralise_tetgen::{Error, Params, fill};
    let program = std::env::current_exe().map_err(Error::Start)?;
    let shell = domain.shell(tetrahedra, progress.part(0.0, 0.1))?;
    let asked = (tetrahedra, Effort::default());
    search(domain.volume_mm3(), asked, progress.part(0.1, 1.0), |edge_mm, progress| {
        let params = Params {
            // The volume of a regular tetrahedron with that edge, and what the largest exceeds it by.
            max_volume_mm3: 1.6 * edge_mm.powi(3) / 72f64.sqrt(),
            max_points: 20 * tetrahedra,
            ..Params::default()
        };
        let mut worker = Command::new(&program);
        worker.arg(TETGEN_WORKER);
        Ok(fill(&shell.points, &shell.faces, &params, &mut worker, progress)?)
    })
}
