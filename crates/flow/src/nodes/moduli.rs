//! A modulus for each tetrahedron, when the case asks for moduli by tissue.

use super::{Import, Mesh, Tissues};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::import::Imported;
use crate::nodes::tissues::Labelled;
use crate::shared::{TissueMap, moduli, shares};
use crate::spec::{Stiffness, StiffnessMap};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_mesh::{Locator, TetMesh};
use supine_report::{FittedTissues, Moduli as Facts, StateFit};
use supine_space::Vector;

pub(crate) struct Moduli;

/// Shares of fat, gland, skin and tumour where there is fat alone.
const FAT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    by_labels: bool,
    stiffness: Option<([f64; 4], Option<f64>)>,
}

/// The moduli and what a report tells of them.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct ByTissue {
    /// Shares of fat, gland, skin and tumour in each tetrahedron.
    pub(crate) shares: Vec<[f64; 4]>,
    /// Of each tetrahedron, kPa.
    pub(crate) young_kpa: Vec<f64>,
    facts: Facts,
}

/// Where tissue is read from; none where it was not looked for.
pub(crate) fn tissue_map<'a>(
    input: &'a Imported,
    tissues: &'a Labelled,
    by_labels: bool,
) -> Option<TissueMap<'a>> {
    let (labels, facts) = (tissues.labels.as_ref()?, tissues.facts.as_ref()?);
    let kind = if by_labels { StiffnessMap::Labels } else { StiffnessMap::Hounsfield };
    Some(TissueMap {
        labels,
        ct: &input.ct,
        levels_hu: (facts.levels.fat_hu, facts.levels.gland_hu),
        kind,
    })
}

impl ByTissue {
    pub(crate) fn facts(&self) -> &Facts {
        &self.facts
    }

    /// Moduli of fat, gland, skin and tumour, kPa.
    pub(crate) fn kpa(&self) -> [f64; 4] {
        let Facts { fat_kpa, gland_kpa, skin_kpa, tumour_kpa, .. } = self.facts;
        [fat_kpa, gland_kpa, skin_kpa, tumour_kpa]
    }

    /// The tissues in the tetrahedra of a mesh, with moduli for each.
    pub(crate) fn of(mesh: &TetMesh, map: &TissueMap<'_>, stiffness: &Stiffness) -> Self {
        let shares = shares(mesh, map);
        let (young_kpa, facts) = moduli(mesh, &shares, stiffness);
        Self { shares, young_kpa, facts }
    }

    /// The same on another mesh of the region: each tetrahedron has the tissues of the one in which
    /// its middle lies; beside the mesh there is fat.
    pub(crate) fn carried(&self, from: &Arc<TetMesh>, to: &TetMesh) -> Self {
        let locator = Locator::new(Arc::clone(from));
        let at = |tet: usize| {
            let middle = to.corners(tet).iter().map(|p| p.coords / 4.0).sum::<Vector>();
            locator.locate(&middle.into()).map_or(FAT, |place| self.shares[place.tet])
        };
        let shares: Vec<[f64; 4]> = (0..to.tets().len()).map(at).collect();
        let young_kpa = supine_personalise::moduli(&shares, &self.kpa());
        Self { shares, young_kpa, facts: self.facts.clone() }
    }

    /// The same tissues in the tetrahedra of another mesh of the region.
    pub(crate) fn on(&self, mesh: &TetMesh, map: &TissueMap<'_>) -> Self {
        let shares = shares(mesh, map);
        let young_kpa = supine_personalise::moduli(&shares, &self.kpa());
        Self { shares, young_kpa, facts: self.facts.clone() }
    }

    /// Those with what was fitted.
    pub(crate) fn fitted(&self, mesh: &TetMesh, fit: &StateFit) -> (Vec<f64>, Facts) {
        let fitted = fit.tissues.as_ref().map(FittedTissues::proportions);
        let kpa = fitted.unwrap_or_else(|| self.kpa());
        let map = StiffnessMap::named(&self.facts.map);
        let stiffness = Stiffness { map, kpa, mean_kpa: Some(fit.young_kpa), given: true };
        moduli(mesh, &self.shares, &stiffness)
    }
}

impl Node for Moduli {
    const ID: NodeId = NodeId::Moduli;
    const METHOD: u32 = 2;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Tissues, Mesh);
    type Out = Option<ByTissue>;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let stiffness = case_state.case.stiffness;
        Ok(NodeInputs {
            by_labels: stiffness.is_some_and(|s| s.map == StiffnessMap::Labels),
            stiffness: stiffness.map(|s| (s.kpa, s.mean_kpa)),
        })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Self::Out> {
        inputs.stiffness.is_none().then_some(None)
    }

    fn run(
        inputs: &NodeInputs,
        (input, tissues, meshed): Outs<Self>,
        _: &Work<'_>,
    ) -> Result<Self::Out, Error> {
        let map = tissue_map(&input, &tissues, inputs.by_labels);
        let (Some((kpa, mean_kpa)), Some(map)) = (inputs.stiffness, map) else { return Ok(None) };
        let stiffness = Stiffness { map: map.kind, kpa, mean_kpa, given: true };
        Ok(Some(ByTissue::of(&meshed.mesh, &map, &stiffness)))
    }

    fn facts(out: &Self::Out) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Self::Out, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}
