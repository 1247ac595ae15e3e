//! What is asked of the mesh.

use super::case::Given;
use super::error::{CaseError, value};
use crate::shared::Mesher;
use supine_mesh::Order;

/// Edges in the tumour when nothing else is said, mm: chosen, not measured.
const TUMOUR_EDGE_MM: f64 = 4.0;
/// Their growth away from it when nothing else is said, mm per mm: chosen, not measured.
const TUMOUR_GROWTH: f64 = 0.5;

/// What is asked of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSpec {
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Order of the displacement within them.
    pub order: Order,
    /// Whether those on skin and chest wall are curved for the mechanics.
    pub curved: bool,
    /// What makes them.
    pub mesher: Mesher,
    /// Whether the piece of soft tissue that holds the sphere's centre is meshed, not the largest.
    pub centre_piece: bool,
    /// Where they are smaller.
    pub refine: Refinement,
}

/// Where the tetrahedra are to be smaller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Refinement {
    /// Nowhere.
    #[default]
    Nowhere,
    /// In and around the tumour.
    Tumour {
        /// Longest edge wanted in it, mm.
        edge_mm: f64,
        /// Growth of that length with the distance from it, mm per mm.
        growth: f64,
    },
    /// Where the tumour's displacement depends on it.
    Goal,
}

impl Refinement {
    /// Name in case files and in the summary.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Nowhere => "none",
            Self::Tumour { .. } => "tumour",
            Self::Goal => "goal",
        }
    }
}

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
