//! The tissue, its load and how it is solved: what several nodes see of the case in the same way.

use crate::Error;
use crate::spec::Case;
use serde::Serialize;
use supine_fem::{Cut, Load, Params, RestState, Tissue};
use supine_mesh::Order;
use supine_report::TissueFit;
use supine_space::{Vector, Warning};

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
    rest: RestState,
    cut: Cut,
    spring_kpa_mm: Option<f64>,
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
            rest: case.rest,
            cut: case.cut,
            spring_kpa_mm: case.spring_kpa_mm,
            order: case.mesh.order.number(),
            gravity: [load.ct.into(), load.target.into()],
        }
    }

    /// The law with the modulus and rest state that were fitted, where they were.
    pub(crate) fn fitted(&self, fit: Option<&TissueFit>) -> Self {
        let Some(best) = fit.map(TissueFit::best) else { return *self };
        Self { young_kpa: best.young_kpa, rest: best.rest, ..*self }
    }

    /// What is said of a law that stiffens and of fibres.
    pub(crate) fn assumed(&self) -> Option<Warning> {
        let law = (!self.law.is_default())
            .then(|| format!("that the tissue stiffens (law {}, {})", self.law, self.stiffening));
        let fibres = self.fibres.map(|[ratio, _]| format!("fibres of {ratio} times its modulus"));
        let what: Vec<String> = law.into_iter().chain(fibres).collect();
        let text = format!(
            "{} is assumed and was measured in no breast: the interval does not hold what another law would move",
            what.join(" with ")
        );
        (!what.is_empty()).then(|| Warning::new("law-assumed", text))
    }

    pub(crate) fn tissue(&self) -> Tissue {
        let Self { young_kpa, poisson, density_kg_m3, law, stiffening, .. } = *self;
        let none = Tissue::default();
        let [fibres, fibre_stiffening] =
            self.fibres.unwrap_or([none.fibres, none.fibre_stiffening]);
        Tissue { young_kpa, poisson, density_kg_m3, law, stiffening, fibres, fibre_stiffening }
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
            ..Params::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Spec;

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
    }
}
