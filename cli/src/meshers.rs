//! The meshers under licences of their own that this program was built with.

#[cfg(any(feature = "cgal", feature = "tetgen"))]
use supine_flow::{Error, Filled, Mesher, Solid};
#[cfg(any(feature = "cgal", feature = "tetgen"))]
use supine_space::{Failure, Progress};

/// The argument by which the program is started again as the process in which TetGen runs.
#[cfg(feature = "tetgen")]
pub(crate) const TETGEN_WORKER: &str = "tetgen-worker";

/// Tells the flow of them.
pub(crate) fn offer() {
    #[cfg(feature = "cgal")]
    Mesher::Cgal.is_built_with(by_cgal);
    #[cfg(feature = "tetgen")]
    Mesher::Tetgen.is_built_with(by_tetgen);
}

#[cfg(feature = "cgal")]
fn by_cgal(solid: &Solid<'_>, edge_mm: f64, progress: Progress<'_>) -> Filled {
    use supine_tetrahedralise_cgal::{Params, Solid as Filled, tetrahedralise};
    let beyond = |p: &supine_space::Point| solid.domain.beyond(p);
    let filled = Filled { beyond: &beyond, sphere: solid.sphere, rims: &solid.shell.rims };
    let params = Params { edge_mm, ..Params::default() };
    tetrahedralise(&filled, &params, progress).map_err(|e| failed(e.kind(), e))
}

#[cfg(feature = "tetgen")]
fn by_tetgen(solid: &Solid<'_>, edge_mm: f64, progress: Progress<'_>) -> Filled {
    use supine_tetrahedralise_tetgen::{Error, Params, fill};
    let params = Params {
        // The volume of a regular tetrahedron with that edge, and what the largest exceeds it by.
        max_volume_mm3: 1.6 * edge_mm.powi(3) / 72f64.sqrt(),
        max_points: 20 * solid.tetrahedra,
        ..Params::default()
    };
    let program = std::env::current_exe().map_err(Error::Start);
    let filled = program.and_then(|program| {
        let mut worker = std::process::Command::new(program);
        worker.arg(TETGEN_WORKER);
        fill(&solid.shell.points, &solid.shell.faces, &params, &mut worker, progress)
    });
    filled.map_err(|e| failed(e.kind(), e))
}

#[cfg(any(feature = "cgal", feature = "tetgen"))]
fn failed(kind: Failure, error: impl std::error::Error + Send + Sync + 'static) -> Error {
    match kind {
        Failure::Stopped => Error::Stopped,
        kind => Error::Fill { kind, source: Box::new(error) },
    }
}
