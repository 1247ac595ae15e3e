//! The displacement under the table's gravity.

use super::{Fit, Mesh, Moduli};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::law::Law;
use crate::nodes::mesh::Meshed;
use crate::nodes::moduli::ByTissue;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_exchange::{read_vtu, write_vtu};
use supine_fem::Body;
use supine_mesh::Deformation;
use supine_report::TissueFit;

pub(crate) struct Solve;

impl Law {
    /// The body of a mesh, with what was fitted where a modulus was.
    pub(crate) fn body(
        &self,
        meshed: &Meshed,
        moduli: Option<&ByTissue>,
        fit: Option<&TissueFit>,
    ) -> Body {
        let inputs = |by: &ByTissue| match fit {
            Some(fit) => Arc::from(by.fitted(&meshed.mesh, fit.best()).0),
            None => Arc::from(by.young_kpa.as_slice()),
        };
        Body {
            young_kpa: moduli.map(inputs),
            curved: meshed.curved.clone(),
            ..Body::new(Arc::clone(&meshed.mesh), self.tissue())
        }
    }
}

/// The displacement of the nodes, from the CT shape, as the solver gives it.
#[derive(Debug)]
pub(crate) struct Solved {
    pub(crate) deformation: Deformation,
    pub(crate) facts: Facts,
}

#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) solve: supine_report::Solve,
    pub(crate) unknowns: usize,
}

impl Solved {
    /// A displacement that is given in place of being found.
    pub(crate) fn given(deformation: Deformation) -> Self {
        let solve = supine_report::Solve {
            min_det_f: 1.0,
            max_det_f: 1.0,
            max_displacement_mm: deformation.displacement().max_norm(),
            ..supine_report::Solve::default()
        };
        Self { deformation, facts: Facts { solve, unknowns: 0 } }
    }
}

impl Node for Solve {
    const ID: NodeId = NodeId::Solve;
    const METHOD: u32 = 6;
    const KEPT: bool = true;
    type NodeInputs = Law;
    type Parents = (Mesh, Moduli, Fit);
    type Out = Solved;

    fn inputs(case_state: &CaseState) -> Result<Law, Error> {
        Law::of(&case_state.case)
    }

    fn run(
        inputs: &Law,
        (meshed, moduli, fit): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Solved, Error> {
        let assumed = inputs.assumed();
        let inputs = inputs.fitted(fit.tissue());
        let body = inputs.body(&meshed, fit.stiffness(&moduli), fit.tissue());
        let (deformation, info) =
            supine_fem::solve(&body, &inputs.load(), &inputs.solver(), work.progress)?;
        work.warn_all(inputs.steep().into_iter().chain(assumed).chain(info.warnings));
        let facts = Facts { solve: info.solve, unknowns: info.unknowns };
        Ok(Solved { deformation, facts })
    }

    fn save(out: &Solved, work: &Work<'_>) -> Result<(), Error> {
        let path = work.place("deformed")?;
        let (mesh, displacement) = (out.deformation.mesh(), out.deformation.displacement());
        write_vtu(mesh, Some(displacement), &path).map_err(Error::product)
    }

    fn facts(out: &Solved) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.facts)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Solved, Error> {
        let facts = serde_json::from_value(facts)?;
        let path = work.place("deformed")?;
        let (mesh, displacement) = read_vtu(&path).map_err(Error::product)?;
        let displacement = displacement.ok_or(Error::NoDisplacement { path })?;
        Ok(Solved { deformation: Deformation::new(Arc::new(mesh), displacement)?, facts })
    }
}
