//! A tagged tetrahedral mesh by CGAL's Mesh_3, from what lies where and the rims to be kept.
//!
//! **Licence.** CGAL's Mesh_3 is under the GNU General Public License, version 3 or later, and so
//! is this crate and every program built with it. It is compiled with the feature `cgal` only, and
//! wants the headers of CGAL 5.5 (Debian: libcgal-dev).
//!
//! The soft tissue is given as a question that CGAL asks at points of its choice (which surface
//! lies this place beyond?), so it follows the same surfaces as the mesher of the house; the rims,
//! where two tags meet, are given as curves, since CGAL rounds off what it is not told. CGAL knows
//! edge lengths and no counts. Deterministic: it has one thread and its random numbers a stated
//! seed. Knows no labels, files or mechanics. LPS, mm.

#[cfg(feature = "cgal")]
#[expect(
    unsafe_code,
    unreachable_pub,
    unused_qualifications,
    unused_lifetimes,
    reason = "the bridge to C++, and what the macro writes for it"
)]
mod bridge;
#[cfg(feature = "cgal")]
mod mesher;

#[cfg(feature = "cgal")]
pub use mesher::{Error, Params, Solid, tetrahedralise};
