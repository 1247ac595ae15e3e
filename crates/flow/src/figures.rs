//! What a planner looks at of results that are held: mesh, mechanics and map in a few figures.

use crate::NodeId;
use crate::nodes::{Fields, Mesh, Solve, Warp};
use crate::session::Session;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;
use supine_volume::Volume;

/// Angles below this are called poor, degrees.
const POOR_DIHEDRAL_DEG: f64 = 5.0;
/// Tissue squeezed below this share of its volume is out of its law's depth, and below the other
/// looked at.
const SQUEEZED: [f64; 2] = [0.3, 0.5];

/// A figure in words.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Figure {
    /// The stage whose result it is of.
    #[serde(skip)]
    pub node: NodeId,
    /// What it belongs to.
    pub group: &'static str,
    /// What it is.
    pub name: &'static str,
    /// Its value with its unit.
    pub text: String,
    /// `good`, `watch` or `bad`; nothing where it is not judged.
    pub level: Option<&'static str>,
}

fn figure(node: NodeId, name: &'static str, text: String) -> Figure {
    let group = match node {
        NodeId::Mesh => "Mesh",
        NodeId::Solve => "Mechanics",
        _ => "Map",
    };
    Figure { node, group, name, text, level: None }
}

/// Judged by two limits below which it is to be watched, and bad.
fn judged(figure: Figure, value: f64, [bad, watch]: [f64; 2]) -> Figure {
    let level = if value < bad {
        "bad"
    } else if value < watch {
        "watch"
    } else {
        "good"
    };
    Figure { level: Some(level), ..figure }
}

impl Session {
    /// Figures of what is held; nothing is made.
    pub fn figures(&self) -> Vec<Figure> {
        let mut all = vec![];
        if let Some((meshed, _)) = self.peek::<Mesh>() {
            let of = &meshed.facts;
            let angle = format!("{:.1} to {:.1}\u{b0}", of.min_dihedral_deg, of.max_dihedral_deg);
            all.push(figure(NodeId::Mesh, "tetrahedra", of.tetrahedra.to_string()));
            all.push(judged(
                figure(NodeId::Mesh, "dihedral angles", angle),
                of.min_dihedral_deg,
                [POOR_DIHEDRAL_DEG / 2.0, POOR_DIHEDRAL_DEG],
            ));
            let ratio =
                format!("{:.2} mean, {:.2} least", of.mean_radius_ratio, of.min_radius_ratio);
            all.push(figure(NodeId::Mesh, "radius ratio (1 is best)", ratio));
            all.push(figure(NodeId::Mesh, "volume", format!("{:.0} ml", of.volume_ml)));
        }
        if let Some((solved, _)) = self.peek::<Solve>() {
            let of = &solved.facts.solve;
            all.push(figure(NodeId::Solve, "iterations", of.iterations.to_string()));
            all.push(figure(NodeId::Solve, "residual", format!("{:.0e}", of.residual)));
            let most = format!("{:.1} mm", of.max_displacement_mm);
            all.push(figure(NodeId::Solve, "largest displacement", most));
            let volume = format!("{:.2} to {:.2}", of.min_det_f, of.max_det_f);
            all.push(judged(
                figure(NodeId::Solve, "elements, volume over that without load", volume),
                of.min_det_f,
                SQUEEZED,
            ));
        }
        if let Some((warped, _)) = self.peek::<Warp>() {
            let of = &warped.facts;
            let change = format!("{:.2} to {:.2}", of.jacobian.p01, of.jacobian.p99);
            all.push(figure(NodeId::Warp, "volume of voxels, 98 % of them", change));
            all.push(figure(NodeId::Warp, "fade at the cut", format!("{:.0} mm", of.fade_mm)));
            let folded = figure(NodeId::Warp, "folded voxels", of.folded_voxels.to_string());
            let level = Some(if of.folded_voxels == 0 { "good" } else { "bad" });
            all.push(Figure { level, ..folded });
        }
        all
    }

    /// The local change of volume of the map that is held (1: kept), on the voxels of the CT around
    /// what moves; nothing is made, and nothing is read from a folder.
    pub fn peek_jacobian(&self) -> Option<Volume<f32>> {
        let (fields, freshness) = self.peek::<Fields>()?;
        let map: Arc<_> = fields.held()?;
        (freshness == crate::Freshness::Fresh).then(|| map.fields.jacobian().clone())
    }
}
