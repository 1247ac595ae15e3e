//! What Rust and C++ tell each other.

use supine_mesh::BoundaryTag;
use supine_space::{Point, Progress, Stopped};

#[cxx::bridge(namespace = "supine_cgal")]
pub(crate) mod ffi {
    /// What is asked of CGAL; lengths in mm.
    struct Request {
        centre: [f64; 3],
        radius: f64,
        edge: f64,
        /// Largest distance of a triangle from its surface, in edge lengths.
        sag: f64,
        /// How near to its surface a vertex lies.
        precision: f64,
        /// Whether CGAL removes slivers itself.
        optimise: bool,
        /// Longest time for each way of removing slivers, s.
        patience: f64,
    }

    /// A mesh in plain numbers.
    struct Raw {
        points: Vec<f64>,
        tets: Vec<u32>,
        faces: Vec<u32>,
        tags: Vec<u8>,
    }

    extern "Rust" {
        type Places<'a>;
        #[allow(clippy::needless_lifetimes, reason = "the bridge asks for it")]
        unsafe fn label<'a>(self: &Places<'a>, x: f64, y: f64, z: f64) -> Result<u8>;
    }

    unsafe extern "C++" {
        include!("mesh.h");
        unsafe fn mesh<'a>(
            places: &Places<'a>,
            request: &Request,
            rims: &[f64],
            lengths: &[usize],
        ) -> Result<Raw>;
    }
}

/// So many questions pass between two looks at the progress callback.
const LOOK: u64 = 2048;

/// Answers what lies where, and hears whether to go on.
pub(crate) struct Places<'a> {
    pub(crate) beyond: &'a dyn Fn(&Point) -> Option<BoundaryTag>,
    pub(crate) progress: Progress<'a>,
    /// Questions after which about 2/3 of the work is done.
    pub(crate) expected: f64,
    pub(crate) asked: std::cell::Cell<u64>,
    pub(crate) stopped: std::cell::Cell<Option<Stopped>>,
}

impl Places<'_> {
    /// 0 inside, else the number of the tag beyond which the point lies; an error, which CGAL
    /// passes through, when the user asked to stop.
    pub(crate) fn label(&self, x: f64, y: f64, z: f64) -> Result<u8, Stopped> {
        let asked = self.asked.get() + 1;
        self.asked.set(asked);
        if asked.is_multiple_of(LOOK)
            && let Err(stopped) = self.progress.at(1.0 - (-(asked as f64) / self.expected).exp())
        {
            self.stopped.set(Some(stopped));
            return Err(stopped);
        }
        Ok((self.beyond)(&Point::new(x, y, z)).map_or(0, BoundaryTag::number))
    }
}
