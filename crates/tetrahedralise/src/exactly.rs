//! The asked number of tetrahedra, or the smallest that works.

use crate::mesher::Mesher;
use crate::params::MAX_TETRAHEDRA;
use crate::{Error, Info};
use supine_space::Progress;

/// Fewer tetrahedra than this hold no breast.
pub(crate) const MIN_TETRAHEDRA: usize = 200;
/// Numbers tried until one works, each larger by this share.
const TRIES: usize = 30;
const STEP: f64 = 0.1;

/// The mesh of exactly the asked number of tetrahedra. `attempt` makes the best mesh it can of a
/// number; it may have another.
///
/// # Errors
/// When there are other than the asked: then the smallest larger number is sought that works, and
/// named.
pub(crate) fn exactly<'a>(
    asked: usize,
    progress: Progress<'_>,
    mut attempt: impl FnMut(usize, Progress<'_>) -> Result<(Mesher<'a>, Info), Error>,
) -> Result<(Mesher<'a>, Info), Error> {
    if asked > MAX_TETRAHEDRA {
        return Err(Error::TooMany { asked, max: MAX_TETRAHEDRA });
    }
    let mut tried = asked.max(MIN_TETRAHEDRA);
    let (mesher, info) = attempt(tried, progress.part(0.0, 0.9))?;
    let first = mesher.mesh.count();
    if first == asked {
        return Ok((mesher, info));
    }
    let mut reached = first;
    for _ in 0..TRIES {
        if reached == tried {
            return Err(Error::TooFew { asked, min: tried });
        }
        let next = tried + (STEP * tried as f64) as usize;
        tried = if reached > tried { reached } else { next };
        reached = attempt(tried, progress.part(0.9, 1.0))?.0.mesh.count();
    }
    Err(Error::Count { asked, reached: first, tried })
}
