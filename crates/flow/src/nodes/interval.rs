//! Where the tumour comes to within an interval of moduli, when the case asks for it.

use super::{Mesh, Moduli};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::nodes::law::Law;
use crate::nodes::region::Ball;
use crate::shared::movement;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use supine_fem::between;
use supine_mesh::Deformation;
use supine_report::{ModulusInterval, Movement};
use supine_space::Warning;

pub(crate) struct Interval;

#[derive(Serialize)]
pub(crate) struct Own {
    asked: Option<Asked>,
}

#[derive(Serialize)]
struct Asked {
    young_kpa: [f64; 2],
    tumour: Ball,
    law: Law,
}

impl Node for Interval {
    const ID: NodeId = NodeId::Interval;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    type Own = Own;
    type Parents = (Mesh, Moduli);
    /// None where it is not asked for, or where one end has no solution.
    type Out = Option<ModulusInterval>;

    fn own(ground: &Ground) -> Result<Own, Error> {
        let case = &ground.case;
        let Some(young_kpa) = case.young_interval_kpa else { return Ok(Own { asked: None }) };
        let (tumour, law) = (case.tumour()?.into(), Law::of(case)?);
        Ok(Own { asked: Some(Asked { young_kpa, tumour, law }) })
    }

    fn not_asked(own: &Own) -> Option<Self::Out> {
        own.asked.is_none().then_some(None)
    }

    fn run(own: &Own, (meshed, moduli): Outs<Self>, work: &Work<'_>) -> Result<Self::Out, Error> {
        let Some(Asked { young_kpa, tumour, law }) = &own.asked else { return Ok(None) };
        let body = law.body(&meshed, moduli.as_ref().as_ref());
        let found = match between(&body, &law.load(), &law.solver(), *young_kpa, work.progress) {
            Ok(found) => found,
            Err(stopped @ supine_fem::Error::Stopped(_)) => return Err(stopped.into()),
            Err(error) => {
                let [low, high] = young_kpa;
                let text = format!("no displacement between {low} and {high} kPa: {error}");
                work.warn(Warning::new("interval-without-solution", text));
                return Ok(None);
            }
        };
        work.warn_all(found.warnings);
        let centre = tumour.sphere()?.centre();
        let end = |u: &Deformation| -> Result<Movement, Error> {
            let params = supine_warp::Params::default();
            let after = supine_warp::carry_points(u, &params, &[centre])?;
            Ok(movement(centre, after[0]))
        };
        let tumour = [end(&found.low)?, end(&found.high)?];
        let (young_kpa, overshoot_mm) = (*young_kpa, found.overshoot_mm);
        Ok(Some(ModulusInterval { young_kpa, tumour, overshoot_mm }))
    }

    fn facts(out: &Self::Out) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Self::Out, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}
