//! From question and curves to a mesh.

use crate::bridge::{Places, ffi};
use std::cell::Cell;
use supine_mesh::{BoundaryFace, BoundaryTag, MeshError, TetMesh};
use supine_space::{Failure, Point, Progress, Sphere, Stopped};

/// What is to be meshed.
#[derive(Clone, Copy)]
pub struct Solid<'a> {
    /// The surface beyond which a place (LPS, mm) lies; `None` inside.
    pub beyond: &'a dyn Fn(&Point) -> Option<BoundaryTag>,
    /// A sphere that holds all of it, LPS, mm.
    pub sphere: Sphere,
    /// Curves that become edges of the mesh, as chains of points (LPS, mm); closed ones end where
    /// they begin, and chains that meet share the point.
    pub rims: &'a [Vec<Point>],
}

impl std::fmt::Debug for Solid<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Solid({:?}, {} rims)", self.sphere, self.rims.len())
    }
}

/// Settings of the mesher.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Longest edge on the rims, and largest radius of the circumscribed circles and spheres of
    /// triangles and tetrahedra, mm.
    pub edge_mm: f64,
    /// Largest distance of a triangle from its surface, in edge lengths.
    pub sag: f64,
    /// Whether CGAL removes slivers itself (perturbation, then exudation).
    pub remove_slivers: bool,
}

impl Default for Params {
    fn default() -> Self {
        Self { edge_mm: 5.0, sag: 0.06, remove_slivers: true }
    }
}

/// How near to their surface vertices are placed, mm.
const PRECISION_MM: f64 = 0.002;
/// Longest time that each way of removing slivers may take, s. Far more than it takes: a mesh that
/// depends on the clock is no use.
const PATIENCE_S: f64 = 600.0;
/// Questions of CGAL for each edge length squared on the sphere's surface, seen on breasts.
const QUESTIONS: f64 = 200.0;

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A setting is out of its range.
    #[error("the setting {name} = {value:.3} of CGAL must be {range}")]
    Setting {
        /// Name of the field of `Params`.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// CGAL gave up.
    #[error("CGAL could not mesh the region ({0}); use the native mesher, or another count")]
    Failed(String),
    /// CGAL's result is not a mesh.
    #[error("CGAL made a broken mesh ({0}); use the native mesher, or another count")]
    Broken(#[from] MeshError),
}

impl Error {
    /// The kind of failure: all but a stop is one of the method.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Stopped(_) => Failure::Stopped,
            _ => Failure::Method,
        }
    }
}

/// A mesh with edges of about the asked length; boundary faces carry the tag beyond which their
/// outer side lies. The progress is an estimate: CGAL does not tell how far it is.
///
/// # Errors
/// When a setting is not usable, CGAL makes no mesh, or the progress callback says stop.
pub fn tetrahedralise(
    solid: &Solid<'_>,
    params: &Params,
    progress: Progress<'_>,
) -> Result<TetMesh, Error> {
    check(params)?;
    progress.at(0.0)?;
    let (centre, radius) = (solid.sphere.centre(), solid.sphere.radius());
    let edges = radius / params.edge_mm;
    let places = Places {
        beyond: solid.beyond,
        progress,
        expected: QUESTIONS * edges * edges * 12.6,
        asked: Cell::new(0),
        stopped: Cell::new(None),
    };
    let request = ffi::Request {
        centre: centre.coords.into(),
        radius,
        edge: params.edge_mm,
        sag: params.sag,
        precision: PRECISION_MM,
        optimise: params.remove_slivers,
        patience: PATIENCE_S,
    };
    let flat: Vec<f64> = solid.rims.iter().flatten().flat_map(|p| p.coords.data.0[0]).collect();
    let lengths: Vec<usize> = solid.rims.iter().map(Vec::len).collect();
    let raw = ask(&places, &request, &flat, &lengths);
    if let Some(stopped) = places.stopped.get() {
        return Err(stopped.into());
    }
    let mesh = mesh(&raw.map_err(|e| Error::Failed(e.what().to_owned()))?)?;
    progress.at(1.0)?;
    Ok(mesh)
}

fn check(params: &Params) -> Result<(), Error> {
    let settings = [
        ("edge_mm", params.edge_mm, 0.1..=100.0, "0.1 to 100"),
        ("sag", params.sag, 0.001..=1.0, "0.001 to 1"),
    ];
    for (name, value, allowed, range) in settings {
        if !allowed.contains(&value) {
            return Err(Error::Setting { name, value, range });
        }
    }
    Ok(())
}

#[expect(unsafe_code, reason = "the bridge marks every function that borrows")]
fn ask(
    places: &Places<'_>,
    request: &ffi::Request,
    rims: &[f64],
    lengths: &[usize],
) -> Result<ffi::Raw, cxx::Exception> {
    // SAFETY: C++ keeps none of its arguments beyond the call, and reads as many coordinates as the
    // lengths add up to, three each, which the caller has put into `rims`.
    unsafe { ffi::mesh(places, request, rims, lengths) }
}

fn mesh(raw: &ffi::Raw) -> Result<TetMesh, MeshError> {
    let points = raw.points.chunks_exact(3).map(Point::from_slice).collect();
    let tets = raw.tets.chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]).collect();
    let faces = raw.faces.chunks_exact(3).zip(&raw.tags).filter_map(|(f, &tag)| {
        let tag = BoundaryTag::from_number(tag)?;
        Some(BoundaryFace { points: [f[0], f[1], f[2]], tag })
    });
    TetMesh::new(points, tets, faces.collect())
}
