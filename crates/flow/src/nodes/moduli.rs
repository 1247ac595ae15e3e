//! A modulus for each tetrahedron, when the case asks for moduli by tissue.

use super::{Import, Mesh, Tissues};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::shared::{ModulusMap, moduli};
use crate::spec::{Stiffness, StiffnessMap};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};

pub(crate) struct Moduli;

#[derive(Serialize)]
pub(crate) struct Own {
    by_labels: bool,
    stiffness: Option<([f64; 4], Option<f64>)>,
}

/// The moduli and what a report tells of them.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct ByTissue {
    /// Of each tetrahedron, kPa.
    pub(crate) young_kpa: Vec<f64>,
    pub(crate) facts: supine_report::Moduli,
}

impl Node for Moduli {
    const ID: NodeId = NodeId::Moduli;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    type Own = Own;
    type Parents = (Import, Tissues, Mesh);
    type Out = Option<ByTissue>;

    fn own(ground: &Ground) -> Result<Own, Error> {
        let stiffness = ground.case.stiffness;
        Ok(Own {
            by_labels: stiffness.is_some_and(|s| s.map == StiffnessMap::Labels),
            stiffness: stiffness.map(|s| (s.kpa, s.mean_kpa)),
        })
    }

    fn not_asked(own: &Own) -> Option<Self::Out> {
        own.stiffness.is_none().then_some(None)
    }

    fn run(
        own: &Own,
        (input, tissues, meshed): Outs<Self>,
        _: &Work<'_>,
    ) -> Result<Self::Out, Error> {
        let (Some((kpa, mean_kpa)), Some(labels), Some(facts)) =
            (own.stiffness, &tissues.labels, &tissues.facts)
        else {
            return Ok(None);
        };
        let map = if own.by_labels { StiffnessMap::Labels } else { StiffnessMap::Hounsfield };
        let levels_hu = (facts.fat_hu, facts.gland_hu);
        let place = ModulusMap { labels, ct: &input.ct, levels_hu };
        let (young_kpa, facts) = moduli(&meshed.mesh, &place, &Stiffness { map, kpa, mean_kpa });
        Ok(Some(ByTissue { young_kpa, facts }))
    }

    fn facts(out: &Self::Out) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Self::Out, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}
