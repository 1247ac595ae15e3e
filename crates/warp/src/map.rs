//! The whole map in index space: mesh pieces first, then the collar.

use crate::kernel::LONGEST;
use crate::predicate::Index;
use crate::{Error, collar::Collar, pieces::Pieces};
use supine_space::Grid;

/// Tetrahedra in the index space of a grid, before and after deformation.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    /// Vertices in the CT, as indices of the CT.
    pub(crate) rest: Vec<Index>,
    /// The same as indices of the volume that is made.
    pub(crate) before: Vec<Index>,
    /// Vertices after deformation, as indices of the volume that is made.
    pub(crate) deformed: Vec<Index>,
    pub(crate) tets: Vec<[u32; 4]>,
    /// Tetrahedra from here on belong to the collar.
    pub(crate) collar_from: usize,
    /// Those whose voxels stay as they are where no tissue comes; none where that is nowhere.
    pub(crate) stays: Option<Vec<bool>>,
}

impl Map {
    /// Every vertex is converted once, so that tetrahedra agree exactly on what they share.
    pub(crate) fn new([ct, made]: [&Grid; 2], pieces: &Pieces, collar: &Collar) -> Self {
        let in_ct = || pieces.rest.iter().chain(&collar.rest);
        let mut tets = pieces.tets.clone();
        tets.extend_from_slice(&collar.tets);
        let mut map = Self {
            rest: in_ct().map(|p| ct.index_from_patient(p)).collect(),
            before: in_ct().map(|p| made.index_from_patient(p)).collect(),
            deformed: Vec::with_capacity(pieces.rest.len() + collar.rest.len()),
            tets,
            collar_from: pieces.tets.len(),
            stays: pieces.stays.as_ref().map(|stays| {
                let of_pieces = pieces.parents.iter().map(|parent| stays[parent.tet as usize]);
                of_pieces.chain(collar.tets.iter().map(|_| false)).collect()
            }),
        };
        map.deform(made, pieces, collar);
        map
    }

    /// Takes another displacement of the same pieces and collar.
    pub(crate) fn deform(&mut self, made: &Grid, pieces: &Pieces, collar: &Collar) {
        let moved = pieces.rest.iter().zip(&pieces.displacement).map(|(p, u)| p + u);
        let all = moved.chain(collar.deformed.iter().copied());
        self.deformed.clear();
        self.deformed.extend(all.map(|p| made.index_from_patient(&p)));
    }
}

/// Refuses grids in which nothing can be interpolated or not every voxel addressed.
pub(crate) fn check_grid(grid: &Grid) -> Result<(), Error> {
    let size = grid.size();
    if size.iter().any(|&n| n < 2) {
        return Err(Error::Thin { size });
    }
    let all = size.iter().try_fold(1i32, |all, &n| all.checked_mul(i32::try_from(n).ok()?));
    if size[..2].iter().any(|&n| n > LONGEST) || all.is_none() {
        return Err(Error::Large { size });
    }
    Ok(())
}
