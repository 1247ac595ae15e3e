//! What can be chosen, and what is told of a solution.

use crate::Error;
use supine_mesh::Order;
use supine_record::{Cut, Law, Membrane, RestState, SlidingArea, Solve};
use supine_space::{GRAVITY_M_S2, Vector, Warning};

/// The soft tissue: homogeneous, isotropic, compressible.
///
/// A modulus belongs to the rest state and the element order it was fitted with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tissue {
    /// Young's modulus E at small strain, kPa.
    pub young_kpa: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Density ρ, kg/m³.
    pub density_kg_m3: f64,
    /// How it goes on beyond small strain.
    pub law: Law,
    /// How much the shear modulus grows by unit of Q at small strain, in proportion
    /// (Q as in the head of this crate); nothing to a neo-Hookean solid.
    pub stiffening: f64,
    /// Young's modulus that fibres from the chest wall to the skin add along themselves in tension,
    /// at small strain, over that of the tissue; 0: none.
    pub fibres: f64,
    /// k of the fibres, how fast they stiffen.
    pub fibre_stiffening: f64,
    /// Which way the fibres run in the CT, LPS, of any length; `None`: from the chest wall to the
    /// skin.
    pub fibre_direction: Option<[f64; 3]>,
}

impl Default for Tissue {
    fn default() -> Self {
        Self {
            young_kpa: 0.609,
            poisson: 0.45,
            density_kg_m3: 1000.0,
            law: Law::NeoHookean,
            stiffening: 0.0,
            fibres: 0.0,
            fibre_stiffening: 1.0,
            fibre_direction: None,
        }
    }
}

fn in_range(name: &'static str, value: f64, ok: bool, range: &'static str) -> Result<(), Error> {
    if ok { Ok(()) } else { Err(Error::OutOfRange { name, value, range }) }
}

impl Tissue {
    /// Checks that the numbers describe a solid.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the value and its range.
    pub fn check(&self) -> Result<(), Error> {
        let (e, nu, rho) = (self.young_kpa, self.poisson, self.density_kg_m3);
        in_range("Young's modulus (kPa)", e, (0.001..=1e6).contains(&e), "0.001 to 1000000")?;
        in_range(
            "Poisson's ratio",
            nu,
            (0.0..0.4999).contains(&nu),
            "at least 0 and below 0.4999",
        )?;
        in_range("density (kg/m³)", rho, (1.0..=20_000.0).contains(&rho), "1 to 20000")?;
        let b = self.stiffening;
        let ok = self.law == Law::NeoHookean || (0.001..=20.0).contains(&b);
        in_range("stiffening", b, ok, "0.001 to 20")?;
        let (f, k) = (self.fibres, self.fibre_stiffening);
        in_range("fibres over Young's modulus", f, (0.0..=1000.0).contains(&f), "0 to 1000")?;
        in_range("stiffening of fibres", k, (0.001..=100.0).contains(&k), "0.001 to 100")?;
        let length = self.fibre_direction.map_or(1.0, |along| Vector::from(along).norm());
        let ok = length > 0.0 && length.is_finite();
        in_range("length of the direction of fibres", length, ok, "above 0")
    }

    /// Weight ρ g per volume, kPa/mm.
    pub fn weight(&self) -> f64 {
        self.density_kg_m3 * GRAVITY_M_S2 * 1e-6
    }
}

/// Directions of gravity: unit vectors in LPS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// In which the CT was taken.
    pub ct: Vector,
    /// The one wanted.
    pub target: Vector,
}

impl Load {
    /// Checks that both are directions.
    ///
    /// # Errors
    /// [`Error::Direction`] when a length is not 1 within 1e-6.
    pub(crate) fn check(&self) -> Result<(), Error> {
        for (which, v) in [("CT", self.ct), ("target", self.target)] {
            let length = v.norm();
            if length.is_nan() || (length - 1.0).abs() > 1e-6 {
                return Err(Error::Direction { which, direction: v.into(), length });
            }
        }
        Ok(())
    }
}

fn check_area(area: &SlidingArea) -> Result<(), Error> {
    let SlidingArea { centre_mm, radius_mm: radius, rim_mm: rim, stiffness_kpa_mm: k } = *area;
    let far = centre_mm.map_or(0.0, |centre| Vector::from(centre).amax());
    in_range("middle of the sliding wall (mm)", far, far < 1e6, "within 1000000")?;
    in_range(
        "radius of the sliding wall (mm)",
        radius,
        (1.0..=1e4).contains(&radius),
        "1 to 10000",
    )?;
    let ok = rim > 0.0 && rim <= radius;
    in_range("rim of the sliding wall (mm)", rim, ok, "above 0, at most the radius")?;
    in_range(
        "shear stiffness of the sliding wall (kPa/mm)",
        k,
        (0.0..=1e6).contains(&k),
        "0 to 1000000",
    )
}

fn check_skin(skin: &Membrane) -> Result<(), Error> {
    let Membrane { thickness_mm: h, young_kpa: e, stretch } = *skin;
    in_range("thickness of the skin (mm)", h, (0.01..=10.0).contains(&h), "0.01 to 10")?;
    in_range(
        "Young's modulus of the skin (kPa)",
        e,
        (0.001..=1e6).contains(&e),
        "0.001 to 1000000",
    )?;
    in_range("stretch of the skin", stretch, (1.0..=2.0).contains(&stretch), "1 to 2")
}

/// How to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Order of the elements.
    pub order: Order,
    /// What is stress-free.
    pub rest: RestState,
    /// What happens at the cut.
    pub cut: Cut,
    /// Stiffness of the springs of [`Cut::Spring`], traction per displacement, kPa/mm; `None`: that
    /// of a layer as thick as the cut, π μ / 2h with h the way from chest wall to skin at each
    /// face.
    pub spring_kpa_mm: Option<f64>,
    /// Where the tissue slides on the chest wall; `None`: it is held everywhere.
    pub sliding: Option<SlidingArea>,
    /// The skin, where it counts as more than tissue.
    pub skin: Option<Membrane>,
    /// Norm of the out-of-balance forces over that of load or reactions at which a solution counts.
    pub tolerance: f64,
    /// Newton iterations before a load (or load step) is given up.
    pub max_iterations: usize,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            order: Order::Quadratic,
            rest: RestState::Net,
            cut: Cut::default(),
            spring_kpa_mm: None,
            sliding: None,
            skin: None,
            tolerance: 1e-10,
            max_iterations: 60,
        }
    }
}

impl Params {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the value and its range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let t = self.tolerance;
        in_range("solver tolerance", t, (1e-12..=1e-4).contains(&t), "1e-12 to 1e-4")?;
        if let Some(k) = self.spring_kpa_mm {
            in_range("springs at the cut (kPa/mm)", k, (0.0..=1e6).contains(&k), "0 to 1000000")?;
        }
        if let Some(sliding) = &self.sliding {
            check_area(sliding)?;
        }
        if let Some(skin) = &self.skin {
            check_skin(skin)?;
        }
        let n = self.max_iterations;
        in_range("Newton iterations", n as f64, n > 0, "at least 1")
    }
}

/// Below this det F a result carries a warning: tissue squeezed to less is beyond what its law is
/// known to describe. Chosen, not measured.
pub const SQUEEZED_DET_F: f64 = 0.3;

/// What happened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Info {
    /// What a user should know.
    pub warnings: Vec<Warning>,
    /// What is told of the solution.
    pub solve: Solve,
    /// Unknowns of the system.
    pub unknowns: usize,
    /// Entries of the triangular factor of its matrix.
    pub factor_entries: usize,
    /// How the stress-free shape was found; `None` for [`RestState::Net`].
    pub unloading: Option<Unloading>,
}

/// How the stress-free shape was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unloading {
    /// Newton iterations of the inverse problem.
    pub iterations: usize,
    /// Largest distance of the stress-free shape from the CT shape, mm.
    pub max_distance_mm: f64,
    /// Largest distance from the CT shape after a cold forward solve back to it, mm; `None` when
    /// that was not tried: see [`crate::Sequence`].
    pub reload_error_mm: Option<f64>,
    /// Smallest det of the map from the CT shape to the stress-free shape.
    pub min_det: f64,
}
