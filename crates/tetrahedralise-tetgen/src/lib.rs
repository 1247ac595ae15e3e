//! A closed tagged surface filled with tetrahedra by TetGen, in a process of its own.
//!
//! **Licence.** TetGen is under the GNU Affero General Public License, version 3 or later, and so
//! is this crate and every program built with it. It is compiled with the feature `tetgen` only,
//! and wants TetGen 1.5 as a library (Debian: libtet1.5-dev).
//!
//! TetGen may abort, crash or run without end on surfaces that other programs take, so it never
//! runs in the process that asks: `fill` starts a worker, hands it the surface through a pipe and
//! takes the mesh back; whatever happens to the worker becomes one error. The worker is any program
//! that calls `work`; `tetgen-worker` of this package is one. The triangles of the surface are kept
//! as they are. Knows no labels, files or mechanics. LPS, mm.

#[cfg(feature = "tetgen")]
#[expect(
    unsafe_code,
    unreachable_pub,
    unused_qualifications,
    reason = "the bridge to C++, and what the macro writes for it"
)]
mod bridge;
#[cfg(feature = "tetgen")]
mod fill;
#[cfg(any(feature = "tetgen", test))]
mod wire;
#[cfg(feature = "tetgen")]
mod worker;

#[cfg(feature = "tetgen")]
pub use fill::{Error, Params, fill};
#[cfg(feature = "tetgen")]
pub use worker::work;
