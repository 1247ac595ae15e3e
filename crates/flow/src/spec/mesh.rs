//! What is asked of the mesh.

use super::case::{MeshSpec, Refinement};
use super::error::{CaseError, value};
use super::given::Given;
use crate::shared::Mesher;
use supine_mesh::Order;

/// Edges in the tumour when nothing else is said, mm: chosen, not measured.
const TUMOUR_EDGE_MM: f64 = 4.0;
/// Their growth away from it when nothing else is said, mm per mm: chosen, not measured.
const TUMOUR_GROWTH: f64 = 0.5;

pub(super) fn spec(given: Given<'_>) -> Result<MeshSpec, CaseError> {
    let mesher = mesher(given)?;
    let refine = refinement(given)?;
    if mesher != Mesher::Native && refine != Refinement::Nowhere {
        let reason = format!("the mesher {} cannot: use native or leave it out", mesher.name());
        return Err(value("mesh.refine", reason));
    }
    let order = if given.whole("mesh.order") == 1 { Order::Linear } else { Order::Quadratic };
    let curved = given.word("mesh.geometry") == "curved";
    if curved && order == Order::Linear {
        return Err(value("mesh.geometry", "only elements of order 2 can be curved"));
    }
    let centre_piece = given.word("mesh.piece") == "centre";
    let tetrahedra = given.whole("mesh.tetrahedra");
    Ok(MeshSpec { tetrahedra, order, curved, mesher, centre_piece, refine })
}

/// The mesher, if this program was built with it.
fn mesher(given: Given<'_>) -> Result<Mesher, CaseError> {
    let word = given.word("mesh.mesher");
    let mesher = Mesher::ALL.into_iter().find(|m| m.name() == word).unwrap_or_default();
    mesher.fill().map_err(|e| value("mesh.mesher", e.to_string()))?;
    Ok(mesher)
}

fn refinement(given: Given<'_>) -> Result<Refinement, CaseError> {
    let keys = ["mesh.tumour_edge", "mesh.tumour_growth"];
    let [edge_mm, growth] = keys.map(|key| given.number(key));
    match given.word("mesh.refine") {
        "tumour" => Ok(Refinement::Tumour {
            edge_mm: edge_mm.unwrap_or(TUMOUR_EDGE_MM),
            growth: growth.unwrap_or(TUMOUR_GROWTH),
        }),
        other => match keys.into_iter().zip([edge_mm, growth]).find(|(_, v)| v.is_some()) {
            Some((key, _)) => Err(value(key, "says nothing without refine = \"tumour\"")),
            None if other == "goal" => Ok(Refinement::Goal),
            None => Ok(Refinement::Nowhere),
        },
    }
}
