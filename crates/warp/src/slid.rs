//! Tissue that slid along the chest wall.
//!
//! The wall of a mesh has bumps, over which the tissue slides as if they were smoothed: between
//! wall and moved tissue, voxels may be left that no tetrahedron covers. Nothing opens there, and
//! no air gets in: the tissue beside the wall keeps its values.

use supine_mesh::{BoundaryTag, Displacement, TetMesh};

/// Farther than this a wall has moved, mm.
const STILL_MM: f64 = 1e-3;

/// Whether each tetrahedron has a point of the chest wall that slid, and none of the skin; nothing
/// where the tissue did not slide at all.
pub(crate) fn on_slid_wall(mesh: &TetMesh, displacement: &Displacement) -> Option<Vec<bool>> {
    let moves = |p: u32| displacement.values()[p as usize].norm() > STILL_MM;
    let mut slid = vec![false; mesh.points().len()];
    mesh.points_on(BoundaryTag::ChestWall).into_iter().for_each(|p| slid[p as usize] = moves(p));
    if !slid.contains(&true) {
        return None;
    }
    let mut skin = vec![false; mesh.points().len()];
    mesh.points_on(BoundaryTag::Skin).into_iter().for_each(|p| skin[p as usize] = true);
    let on = |tet: &[u32; 4]| {
        tet.iter().any(|p| slid[*p as usize]) && tet.iter().all(|p| !skin[*p as usize])
    };
    Some(mesh.tets().iter().map(on).collect())
}
