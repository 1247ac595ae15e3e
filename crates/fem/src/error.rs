//! Why the mechanics have no result.

use supine_space::{Failure, Stopped};

/// Why a solution could not be found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The user stopped the work.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A number of the tissue, the load or the parameters is out of range.
    #[error("{name} is {value}, but must be {range}")]
    OutOfRange {
        /// What, with its unit.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// There are not as many moduli as tetrahedra.
    #[error("{moduli} moduli were given for {tets} tetrahedra: one for each is needed")]
    Moduli {
        /// Moduli given.
        moduli: usize,
        /// Tetrahedra of the mesh.
        tets: usize,
    },
    /// A gravity direction is not a unit vector.
    #[error(
        "the {which} gravity direction ({0:.3}, {1:.3}, {2:.3}) has length {length:.3}, but a direction of \
         length 1 is needed", direction[0], direction[1], direction[2]
    )]
    Direction {
        /// `CT` or `target`.
        which: &'static str,
        /// As given, LPS.
        direction: [f64; 3],
        /// Its length.
        length: f64,
    },
    /// Nothing holds the body.
    #[error(
        "nothing holds {tets} of the {of} tetrahedra (among them tetrahedron {tet}): their part of \
         the mesh has no chest_wall face, or slides on all of them without friction. Check the \
         segmentation of the chest wall, choose a region that reaches it, or let it slide on a \
         smaller part or with friction"
    )]
    NoSupport {
        /// Tetrahedra without support.
        tets: usize,
        /// Tetrahedra of the mesh.
        of: usize,
        /// The first one without support.
        tet: usize,
    },
    /// Everything is held.
    #[error("every node of the mesh is held: there is no soft tissue left to move")]
    NothingFree,
    /// A tetrahedron has no volume at a quadrature point.
    #[error("tetrahedron {tet} is flat or turned inside out: mesh again")]
    Flat {
        /// Which one.
        tet: usize,
    },
    /// A mesh with moved points is none.
    #[error(transparent)]
    Mesh(#[from] supine_mesh::MeshError),
    /// The displacement does not fit the mesh.
    #[error(transparent)]
    Displacement(#[from] supine_mesh::DisplacementError),
    /// The offsets of curved elements are without mid-side nodes.
    #[error("the offsets of a curved shape need a vector for each edge too, not for points alone")]
    Curved,
    /// The equations were not solved.
    #[error(
        "no equilibrium found at {share:.0}% of the load after {iterations} iterations: {cause} \
         (relative residual {residual:.1e}, wanted {tolerance:.0e}; worst is tetrahedron {tet}, \
         volume ratio {volume_ratio:.3}). {advice}", share = 100.0 * load_share
    )]
    NonConvergence {
        /// What went wrong in the last attempt.
        cause: &'static str,
        /// Newton iterations in all.
        iterations: usize,
        /// Relative residual in the last attempt.
        residual: f64,
        /// The one wanted.
        tolerance: f64,
        /// Share of the load up to which equilibria were found, 0..=1.
        load_share: f64,
        /// The most compressed tetrahedron.
        tet: usize,
        /// Its smallest det F.
        volume_ratio: f64,
        /// What to do.
        advice: &'static str,
    },
    /// No stress-free shape from which supine gravity gives the CT shape.
    #[error(
        "no usable unloaded shape at a modulus of {young_kpa:.3} kPa: {problem}. {}",
        advice(*exists_from_kpa)
    )]
    NoUnloadedShape {
        /// The modulus asked for, kPa.
        young_kpa: f64,
        /// What failed.
        problem: String,
        /// A modulus at which this shape has one, kPa, when one was found.
        exists_from_kpa: Option<f64>,
    },
    /// The stiffness at the solution has no factor.
    #[error(
        "the stiffness is singular: part of the mesh may hang by a single point or edge; mesh again"
    )]
    Singular,
    /// The place whose displacement is wanted lies outside the mesh.
    #[error(
        "no tissue of the mesh lies within the goal at {centre:.1?} (LPS, mm): check its place and the region"
    )]
    GoalOutside {
        /// Its centre, LPS, mm.
        centre: [f64; 3],
    },
    /// The applicator holds no tissue.
    #[error(
        "the applicator at {centre:.1?} (LPS, mm) holds no free node of the mesh: check its place, or mesh \
         finer there"
    )]
    ApplicatorOutside {
        /// Its centre, LPS, mm.
        centre: [f64; 3],
    },
    /// Tissue cannot slide on the applicator at a node.
    #[error(
        "a node at {place:.1?} (LPS, mm) lies near the middle of the applicator, where its surface has no \
         normal to slide by: mesh finer there, move points onto the surface, or tie the contact"
    )]
    ApplicatorMiddle {
        /// The node, LPS, mm.
        place: [f64; 3],
    },
    /// Tissue lies in the applicator where it has no surface to be pressed at.
    #[error(
        "tissue at {place:.1?} (LPS, mm) lies within the applicator and has no surface there: give the cavity \
         in which it lies, put it in from outside, or mesh finer there"
    )]
    ApplicatorBuried {
        /// A node of the tissue, LPS, mm.
        place: [f64; 3],
    },
    /// The cavity holds no tissue.
    #[error(
        "the cavity at {centre:.1?} (LPS, mm, in the CT) holds the middle of no tetrahedron: check its place, mesh finer \
         there, or move points onto its surface"
    )]
    CavityEmpty {
        /// Its centre, LPS, mm.
        centre: [f64; 3],
    },
    /// A cavity is given where the tissue is held to the applicator.
    #[error(
        "a cavity goes with tissue that lifts off: leave it out, or let the contact be unilateral"
    )]
    CavityContact,
    /// A pose is not a turn and a shift.
    #[error("the pose of the applicator is not finite, or its rotation is not of length 1")]
    ApplicatorPose,
    /// The tissue does not follow the applicator.
    #[error(
        "no equilibrium found with the applicator at this pose (relative residual {residual:.1e}): it is \
         too far from the last one, or presses tissue to nothing. The last pose still holds"
    )]
    ApplicatorStuck {
        /// Relative residual of the last attempt.
        residual: f64,
    },
    /// There is not enough memory.
    #[error("not enough memory for the factor of {unknowns} unknowns: use fewer tetrahedra")]
    Memory {
        /// Number of unknowns.
        unknowns: usize,
    },
}

impl Error {
    /// What kind of failure this is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Stopped(_) => Failure::Stopped,
            Self::Displacement(error) => error.kind(),
            Self::OutOfRange { .. }
            | Self::Moduli { .. }
            | Self::Direction { .. }
            | Self::Curved
            | Self::GoalOutside { .. }
            | Self::ApplicatorOutside { .. }
            | Self::ApplicatorBuried { .. }
            | Self::CavityEmpty { .. }
            | Self::CavityContact
            | Self::ApplicatorPose => Failure::Input,
            // A mesh that the method moved or that the mesher made, not one that was read.
            Self::Mesh(_)
            | Self::NoSupport { .. }
            | Self::NothingFree
            | Self::Flat { .. }
            | Self::NonConvergence { .. }
            | Self::NoUnloadedShape { .. }
            | Self::Singular
            | Self::ApplicatorMiddle { .. }
            | Self::ApplicatorStuck { .. } => Failure::Method,
            Self::Memory { .. } => Failure::Retry,
        }
    }

    pub(crate) fn flat(tet: usize) -> Self {
        Self::Flat { tet }
    }
}

fn advice(exists_from_kpa: Option<f64>) -> String {
    match exists_from_kpa {
        Some(e) => format!(
            "One exists from about {e:.2} kPa: use that modulus or a higher one, or the rest state \
             net"
        ),
        None => "None was found at higher moduli either: use the rest state net".into(),
    }
}
