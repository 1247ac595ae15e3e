//! A problem of the mechanics as files of other solvers hold it.

use supine_exchange::Statics;
use supine_fem::Tissue;
use supine_mesh::Order;
use supine_space::{GRAVITY_M_S2, Vector};

/// The problem of a mesh at its stress-free shape: elements of an order, gravity in units of g
/// (LPS), the cut held or free.
///
/// With the rest state `net` gravity is that of the pose minus that of the CT.
pub fn statics(tissue: &Tissue, gravity: Vector, order: Order, cut_held: bool) -> Statics {
    Statics {
        young_kpa: tissue.young_kpa,
        poisson: tissue.poisson,
        density_kg_m3: tissue.density_kg_m3,
        acceleration_m_s2: gravity * GRAVITY_M_S2,
        order,
        cut_held,
    }
}
