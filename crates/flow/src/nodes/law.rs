//! The tissue, its load and how it is solved: what several nodes see of the case in the same way.

use crate::Error;
use crate::spec::Case;
use serde::Serialize;
use supine_fem::{Cut, Load, Membrane, Params, RestState, SlidingArea, Tissue};
use supine_mesh::Order;
use supine_personalise::with_additions;
use supine_report::{StateFit, TissueFit};
use supine_space::{Vector, Warning};

/// No operating table is tilted further, degrees.
const STEEP_DEG: f64 = 60.0;

/// The tissue, its load and how it is solved.
#[derive(Serialize, Clone, Copy, Debug)]
pub(crate) struct Law {
    young_kpa: f64,
    poisson: f64,
    density_kg_m3: f64,
    #[serde(skip_serializing_if = "supine_fem::Law::is_default")]
    law: supine_fem::Law,
    #[serde(skip_serializing_if = "is_none")]
    stiffening: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    fibres: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fibre_direction: Option<[f64; 3]>,
    rest: RestState,
    cut: Cut,
    spring_kpa_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sliding: Option<SlidingArea>,
    #[serde(skip_serializing_if = "Option::is_none")]
    skin: Option<Membrane>,
    order: u8,
    /// Directions of gravity in the CT and on the table, unit vectors, LPS.
    gravity: [[f64; 3]; 2],
}

/// Whether a law has no such parameter.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_none(stiffening: &f64) -> bool {
    *stiffening <= 0.0
}

impl Law {
    pub(crate) fn of(case: &Case) -> Result<Self, Error> {
        Ok(Self::under(case, case.load()?))
    }

    /// The law of a case under another load than that of its table.
    pub(crate) fn under(case: &Case, load: Load) -> Self {
        let Tissue { young_kpa, poisson, density_kg_m3, law, stiffening, .. } = case.tissue;
        let fibres = case.tissue.fibres;
        Self {
            young_kpa,
            poisson,
            density_kg_m3,
            law,
            stiffening,
            fibres: (fibres > 0.0).then_some([fibres, case.tissue.fibre_stiffening]),
            fibre_direction: case.tissue.fibre_direction,
            rest: case.rest,
            cut: case.cut,
            spring_kpa_mm: case.spring_kpa_mm,
            sliding: case.sliding,
            skin: case.skin,
            order: case.mesh.order.number(),
            gravity: [load.ct.into(), load.target.into()],
        }
    }

    /// The law with what was fitted, where something was.
    pub(crate) fn fitted(&self, fit: Option<&TissueFit>) -> Self {
        let Some(fit) = fit else { return *self };
        let StateFit { young_kpa, rest, .. } = *fit.best();
        let (tissue, params) = with_additions(fit.additions(), &self.tissue(), &self.solver());
        let Tissue { law, stiffening, fibres, fibre_stiffening, .. } = tissue;
        let fibres = (fibres > 0.0).then_some([fibres, fibre_stiffening]);
        let (sliding, skin) = (params.sliding, params.skin);
        Self { young_kpa, rest, law, stiffening, fibres, sliding, skin, ..*self }
    }

    /// What is said of a law that stiffens, of fibres, of skin and of a wall that slides.
    pub(crate) fn assumed(&self) -> Option<Warning> {
        let law = (!self.law.is_default())
            .then(|| format!("that the tissue stiffens (law {}, {})", self.law, self.stiffening));
        let fibres = self.fibres.map(|[ratio, _]| format!("fibres of {ratio} times its modulus"));
        let skin = self.skin.map(|skin| format!("a skin of {} kPa", skin.young_kpa));
        let sliding = self.sliding.map(|area| {
            format!("tissue that slides on the chest wall ({} kPa/mm)", area.stiffness_kpa_mm)
        });
        let what: Vec<String> = law.into_iter().chain(fibres).chain(skin).chain(sliding).collect();
        let text = format!(
            "{} is assumed and was measured in no breast: the interval does not hold what another assumption would move",
            what.join(" with ")
        );
        (!what.is_empty()).then(|| Warning::new("law-assumed", text))
    }

    /// What is said of a table that is turned far: degrees are easily mistyped.
    pub(crate) fn steep(&self) -> Option<Warning> {
        let [_, target] = self.gravity.map(Vector::from);
        let degrees = target.angle(&supine_space::supine()).to_degrees();
        let text = format!(
            "the table turns the patient by {degrees:.0} degrees from lying on her back: check `table` for a mistyped angle"
        );
        (degrees > STEEP_DEG).then(|| Warning::new("table-steep", text))
    }

    /// What files for other solvers do not hold, if there is something.
    pub(crate) fn beyond_problem_files(&self) -> Option<&'static str> {
        match self {
            Self { fibres: Some(_), .. } => Some("fibres"),
            Self { sliding: Some(_), .. } => Some("tissue that slides on the chest wall"),
            Self { skin: Some(_), .. } => Some("a skin"),
            Self { law, .. } if !law.is_default() => Some(law.name()),
            _ => None,
        }
    }

    pub(crate) fn tissue(&self) -> Tissue {
        let Self { young_kpa, poisson, density_kg_m3, law, stiffening, fibre_direction, .. } =
            *self;
        let none = Tissue::default();
        let [fibres, fibre_stiffening] =
            self.fibres.unwrap_or([none.fibres, none.fibre_stiffening]);
        Tissue {
            young_kpa,
            poisson,
            density_kg_m3,
            law,
            stiffening,
            fibres,
            fibre_stiffening,
            fibre_direction,
        }
    }

    pub(crate) fn load(&self) -> Load {
        let [ct, target] = self.gravity.map(Vector::from);
        Load { ct, target }
    }

    pub(crate) fn solver(&self) -> Params {
        Params {
            order: if self.order == 1 { Order::Linear } else { Order::Quadratic },
            rest: self.rest,
            cut: self.cut,
            spring_kpa_mm: self.spring_kpa_mm,
            sliding: self.sliding,
            skin: self.skin,
            ..Params::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Spec;

    #[test]
    fn a_table_that_stands_is_told() {
        let steep = |table: &str| {
            let case = Spec::from_text(&format!("table = {{ {table} }}"), "").unwrap();
            Law::of(&case.case().unwrap()).unwrap().steep().map(|warning| warning.to_string())
        };
        assert_eq!(steep("ap = 30.0, lat = -30.0"), None);
        assert!(steep("ap = 70.0, lat = 5.0").unwrap().contains("by 70 degrees"));
        assert!(steep("ap = 0.0, lat = 180.0").unwrap().contains("by 180 degrees"));
    }

    #[test]
    fn what_is_assumed_of_a_tissue_is_told() {
        let assumed = |tissue: &str| {
            let text = format!("table = {{ ap = 7.0, lat = 5.0 }}\n[tissue]\n{tissue}");
            let case = Spec::from_text(&text, "").unwrap().case().unwrap();
            Law::of(&case).unwrap().assumed().map(|warning| warning.to_string())
        };
        assert_eq!(assumed("young = 0.7"), None);
        let both = assumed("law = 'gent'\nstiffening = 0.4\nfibres = 2.0").unwrap();
        let want = "stiffens (law gent, 0.4) with fibres of 2 times its modulus is assumed";
        assert!(both.contains(want), "{both}");
        assert!(assumed("fibres = 2.0").unwrap().starts_with("fibres of 2 times"));
        let boundary = assumed("[wall]\nhold = 'sliding'\n[skin]\nyoung = 90.0").unwrap();
        let want = "a skin of 90 kPa with tissue that slides on the chest wall (0.02 kPa/mm) is";
        assert!(boundary.starts_with(want), "{boundary}");
    }
}
